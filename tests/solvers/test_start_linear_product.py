"""Start systems: their points solve them, are distinct, and are as many as counted."""

from itertools import product

import numpy as np
import pytest
import sympy

from solvers.partition import multihomogeneous_bezout, partition_of
from solvers.start_linear_product import ChoiceGraph, linear_product
from solvers.start_multihomogeneous import multihomogeneous
from solvers.system import System, evaluate

x, y, z, p = sympy.symbols("x y z p")


def values_at_start(homotopy, points):
    system = System.from_program(homotopy.program)
    return evaluate(system.jacobian_program, points, homotopy.start)


def generic_solutions(structure, n, rng):
    """By brute force: try every choice of forms with random coefficients."""
    forms = []
    for sets in structure:
        table = np.zeros((len(sets), n))
        for row, members in zip(table, sets):
            row[list(members)] = rng.normal(size=len(members))
        forms.append(table)
    return sum(
        abs(np.linalg.det(np.array([forms[i][k] for i, k in enumerate(choice)]))) > 1e-9
        for choice in product(*[range(len(sets)) for sets in structure])
    )


def test_choices_are_counted_as_brute_force_counts_them():
    rng = np.random.default_rng(1)
    for _ in range(40):
        n = int(rng.integers(1, 6))
        structure = [
            tuple(
                tuple(sorted(rng.choice(n, size=rng.integers(1, n + 1), replace=False).tolist()))
                for _ in range(rng.integers(1, 4))
            )
            for _ in range(n)
        ]
        assert ChoiceGraph(tuple(structure)).count == generic_solutions(structure, n, rng)


def test_every_choice_comes_once():
    structure = (((0, 1), (0, 1), (2,)), ((0,), (1, 2)), ((0, 1), (2,), (2,)))
    graph = ChoiceGraph(structure)
    choices = graph.choices(range(graph.count))
    assert len({tuple(c) for c in choices.tolist()}) == graph.count


@pytest.mark.parametrize("groups", [[[0, 1, 2]], [[0], [1, 2]], [[0], [1], [2]]])
def test_points_solve_the_start_system(groups):
    system = System([x**2 * y - p * z + 1, x * y * z - 2, z**2 + x * y - 3 * p], [x, y, z], [p])
    homotopy = multihomogeneous(system, np.array([0.7 + 0.1j]), seed=2, groups=groups)
    count = homotopy.starts.count
    assert count == partition_of(system, groups).bezout
    points = homotopy.starts.points(np.arange(count))
    residual, jacobian = values_at_start(homotopy, points)
    assert np.abs(residual).max() < 1e-11 * max(1, np.abs(points).max()) ** 3
    assert np.linalg.svd(jacobian, compute_uv=False)[:, -1].min() > 1e-6
    distances = np.abs(points[:, None] - points[None]).max(axis=2) + np.eye(count)
    assert distances.min() > 1e-6


def test_points_are_generated_one_by_one():
    unknowns = sympy.symbols("x0:12")
    system = System([sum(unknowns) ** 4 + k for k in range(12)], unknowns)
    groups = [list(range(6)), list(range(6, 12))]
    homotopy = multihomogeneous(system, np.zeros(0), groups=groups)
    assert homotopy.starts.count == multihomogeneous_bezout([[4] * 12] * 2, [6, 6]) == 924 * 4**12
    last = homotopy.starts.count - 1
    points = homotopy.starts.points(np.array([last, 10**9]))
    assert np.array_equal(points[1:], homotopy.starts.points(np.array([10**9])))
    assert np.abs(values_at_start(homotopy, points)[0]).max() < 1e-8
    with pytest.raises(IndexError):
        homotopy.starts.points(np.array([last + 1]))


def test_numbers_beyond_64_bits():
    count = 40
    graph = ChoiceGraph(((tuple(range(count)),) * 4,) * count)
    assert graph.count == 4**count
    assert graph.choices([4**count - 1]).tolist() == [[3] * count]


def test_the_end_of_the_homotopy_is_the_target():
    system = System([x**2 * y - p, x * y - 2], [x, y], [p])
    homotopy = multihomogeneous(
        system, np.array([3.0]), unknown_scale=np.array([2.0, 5.0]), equation_scale=np.array([0.5, 0.1])
    )
    u = np.array([[0.3 + 1j, -0.7]])
    residual, _ = evaluate(System.from_program(homotopy.program).jacobian_program, u, homotopy.target)
    expected, _ = system.evaluate(homotopy.in_user_units(u), [3.0])
    assert np.allclose(residual, expected * [0.5, 0.1])


def test_structure_that_does_not_cover_is_refused():
    system = System([x**2 * y - 1, x + y], [x, y])
    with pytest.raises(ValueError, match="degree 3"):
        linear_product(system, [[[0, 1]], [[0, 1]]], np.zeros(0))
    with pytest.raises(ValueError, match="degree 2 in x"):
        linear_product(system, [[[0], [1], [1]], [[0, 1]]], np.zeros(0))
