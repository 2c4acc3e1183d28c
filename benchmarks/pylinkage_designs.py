"""Designs of pylinkage for motion tasks that are known to be solvable, stored for a comparison.

Run it with a Python that has pylinkage (``pip install 'pylinkage[scipy,viz]'``), in an environment of its own:

    python benchmarks/pylinkage_designs.py notebooks/data/pylinkage_designs.json

Each task is sampled from a random four-bar that is driven over a part of one branch, so that at least one design
without any defect exists: the one it comes from.  This module needs NumPy only; the notebook reads what it writes.
"""

from __future__ import annotations

import json
import math
import sys
import time
from pathlib import Path

import numpy as np

#: Tasks for each number of poses, and designs asked for in each.
TASKS = {5: 50, 4: 25, 3: 25}
DESIGNS = 20
SEED = 2026
#: The input turns by at least and at most this between the first and the last pose, degrees.
TRAVEL = (60.0, 140.0)
#: Least sine of the transmission angle on the way, so that the sample is a linkage one could build.
TRANSMISSION = 0.35


def sample_task(rng: np.random.Generator, count: int) -> dict:
    """Poses of a random four-bar in order on one branch, and its pivots at the first pose."""
    while True:
        o1, o2, a1, a2, p = rng.uniform(-1, 1, 5) + 1j * rng.uniform(-1, 1, 5)
        coupler, rocker = abs(a2 - a1), abs(a2 - o2)
        side = np.sign(((a2 - a1).conjugate() * (a2 - o2)).imag)
        travel = math.radians(rng.uniform(*TRAVEL)) * rng.choice([-1, 1])
        tips = o1 + (a1 - o1) * np.exp(1j * np.linspace(0, travel, 200))
        diagonal = np.abs(o2 - tips)
        cosine = (coupler**2 + rocker**2 - diagonal**2) / (2 * coupler * rocker)
        if np.any(np.abs(cosine) > math.sqrt(1 - TRANSMISSION**2)):
            continue  # a dead centre, or nearly one, on the way
        angle = (coupler**2 + diagonal**2 - rocker**2) / (2 * coupler * diagonal)
        direction = (o2 - tips) / diagonal * np.exp(1j * side * np.arccos(np.clip(angle, -1, 1)))
        if abs(tips[0] + coupler * direction[0] - a2) > 1e-9:
            direction = (o2 - tips) / diagonal * np.exp(-1j * side * np.arccos(np.clip(angle, -1, 1)))
        turn = direction * coupler / (a2 - a1)
        at = np.round(np.linspace(0, 199, count)).astype(int)
        points = tips[at] + turn[at] * (p - a1)
        pivots = [o1, a1, o2, a2]
        return {
            "poses": [[float(z.real), float(z.imag), float(np.angle(t))] for z, t in zip(points, turn[at])],
            "pivots": [[float(z.real), float(z.imag)] for z in pivots],
        }


def sample_tasks() -> list[dict]:
    """All tasks, five poses first."""
    rng = np.random.default_rng(SEED)
    return [sample_task(rng, count) for count, number in TASKS.items() for _ in range(number)]


def main(path: str) -> None:
    """Ask pylinkage for designs of every task, and write tasks and designs."""
    import pylinkage
    from pylinkage.synthesis import Pose, motion_generation

    rows = []
    for task in sample_tasks():
        begun = time.perf_counter()
        result = motion_generation(
            [Pose(*pose) for pose in task["poses"]], max_solutions=DESIGNS, require_grashof=False
        )
        seconds = time.perf_counter() - begun
        names = ("ground_pivot_a", "crank_pivot_b", "ground_pivot_d", "coupler_pivot_c")
        designs = [[list(map(float, getattr(s, name))) for name in names] for s in result.raw_solutions]
        rows.append({**task, "designs": designs, "seconds": round(seconds, 4)})
    document = {
        "command": "python benchmarks/pylinkage_designs.py notebooks/data/pylinkage_designs.json",
        "pylinkage": pylinkage.__version__,
        "options": {"max_solutions": DESIGNS, "require_grashof": False},
        "seed": SEED,
        "tasks": rows,
    }
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    Path(path).write_text(json.dumps(document) + "\n", encoding="utf-8")
    print(f"{len(rows)} tasks, {sum(len(row['designs']) for row in rows)} designs written to {path}")


if __name__ == "__main__":
    main(sys.argv[1])
