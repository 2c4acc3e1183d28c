"""Does every path end where a very conservative run ends? Lost paths and jumps of the tracker alone, no retries.

    python -m benchmarks.faithful [--targets N]

The trammel through seven poses, 560 paths to each random complex target, in double precision.
"""

from __future__ import annotations

import argparse

import numpy as np

from benchmarks.systems import trammel_seed, trammel_system
from solvers import monodromy
from solvers.homotopy import parameter_homotopy
from solvers.kernel.reference import REACHED, Settings
from solvers.points import pairs_of_equals
from solvers.tracking import engine_of


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--targets", type=int, default=200)
    targets = parser.parse_args().targets
    rng = np.random.default_rng(0)
    system = trammel_system()
    family = monodromy(system, seed=0, start=trammel_seed(rng), jobs=2)
    start = family.parameters
    engine = engine_of(parameter_homotopy(system.program, start, start, family.points))
    careful = Settings().tighter().tighter()
    lost = jumps = lost_careful = differ = both = 0
    for _ in range(targets):
        target = rng.normal(size=len(start)) + 1j * rng.normal(size=len(start))
        fast = engine.track(family.points, target, start - target)
        slow = engine.track(family.points, target, start - target, settings=careful)
        ok, ok_slow = (done.status == REACHED for done in (fast, slow))
        lost += int((~ok).sum())
        lost_careful += int((~ok_slow).sum())
        jumps += len(pairs_of_equals(fast.x[ok], 1e-7))
        same = ok & ok_slow
        size = np.abs(slow.x[same]).max(axis=1)
        differ += int((np.abs(fast.x[same] - slow.x[same]).max(axis=1) > 1e-6 * size).sum())
        both += int(same.sum())
    paths = targets * len(family)
    print(f"{paths} paths to {targets} targets: {lost} lost ({100 * lost / paths:.4f} %), {jumps} jumps detected")
    print(f"against contraction {careful.contraction:g}, safety {careful.safety:g}: {lost_careful} lost there,")
    print(f"{differ} of the {both} paths that both runs finished end elsewhere")


if __name__ == "__main__":
    main()
