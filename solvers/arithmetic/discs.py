"""Complex discs in double precision whose radii are proved: the fast arithmetic of certificates.

A disc is all numbers within ``rad`` of ``mid``.  Every operation rounds to nearest, adds a bound on its own
rounding error to the radius and rounds the radius upwards by a factor, so that the result contains every
value that the operands allow.  A lane axis (any numpy shape) makes thousands of points one operation.

Error bounds, with u = 2^-53 the unit roundoff:

* Sums: each part is rounded correctly, so the error is at most u |result|.
* Products: at most sqrt(5) u |a| |b| (Brent, Percival, Zimmermann, "Error bounds on complex floating-point
  multiplication", Math. Comp. 2007), and at most 2 u |a| |b| where the processor fuses multiply and add
  (Jeannerod, Kornerup, Louvet, Muller, "Error bounds on complex floating-point multiplication with an FMA",
  Math. Comp. 2017).  Which of the two numpy uses depends on the machine; 3 u covers both.
* Inner products of n complex terms, in any order, fused or not: sqrt(2) gamma(2n) sum |a| |b|, because each
  part is a real inner product of length 2n (Higham, "Accuracy and Stability of Numerical Algorithms", §3.1).
  This supposes that the matrix product computes sums of products, as BLAS libraries do for these sizes (no
  Strassen, no three-multiplication complex product).
* Midpoint-radius rules: Rump, "Verification methods", Acta Numerica 2010, §§ 2 and 9.

Numbers so large or small that a square overflows or underflows make the radius infinite or are covered by
``TINY``, which also allows for processors that flush subnormal numbers to zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from solvers.replay import compiled_loops
from solvers.tape import Exact, Program

#: Unit roundoff of double precision.
U = 2.0**-53
#: Upward rounding of a non-negative expression of at most a dozen roundings: (1 + u)^14 < 1 + 16 u.
UP = 1.0 + 16 * U
#: Covers the absolute error of products that underflow, flushed to zero (2^-1022) or not, a few at a time.
TINY = 2.0**-1000
#: The same for the square root of a sum of two squares: sqrt(2 * 2^-1022) < 2^-510.
TINY_SIZE = 2.0**-500
#: Bound on the relative rounding error of a complex product, in units of u (see above).
PRODUCT_ERROR = 3 * U
#: 1/z by conj(z)/|z|^2 is used only where |z|^2 stays clear of overflow and underflow.
SQUARE_RANGE = (2.0**-900, 2.0**900)


def magnitude(z: Any) -> Any:
    """An upper bound of |z|, elementwise: two squares, a sum and a root make 2u relative error at most."""
    return np.sqrt(z.real * z.real + z.imag * z.imag) * UP + TINY_SIZE


def gamma(n: int) -> float:
    """An upper bound of n u / (1 - n u), the relative error of n roundings (Higham, Lemma 3.1)."""
    return n * U / (1 - n * U) * UP


def up(x: Any, roundings: int) -> Any:
    """A non-negative result of the given number of roundings, rounded upwards, with its underflow covered."""
    return x * (1 + 2 * gamma(roundings + 2)) + TINY * roundings


class Disc:
    """A disc, or an array of discs: ``mid`` complex, ``rad`` real, of one shape or broadcastable.

    Examples
    --------
    >>> third = Disc.of((Fraction(1, 3), Fraction(0)))
    >>> one = third + third + third
    >>> bool(abs(one.mid - 1) <= one.rad < 1e-15)
    True
    >>> float((1 / Disc(0.1, 0.2)).rad)
    inf
    """

    __slots__ = ("_size", "mid", "rad")
    __array_ufunc__ = None  # numpy arrays leave mixed operations to the methods below

    def __init__(self, mid: Any, rad: Any = 0.0) -> None:
        self.mid = np.asarray(mid, dtype=np.complex128)[()]
        self.rad = rad
        self._size: Any = None

    @classmethod
    def of(cls, value: Exact) -> Disc:
        """The smallest disc that is cheap to find round an exact number."""
        try:
            mid = complex(float(value[0]), float(value[1]))
        except OverflowError:
            return cls(0.0, np.inf)
        error = abs(value[0] - Fraction(mid.real)) + abs(value[1] - Fraction(mid.imag))
        return cls(mid, float(error) * UP + TINY if error else 0.0)

    @property
    def size(self) -> Any:
        """An upper bound of |mid|."""
        if self._size is None:
            self._size = magnitude(self.mid)
        return self._size

    def __repr__(self) -> str:
        return f"Disc({self.mid} ± {self.rad})" if np.ndim(self.mid) == 0 else f"Disc(shape {self.mid.shape})"

    def __neg__(self) -> Disc:
        result = Disc(-self.mid, self.rad)
        result._size = self._size
        return result

    def __add__(self, other: Disc) -> Disc:
        result = Disc(self.mid + other.mid)
        result.rad = (self.rad + other.rad + U * result.size) * UP
        return result

    def __sub__(self, other: Disc) -> Disc:
        result = Disc(self.mid - other.mid)
        result.rad = (self.rad + other.rad + U * result.size) * UP
        return result

    def __mul__(self, other: Disc) -> Disc:
        a, b = self.size, other.size
        # |xy - ab| <= |a| |y - b| + |x - a| |y|
        rad = a * (other.rad + PRODUCT_ERROR * b) + self.rad * (b + other.rad)
        return Disc(self.mid * other.mid, (rad + TINY) * UP)

    def reciprocal(self) -> Disc:
        """1 / disc; an infinite radius where the disc holds zero or the size is extreme.

        |1/x - 1/a| = |x - a| / (|x| |a|) with |x| >= |a| - rad.
        """
        re, im = self.mid.real, self.mid.imag
        square = re * re + im * im
        below = np.sqrt(square) * (1 - 4 * U)  # a lower bound of |a| inside SQUARE_RANGE
        room = (below - self.rad) * (1 - 4 * U)
        # re/square and im/square carry 3 roundings each; 4 u |1/a| bounds both together.
        rad = (self.rad / (below * room) + 4 * U / below) * UP + TINY
        good = (room > 0) & (square > SQUARE_RANGE[0]) & (square < SQUARE_RANGE[1])
        mid = np.where(good, re / square - 1j * (im / square), 0)
        return Disc(mid, np.where(good, rad, np.inf)[()])

    def __truediv__(self, other: Disc) -> Disc:
        return self * other.reciprocal()

    def __rtruediv__(self, one: int) -> Disc:
        if one != 1:
            return Disc(one) * self.reciprocal()
        return self.reciprocal()


def enclosures(values: Iterable[Exact]) -> list[Disc]:
    """Discs that hold exact numbers."""
    return [Disc.of(value) for value in values]


def replay(
    program: Program,
    points: np.ndarray,
    radii: np.ndarray | None,
    parameters: Sequence[Disc],
    output: str,
    constants: Sequence[Disc] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Enclosures of one output of a program over polydiscs.

    Parameters
    ----------
    program : Program
    points : ndarray, shape (n, unknowns)
        Midpoints.
    radii : ndarray, shape (n, unknowns), or None
        Radii; zero if None.
    parameters : sequence of Disc
    output : str
        "F" or "J": all outputs of the program are computed, this one is returned.
    constants : sequence of Disc, optional
        ``enclosures(program.constants)``, when a caller runs the program many times.

    Returns
    -------
    mid : ndarray of complex, shape (n, length of the output)
    rad : ndarray of float, the same shape
    """
    if constants is None:
        constants = enclosures(program.constants)
    wanted = program.outputs[output]
    mid, rad = np.empty((len(points), len(wanted)), np.complex128), np.empty((len(points), len(wanted)))
    sizes = np.zeros(points.shape) if radii is None else np.ascontiguousarray(radii)
    loops = compiled_loops()
    if loops is not None:
        zero = [Disc(0.0)] * len(parameters)
        still = [*parameters, *zero, *constants]
        mids = np.array([disc.mid for disc in still], np.complex128)
        rads = np.array([disc.rad for disc in still], np.float64)
        loops.discs(program.code, mids, rads, np.ascontiguousarray(points), sizes, wanted, mid, rad)
        return mid, rad
    unknowns = [Disc(mid, rad) for mid, rad in zip(points.T.copy(), sizes.T.copy())]
    with np.errstate(all="ignore"):
        values = program.replay(unknowns, parameters, constants=constants)[output]
    for k, value in enumerate(values):
        mid[:, k] = value.mid
        rad[:, k] = value.rad
    return mid, rad
