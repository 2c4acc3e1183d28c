"""Vectors of lanes against NumPy, for every width, with and without the fused instruction."""

import numpy as np
import pytest
from numba import njit

from solvers.kernel import double_lanes, lanes, tracker
from solvers.kernel.lanes import Lanes, native_lanes

ALL = [Lanes(2), Lanes(2, fma=False), Lanes(4), Lanes(4, fma=False), Lanes(8)]


@njit
def _arithmetic(token, a, out):
    x, y, z = lanes.load(token, a, 0), lanes.load(token, a, 1), lanes.load(token, a, 2)
    half = lanes.splat(token, 0.5)
    lanes.store(out, 0, x + y)
    lanes.store(out, 1, x - y)
    lanes.store(out, 2, x * y)
    lanes.store(out, 3, x / y)
    lanes.store(out, 4, lanes.fma(x, y, z))
    lanes.store(out, 5, lanes.sqrt(y))
    lanes.store(out, 6, lanes.maximum(x, z))
    lanes.store(out, 7, lanes.minimum(x, z))
    lanes.store(out, 8, lanes.select((x < z) & (y > half), x, y))
    lanes.store(out, 9, lanes.rough_reciprocal(y))
    lanes.store(out, 10, lanes.negative(x))
    lanes.store(out, 11, lanes.product_error(x, y, x * y))
    lanes.store(out, 12, tracker._exp(token, x))
    return lanes.bits((x <= z) | (y >= half)), lanes.any_lane(lanes.outside(x < z))


@pytest.mark.parametrize("token", ALL, ids=str)
def test_arithmetic(token):
    width = token.width
    rng = np.random.default_rng(width)
    x, y, z = rng.normal(size=width) * 10, rng.uniform(0.01, 3, width), rng.normal(size=width) * 10
    out = np.zeros(13 * width)
    mask, above = _arithmetic(token, np.concatenate([x, y, z]), out)
    out = out.reshape(13, width)
    exact = [x + y, x - y, x * y, x / y, x * y + z, np.sqrt(y), np.maximum(x, z), np.minimum(x, z)]
    exact.append(np.where((x < z) & (y > 0.5), x, y))
    assert np.abs(out[:9] - exact).max() < 1e-13
    assert np.abs(out[9] * y - 1).max() < 0.02
    assert np.array_equal(out[10], -x)
    from fractions import Fraction

    errors = [float(Fraction(a) * Fraction(b) - Fraction(a * b)) for a, b in zip(x, y)]
    assert np.array_equal(out[11], errors)
    assert np.abs(out[12] / np.exp(x) - 1).max() < 1e-15
    assert mask == sum(1 << k for k in range(width) if x[k] <= z[k] or y[k] >= 0.5)
    assert above == bool((~(x < z)).any())


@njit
def _not_a_number(token, a):
    x = lanes.load(token, a, 0)
    return lanes.bits(x < lanes.splat(token, 1.0)), lanes.bits(x >= lanes.splat(token, 1.0))


def test_a_comparison_with_nan_is_false():
    values = np.full(4, np.nan)
    values[2] = 0.0
    assert _not_a_number(Lanes(4), values) == (0b0100, 0)


@njit
def _double_double(token, work):
    a, b = double_lanes._read(token, work, 0), double_lanes._read(token, work, 4)
    double_lanes._write(work, 8, double_lanes._complex_product(a, b))
    double_lanes._write(work, 12, double_lanes._complex_sum(a, b))
    double_lanes._write(work, 16, double_lanes._inverse(token, a))


@pytest.mark.parametrize("token", ALL, ids=str)
def test_double_double_against_exact_fractions(token):
    from fractions import Fraction

    width = token.width
    rng = np.random.default_rng(1)
    work = rng.normal(size=(20, width))
    work[2:4] *= 1e-17
    work[6:8] *= 1e-17
    flat = work.ravel().copy()
    _double_double(token, flat)
    rows = flat.reshape(20, width)

    def number(first, lane):
        parts = [Fraction(v) for v in rows[first : first + 4, lane]]
        return parts[0] + parts[2], parts[1] + parts[3]

    for lane in range(width):
        (a, b), (c, d) = number(0, lane), number(4, lane)
        norm = a * a + b * b
        truth = {8: (a * c - b * d, a * d + b * c), 12: (a + c, b + d), 16: (a / norm, -b / norm)}
        for row, parts in truth.items():
            size = max(abs(float(p)) for p in parts)
            assert all(abs(float(x - y)) < 1e-30 * size for x, y in zip(number(row, lane), parts))


def test_the_width_can_be_asked_for(monkeypatch):
    native_lanes.cache_clear()
    monkeypatch.setenv("EVERYLINKAGE_LANES", "4")
    assert native_lanes().width == 4
    native_lanes.cache_clear()
    monkeypatch.delenv("EVERYLINKAGE_LANES")
    assert native_lanes().width in (2, 4, 8)


def test_other_widths_are_refused():
    with pytest.raises(ValueError, match="3 lanes"):
        Lanes(3)
