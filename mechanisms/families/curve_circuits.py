"""Circuits of a plane curve, each traced once round by one parameter from 0 to 2π.

A circular cubic has one or two, each over an interval of its discriminant (`mechanisms.families.circle_points`).  A
conic with real points is one: in the axes of its quadratic form it is the circle (cos φ, sin φ, 1).  A pair of lines
is two.  All of them are closed in the projective plane, infinity being a place like any other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import ArrayLike, NDArray

__all__ = ["FINE", "Circuit", "ConicCircuit", "CubicCircuit", "LineCircuit", "conic_circuits"]

#: Points looked at when a circuit is divided into equal steps, or searched for the point nearest to a place.
FINE = 4096
#: Eigenvalues of a quadratic form below this part of the largest are zero.
RANK = 1e-11


@dataclass(frozen=True, eq=False)
class Circuit:
    """One closed branch of the circle-point curve, with its centre points.

    Attributes
    ----------
    centers : callable
        From homogeneous circle points to their centre points, (n, 3) to (n, 3).
    unbounded : bool
        Whether it runs through infinity.
    """

    centers: Callable[[NDArray[Any]], NDArray[Any]]
    unbounded: bool

    def moving_points(self, phi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Homogeneous circle points of parameters, (n,) to (n, 3)."""
        raise NotImplementedError

    def phi_of(self, place: complex) -> float:
        """The parameter of a finite circle point, in units of the task's size."""
        raise NotImplementedError

    def points(self, phi: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
        """Circle points and centre points, homogeneous and in units of the task's size from pose 0's point.

        Parameters
        ----------
        phi : (n,) array_like, radians
            The parameter; 2π is once round.

        Returns
        -------
        moving, fixed : (n, 3) float arrays
            (x, y, w), where w = 0 is infinity.
        """
        moving = self.moving_points(np.atleast_1d(np.asarray(phi, dtype=float)))
        moving = moving / np.linalg.norm(moving, axis=1, keepdims=True)
        return moving, self.centers(moving)

    def stations(self, count: int) -> NDArray[np.float64]:
        """Parameters of `count` points at equal steps, measured on both curves as seen from the task.

        Distances are those on a sphere on which the task is as large as a hemisphere, so that the way to
        infinity is finite.
        """
        phi = np.linspace(0.0, 2 * np.pi, FINE + 1)
        steps = np.zeros(FINE)
        for places in self.points(phi):
            steps += _angles_between(places[:-1], places[1:])
        length = np.concatenate([[0.0], np.cumsum(steps)])
        return np.interp(np.arange(count) * length[-1] / count, length, phi)


@dataclass(frozen=True, eq=False)
class CubicCircuit(Circuit):
    """A circuit of a circular cubic.

    Attributes
    ----------
    low, high : float
        The interval of x, across the asymptote.
    axes : (3, 3) array
        Columns: across the asymptote, along it, the origin.
    quadratic : list of three arrays
        A, B, C as polynomials in x.
    discriminant : array
        B² − 4AC.
    """

    low: float
    high: float
    axes: NDArray[np.float64]
    quadratic: list[NDArray[np.float64]]
    discriminant: NDArray[np.float64]

    def moving_points(self, phi: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Circuit`."""
        middle, radius = (self.low + self.high) / 2, (self.high - self.low) / 2
        x = middle + radius * np.cos(phi)
        a, b, c = (poly.polyval(x, row) for row in self.quadratic)
        root = radius * np.sin(phi) * np.sqrt(np.maximum(poly.polyval(x, self._rest), 0.0))
        # y = (−b + root)/2a = 2c/(−b − root), each without cancellation on its side
        plain = b * root <= 0
        y, w = np.where(plain, -b + root, 2 * c), np.where(plain, 2 * a, -b - root)
        return np.stack([x * w, y, w], axis=-1) @ self.axes.T

    def phi_of(self, place: complex) -> float:
        """See `Circuit`."""
        x, y, _ = self.axes.T @ np.array([place.real, place.imag, 1.0])
        a, b, _ = (poly.polyval(x, row) for row in self.quadratic)
        middle, radius = (self.low + self.high) / 2, (self.high - self.low) / 2
        phi = float(np.arccos(np.clip((x - middle) / radius, -1.0, 1.0)))
        return phi if 2 * a * y + b >= 0 else 2 * np.pi - phi

    @property
    def _rest(self) -> NDArray[np.float64]:
        """D/((x − low)(high − x)) as a polynomial, positive between."""
        factor = poly.polymul([-self.low, 1.0], [-self.high, 1.0])
        return -poly.polydiv(self.discriminant, factor)[0]


@dataclass(frozen=True, eq=False)
class ConicCircuit(Circuit):
    """A conic: the image of the circle (cos φ, sin φ, 1) under a matrix."""

    frame: NDArray[np.float64]

    def moving_points(self, phi: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Circuit`."""
        return np.stack([np.cos(phi), np.sin(phi), np.ones_like(phi)], axis=-1) @ self.frame.T

    def phi_of(self, place: complex) -> float:
        """See `Circuit`."""
        c, s, k = np.linalg.solve(self.frame, [place.real, place.imag, 1.0])
        return float(np.arctan2(s / k, c / k) % (2 * np.pi))


@dataclass(frozen=True, eq=False)
class LineCircuit(Circuit):
    """A straight line: p cos φ/2 + q sin φ/2."""

    p: NDArray[np.float64]
    q: NDArray[np.float64]

    def moving_points(self, phi: NDArray[np.float64]) -> NDArray[np.float64]:
        """See `Circuit`."""
        return np.cos(phi / 2)[:, None] * self.p + np.sin(phi / 2)[:, None] * self.q

    def phi_of(self, place: complex) -> float:
        """See `Circuit`."""
        (c, s), *_ = np.linalg.lstsq(np.stack([self.p, self.q], axis=1), [place.real, place.imag, 1.0], rcond=None)
        return float(2 * np.arctan2(s, c) % (2 * np.pi))


def conic_circuits(centers: Callable[[NDArray[Any]], NDArray[Any]], form: NDArray[np.float64]) -> list[Circuit]:
    """The real circuits of a conic xᵀ·form·x = 0: one, two lines, one line, or none.

    Examples
    --------
    >>> conic_circuits(lambda z: z, np.diag([1.0, 1.0, 1.0]))
    []
    >>> circle, = conic_circuits(lambda z: z, np.diag([1.0, 1.0, -4.0]))
    >>> x, y, w = circle.points([1.0])[0][0]
    >>> circle.unbounded, float((np.hypot(x, y) / abs(w)).round(9))
    (False, 2.0)
    >>> len(conic_circuits(lambda z: z, np.diag([1.0, -1.0, 0.0])))
    2
    """
    values, vectors = np.linalg.eigh(form)
    values = np.where(np.abs(values) <= RANK * np.abs(values).max(), 0.0, values)
    if (values < 0).sum() > (values > 0).sum():
        values = -values
    plus, minus = np.flatnonzero(values > 0), np.flatnonzero(values < 0)
    scaled = vectors / np.sqrt(np.where(values == 0, 1.0, np.abs(values)))
    if len(plus) == 2 and len(minus) == 1:
        frame = scaled[:, [*plus, *minus]]
        return [ConicCircuit(centers, bool(np.hypot(*frame[2, :2]) >= abs(frame[2, 2])), frame)]
    if len(plus) == 1:
        first = vectors[:, plus[0]] * np.sqrt(values[plus[0]])
        second = [vectors[:, k] * np.sqrt(-values[k]) for k in minus]
        normals = [first] if not second else [first + second[0], first - second[0]]
        return [_line(centers, n) for n in normals if np.abs(n[:2]).max() > RANK * abs(n[2])]
    return []


def _line(centers: Callable[[NDArray[Any]], NDArray[Any]], normal: NDArray[np.float64]) -> LineCircuit:
    """A line with its point at infinity at φ = π, where no circuit begins."""
    at_infinity = np.array([-normal[1], normal[0], 0.0])
    at_infinity /= np.linalg.norm(at_infinity)
    nearest = np.cross(at_infinity, normal)
    return LineCircuit(centers, True, nearest / np.linalg.norm(nearest), at_infinity)


def _angles_between(first: NDArray[np.float64], second: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles between lines through the origin: distances of homogeneous points."""
    cross = np.linalg.norm(np.cross(first, second), axis=1)
    sizes = np.linalg.norm(first, axis=1) * np.linalg.norm(second, axis=1)
    return np.arcsin(np.clip(cross / sizes, 0.0, 1.0))
