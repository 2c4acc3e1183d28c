"""How many four-bars take M poses and N points, 2M + N = 10, and is the one that they come from among them?

    python -m benchmarks.alt_burmester 2 6 --seeds 1 2 3
    python -m benchmarks.alt_burmester 2 6 --start polyhedral
    python -m benchmarks.alt_burmester 2 6 --tasks 100

Counts are of ordered pairs of dyads with different moving pivots, by monodromy with a trace test, or by every path of
another start.  A start system also leads to the pairs of one dyad with itself, which come in families, and so to
singular ends: only the regular ends are counted.

With ``--tasks`` positions are sampled from random real four-bars (both assemblies, so that they may lie on different
circuits: synthesis does not ask), solved from the catalogue's generic roots, and the true one is looked for; where it
is missing, or its pivots are off, the error that rounding the positions allows is printed beside it.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from benchmarks.burmester import random_task
from mechanisms.families.alt_burmester import mixed_instance, mixed_parameters, mixed_system, swap
from mechanisms.families.motion_dyads import Poses
from solvers import monodromy, solve

#: How exactly the true pivots must be found, in sizes of the task.
BOUND = 1e-9


def main() -> None:
    """Print one line for each seed or start, or a table of the tasks."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("poses", type=int)
    parser.add_argument("points", type=int)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--start", choices=("monodromy", "polyhedral", "total-degree"), default="monodromy")
    parser.add_argument("--tasks", type=int, default=0)
    options = parser.parse_args()
    if options.tasks:
        round_trips(options.poses, options.points, options.tasks, options.seeds[0])
        return
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


def round_trips(poses: int, points: int, tasks: int, seed: int) -> None:
    """Positions of random four-bars, and how well these come back."""
    from mechanisms.catalogue import generic

    system, start = mixed_system(poses, points), generic(f"alt-burmester:{poses}:{points}")
    rng = np.random.default_rng(seed)
    errors, conditions, seconds, lost = [], [], [], 0
    for _ in range(tasks):
        sampled, true = random_task(rng, poses + points)
        given = Poses(sampled.points[:poses], sampled.angles[:poses])
        values = mixed_parameters(given, sampled.points[poses:], sampled.size)
        begun = time.process_time()
        found = solve(system, values, start, certificates=False)
        seconds.append(time.process_time() - begun)
        lost += found.ledger.failed
        places = [(z - sampled.points[0]) / sampled.size for dyad in true for z in (dyad.moving, dyad.fixed)]
        turns = np.exp(1j * sampled.angles[poses:])
        wanted = np.array([part for z in (*places, *turns) for part in (z, np.conj(z))])
        errors.append(float(np.abs(found.points[:, :8] - wanted[:8]).max(axis=1).min()))
        _, jacobian = system.evaluate(wanted[None], values)
        conditions.append(float(np.finfo(float).eps * np.linalg.cond(jacobian[0])))
    off, bound = np.array(errors), np.array(conditions)
    found_again = int((off <= BOUND).sum())
    print(f"({poses}, {points}), {tasks} tasks, seed {seed}: true four-bar found to {BOUND:g}: {found_again}")
    print(f"error: median {np.median(off):.1e}, worst {off.max():.1e}; paths lost: {lost} of {tasks * len(start)}")
    for k in np.flatnonzero(off > BOUND):
        print(f"  task {k}: error {off[k]:.1e}, rounding times condition {bound[k]:.1e}")
    print(f"processor seconds per task: median {np.median(seconds):.3f}")


if __name__ == "__main__":
    main()
