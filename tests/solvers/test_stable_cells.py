"""Stable mixed volumes: published numbers, and the same roots as from a total-degree start."""

import numpy as np
import pytest
import sympy

from benchmarks.zoo import ZOO
from solvers import System, solve
from solvers.choose_start import choose_start
from solvers.mixed_cells import mixed_volume
from solvers.points import pairs_of_equals
from solvers.polyhedral import fewest_cells, scaled_terms
from solvers.stable_cells import stable_cells

x = sympy.symbols("x:3")
#: Huber and Sturmfels 1997: a y + b y² + c x y³, d x + e x² + f x³ y.
EXAMPLE = [np.array([[0, 0], [0, 1], [0, 2], [1, 3]]), np.array([[0, 0], [1, 0], [2, 0], [3, 1]])]


def test_published_example_has_three_six_and_eight_solutions() -> None:
    assert mixed_volume([support[1:] for support in EXAMPLE]) == 3
    assert mixed_volume(EXAMPLE) == 8
    assert {stable_cells(EXAMPLE, [True, True], seed).mixed_volume for seed in range(20)} == {6}


def test_constants_that_are_there_are_not_lifted() -> None:
    assert stable_cells(EXAMPLE, [False, False]).mixed_volume == 8
    assert fewest_cells(EXAMPLE, np.ones(8)).mixed_volume == 8


@pytest.mark.parametrize("first", range(0, 60, 20))
def test_published_example_is_solved_with_six_paths(first: int) -> None:
    system = System([2 * x[1] + 3 * x[1] ** 2 + 5 * x[0] * x[1] ** 3, 7 * x[0] - 4 * x[0] ** 2 + 3 * x[0] ** 3 * x[1]],
                    x[:2])  # fmt: skip
    for seed in range(first, first + 20):
        found = solve(system, seed=seed, certificates=False)
        assert found.start == "polyhedral" and found.ledger.as_dict() == {
            "tracked": 6, "finite": 6, "singular": 0, "at_infinity": 0, "failed": 0}  # fmt: skip
        zeros = sorted(tuple(np.round(p, 9)) for p in found.points.real[np.abs(found.points).min(axis=1) < 1e-12])
        np.testing.assert_allclose(zeros, [(0, -2 / 3), (0, 0), (7 / 4, 0)], atol=1e-8)


def sparse_systems(wanted: int) -> list[System]:
    """Random systems without constants for which stable cells save paths."""
    rng, found = np.random.default_rng(7), []
    while len(found) < wanted:
        n = int(rng.integers(2, 4))
        equations = []
        for _ in range(n):
            powers = rng.integers(0, 4 if n == 2 else 3, size=(rng.integers(2, 5), n))
            powers = powers[powers.sum(axis=1) > 0]
            equations.append(
                sum(int(rng.integers(1, 9)) * sympy.prod([x[j] ** int(k) for j, k in enumerate(p)]) for p in powers)
            )
        if 0 in equations:
            continue
        system = System(equations, x[:n])
        cells = choose_start(system, start="polyhedral").cells
        if cells is not None and cells.fade:
            found.append(system)
    return found


def test_sparse_systems_have_the_roots_of_a_total_degree_start() -> None:
    for seed, system in enumerate(sparse_systems(6)):
        one = solve(system, start="polyhedral", seed=seed, certificates=False).points
        other = solve(system, start="total-degree", seed=seed, certificates=False).points
        pairs = pairs_of_equals(np.concatenate([one, other]), 1e-6, floor=1e-6)
        assert len(one) == len(other) == len(pairs)


@pytest.mark.parametrize(
    ("equations", "seeds", "roots"),
    [
        # No solution has a zero coordinate: both constants are needless.
        ([2 * x[0] * x[1] ** 3 - x[1] ** 3, x[0] ** 4 * x[1] - 3 * x[0] * x[1] ** 3 + 2], (1, 2, 7), 3),
        # One of two constants is needed.
        ([-3 * x[0] * x[2] ** 3 + x[2] ** 3, 3 * x[1] ** 2 + 3 * x[1] * x[2],
          2 * x[0] ** 3 * x[2] + x[1] ** 2 * x[2] ** 2 - 2], (6,), 5),
        # Both are needed, for a triple root at the origin.
        ([3 * x[0] ** 4 * x[1] - 3 * x[0], -3 * x[0] ** 3 * x[1] ** 4 - 2 * x[0] ** 2 * x[1] ** 4 + 2 * x[1] ** 3],
         range(20), 1),
    ],
)  # fmt: skip
def test_no_path_changes_places_with_one_that_is_not_followed(equations, seeds, roots) -> None:
    """On these seeds paths come so near to infinity that constants of 1e-10 sent them there."""
    system = System(equations, x[: len(equations)])
    for seed in seeds:
        assert len(solve(system, start="polyhedral", seed=seed, certificates=False)) == roots


def test_constants_that_no_stable_cell_needs_are_nearly_zero() -> None:
    supports = [np.array([[0, 0], [0, 3], [1, 3]]), np.array([[0, 0], [1, 3], [4, 1]])]
    cells = stable_cells(supports, [True, False])
    left = np.exp(-cells.fade * np.concatenate(cells.liftings))
    assert cells.mixed_volume == 3 and left[0] < 1e-50 and left[1:].min() > 0.9


def test_the_four_bar_of_the_zoo_needs_its_56_paths() -> None:
    """Every system with its supports has 36 solutions without a zero and 20 more with two, all of them isolated."""
    supports, _ = scaled_terms(ZOO["fourbar5"].build(), np.zeros(0))
    assert stable_cells(supports, [True] * 4).mixed_volume == 56
    assert mixed_volume([support[1:] for support in supports]) == 36
    rng, unknowns = np.random.default_rng(1), sympy.symbols("a:4")
    monomials = [[sympy.prod([u ** int(k) for u, k in zip(unknowns, e)]) for e in s[1:]] for s in supports]
    equations = [sum(complex(*rng.normal(size=2)) * m for m in row) for row in monomials]
    found = solve(System(equations, unknowns), start="polyhedral", certificates=False)
    zeros = np.sort(np.abs(found.singular.points), axis=1)
    assert len(found) == 36 and np.abs(found.points).min() > 1e-3
    assert len(zeros) == 20 and zeros[:, :2].max() < 1e-9 and zeros[:, 2].min() > 1e-3
