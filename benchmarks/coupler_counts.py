"""How many coupler curves pass six to nine points, counted from nothing, and again by monodromy.

    python -m benchmarks.coupler_counts [--points 6 7 8 9] [--seeds N] [--first SEED] [--jobs N] [--no-compare]
                                        [--route polyhedral|regeneration]

Each seed draws random complex points and choices.  Six, seven and eight points: Eq. (19) of Suárez-Velásquez,
Cervantes-Sánchez and Rico-Martínez (2018) with its choices y_M, y_N, g · y_N, g · g; nine points: Alt's problem.  The
roots are found by a polyhedral homotopy or by regeneration, every path accounted for; no root is known before.  The
roots of the catalogue, which monodromy has found, are then carried to the same parameters, and the two sets are
compared root by root.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from mechanisms.catalogue import load
from mechanisms.families.four_bar_curve import curve_system, nine_point_system
from mechanisms.families.four_bar_generic import curve_name
from mechanisms.families.four_bar_sparse import as_curve_roots, nine_point_blocks, sparse_blocks, sparse_system
from solvers import solve
from solvers.points import PointSet
from solvers.regeneration import Blocks, Cell, regenerate
from solvers.solutions import Ledger
from solvers.tracking import Run

#: What the paper chooses.
CHOSEN: dict[int, tuple[str, ...]] = {6: ("y_M", "y_N", "g"), 7: ("y_N", "g"), 8: ("g",), 9: ()}
#: The route with fewer paths.
ROUTES = {6: "polyhedral", 7: "regeneration", 8: "regeneration", 9: "regeneration"}
#: Slices that regeneration tries until no path fails.
ATTEMPTS = 4
#: Roots of the two routes are one root when they agree to this, relative.
SAME = 1e-6


def parameters(points: int, seed: int) -> np.ndarray:
    """Random complex parameters of `curve_system`, or of the nine-point problem."""
    count = 16 if points == 9 else 2 * points + len(CHOSEN[points])
    return np.random.default_rng([seed, points]).normal(size=(count, 2)) @ [1, 1j]


def from_nothing(points: int, seed: int, jobs: int = 1, route: str = "") -> tuple[np.ndarray, Ledger]:
    """All roots as those of `curve_system` or `nine_point_system`, and the account of all paths.

    In regeneration's account singular ends and those at infinity are of all stages together.
    """
    chosen, values = CHOSEN[points], parameters(points, seed)
    if (route or ROUTES[points]) == "regeneration":
        blocks = nine_point_blocks() if points == 9 else sparse_blocks(points, chosen)
        cells = _cells(blocks, values, seed, jobs)
        roots = cells[-1].points
        sums = {name: sum(getattr(c, name) for c in cells) for name in ("singular", "at_infinity", "failed")}
        account = Ledger(tracked=sum(cell.paths for cell in cells), finite=len(roots), **sums)
    else:
        system = nine_point_system() if points == 9 else sparse_system(points, chosen)
        found = solve(system, values, start="polyhedral", seed=seed, jobs=jobs, certificates=False)
        roots, account = found.points, found.ledger
    return (roots if points == 9 else as_curve_roots(roots, chosen, values)), account


def _cells(blocks: Blocks, values: np.ndarray, seed: int, jobs: int) -> list[Cell]:
    """Cells without a failed path; if need be on other slices, as a root of an early cell may lie too far out."""
    for attempt in range(ATTEMPTS):
        cells = []
        for cell in regenerate(blocks, values, seed + 1000 * attempt, Run(jobs=jobs)):
            cells.append(cell)
            if cell.failed and attempt + 1 < ATTEMPTS:
                break
        else:
            break
    return cells


def by_monodromy(points: int, seed: int, jobs: int = 1) -> np.ndarray:
    """The catalogue's roots carried to the same parameters."""
    chosen = CHOSEN[points]
    system = curve_system(points, chosen) if chosen else nine_point_system()
    known = load(curve_name(points, chosen))
    return solve(system, parameters(points, seed), start=known, seed=seed, jobs=jobs, certificates=False).points


def in_common(one: np.ndarray, other: np.ndarray) -> int:
    """How many points of one list are in the other."""
    known = PointSet(other.shape[1], SAME)
    known.add(other)
    places = known.find(one)
    return len(np.unique(places[places >= 0]))


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--points", type=int, nargs="+", default=[6, 7, 8, 9], choices=sorted(CHOSEN))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--route", choices=("polyhedral", "regeneration"), default="", help="by default the shorter")
    parser.add_argument("--no-compare", action="store_true", help="do not carry the catalogue's roots there")
    given = parser.parse_args()
    print("points seed route          paths  finite  singular  at infinity  failed  monodromy  in common  processor s")
    for points in given.points:
        counts = []
        for seed in range(given.first, given.first + given.seeds):
            start = time.process_time()
            roots, account = from_nothing(points, seed, given.jobs, given.route)
            seconds = time.process_time() - start
            other, common = "", ""
            if not given.no_compare:
                carried = by_monodromy(points, seed, given.jobs)
                other, common = str(len(carried)), str(in_common(carried, roots))
            print(
                f"{points:6} {seed:4} {given.route or ROUTES[points]:12} {account.tracked:7} {account.finite:7} "
                f"{account.singular:9} {account.at_infinity:12} {account.failed:7} {other:>10} {common:>10} "
                f"{seconds:12.1f}",
                flush=True,
            )
            counts.append(account.finite)
        summary = ", ".join(f"{n} on {counts.count(n)} seeds" for n in sorted(set(counts)))
        print(f"{points} points: {summary}", flush=True)


if __name__ == "__main__":
    main()
