"""All roots at generic parameters, from nothing, and carried to new ones.

    python -m benchmarks.fibres [--seeds N] [--jobs N] [--targets N]

For Alt's nine points and for the seven-pose trammel: monodromy with trace test and certificates, then real targets by
parameter homotopy, each line with wall and processor seconds.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from benchmarks.systems import trammel_seed, trammel_system
from solvers import Solutions, System, certify, monodromy, solve

#: Problem 3 of Wampler, Morgan and Sommese, Complete solution of the nine-point path synthesis problem, 1992.
NINE_POINTS = np.array(
    [0.25, 0.52 + 0.1j, 0.8 + 0.7j, 1.2 + 1j, 1.4 + 1.3j, 1.1 + 1.48j, 0.7 + 1.4j, 0.2 + 1j, 0.02 + 0.4j]
)


@contextmanager
def clock(what: str) -> Iterator[None]:
    """Print wall and processor time of a block."""
    wall, cpu = time.perf_counter(), time.process_time()
    yield
    print(f"  {what}: {time.perf_counter() - wall:.2f} s, processor {time.process_time() - cpu:.2f} s", flush=True)


def nine_points(seed: int, jobs: int) -> tuple[System, Solutions]:
    """Alt's problem with its six-fold symmetry; the three fixed pivots together are invariant."""
    from mechanisms.families.four_bar_curve import cognate, nine_point_instance, nine_point_system, swap

    system = nine_point_system()
    a, z, b, w = (system.unknowns[k] for k in (0, 2, 4, 6))
    pivots = a + b + (a - z / (z - w) * (a - b))
    start = nine_point_instance(np.random.default_rng(seed))
    return system, monodromy(
        system, seed=seed, start=start, symmetry=(swap, cognate), invariant=pivots, jobs=jobs
    )


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--targets", type=int, default=40)
    given = parser.parse_args()
    for seed in range(given.seeds):
        print(f"nine points, seed {seed}")
        with clock("monodromy and trace test"):
            system, family = nine_points(seed, given.jobs)
        print(f"  {family.evidence}; complete: {family.complete}")
        with clock("certificates"):
            certificate = certify(system, family)
        print(f"  {certificate}")
        delta = (NINE_POINTS - NINE_POINTS[0])[1:]
        with clock("a real target, certified"):
            real = solve(system, np.stack([delta, delta.conj()], 1).ravel(), start=family, jobs=given.jobs)
        print(f"  {real}; {real.certificate}")
    for seed in range(given.seeds):
        print(f"seven-pose trammel, seed {seed}")
        rng = np.random.default_rng(seed)
        system = trammel_system()
        point, values = trammel_seed(rng)
        with clock("monodromy and trace test"):
            family = monodromy(system, seed=seed, start=(point, values), jobs=given.jobs)
        print(f"  {family.evidence}; complete: {family.complete}")
        full = short = again = 0
        with clock(f"{given.targets} random complex targets"):
            for k in range(given.targets):
                target = rng.normal(size=len(values)) + 1j * rng.normal(size=len(values))
                there = solve(system, target, start=family, jobs=given.jobs, seed=k, certificates=False)
                full += len(there) == len(family)
                short += len(there) < len(family)
                again += bool(there.ledger.rungs)
        print(f"  {full} complete, {short} short, {again} needed more than one pass")


if __name__ == "__main__":
    main()
