"""The tracker does not know units: unknowns, equations and parameters may be measured in any."""

import numpy as np
import pytest
from kernel_systems import katsura

from solvers.graph import Builder
from solvers.kernel.engine import make_engine
from solvers.kernel.reference import REACHED


@pytest.mark.parametrize("prefer", ["reference", "interpreted"])
@pytest.mark.parametrize("exponent", [-40, -3, 7, 40])
def test_powers_of_two_change_nothing_but_the_exponent(prefer, exponent):
    plain, *line = katsura(3)
    unit = 2.0**exponent
    scaled, starts, base, direction = katsura(3, unit)
    plain.prefer = scaled.prefer = prefer
    expected, found = plain.track(*line), scaled.track(starts, base, direction)
    assert np.array_equal(found.ticks, expected.ticks)
    assert np.array_equal(found.x, expected.x * unit)


@pytest.mark.parametrize("prefer", ["reference", "interpreted", "compiled"])
@pytest.mark.parametrize("unit", [1e-4, 1e4, 25.4])
def test_other_units_give_the_same_roots(prefer, unit):
    plain, *line = katsura(3)
    scaled, starts, base, direction = katsura(3, unit)
    plain.prefer = scaled.prefer = prefer
    expected, found = plain.track(*line), scaled.track(starts, base, direction)
    assert (found.status == REACHED).all()
    assert np.abs(found.x / unit - expected.x).max() < 1e-13
    assert np.abs(found.steps - expected.steps).max() <= 3


@pytest.mark.parametrize("pivoted", [False, True])
def test_each_unknown_has_its_own_weight(pivoted):
    # x² + y² = p and x = q y, with y measured in 1e6 and the equations in 1e-9: the weights are relative.
    roots = []
    for size, weight in ((1.0, 1.0), (1e6, 1e-9)):
        b = Builder(2, 2)
        x, y = b.unknown(0), b.multiply(b.constant(1 / size), b.unknown(1))
        circle = b.sub(b.add(b.square(x), b.square(y)), b.parameter(0))
        line = b.sub(x, b.multiply(b.parameter(1), y))
        start = np.array([2.0, 1.0 + 0.5j])
        y0 = np.sqrt(start[0] / (1 + start[1] ** 2))
        points = np.array([[start[1] * y0, y0 * size], [-start[1] * y0, -y0 * size]])
        equations = [b.multiply(b.constant(weight), circle), line]
        engine = make_engine(b, equations, (points, start))
        engine.prefer = "interpreted"
        target = np.array([3 - 1j, 0.2])
        found = engine.track(points, target, start - target, pivoted=pivoted)
        assert (found.status == REACHED).all()
        roots.append((found.x / [1, size], found.steps))
    assert np.abs(roots[0][0] - roots[1][0]).max() < 1e-14
    assert np.abs(roots[0][1] - roots[1][1]).max() <= 1
