"""Complex double-double numbers, about 32 digits, over a lane axis of numpy arrays.

A number is an unevaluated sum ``hi + lo`` of two doubles for each of its two parts, |lo| at most half a unit in
the last place of hi.  Sums and products are error-free transforms (Dekker, Numer. Math. 1971; Knuth) put together
as in Joldes, Muller, Popescu, "Tight and rigorous error bounds for basic building blocks of double-word
arithmetic", ACM TOMS 2017.  A complex product is accurate relative to the product of the magnitudes, like any
complex product.

A product splits its factors by 2^27 + 1: magnitudes beyond 2^996 overflow, and below 2^-969 digits are lost.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from solvers.replay import compiled_loops
from solvers.tape import Exact, Program, double

#: Relative rounding error of an operation, a small multiple of it in truth: 2^-104.
EPSILON = 2.0**-104
#: Splits a double into two halves of 26 bits (Dekker).
SPLITTER = 2.0**27 + 1


def two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """a + b rounded, and the error, exactly (Knuth); works on the parts of complex numbers too."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def fast_two_sum(a: Any, b: Any) -> tuple[Any, Any]:
    """The same for |a| >= |b| (Dekker)."""
    s = a + b
    return s, b - (s - a)


def _split(a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    c = SPLITTER * a
    high = c - (c - a)
    return high, a - high


class DoubleDouble:
    """Complex double-double numbers of any shape.

    Parameters
    ----------
    hi, lo : complex or array of complex
        The value is their exact sum; they need not be normalised.

    Attributes
    ----------
    hi, lo : ndarray of complex
        Leading and trailing part.

    Examples
    --------
    >>> third = 1 / DoubleDouble(3)
    >>> residual = third * DoubleDouble(3) - DoubleDouble(1)
    >>> bool(abs(residual.hi) < 1e-31)
    True
    """

    __slots__ = ("hi", "lo")
    __array_ufunc__ = None  # numpy leaves mixed operations to the methods below

    def __init__(self, hi: Any, lo: Any = 0.0) -> None:
        a, b = np.asarray(hi, dtype=np.complex128), np.asarray(lo, dtype=np.complex128)
        self.hi, self.lo = two_sum(a, b)

    @classmethod
    def _raw(cls, hi: Any, lo: Any) -> DoubleDouble:
        result = cls.__new__(cls)
        result.hi, result.lo = hi, lo
        return result

    @classmethod
    def of(cls, values: Exact | Iterable[Exact]) -> DoubleDouble:
        """Exact numbers rounded to double-double: one pair of fractions, or many (shape (n,))."""
        if isinstance(values, tuple) and len(values) == 2 and isinstance(values[0], Fraction):
            (re, re_lo), (im, im_lo) = (_halves(part) for part in values)
            return cls._raw(np.complex128(complex(re, im)), np.complex128(complex(re_lo, im_lo)))
        numbers = [cls.of(value) for value in values]
        return cls._raw(np.array([v.hi for v in numbers], complex), np.array([v.lo for v in numbers], complex))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array of numbers."""
        return np.broadcast_shapes(np.shape(self.hi), np.shape(self.lo))

    def __repr__(self) -> str:
        return f"DoubleDouble({self.hi} + {self.lo})" if not self.shape else f"DoubleDouble(shape {self.shape})"

    def __getitem__(self, index: Any) -> DoubleDouble:
        return DoubleDouble._raw(np.asarray(self.hi)[index], np.asarray(self.lo)[index])

    def __complex__(self) -> complex:
        return complex(self.hi)

    def exact(self) -> Exact:
        """The exact value of a single number, as fractions."""
        hi, lo = complex(self.hi), complex(self.lo)
        return Fraction(hi.real) + Fraction(lo.real), Fraction(hi.imag) + Fraction(lo.imag)

    # -- arithmetic -----------------------------------------------------------------------------------------------
    def __neg__(self) -> DoubleDouble:
        return DoubleDouble._raw(-self.hi, -self.lo)

    def __add__(self, other: Any) -> DoubleDouble:
        other = _coerce(other)
        # AccurateDWPlusDW of Joldes et al.: error below 3 u^2 even where the sum cancels.
        s, e = two_sum(self.hi, other.hi)
        t, f = two_sum(self.lo, other.lo)
        s, e = fast_two_sum(s, e + t)
        return DoubleDouble._raw(*fast_two_sum(s, e + f))

    def __sub__(self, other: Any) -> DoubleDouble:
        return self + (-_coerce(other))

    def __mul__(self, other: Any) -> DoubleDouble:
        other = _coerce(other)
        axes = max(np.ndim(self.hi), np.ndim(other.hi))
        a, c = _parts(self.hi, axes), _parts(self.lo, axes)
        b, d = _parts(other.hi, axes), _parts(other.lo, axes)
        a_high, a_low = _split(a)
        b_high, b_low = _split(b)
        a, a_high, a_low, c = (v[:, None] for v in (a, a_high, a_low, c))
        # All four products of a part of one factor and a part of the other, with their errors.
        p = a * b
        e = ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low
        e = e + (a * d + c * b)
        re, re_lo = two_sum(p[0, 0], -p[1, 1])
        im, im_lo = two_sum(p[0, 1], p[1, 0])
        re, re_lo = fast_two_sum(re, re_lo + (e[0, 0] - e[1, 1]))
        im, im_lo = fast_two_sum(im, im_lo + (e[0, 1] + e[1, 0]))
        return DoubleDouble._raw(_joined(re, im), _joined(re_lo, im_lo))

    def reciprocal(self) -> DoubleDouble:
        """1 / number: one Newton step from double precision, whose residual is found in double-double."""
        with np.errstate(all="ignore"):
            start = 1 / np.asarray(self.hi)
            residual = _ONE - self * DoubleDouble._raw(start, np.zeros_like(start))
            return DoubleDouble._raw(*fast_two_sum(start, start * (residual.hi + residual.lo)))

    def __truediv__(self, other: Any) -> DoubleDouble:
        return self * _coerce(other).reciprocal()

    def __rtruediv__(self, other: Any) -> DoubleDouble:
        return self.reciprocal() if isinstance(other, int) and other == 1 else _coerce(other) / self

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other: Any) -> DoubleDouble:
        return _coerce(other) - self


def _coerce(value: Any) -> DoubleDouble:
    return value if isinstance(value, DoubleDouble) else DoubleDouble(value)


def _halves(value: Fraction) -> tuple[float, float]:
    hi = double(value)
    return hi, float(value - Fraction(hi))


def _parts(z: Any, axes: int) -> np.ndarray:
    """Real and imaginary part along a new first axis, before as many lane axes as the other factor has."""
    z = np.asarray(z)
    result = np.empty((2, *(1,) * (axes - z.ndim), *z.shape))
    result[0], result[1] = z.real, z.imag
    return result


def _joined(re: Any, im: Any) -> Any:
    z = np.empty(np.shape(re), np.complex128)
    z.real, z.imag = re, im
    return z[()]


_ONE = DoubleDouble(1.0)


def columns(x: DoubleDouble | Any) -> list[DoubleDouble]:
    """The columns of an array (n, k) of numbers, each over n lanes."""
    x = _coerce(x)
    return [DoubleDouble._raw(np.ascontiguousarray(h), np.ascontiguousarray(t)) for h, t in zip(x.hi.T, x.lo.T)]


def stacked(values: Sequence[DoubleDouble], lanes: int) -> DoubleDouble:
    """Numbers over lanes (or single ones) side by side, shape (lanes, count)."""
    hi = np.empty((lanes, len(values)), np.complex128)
    lo = np.empty_like(hi)
    for k, value in enumerate(values):
        value = _coerce(value)
        hi[:, k], lo[:, k] = value.hi, value.lo
    return DoubleDouble._raw(hi, lo)


def replay(
    program: Program,
    unknowns: Any,
    parameters: Any = (),
    velocities: Any = None,
) -> dict[str, DoubleDouble]:
    """Run a program over many lanes in double-double.

    With the program of :mod:`solvers.kernel.elimination` this is one tick of the tracker: outputs "dx" and "dr".

    Parameters
    ----------
    unknowns : DoubleDouble or array of complex, shape (n, unknowns)
    parameters, velocities : the same, shape (parameters,) for all lanes or (n, parameters)
        A sequence of exact values will do for parameters.

    Returns
    -------
    dict of str to DoubleDouble, shape (n, length of the output)

    Examples
    --------
    >>> from solvers.graph import Builder
    >>> b = Builder(1, 0)
    >>> program = b.finish({"F": [b.sub(b.square(b.unknown(0)), b.constant(2))]})
    >>> root2 = DoubleDouble(np.sqrt([[2.0]]), [[-9.667293313452913e-17]])
    >>> bool(abs(replay(program, root2)["F"].hi[0, 0]) < 1e-31)
    True
    """
    x = _coerce(unknowns)
    p = _read(parameters)
    v = _read(np.zeros(p.shape) if velocities is None else velocities)
    constants = program.constant_halves
    loops = compiled_loops("double_sweep")
    if loops is None:
        fixed = [DoubleDouble._raw(complex(*row[:2]), complex(*row[2:])) for row in constants.tolist()]
        out = program.replay(columns(x), _inputs(p), _inputs(v), fixed)
        return {name: stacked(values, len(x.hi)) for name, values in out.items()}
    own = [_four(value)[None] if value.hi.ndim == 1 else _four(value) for value in (p, v)]
    rows = max(map(len, own))
    shape = (rows, len(constants), 4)
    still = np.concatenate(
        [*(np.broadcast_to(part, (rows, *part.shape[1:])) for part in own), np.broadcast_to(constants, shape)], axis=1
    )
    wanted = np.concatenate([*program.outputs.values()])
    result = np.empty((len(x.hi), len(wanted), 4))
    loops.values(program.code, still, _four(x), wanted, result)
    z = result[:, :, :2] + 0.0, result[:, :, 2:] + 0.0
    hi, lo = (part.view(np.complex128)[:, :, 0] for part in z)
    ends = np.cumsum([len(slots) for slots in program.outputs.values()])[:-1]
    parts = zip(np.split(hi, ends, axis=1), np.split(lo, ends, axis=1))
    return {name: DoubleDouble._raw(*part) for name, part in zip(program.outputs, parts)}


def _read(values: Any) -> DoubleDouble:
    if not isinstance(values, DoubleDouble) and len(values) and isinstance(values[0], tuple):
        return DoubleDouble.of(values)
    return _coerce(values)


def _inputs(values: DoubleDouble) -> list[DoubleDouble]:
    return columns(values) if values.hi.ndim == 2 else [values[k] for k in range(len(values.hi))]


def _four(values: DoubleDouble) -> np.ndarray:
    """Leading and trailing parts as four doubles along a last axis."""
    return np.stack([values.hi.real, values.hi.imag, values.lo.real, values.lo.imag], axis=-1)
