"""Every start system on every system of the zoo: do they lead to the same roots, root by root?

    python -m benchmarks.agreement [SYSTEM …] [--starts S,T] [--seeds 1] [--json]

The starts are total-degree, multihomogeneous, polyhedral (solutions with zero coordinates wanted) and monodromy: all
roots of the system with a random constant added to each equation, from one root, then carried to the constant zero;
where the trace test tells that loops of constants do not lead to all of them, all coefficients take part.
Each start must find every root that any of them finds once and only once, as many as published, with no path failed.
A line for each start that does not; exit code 1 if there is one.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy

from benchmarks.zoo import ZOO
from solvers import Solutions, System, monodromy, solve
from solvers.points import PointSet, pairs_of_equals
from solvers.supports import terms

STARTS = ("total-degree", "multihomogeneous", "polyhedral", "monodromy")
#: Roots nearer than this, relative to their largest coordinate (or 1), are the same; they are refined to rounding,
#: and the worst-conditioned ones of the zoo to 1e-9.
SAME = 1e-7


@dataclass
class Outcome:
    """One start on one system.

    Attributes
    ----------
    start : str
    roots : ndarray, shape (n, unknowns)
    paths, failed, singular : int
        Of the ledger; singular counts endpoints.
    seconds : float
        CPU time.
    trouble : list of str
        How the roots differ from those of the other starts.
    """

    start: str
    roots: np.ndarray
    paths: int
    failed: int
    singular: int
    seconds: float
    trouble: list[str]


def shifted(system: System) -> System:
    """The system with a parameter, in units of the largest coefficient, added to each equation.

    Monodromy needs parameters that move, by as much as matters: constants that are small beside the equation's other
    terms lead round nothing.
    """
    shifts = sympy.symbols(f"shift:{system.size[0]}")
    sizes = [float(np.abs(row).max()) for row in terms(system).coefficients]
    moved = [f + size * s for f, size, s in zip(system.equations, sizes, shifts)]
    return System(moved, system.unknowns, shifts)


def freed(system: System) -> tuple[System, np.ndarray]:
    """The system with its coefficients as parameters, and their values."""
    equations, parameters, values = [], [], []
    for row, equation in enumerate(system.equations):
        expanded = sympy.Poly(equation, *system.unknowns)
        names = sympy.symbols(f"c{row}_:{len(expanded.terms())}")
        equations.append(sympy.Poly(dict(zip(expanded.monoms(), names)), *system.unknowns).as_expr())
        parameters += names
        values += [complex(c) for c in expanded.coeffs()]
    return System(equations, system.unknowns, parameters), np.array(values)


def solved(system: System, start: str, seed: int) -> Solutions:
    """The roots by one start."""
    if start != "monodromy":
        return solve(system, start=start, seed=seed, certificates=False)
    moving = shifted(system)
    generic, values = monodromy(moving, seed=seed), np.zeros(system.size[0])
    if not generic.complete:
        moving, values = freed(system)
        generic = monodromy(moving, seed=seed)
    return solve(moving, values, start=generic, seed=seed, certificates=False)


def with_one(roots: np.ndarray) -> np.ndarray:
    """Roots with a coordinate 1 added: relative to itself nothing is equal to the origin."""
    return np.column_stack([roots, np.ones(len(roots))])


def compare(name: str, starts: tuple[str, ...] = STARTS, seed: int = 0) -> list[Outcome]:
    """Solve one system of the zoo by each start, and say where they differ."""
    system, published = ZOO[name].build(), ZOO[name].isolated
    outcomes = []
    for start in starts:
        begin = time.process_time()
        found = solved(system, start, seed)
        spent = time.process_time() - begin
        ledger = found.ledger
        outcomes.append(Outcome(start, found.points, ledger.tracked, ledger.failed, ledger.singular, spent, []))
    everything = PointSet(system.size[1] + 1, SAME)
    for outcome in outcomes:
        everything.add(with_one(outcome.roots))
    for outcome in outcomes:
        twice = len(pairs_of_equals(with_one(outcome.roots), SAME))
        met = everything.find(with_one(outcome.roots))
        missed = len(everything) - len(np.unique(met[met >= 0]))
        told = [
            (outcome.failed, f"{outcome.failed} paths failed"),
            (twice, f"{twice} roots twice"),
            (missed, f"{missed} roots missed that another start found"),
            (len(outcome.roots) != published, f"{len(outcome.roots)} roots, published are {published}"),
        ]
        outcome.trouble += [words for true, words in told if true]
    return outcomes


def as_dict(name: str, seed: int, outcome: Outcome) -> dict[str, Any]:
    """For ``--json``."""
    numbers = {key: getattr(outcome, key) for key in ("start", "paths", "failed", "singular", "trouble")}
    return {"system": name, "seed": seed, "roots": len(outcome.roots), "cpu_seconds": outcome.seconds} | numbers


def main(arguments: list[str] | None = None) -> int:
    """Run and print; 1 if any start differs."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.agreement", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=f"of {', '.join(ZOO)}; default: all")
    parser.add_argument("--starts", default=",".join(STARTS), help="separated by commas")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args(arguments)
    starts = tuple(options.starts.split(","))
    for word, known in [(w, STARTS) for w in starts] + [(w, tuple(ZOO)) for w in options.systems]:
        if word not in known:
            parser.error(f"there is no {word}; choose of {', '.join(known)}")
    good = total = 0
    for name in options.systems or ZOO:
        for seed in range(options.seeds):
            outcomes = compare(name, starts, seed)
            total, good = total + 1, good + (not any(outcome.trouble for outcome in outcomes))
            if options.json:
                for outcome in outcomes:
                    print(json.dumps(as_dict(name, seed, outcome)), flush=True)
                continue
            paths = ", ".join(f"{o.start} {o.paths} paths {o.seconds:.1f} s" for o in outcomes)
            print(f"{name:10} seed {seed}: {len(outcomes[0].roots):4} roots  {paths}", flush=True)
            for outcome in outcomes:
                if outcome.trouble:
                    print(f"           {outcome.start}: {'; '.join(outcome.trouble)}", flush=True)
    if not options.json:
        print(f"{good} of {total} runs agree root by root")
    return int(good < total)


if __name__ == "__main__":
    sys.exit(main())
