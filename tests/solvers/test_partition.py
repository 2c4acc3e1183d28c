"""Multihomogeneous Bézout numbers against definitions and published numbers."""

from math import prod

import numpy as np
import pytest
import sympy

from solvers.partition import (
    _all_partitions,
    _degrees_in_many,
    best_partition,
    multihomogeneous_bezout,
    partition_of,
)
from solvers.system import System


def by_expansion(degrees, sizes):
    """The definition: a coefficient of a product of linear forms, expanded by SymPy."""
    y = sympy.symbols(f"y0:{len(sizes)}")
    product = sympy.prod([sum(d * v for d, v in zip(column, y)) for column in zip(*degrees)])
    return int(sympy.Poly(product, *y).coeff_monomial(sympy.prod([v**k for v, k in zip(y, sizes)])))


def test_number_agrees_with_its_definition():
    rng = np.random.default_rng(3)
    for _ in range(40):
        sizes = rng.integers(1, 4, size=rng.integers(1, 4)).tolist()
        degrees = rng.integers(0, 4, size=(len(sizes), sum(sizes))).tolist()
        assert multihomogeneous_bezout(degrees, sizes) == by_expansion(degrees, sizes)


def test_single_group_is_the_total_degree_and_singletons_are_the_permanent():
    rng = np.random.default_rng(4)
    degrees = rng.integers(1, 5, size=(1, 6)).tolist()
    assert multihomogeneous_bezout(degrees, [6]) == prod(degrees[0])
    matrix = rng.integers(0, 3, size=(5, 5)).tolist()
    permanent = sympy.Matrix(matrix).per()
    assert multihomogeneous_bezout(matrix, [1] * 5) == permanent


def test_bell_numbers():
    assert [sum(1 for _ in _all_partitions(n)) for n in range(1, 8)] == [1, 2, 5, 15, 52, 203, 877]


def test_degrees_of_many_groups_agree_with_degrees_in():
    x, y, z = sympy.symbols("x y z")
    system = System([(x * y + z) ** 2 - x**2 * y**2, x**3 * (y - z) - 1, x + y * z**2], [x, y, z])
    groups = [[0], [1], [2], [0, 1], [0, 2], [1, 2], [0, 1, 2]]
    members = np.array([[int(k in group) for k in range(3)] for group in groups])
    assert np.array_equal(_degrees_in_many(system, members).T, system.degrees_in(groups))


def test_generalised_eigenvalue_problem():
    """A v = λ v with one linear normalisation: n eigenpairs, not 2^n."""
    n = 5
    rng = np.random.default_rng(5)
    A = rng.integers(-9, 10, size=(n, n)).tolist()
    v, lam = sympy.symbols(f"v0:{n}"), sympy.Symbol("lam")
    equations = [sum(a * b for a, b in zip(row, v)) - lam * v[k] for k, row in enumerate(A)]
    equations.append(sum(v) - 1)
    system = System(equations, [*v, lam])
    assert system.bezout == 2**n
    assert best_partition(system).bezout == n


@pytest.mark.parametrize("count", [10, 14])
def test_local_search_finds_the_grouping_of_a_larger_eigenproblem(count):
    rng = np.random.default_rng(6)
    n = count - 1
    A = rng.integers(-9, 10, size=(n, n)).tolist()
    v, lam = sympy.symbols(f"v0:{n}"), sympy.Symbol("lam")
    equations = [sum(a * b for a, b in zip(row, v)) - lam * v[k] for k, row in enumerate(A)]
    equations.append(sum(v) - 1)
    assert best_partition(System(equations, [*v, lam])).bezout == n


def test_partition_must_hold_every_unknown_once():
    x, y = sympy.symbols("x y")
    with pytest.raises(ValueError, match="once"):
        partition_of(System([x * y - 1, x + y], [x, y]), [[0], [0, 1]])
