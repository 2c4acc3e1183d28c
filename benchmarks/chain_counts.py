"""How many coupled serial chains pass 2N + 1 points, by gear ratios: complex and real, with the ledger of each
solve.

    python -m benchmarks.chain_counts [--links 2|3] [--most PATHS] [--tasks N] [--json]

Every complex count comes from one solve at complex random displacements by the multihomogeneous homotopy; real
counts from tasks made of known random chains, each reached by a parameter homotopy from the complex solve.
"""

from __future__ import annotations

import argparse
import itertools
import json
import time
from typing import Any

import numpy as np

from mechanisms.families import chain_paths as paths
from mechanisms.families.chain import SerialChain, whole_exponents
from solvers import Solutions, solve

HALVES = [k / 2 for k in range(-6, 7) if k not in (0, 2)]


def generic(exponents: tuple[int, ...], seed: int = 0) -> Solutions:
    """All chains at complex displacements, those with a rotation of zero left out."""
    rng = np.random.default_rng([seed, *map(abs, exponents)])
    values = rng.normal(size=(4 * len(exponents), 2)) @ [1, 1j]
    system = paths.path_system(exponents)
    found = solve(system, values, start="multihomogeneous", seed=seed, certificates=False)
    keep = paths.is_rotation(found.points, len(exponents))
    found.points, found.paths = found.points[keep], found.paths[keep]
    return found


def real_counts(found: Solutions, ratios: tuple[float, ...], tasks: int, seed: int = 0) -> list[int]:
    """Numbers of real chains through the points of random known chains; the known one must be among them."""
    exponents, counts = whole_exponents(ratios), []
    rng = np.random.default_rng(seed)
    for _ in range(tasks):
        z = rng.normal(size=(len(ratios) + 1, 2)) @ [1, 1j]
        known = SerialChain(z[0], tuple(z[1:]), ratios)
        phi = np.r_[0.0, np.sort(rng.uniform(0.2, 3.0, 2 * len(ratios)))]
        points = known.tip(phi)
        values, _ = paths.path_parameters(points)
        system = paths.path_system(exponents)
        here = solve(system, values, start=found, seed=seed, certificates=False)
        chains = [chain for _, chain, _ in paths.real_chains(here, exponents, points)]
        if not any(np.allclose(chain.links, known.links, rtol=1e-5, atol=1e-6) for chain in chains):
            raise AssertionError(f"the known chain {known} is not among {len(chains)} real ones")
        counts.append(len(chains))
    return counts


def rows(links: int, most: int, tasks: int) -> list[dict[str, Any]]:
    """One row for each set of ratios, simplest first; those with too many paths are listed unsolved."""
    table: list[dict[str, Any]] = []
    seen: dict[tuple[int, ...], Solutions] = {}
    choices = [(1.0, *c) for c in itertools.combinations(HALVES, links - 1)]
    for ratios in sorted(choices, key=lambda r: paths.paths_to_track(whole_exponents(r))):
        exponents = whole_exponents(ratios)
        count = paths.paths_to_track(exponents)
        row: dict[str, Any] = {"ratios": ratios[1:], "exponents": exponents, "paths": count}
        if count <= most:
            start = time.perf_counter()
            found = seen.setdefault(exponents, generic(exponents))
            row |= {"complex": len(found.points), "failed": found.ledger.failed, "ledger": found.ledger.as_dict()}
            row["seconds"] = round(time.perf_counter() - start, 1)
            row["real"] = real_counts(found, ratios, tasks)
        table.append(row)
        print(json.dumps(row), flush=True)
    return table


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--links", type=int, default=2)
    parser.add_argument("--most", type=int, default=20_000)
    parser.add_argument("--tasks", type=int, default=3)
    options = parser.parse_args()
    rows(options.links, options.most, options.tasks)


if __name__ == "__main__":
    main()
