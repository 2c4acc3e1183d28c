"""How many coupled serial chains pass 2N + 1 points, by gear ratios −3 … 3 in halves: complex and real, with evidence.

    python -m benchmarks.chain_counts [--links 2|3] [--most PATHS] [--bounds] [--jobs N] [--table FILE] [--json]

Neither the order of the links nor a common factor of the exponents changes a count, so that 11 ratios of two links
make 9 kinds, and 55 pairs of ratios of three links 44.  Those whose multihomogeneous number, `chain_paths.
paths_to_track`, is at most `--most` are solved; each finished kind is appended to the table at once, and what the
table holds is printed and not solved again (a table of the version that is released lies beside this file; give
another FILE to count anew).  The bound is proved: the mixed volume of `chain_paths.root_bound`.

The complex count is the size of the union of what two monodromy runs (more, if need be) and the tasks below have
found.  In a run every root brings its mirror image, and the points change places.  Each run begins with its own random
chain: from how many roots both have found, capture and recapture must estimate just as many (Lincoln and Petersen; a
root missed by a run of n roots that misses m is missed by both with a chance of m/n).  The trace test is made where it
is quick, and from some size on there is one run only.  Two links are solved by the multihomogeneous homotopy too, every
path accounted for.

The real counts are those of tasks made of random known chains, reached by a parameter homotopy: the known chain must
be among the real ones, and the mirror image of every root among the roots. This is capture and recapture once more: a
root that is missing shows itself by its image, unless that is missing as well, or along another way to the task, and is
added to the count.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families import chain_paths as paths
from mechanisms.families.chain import SerialChain
from mechanisms.families.reality import real_roots
from solvers import Solutions, solve
from solvers.carry import carry, random_bend
from solvers.homotopy import parameter_homotopy
from solvers.points import PointSet
from solvers.refine import refine
from solvers.trace import trace_test
from solvers.tracking import engine_of

#: Twice the ratios after the first: −3 … 3 in halves without 0 and 1, with which a link is of no use.
HALVES = [k for k in range(-6, 7) if k not in (0, 2)]
#: Monodromy runs at most.
RUNS = 6
#: A trace test that fails is made again along other lines so often.
TESTS = 6
#: Roots up to which the trace test is made: it follows two or three times as many points as there are roots.
TRACED = 50_000
#: Paths of the multihomogeneous homotopy up to which it is followed as well.
HOMOTOPY = 20_000
#: Mirror images are found at this distance, relative.
NEAR = 1e-7
#: Arcs to one task while roots are missing, and those that bring no more of them until it is left at that.
ARCS, IN_VAIN = 6, 2
#: Roots with links longer than this, in sizes of the path, are computed to so many digits: to sixteen rotations next to
#: one another are the same.
HUGE, DIGITS = 1e3, 40
#: So are those whose mirror image is farther away than the first, but nearer than the second: nearly real ones.
ROUNDING, NEARLY = 1e-11, 1e-3
#: Roots up to which there is more than one run.
TWICE = 200_000
#: The known chain is found when its links are, to this, in units of their size.
KNOWN = 1e-5
#: Tasks from known chains.
TASKS = 3
TABLE = Path(__file__).with_suffix(".jsonl")


def kinds(links: int) -> dict[tuple[int, ...], list[list[float]]]:
    """Every kind of exponents, with the ratios R1 … that are of this kind; the smallest exponents first.

    >>> kinds(2)[(-1, 2)]
    [[-2.0], [-0.5]]
    """
    found: dict[tuple[int, ...], list[list[float]]] = {}
    for halves in itertools.combinations(HALVES, links - 1):
        found.setdefault(paths.kind_of((2, *halves)), []).append([k / 2 for k in halves])
    return {kind: found[kind] for kind in sorted(found, key=lambda kind: (paths.paths_to_track(kind), kind))}


def complex_chains(exponents: tuple[int, ...], jobs: int = 1) -> tuple[Solutions, dict[str, Any]]:
    """All chains at random complex displacements: the union of independent runs, the overlap of which is its proof."""
    found = paths.generic_chains(exponents, 1, jobs=jobs)
    row: dict[str, Any] = {"runs": [len(found)]}
    for seed in range(2, RUNS + 1 if len(found) <= TWICE else 0):
        other = paths.generic_chains(exponents, seed, jobs=jobs)
        row["runs"].append(len(other))
        found, estimate = paths.united(found, other, paths.path_system(exponents))
        row["estimate"] = round(estimate, 2)
        if round(row["estimate"]) == len(found):
            break
    return found, row


def traced(exponents: tuple[int, ...], found: Solutions) -> dict[str, Any]:
    """The trace test, along a few lines of displacements; failing, it may have missed points of its own."""
    for seed in range(TESTS):
        test = trace_test(paths.path_system(exponents), found.parameters, found.points, seed=seed)
        if test.passed:
            break
    return {"passed": test.passed, "residual": float(f"{test.residual:.1e}"), "tests": seed + 1}


def by_homotopy(exponents: tuple[int, ...], seed: int = 0) -> dict[str, int]:
    """Chains by the multihomogeneous homotopy at other displacements, and its ledger."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(4 * len(exponents), 2)) @ [1, 1j]
    found = solve(paths.path_system(exponents), values, start="multihomogeneous", seed=seed, certificates=False)
    return {"chains": int(paths.is_rotation(found.points, len(exponents)).sum()), **found.ledger.as_dict()}


