"""How many coupler curves pass six, seven and eight points, counted from nothing, and again by monodromy.

    python -m benchmarks.coupler_counts [--points 6 7 8] [--seeds N] [--first SEED] [--jobs N] [--no-compare]

Each seed draws random complex points and choices and solves Eq. (19) (Suárez-Velásquez, Cervantes-Sánchez,
Rico-Martínez 2018, with its choices: y_M, y_N, g · y_N, g · g) by a polyhedral homotopy, every path accounted for; no
root is known before.  The roots of the catalogue, which monodromy has found, are then carried to the same
parameters, and the two sets are compared root by root.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from mechanisms.catalogue import load
from mechanisms.families.four_bar_curve import curve_system
from mechanisms.families.four_bar_generic import curve_name
from mechanisms.families.four_bar_sparse import as_curve_roots, sparse_system
from solvers import Solutions, solve
from solvers.points import PointSet

#: What the paper chooses.
CHOSEN = {6: ("y_M", "y_N", "g"), 7: ("y_N", "g"), 8: ("g",)}
#: Roots of the two routes are one root when they agree to this, relative.
SAME = 1e-7


def from_nothing(points: int, seed: int, jobs: int) -> Solutions:
    """All roots at random complex parameters by a polyhedral homotopy, as roots of `curve_system`."""
    system, chosen = sparse_system(points, CHOSEN[points]), CHOSEN[points]
    values = np.random.default_rng([seed, points]).normal(size=(len(system.parameters), 2)) @ [1, 1j]
    found = solve(system, values, start="polyhedral", seed=seed, jobs=jobs, certificates=False)
    found.points = as_curve_roots(found.points, chosen, found.parameters)
    return found


def by_monodromy(points: int, values: np.ndarray, seed: int, jobs: int) -> Solutions:
    """The catalogue's roots carried to the given parameters."""
    chosen = CHOSEN[points]
    known = load(curve_name(points, chosen))
    return solve(curve_system(points, chosen), values, start=known, seed=seed, jobs=jobs, certificates=False)


def in_common(one: np.ndarray, other: np.ndarray) -> int:
    """How many points of one list are in the other."""
    known = PointSet(other.shape[1], SAME)
    known.add(other)
    return len(np.unique(known.find(one)[known.find(one) >= 0]))


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, nargs="+", default=[6, 7, 8], choices=sorted(CHOSEN))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--no-compare", action="store_true", help="do not carry the catalogue's roots there")
    given = parser.parse_args()
    print("points seed   paths  finite  singular  at infinity  failed  monodromy  in common  processor seconds")
    for points in given.points:
        counts = []
        for seed in range(given.first, given.first + given.seeds):
            start = time.process_time()
            found = from_nothing(points, seed, given.jobs)
            seconds = time.process_time() - start
            other, common = "", ""
            if not given.no_compare:
                carried = by_monodromy(points, found.parameters, seed, given.jobs)
                other, common = str(len(carried)), str(in_common(carried.points, found.points))
            account = found.ledger
            print(
                f"{points:6} {seed:4} {account.tracked:7} {account.finite:7} {account.singular:9} "
                f"{account.at_infinity:12} {account.failed:7} {other:>10} {common:>10} {seconds:18.1f}",
                flush=True,
            )
            counts.append(account.finite)
        summary = ", ".join(f"{n} on {counts.count(n)} seeds" for n in sorted(set(counts)))
        print(f"{points} points: {summary}", flush=True)


if __name__ == "__main__":
    main()
