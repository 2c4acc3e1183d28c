"""Ends that agree beside their largest unknown: one multiple root, or several roots."""

import numpy as np
import pytest
import sympy

from solvers import System, solve
from solvers.singular_points import singular_points

x, y, a = sympy.symbols("x y a")
FAR = 5 * 10**9


@pytest.mark.parametrize(
    "equation, places, winding, multiplicities",
    [
        (x**2, [1e-9, -1e-9], 2, [2]),
        (x**2, [1e-9, -1e-9], 1, [2]),
        (x**2 + 1, [1j, -1j], 1, [1, 1]),
        ((x**2 + 1) ** 2, [1j + 1e-9, 1j - 1e-9, -1j + 1e-9, -1j - 1e-9], 2, [2, 2]),
        (x**3 + x, [1j, 0, -1j], 1, [1, 1, 1]),  # their mean is one of them
        (x**3 * (x - 1), [1e-6, 1e-6j, -1e-6, 1], 3, [3, 1]),
    ],
)
def test_beside_a_large_unknown(equation, places, winding, multiplicities):
    ends = np.array([[place, FAR] for place in places], complex)
    found = singular_points(System([equation, y - FAR], [x, y]), np.zeros(0), ends, np.full(len(ends), winding), 1.0)
    assert found.multiplicity.tolist() == multiplicities
    for point in found.points:
        assert abs(complex(equation.subs(x, complex(point[0])))) < 1e-11


def test_compared_in_the_units_of_the_homotopy():
    system, ends = System([x**2 + 1, y - FAR], [x, y]), np.array([[1j, FAR], [-1j, FAR]])
    for scale in ([1.0, 1.0], [1.0, 2.0**32], [2.0**20, 1.0]):
        found = singular_points(system, np.zeros(0), ends, np.array([1, 1]), 1.0, np.array(scale))
        assert found.multiplicity.tolist() == [1, 1]


def test_far_simple_roots_near_to_each_other_beside_their_largest_unknown():
    system = System([a * x**4 + a * x**2 * y + a * x**2 + a + 2, a * x**2 * y + a + 3 * y], [x, y], [a])
    for seed in range(50, 54):
        found = solve(system, [6e-8], seed=seed)
        assert len(found) == 6 and found.complete and not len(found.singular), seed
        assert found.certificate.certified.all(), seed
        far = found.points[np.abs(found.points[:, 1]) > 1]
        assert np.allclose(np.sort(far[:, 0].imag), [-(5e7**0.5), 5e7**0.5]) and np.allclose(far[:, 1], 5e7)
