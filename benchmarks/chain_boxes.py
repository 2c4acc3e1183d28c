"""Five poses of random three-link chains: is every chain with ratios in [−5, 5]² proved, and the known one among them?

    python -m benchmarks.chain_boxes [--chains 24] [--json]

Each task is made from a random chain; the box of ratios is searched by subdivision in Arb, for at most one turn of the
input. Printed for each: chains found, whether the list is proved to be complete, how near the known ratios are to the
nearest of the list, how well all pass the poses, boxes, CPU seconds. Exit code 1 if any is unproved or the known
one missing.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import Any

import numpy as np

from mechanisms.families.chain import SerialChain
from mechanisms.families.chain_guidance import five_pose_chains

#: The known ratios are found when they are this near.
NEAR = 1e-8


def one_task(seed: int) -> dict[str, Any]:
    """Search the box for the poses of one random chain whose ratios lie in it."""
    rng = np.random.default_rng([seed, 5])
    z = rng.normal(size=(4, 2)) @ [1, 1j]
    ratios = (1.0, float(rng.uniform(-5, 5)), float(rng.choice([-1, 1]) * rng.uniform(0.3, 5)))
    chain = SerialChain(z[0], tuple(z[1:]), ratios)
    phi = np.r_[0.0, np.sort(rng.uniform(0.2, 2.8, 4))]
    points, angles = chain.tip(phi), chain.turning(phi)
    begin = time.process_time()
    found = five_pose_chains(points, angles)
    seconds = time.process_time() - begin
    size = float(np.abs(points - points[0]).max())
    misses = [
        float(np.abs(one.tip((angles - angles[0]) / one.ratios[-1]) - points).max()) / max(size, *one.lengths)
        for one in found.chains
    ]
    off = np.abs(found.ratios - ratios[1:]).max(axis=1).min() if len(found.ratios) else np.inf
    return {
        "seed": seed,
        "ratios": [round(r, 4) for r in ratios[1:]],
        "chains": len(found.chains),
        "proved": found.proved,
        "known_off": float(off),
        "worst_miss": max(misses, default=0.0),
        "boxes": found.boxes,
        "cpu_seconds": round(seconds, 2),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--chains", type=int, default=24)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    good = proved = 0
    for seed in range(options.chains):
        row = one_task(seed)
        proved += row["proved"]
        good += row["proved"] and row["known_off"] < NEAR
        first, last = row["ratios"]
        line = (
            f"{seed:3} R = {first:7.4f}, {last:7.4f}: {row['chains']:3} chains, "
            f"{'proved' if row['proved'] else 'not proved'}, known one to {row['known_off']:.0e}, "
            f"worst miss {row['worst_miss']:.0e}, {row['boxes']} boxes, {row['cpu_seconds']} CPU s"
        )
        print(json.dumps(row) if options.json else line, flush=True)
    if not options.json:
        print(f"{proved} of {options.chains} proved, {good} of them with the known chain")
    sys.exit(good < options.chains)


if __name__ == "__main__":
    main()
