"""Five poses sampled from random real four-bars: is the true linkage found, how exactly, how fast?

    python -m benchmarks.burmester [--tasks 1000] [--seed 0] [--start total-degree]

Each task: a four-bar with random pivots and a random coupler point, put into five random closed configurations
(both assemblies allowed, so that the poses may lie on different circuits: synthesis does not ask).  A task is
passed when both true dyads are among the real ones found, with pivots off by no more than 1e-9 of the task's
size.  Poses stand in double precision, so that a badly conditioned task moves its own true answer; the bound
that this sets, rounding times condition number, is printed beside the errors.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from mechanisms.families.burmester import (
    MIRROR,
    dyad_of_root,
    dyad_parameters,
    five_pose_dyads,
    generic_dyads,
    projective_system,
)
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.reality import real_roots

#: How exactly the true pivots must be found, in sizes of the task.
BOUND = 1e-9


def random_task(rng: np.random.Generator, count: int = 5) -> tuple[Poses, list[MotionDyad]]:
    """Poses of a random four-bar, five unless told, and its two dyads."""
    while True:
        o1, o2, a1, a2, p = rng.uniform(-1, 1, 5) + 1j * rng.uniform(-1, 1, 5)
        crank, coupler, rocker = abs(a1 - o1), abs(a2 - a1), abs(a2 - o2)
        points, angles = [p], [0.0]
        for _ in range(200):
            tip = o1 + crank * np.exp(2j * np.pi * rng.uniform())
            diagonal = o2 - tip
            d = abs(diagonal)
            if not abs(coupler - rocker) < d < coupler + rocker:
                continue
            cosine = (coupler**2 + d**2 - rocker**2) / (2 * coupler * d)
            side = rng.choice([-1, 1])
            arm = diagonal / d * coupler * np.exp(1j * side * np.arccos(cosine))
            turn = arm / (a2 - a1)
            points.append(tip + turn * (p - a1))
            angles.append(float(np.angle(turn)))
            if len(points) == count:
                poses = Poses(np.array(points), np.array(angles))
                return poses, [MotionDyad("RR", o1, a1), MotionDyad("RR", o2, a2)]


def distance(poses: Poses, true: MotionDyad, found: MotionDyad) -> float:
    """How far the pivots are off, in sizes of the task."""
    if found.kind != "RR":
        return np.inf
    return max(abs(true.fixed - found.fixed), abs(true.moving - found.moving)) / poses.size


def rounding(poses: Poses, dyad: MotionDyad) -> float:
    """To first order, how far rounding the poses in the last bit may move a dyad, in sizes of the task."""
    e, p = np.exp(1j * poses.angles[1:]), poses.moves[1:] / poses.size
    z, big = (dyad.moving - poses.points[0]) / poses.size, (dyad.fixed - poses.points[0]) / poses.size
    arm, first = p + e * z - big, z - big
    by_z, by_big = np.conj(arm) * e - np.conj(first), -np.conj(arm) + np.conj(first)
    jacobian = 2 * np.column_stack([by_z.real, -by_z.imag, by_big.real, -by_big.imag])
    size = 2 * np.abs(arm) * (np.abs(p) + np.abs(z) + abs(poses.points[0]) / poses.size)
    return float(np.finfo(float).eps * np.abs(np.linalg.inv(jacobian)).dot(size).max())


def main() -> None:
    """Run the benchmark and print its table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", choices=("generic", "total-degree"), default="generic")
    parser.add_argument("--certificates", action="store_true")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    tasks = [random_task(rng) for _ in range(options.tasks)]
    five_pose_dyads(tasks[0][0])  # loads the kernel and finds the generic roots
    errors, bounds, times, counts = [], [], [], []
    for poses, true in tasks:
        begun = time.perf_counter()
        found = _solve(poses, options.start, options.certificates)
        times.append(time.perf_counter() - begun)
        counts.append(len(found))
        errors.append(max(min((distance(poses, t, f) for f in found), default=np.inf) for t in true))
        bounds.append(max(rounding(poses, t) for t in true))
    errors, bounds, seconds = np.array(errors), np.array(bounds), np.array(times)
    print(f"{options.tasks} tasks, seed {options.seed}, start {options.start}")
    print(f"true four-bar found to {BOUND:g}: {int((errors <= BOUND).sum())} of {options.tasks}")
    print(f"real dyads: {dict(zip(*map(np.ndarray.tolist, np.unique(counts, return_counts=True))))}")
    print(f"error: median {np.median(errors):.1e}, worst {errors.max():.1e}; worst error / bound by rounding "
          f"{(errors / bounds).max():.2g}")  # fmt: skip
    for k in np.flatnonzero(errors > BOUND):
        print(f"  task {k}: error {errors[k]:.1e}, rounding of the poses allows {bounds[k]:.1e}")
    print(f"time per task: median {1e3 * np.median(seconds):.1f} ms, 99 % {1e3 * np.quantile(seconds, 0.99):.1f} ms")


def _solve(poses: Poses, start: str, certificates: bool) -> list[MotionDyad]:
    if start == "generic" and not certificates:
        return five_pose_dyads(poses)
    from solvers import solve

    begin = generic_dyads() if start == "generic" else start
    found = solve(projective_system(), dyad_parameters(poses), begin, certificates=certificates)
    real = real_roots(found.points, MIRROR)
    dyads = [dyad_of_root(poses, point) for point, ok in zip(found.points, real) if ok]
    return [dyad for dyad in dyads if dyad is not None]


if __name__ == "__main__":
    main()
