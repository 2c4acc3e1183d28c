"""Every start leads to the same roots, and to the published number of them."""

import numpy as np
import pytest

from benchmarks.zoo import ZOO
from solvers import solve
from solvers.points import pairs_of_equals

STARTS = ("total-degree", "multihomogeneous", "polyhedral")
QUICK = ("watt2", "burmester", "noon3", "noon4", "eco5", "cyclic5", "katsura5", "chandra6", "fourbar5")
#: Systems whose paths to infinity and to singular ends are many.
SLOW = ("quartics", "noon5", "eco6", "eco7", "cyclic6", "katsura6", "katsura8", "caprasse", "d1", "chandra8")


def check(name):
    benchmark = ZOO[name]
    system = benchmark.build()
    found = []
    for start in STARTS:
        solutions = solve(system, start=start, seed=11, certificates=False)
        assert solutions.ledger.failed == 0, solutions.ledger
        assert solutions.ledger.balanced
        found.append(solutions.points)
    for points in found:
        assert len(points) == benchmark.isolated
        both = np.concatenate([found[0], points])
        # Every root of one list has exactly one partner in the other, and none in its own.
        pairs = pairs_of_equals(both, 1e-7)
        assert len(pairs) == benchmark.isolated
        assert np.all(pairs[:, 0] < benchmark.isolated)
        assert np.all(pairs[:, 1] >= benchmark.isolated)


@pytest.mark.parametrize("name", QUICK)
def test_starts_agree_root_by_root(name):
    check(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_starts_agree_root_by_root_on_larger_systems(name):
    check(name)
