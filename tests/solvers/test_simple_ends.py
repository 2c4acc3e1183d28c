"""Ends taken for singular: simple roots are recognised, multiple ones and roots found twice are not."""

from dataclasses import replace

import numpy as np
from sympy import symbols

from solvers import System, certify, solve
from solvers.simple_ends import with_simple_ends
from solvers.solutions import Singular

x, y = symbols("x y")


def split(solutions, rows, multiplicity=1, winding=1):
    """The same solutions, some roots of which have been taken for singular ends."""
    rows = np.array(rows)
    kept = np.setdiff1d(np.arange(len(solutions)), rows)
    ones = np.ones(len(rows), np.int64)
    return replace(
        solutions,
        points=solutions.points[kept],
        paths=solutions.paths[kept],
        singular=Singular(solutions.points[rows], multiplicity * ones, winding * ones, ones),
        ledger=replace(solutions.ledger, finite=len(kept), singular=len(rows)),
        certificate=None,
    )


def test_simple_roots_go_back_to_the_others():
    """One root is at 10^9 and 10^−9, as the barred coordinates of a nearly degenerate four-bar are."""
    system = System([(x - 1) * (x - 2) * (x - 10**9), x * y - 1], [x, y])
    whole = solve(system, start="total-degree")
    assert len(whole) == 3
    far = int(np.argmax(np.abs(whole.points[:, 0])))
    found = with_simple_ends(system, split(whole, [far]))
    assert len(found) == 3 and not len(found.singular) and found.ledger.balanced
    assert np.allclose(np.sort(found.points[:, 0].real), [1, 2, 1e9])
    assert found.paths.tolist().count(-1) == 1


def test_certificates_cover_the_added_roots():
    system = System([x**2 - 2, y - x], [x, y])
    whole = solve(system)
    part = split(whole, [0])
    part = replace(part, certificate=certify(system, part))
    found = with_simple_ends(system, part)
    assert found.certificate.distinct == 2


def test_multiple_roots_stay_singular():
    system = System([(x - 1) ** 2 * (x + 1), y - x], [x, y])
    found = solve(system, start="total-degree")
    assert len(found) == 1 and with_simple_ends(system, found) is found
    alone = replace(found, singular=replace(found.singular, multiplicity=np.ones(1, int), winding=np.ones(1, int)))
    assert with_simple_ends(system, alone) is alone


def test_a_root_that_is_known_already_is_not_added_again_and_says_that_one_is_missing():
    system = System([x**2 - 2, y - x], [x, y])
    whole = solve(system)
    twice = replace(split(whole, [0]), points=whole.points)
    found = with_simple_ends(system, twice)
    assert len(found) == 2 and len(found.singular) == 1
    assert found.complete is False and "lost its own" in found.evidence


def test_other_shapes_and_windings_are_left_alone():
    system = System([x**2 - 2, y - x], [x, y])
    wound = split(solve(system), [0], winding=2)
    assert with_simple_ends(system, wound) is wound
    over = System([x**2 - 2, y - x, x * y - 2], [x, y])
    assert with_simple_ends(over, wound) is wound