def real_chains(
    found: Solutions, exponents: tuple[int, ...], seed: int, jobs: int = 1
) -> tuple[dict[str, int], Solutions | None]:
    """Roots and real chains for the points of one random known chain, and all these roots, if they are more than found.

    Roots with links up to 1e11 times the size of the path, rotations next to one another, are carried in 32 digits. A
    path that is lost is sent along another arc; where a few roots had not been found, other arcs lead to them.
    """
    links = len(exponents)
    rng = np.random.default_rng([seed, *map(abs, exponents)])
    z = rng.normal(size=(links + 1, 2)) @ [1, 1j]
    known = SerialChain(z[0], tuple(z[1:]), tuple(p / exponents[0] for p in exponents))
    apart = 2.4 / (2 * links)  # radians between neighbours, up to a third
    phi = apart * (np.arange(2 * links + 1) + rng.uniform(-1 / 3, 1 / 3, 2 * links + 1))
    values, size = paths.path_parameters(known.tip(phi - phi[0]))
    system, mirror, roots = paths.path_system(exponents), paths.path_mirror(links), PointSet(4 * links, NEAR)
    points = np.zeros((0, 4 * links), np.complex128)
    engine = engine_of(parameter_homotopy(system.program, found.parameters, values, found.points[:1]))
    arcs, vain, alone = 0, 0, np.zeros(1, bool)
    while arcs < ARCS and vain < IN_VAIN and len(roots) + alone.sum() < len(found):
        arcs, before = arcs + 1, len(roots) + alone.sum()
        ends = carry(engine, found.points, found.parameters, values, random_bend(rng), jobs, ladder=True)
        ends = ends[paths.is_rotation(ends, links)]
        units = in_units(ends, links)
        unlike = np.abs(mirror.image(units) - units).max(axis=1)
        doubtful = (np.abs(ends).max(axis=1) > HUGE) | ((unlike > ROUNDING) & (unlike < NEARLY))
        refined = refine(system, ends[doubtful], values, digits=DIGITS).points
        ends[doubtful] = np.array([[complex(v) for v in x] for x in refined]).reshape(-1, 4 * links)
        number, row = np.unique(roots.add(in_units(ends, links)), return_index=True)
        points = np.concatenate([points, ends[row[number >= len(points)]]])
        alone = roots.find(mirror.image(roots.points)) < 0
        vain = vain + 1 if len(roots) + alone.sum() == before else 0
    real = real_roots(roots.points, mirror)
    shape = (points[real, :links] + points[real, links : 2 * links].conj()) / 2 * size
    if not np.any(np.abs(shape - known.links).max(axis=1, initial=0.0) < KNOWN):
        raise AssertionError(f"the known chain {known} is not among {len(shape)} real ones")
    every = {"roots": len(roots) + int(alone.sum()), "real": len(shape), "added": int(alone.sum()), "arcs": arcs}
    if every["roots"] <= len(found):
        return every, None
    every_root = np.concatenate([points, mirror.image(points[alone])])
    count = np.arange(len(every_root))
    return every, replace(found, points=every_root, parameters=values, paths=count, orbit=count)


