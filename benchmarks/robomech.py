"""How surely RoboMech manipulators are found: from the two paths alone, and with the passive chains given.

    python -m benchmarks.robomech [--seeds 20] [--first 0] [--good 1e-6] [--norm least-squares] [--samples 4000]
    python -m benchmarks.robomech --chains [--seeds 20]
    python -m benchmarks.robomech --unmet [--seeds 3] [--samples 128]

The task is the pair of paths of a manipulator drawn in round numbers (`mechanisms.reproduce.robomech`), nothing else:
no dimension of it, not even perturbed.  Printed for each seed: CPU seconds, the largest and the root mean square
distance of C and F from their points with the input alone driven, whether it is the manipulator that was drawn, and
the critical points of its negative dyads; in the end the rate.  Exit code 1 when fewer than nine in ten succeed.

`--unmet` lays a wave of a hundredth upon one path, which no manipulator follows, and makes the mean square and the
largest error least: each must be better in its own norm.
"""

from __future__ import annotations

import argparse
import sys
import time

import numpy as np

from mechanisms.families.robomech_fit import Norm, passive_chain
from mechanisms.families.robomech_joint import ManipulatorFit, complete_manipulators
from mechanisms.families.robomech_search import GOOD, SAMPLES, fit_manipulator
from mechanisms.reproduce.robomech import PHI7, drawn, paths

#: Dimensions nearer than this to those that were drawn are the same.
ORIGINAL, ORIGINAL_GIVEN = 1e-4, 1e-8
#: A wave that no manipulator follows: four turns along the path.
WAVE, WAVES = 0.01, 40j


def difference(fit: ManipulatorFit) -> float:
    """The largest difference of a dimension from the manipulator that was drawn."""
    ours, theirs = fit.mechanism.parameters(), drawn().parameters()
    return max(abs(ours[name] - theirs[name]) for name in theirs)


def line(seed: int, fit: ManipulatorFit, seconds: float, original: float) -> str:
    """One row."""
    which = "the original" if difference(fit) < original else "another"
    proofs = ", ".join(f"{name} {dyads.summary}" for name, dyads in zip(("LM", "NQ"), fit.proofs))
    return (
        f"seed {seed:3}  {seconds:7.1f} CPU s  largest error {fit.worst:.1e}  rms {fit.rms:.1e}  {which:12}  "
        f"{proofs or 'dyads not proved'}"
    )


def from_paths(seeds: range, good: float, norm: Norm, samples: int) -> int:
    """How many seeds reach the largest error `good`."""
    c, f = paths()
    reached = originals = 0
    taken = []
    for seed in seeds:
        begin = time.process_time()
        fits = fit_manipulator(c, f, PHI7.tolist(), norm, seed, good, samples)
        best = min(fits, key=lambda fit: fit.worst)
        taken.append(time.process_time() - begin)
        reached += best.worst <= good
        originals += difference(best) < ORIGINAL
        print(line(seed, best, taken[-1], ORIGINAL), flush=True)
    print(
        f"{reached} of {len(seeds)} seeds within {good:g}, {originals} of them the original; "
        f"median {np.median(taken):.0f}, most {max(taken):.0f} CPU s"
    )
    return reached


def with_chains(seeds: range) -> int:
    """How many seeds find the original to `ORIGINAL_GIVEN`."""
    c, f = paths()
    mech = drawn()
    reached = 0
    for seed in seeds:
        begin = time.process_time()
        chains = [
            passive_chain(path, half.pivot, half.crank, half.rod, elbow)
            for path, half, elbow in ((c, mech.c, 1.0), (f, mech.f, -1.0))
        ]
        best = complete_manipulators(chains, c, f, PHI7.tolist(), seed=seed)[0]
        reached += difference(best) < ORIGINAL_GIVEN
        print(line(seed, best, time.process_time() - begin, ORIGINAL_GIVEN), f"to {difference(best):.0e}", flush=True)
    print(f"{reached} of {len(seeds)} seeds find the original to {ORIGINAL_GIVEN:g}")
    return reached


def unmet(seeds: range, samples: int) -> int:
    """How many seeds give fits that are each better in their own norm."""
    c, f = paths()
    bent = (np.array(c) + WAVE * np.exp(WAVES * PHI7)).tolist()
    reached = 0
    for seed in seeds:
        begin = time.process_time()
        mean = fit_manipulator(bent, f, PHI7.tolist(), seed=seed, samples=samples)[0]
        worst = fit_manipulator(bent, f, PHI7.tolist(), "minimax", seed, samples=samples)[0]
        for norm, fit in (("least squares", mean), ("Chebyshev", worst)):
            print(f"{norm:14}", line(seed, fit, time.process_time() - begin, 0.0), flush=True)
        reached += mean.rms <= worst.rms and worst.worst <= mean.worst
    print(f"{reached} of {len(seeds)} seeds: each fit better in its own norm")
    return reached


def main(arguments: list[str] | None = None) -> int:
    """Run and print; 1 if fewer than nine in ten succeed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.robomech", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--good", type=float, default=GOOD, help="largest error that ends a search")
    parser.add_argument("--norm", choices=("least-squares", "minimax"), default="least-squares")
    parser.add_argument("--samples", type=int, default=SAMPLES, help="circles of H that are tried at most")
    parser.add_argument("--chains", action="store_true", help="give the passive chains")
    parser.add_argument("--unmet", action="store_true", help="a task that no manipulator meets")
    options = parser.parse_args(arguments)
    seeds = range(options.first, options.first + options.seeds)
    if options.chains:
        reached = with_chains(seeds)
    elif options.unmet:
        reached = unmet(seeds, options.samples)
    else:
        reached = from_paths(seeds, options.good, options.norm, options.samples)
    return 0 if reached >= 0.9 * len(seeds) else 1


if __name__ == "__main__":
    sys.exit(main())
