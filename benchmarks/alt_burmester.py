"""How many four-bars take M poses and N points, 2M + N = 10: by monodromy, or by every path of another start.

    python -m benchmarks.alt_burmester 2 6 --seeds 1 2 3
    python -m benchmarks.alt_burmester 2 6 --start polyhedral

Counts are of ordered pairs of dyads with different moving pivots.  A start system also leads to the pairs of one
dyad with itself, which come in families, and so to singular ends: only the regular ends are counted.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from mechanisms.families.alt_burmester import mixed_instance, mixed_system, swap
from solvers import monodromy, solve


def main() -> None:
    """Print one line for each seed or start."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("poses", type=int)
    parser.add_argument("points", type=int)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--start", choices=("monodromy", "polyhedral", "total-degree"), default="monodromy")
    options = parser.parse_args()
    system = mixed_system(options.poses, options.points)
    for seed in options.seeds:
        begun = time.perf_counter()
        start = mixed_instance(options.poses, options.points, np.random.default_rng(seed))
        if options.start == "monodromy":
            found = monodromy(system, seed, (swap,), start)
            words = found.evidence
        else:
            rng = np.random.default_rng([seed, 2])
            size = len(system.parameters)
            values = rng.normal(size=size) + 1j * rng.normal(size=size)
            found = solve(system, values, options.start, seed=seed, certificates=False)
            words = repr(found.ledger)
        seconds = time.perf_counter() - begun
        print(f"({options.poses}, {options.points}) seed {seed}: {len(found)} roots in {seconds:.1f} s; {words}")


if __name__ == "__main__":
    main()
