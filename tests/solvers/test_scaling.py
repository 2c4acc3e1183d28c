"""Scales: units do not matter, and lost roots come back."""

import numpy as np
import sympy

from solvers.scaling import scales_of, scales_of_terms
from solvers.supports import Terms, terms
from solvers.system import System

x, y, z, p = sympy.symbols("x y z p")


def scaled_sizes(system, scales, values=None):
    expanded = terms(system, values)
    return [
        np.abs(row) * np.prod(scales.unknowns**support, axis=1) * scale
        for support, row, scale in zip(expanded.supports, expanded.coefficients, scales.equations)
    ]


def test_a_change_of_units_is_undone():
    equations = [x**2 + x * y - 3, x * y**2 - y + 2]
    plain = scales_of(System(equations, [x, y]))
    units = {x: x / 2**20, y: y * 2**10}
    changed = scales_of(System([e.subs(units, simultaneous=True) * 2**7 for e in equations], [x, y]))
    assert np.allclose(changed.unknowns, plain.unknowns * [2.0**20, 2.0**-10])
    assert np.allclose(changed.equations, plain.equations * 2.0**-7)


def test_sizes_come_near_to_one():
    rng = np.random.default_rng(1)
    units = {v: v * sympy.Float(10.0 ** rng.integers(-6, 7)) for v in (x, y, z)}
    equations = [x * y - z + 1, x**2 + 2 * y * z - 3, y**2 * z - x]
    system = System([e.subs(units, simultaneous=True) * 10**9 for e in equations], [x, y, z])
    sizes = np.concatenate(scaled_sizes(system, scales_of(system)))
    assert sizes.max() < 20
    assert sizes.min() > 0.05


def test_scales_are_powers_of_two():
    scales = scales_of(System([1e-3 * x**2 + 5e5 * y, x * y - 0.1], [x, y]))
    for value in (*scales.unknowns, *scales.equations):
        assert np.frexp(value)[0] == 0.5


def test_parameters_enter():
    system = System([x**2 - p], [x], [p])
    assert scales_of(system, [2.0**40]).unknowns[0] == 2.0**20


def test_degenerate_systems_do_no_harm():
    assert scales_of(System([x - x, y - 1], [x, y])).unknowns.tolist() == [1, 1]
    empty = Terms((np.zeros((0, 1), np.int64),), ((),))
    assert scales_of_terms(empty).equations.tolist() == [1]


def test_equations_too_large_to_expand_are_left_alone():
    unknowns = sympy.symbols("x0:10")
    scales = scales_of(System([(sum(unknowns) + 1) ** 20], unknowns))
    assert scales.unknowns.tolist() == [1] * 10