def in_units(points: NDArray[Any], links: int) -> NDArray[Any]:
    """Roots with links in units of the longest, so that rotations count however long the links are."""
    size = np.abs(points[:, : 2 * links]).max(axis=1, keepdims=True)
    return np.concatenate([points[:, : 2 * links] / size, points[:, 2 * links :]], axis=1)


def count(exponents: tuple[int, ...], jobs: int = 1) -> dict[str, Any]:
    """What is found out about one kind."""
    begin = time.process_time()
    found, row = complex_chains(exponents, jobs)
    row["tasks"] = []
    for seed in range(TASKS):
        task, more = real_chains(found, exponents, seed, jobs)
        row["tasks"].append(task)
        if more is not None:
            found, _ = paths.united(found, more, paths.path_system(exponents))
    row["complex"] = len(found)
    if len(found.points) <= TRACED:
        row["trace"] = traced(exponents, found)
    if len(exponents) == 2 and paths.paths_to_track(exponents) <= HOMOTOPY:
        row["homotopy"] = by_homotopy(exponents)
    return row | {"cpu_seconds": round(time.process_time() - begin, 1)}


def rows(links: int, most: int, table: Path, jobs: int = 1, bounds: bool = False) -> Iterator[dict[str, Any]]:
    """One row for each kind: kept ones from the table, others solved, if they are not too large, and kept.

    The last line of a kind in the table counts: first it holds the bound alone, perhaps.
    """
    lines = table.read_text().splitlines() if table.exists() else []
    kept = {tuple(row["exponents"]): row for row in map(json.loads, lines)}
    for exponents, ratios in kinds(links).items():
        row = kept.get(exponents, {"exponents": exponents, "ratios": ratios})
        size = len(row)
        if bounds and "bound" not in row:
            row["bound"] = paths.root_bound(exponents)
        if "complex" not in row and paths.paths_to_track(exponents) <= most:
            row |= count(exponents, jobs)
        if len(row) > size:
            with table.open("a") as file:
                file.write(json.dumps(row) + "\n")
        yield row


def in_words(row: dict[str, Any]) -> str:
    """A row as a line."""
    head = f"{tuple(row['exponents'])!s:12} bound {row.get('bound', '–'):>9}"
    ratios = "R = " + ", ".join("/".join(f"{r:g}" for r in each) for each in row["ratios"])
    if "complex" not in row:
        return f"{head}  not counted  {ratios}"
    runs = "/".join(map(str, row["runs"]))
    agree = f"runs {runs}, estimate {row['estimate']:g}" if "estimate" in row else f"run {runs}"
    trace = ", trace test passed" if row.get("trace", {}).get("passed") else ""
    homotopy = f", homotopy {row['homotopy']['chains']}" if "homotopy" in row else ""
    real = "/".join(str(task["real"]) for task in row["tasks"])
    lost = "/".join(str(row["complex"] - task["roots"]) for task in row["tasks"])
    missing = f" (roots missing: {lost})" if lost.strip("0/") else ""
    odd = any((task["roots"] - task["real"]) % 2 for task in row["tasks"])
    missing += " (ODD: not in conjugate pairs)" if odd else ""
    return f"{head} complex {row['complex']:>7} ({agree}{trace}{homotopy}), real {real}{missing}  {ratios}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--links", type=int, choices=(2, 3), default=2)
    parser.add_argument("--most", type=int, default=0, help="solve what the table lacks up to so many paths")
    parser.add_argument("--bounds", action="store_true", help="find mixed volumes that the table lacks: minutes each")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--table", type=Path, default=TABLE)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    for row in rows(options.links, options.most, options.table, options.jobs, options.bounds):
        print(json.dumps(row) if options.json else in_words(row), flush=True)


if __name__ == "__main__":
    main()
