"""Binomial and toric starts: the right number of points, all solutions, all distinct."""

import flint
import numpy as np
import pytest
import sympy

from benchmarks.zoo import ZOO
from solvers.binomial import binomial_lattice, binomial_lattices
from solvers.generic import heights_above
from solvers.monomials import coefficient_program
from solvers.points import pairs_of_equals
from solvers.polyhedral import polyhedral, scaled_terms, toric_points
from solvers.system import System, evaluate
from solvers.tracking import Run, track_all


def least_distance(points):
    differences = np.abs(points[:, None] - points[None]).max(axis=2)
    return (differences + np.eye(len(points)) * 10).min()


def solutions(lattice, angles, indices):
    return np.exp(2j * np.pi * (lattice.inverse @ angles + lattice.turns(indices)))


def test_binomial_systems_are_solved_completely():
    rng = np.random.default_rng(1)
    for n in range(1, 6):
        for _ in range(10):
            exponents = rng.integers(-4, 5, size=(n, n))
            size = round(abs(np.linalg.det(exponents)))
            if not 0 < size < 400:
                continue
            angles = rng.random(n)
            lattice = binomial_lattice(exponents)
            assert lattice.count == size
            points = solutions(lattice, angles, np.arange(size))
            left = np.prod(points[:, None, :] ** exponents[None], axis=2)
            assert np.abs(left - np.exp(2j * np.pi * angles)).max() < 1e-11
            assert least_distance(points) > 1e-3


@pytest.mark.filterwarnings("error")
def test_a_system_of_binomials_has_no_points_above_its_cell():
    x, y = sympy.symbols("x y")
    system = System([2 * x * y**2 - 1, y**3 - 1], [x, y])
    homotopy = polyhedral(system, np.zeros(0))
    assert homotopy.starts.points(np.arange(homotopy.starts.count)).shape == (3, 2)


def test_binomial_solutions_with_huge_exponents():
    size = 10**12 + 39
    lattice = binomial_lattice(np.array([[size, 1], [0, 1]]))
    assert lattice.count == size
    point = solutions(lattice, np.array([0.25, 0.5]), np.array([size // 3]))[0]
    # y = -1, so x^size = -i: the angles are (3/4 + k)/size turns, and k is counted up or down
    assert abs(point[1] + 1) < 1e-12
    turns = np.angle(point[0]) / (2 * np.pi) % 1
    assert min(abs(turns - 1 / 3), abs(turns - 2 / 3)) < 1e-11


def test_dependent_exponents_are_refused():
    with pytest.raises(ZeroDivisionError):
        binomial_lattice(np.array([[1, 2], [2, 4]]))


def test_heights_agree_with_the_definition():
    supports = scaled_terms(ZOO["cyclic5"].build(), np.zeros(0))[0]
    points = toric_points(supports)
    cells = points.cells
    heights = heights_above(cells)
    assert np.all((heights == 0).sum(axis=1) == 2 * 5)
    assert np.all(heights[heights > 0] >= 1)
    for cell, row in zip(cells.edges, heights):
        # Heights are the lifting plus an affine function of the exponents: check that on each support.
        at = 0
        for support, (a, b) in zip(cells.supports, cell):
            height = row[at : at + len(support)]
            assert height[a] == height[b] == 0
            at += len(support)
        system = np.zeros((len(row), 5 + 5 + 1))
        at = 0
        for i, (support, lifting) in enumerate(zip(cells.supports, cells.liftings)):
            system[at : at + len(support), :5] = support
            system[at : at + len(support), 5 + i] = 1
            system[at : at + len(support), 10] = lifting
            at += len(support)
        fit = np.linalg.lstsq(system, row, rcond=None)[0]
        assert np.abs(system @ fit - row).max() < 1e-6 * row.max()


@pytest.mark.parametrize("name", ["cyclic5", "noon4", "eco6", "katsura5", "heart", "caprasse", "reimer5"])
def test_toric_points_solve_the_generic_system_and_are_distinct(name):
    supports, _ = scaled_terms(ZOO[name].build(), np.zeros(0))
    toric = toric_points(supports, seed=5)
    points = toric.points(np.arange(toric.count))
    generic = System.from_program(coefficient_program(supports))
    values, jacobians = evaluate(generic.jacobian_program, points, toric.coefficients)
    steps = np.linalg.solve(jacobians, values[:, :, None])[:, :, 0]
    assert (np.abs(steps).max(axis=1) < 1e-9 * np.abs(points).max(axis=1)).all()
    assert len(pairs_of_equals(points, 1e-7)) == 0


@pytest.mark.parametrize("name", ["cyclic5", "noon3", "eco5", "burmester"])
def test_all_roots_are_found(name):
    benchmark = ZOO[name]
    system = benchmark.build()
    homotopy = polyhedral(system, np.zeros(0), seed=1)
    ends, _ = track_all(homotopy, Run())
    values, jacobians = system.evaluate(ends.x)
    with np.errstate(all="ignore"):
        steps = np.abs(np.linalg.solve(jacobians, values[:, :, None])[:, :, 0]).max(axis=1)
    good = ends.x[steps < 1e-10]
    assert len(good) - len(pairs_of_equals(good, 1e-8)) >= benchmark.isolated


def test_roots_with_zero_coordinates_are_found():
    x, y = sympy.symbols("x y")
    system = System([x * (x + y - 3), y * (x - y - 1)], [x, y])
    ends, _ = track_all(polyhedral(system, np.zeros(0)), Run())
    found = {tuple(np.round(p.real, 8) + 0.0) for p in ends.x}
    assert found == {(0, 0), (3, 0), (0, -1), (2, 1)}


def test_scales_and_parameters():
    x, y, p = sympy.symbols("x y p")
    system = System([x**2 - p * y, x * y - 1 + p], [x, y], [p])
    homotopy = polyhedral(
        system, np.array([3.0]), unknown_scale=np.array([2.0, 0.1]), equation_scale=np.array([0.5, 7.0])
    )
    u = np.array([[0.3 + 1j, -0.7]])
    generic = System.from_program(homotopy.program)
    residual, _ = evaluate(generic.jacobian_program, u, homotopy.target)
    expected, _ = system.evaluate(homotopy.in_user_units(u), [3.0])
    assert np.allclose(residual, expected * [0.5, 7.0])


def test_same_seed_same_points():
    supports, _ = scaled_terms(ZOO["eco5"].build(), np.zeros(0))
    first, second = (toric_points(supports, 3).points(np.arange(8)) for _ in range(2))
    assert np.array_equal(first, second)


def test_many_lattices_are_those_of_each():
    rng = np.random.default_rng(12)
    small = rng.integers(-3, 4, (60, 3, 3))
    large = rng.integers(-(2**40), 2**40, (4, 3, 3))  # inverses of these do not fit into double precision
    matrices = np.concatenate([small, large])
    known = [abs(int(flint.fmpz_mat(3, 3, m.ravel().tolist()).det())) for m in matrices]
    regular = np.flatnonzero(known)
    counts = np.array([known[k] for k in regular], object)
    for lattice, matrix in zip(binomial_lattices(matrices[regular], counts), matrices[regular]):
        one = binomial_lattice(matrix)
        assert (lattice.count, lattice.radices) == (one.count, one.radices)
        assert lattice.adjugate.tolist() == one.adjugate.tolist()
        assert np.array_equal(lattice.turns(np.arange(5)), one.turns(np.arange(5)))
