"""Four poses: the circle points and centre points, traced as real curves.

For three displacements z ↦ p_j + e_j z from pose 0, a point z of the body keeps its distance from a point G of the
frame when

    Re(Ḡ d_j) = h_j,     d_j = p_j + (e_j − 1) z,     h_j = Re(p̄_j e_j z) + |p_j|²/2,     j = 1, 2, 3.

Three linear equations for the two coordinates of G: they have a solution where the determinant of (d_j, −h_j)
vanishes, a **circular cubic** in z, the circle-point curve.  G follows as the null vector, and runs through the
centre-point curve, which is the same thing for the inverse motion.  A null vector at infinity is **Ball's point**:
that point of the body passes through four places of a straight line, a slider.  The curve's own real point at
infinity is the inverted slider.

Every line parallel to the cubic's real asymptote meets it in two more points, the roots of a quadratic
A(x)·y² + B(x)·y + C(x) in coordinates with y along the asymptote.  Real points lie where the quartic
D = B² − 4AC ≥ 0, which opens downwards: over one interval, or over two.  Each interval is one circuit of the
curve, and

    x = m + r·cos φ,        y = (−B + r·sin φ·√(D/((x−x₁)(x₂−x))))/(2A)

runs through it once, smoothly, the turning points included.  So the circuits are known before anything is drawn,
and tracing cannot jump from one to the other.  Where the leading form vanishes, as it does when the poses are parallel
in pairs, the line at infinity is a part of the curve, and what is left is a conic.

Source: L. Burmester, Lehrbuch der Kinematik, 1888; J. M. McCarthy and G. S. Soh, Geometric Design of Linkages,
2nd edition, Springer 2011, chapter 5; the parametrization is the classical one by lines through a point of the
cubic.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from numpy.polynomial import polynomial as poly
from numpy.typing import ArrayLike, NDArray

from mechanisms.families.curve_circuits import FINE, Circuit, CubicCircuit, conic_circuits
from mechanisms.families.motion_dyads import MotionDyad, Poses

__all__ = ["CircleCurve", "Circuit"]

#: Coefficients below this part of the largest are rounding.
ROUNDING = 1e-12
#: A homogeneous point whose last coordinate is below this part of the others is at infinity.
INFINITE = 1e-9
#: A slider that misses its poses by more than this, in sizes of the task, is none.
SLIDES = 1e-9
#: The leading form of a cubic that is below this part of its other coefficients vanishes: what is left is a conic.
CONIC = 1e-11


class CircleCurve:
    """The circle points of four poses, and their centre points.

    Parameters
    ----------
    poses : Poses
        Four of them.

    Attributes
    ----------
    cubic : (10,) float array
        Coefficients of x³, x²y, xy², y³, x²w, xyw, y²w, xw², yw², w³ in units of the task's size.
    circuits : tuple of Circuit
        None, one or two; the unbounded one first.

    Raises
    ------
    ValueError
        In a pure translation, and if every point of the body is a circle point.

    Examples
    --------
    >>> curve = CircleCurve(Poses.of([(0, 0, 0), (1, 0.5, 20), (2, 0.6, 60), (2.5, 0, 100)]))
    >>> len(curve.circuits), [dyad.kind for dyad in curve.sliders()]
    (1, ['PR', 'RP'])
    """

    def __init__(self, poses: Poses) -> None:
        if len(poses) != 4:
            raise ValueError(f"{len(poses)} poses; circle points of a curve belong to four")
        self.poses = poses
        if poses.parallel:
            raise ValueError("the body never turns, so that all of its points move alike: no curve is singled out")
        e, p = np.exp(1j * poses.angles[1:]), poses.moves[1:] / poses.size
        #: rows (d, −h) for a point of each axis: [axis, pose, column]
        self._rows = np.stack([_rows(e, p, z, w) for z, w in ((1, 0), (1j, 0), (0, 1))])
        self.cubic = _determinant(self._rows)
        largest = np.abs(self.cubic).max()
        scale = np.prod(np.linalg.norm(self._rows, axis=(0, 2)))
        if not largest > ROUNDING * scale:
            raise ValueError("four places of every point of the body lie on a circle: the poses are special")
        #: Whether the line at infinity is a part of the curve, and the rest a conic
        self.conic = bool(np.hypot(self.cubic[0], self.cubic[3]) <= CONIC * largest)
        self.axes, self.quadratic = _along_asymptote(self.cubic / largest)
        self.circuits: tuple[Circuit, ...]
        if self.conic:
            xx, xy, yy, x, y, one = self.cubic[4:] / largest
            form = np.array([[xx, xy / 2, x / 2], [xy / 2, yy, y / 2], [x / 2, y / 2, one]])
            self.circuits = tuple(conic_circuits(self.centers, form))
        else:
            self.circuits = tuple(self._circuits())

    def _circuits(self) -> list[Circuit]:
        a, b, c = self.quadratic
        discriminant = _trimmed(poly.polysub(poly.polymul(b, b), 4 * poly.polymul(a, c)))
        roots = poly.polyroots(discriminant)
        scale = np.maximum(1.0, np.abs(roots))
        real = np.sort(roots.real[np.abs(roots.imag) < 1e-9 * scale])
        pairs = [(float(low), float(high)) for low, high in itertools.pairwise(real) if high > low]
        inside = [(low, high) for low, high in pairs if poly.polyval((low + high) / 2, discriminant) > 0]
        pole = -a[0] / a[1] if a[1] else np.inf
        circuits: list[Circuit] = [
            CubicCircuit(self.centers, low <= pole <= high, low, high, self.axes, self.quadratic, discriminant)
            for low, high in inside
        ]
        return sorted(circuits, key=lambda circuit: not circuit.unbounded)

    def matrix(self, moving: ArrayLike) -> NDArray[np.float64]:
        """The rows (d_j, −h_j) at homogeneous points, (n, 3) to (n, 3, 3)."""
        return np.einsum("na,ajc->njc", np.asarray(moving, dtype=float), self._rows)

    def centers(self, moving: NDArray[np.float64]) -> NDArray[np.float64]:
        """Centre points of homogeneous circle points, (n, 3) to (n, 3): the null vectors."""
        rows = self.matrix(moving)
        crosses = np.stack([np.cross(rows[:, i], rows[:, j]) for i, j in ((0, 1), (1, 2), (2, 0))], axis=1)
        best = np.linalg.norm(crosses, axis=2).argmax(axis=1)
        chosen = crosses[np.arange(len(rows)), best]
        return chosen / np.maximum(np.linalg.norm(chosen, axis=1, keepdims=True), 1e-300)

    def dyads(self, circuit: Circuit, phi: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
        """Fixed and moving pivots, in pose 0 and in the task's units; infinite where a slider is."""
        moving, fixed = circuit.points(phi)
        return self.place(fixed), self.place(moving)

    def place(self, homogeneous: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Homogeneous points in the task's units, (n, 3) to (n,); infinite ones as infinite numbers."""
        x, y, w = np.atleast_2d(homogeneous).T
        far = np.abs(w) < INFINITE * np.hypot(x, y)
        safe = np.where(far, 1.0, w)
        places = self.poses.points[0] + self.poses.size * (x + 1j * y) / safe
        return np.where(far, complex(np.inf, 0.0), places)

    def at_station(self, station: float) -> tuple[complex, complex]:
        """Fixed and moving pivot at a station: 100·(number of the circuit) + percentage of the way round it.

        Raises
        ------
        ValueError
            When there is no such circuit.
        """
        number, place = divmod(float(station), 100.0)
        if not 0 <= number < len(self.circuits):
            highest = 100 * len(self.circuits)
            raise ValueError(f"there is no dyad {station:g} on the curve; give a number from 0 to below {highest}")
        circuit = self.circuits[int(number)]
        fine = np.append(circuit.stations(1000), 2 * np.pi)
        fixed, moving = self.dyads(circuit, np.interp(place, np.arange(1001) / 10, fine))
        return complex(fixed[0]), complex(moving[0])

    def station_of(self, circuit: Circuit, phi: float) -> float:
        """The station of a parameter of one of the circuits."""
        fine = np.append(circuit.stations(1000), 2 * np.pi)
        return 100.0 * self.circuits.index(circuit) + float(np.interp(phi, fine, np.arange(1001) / 10))

    def sliders(self) -> list[MotionDyad]:
        """Ball's point as a PR dyad, and the inverted slider as an RP dyad; a conic has others, or none."""
        found = []
        inverse = CircleCurve(inverse_poses(self.poses))
        for curve, kind in ((inverse, "PR"), (self, "RP")):
            other = self if kind == "PR" else inverse
            for normal in curve.infinite_directions():
                # Re(n̄ d_j) = 0 at the other pivot: as many linear equations as displacements
                rows = np.einsum("ajc,c->ja", other._rows[:, :, :2], [normal.real, normal.imag])
                place, *_ = np.linalg.lstsq(rows[:, :2], -rows[:, 2], rcond=None)
                pivot, line = complex(self.poses.points[0] + other.poses.size * complex(*place)), 1j * normal
                dyad = MotionDyad("PR", line, pivot) if kind == "PR" else MotionDyad("RP", pivot, line)
                if dyad.errors(self.poses).max() < SLIDES * self.poses.size:
                    found.append(dyad)
        return found

    def infinite_directions(self) -> list[complex]:
        """Directions of the real asymptotes: one for a cubic, none or two for a conic."""
        if self.conic:
            xx, xy, yy = self.cubic[4:7]
            root = np.sqrt(complex(xy * xy - 4 * xx * yy))
            if root.imag or not root.real:
                return []
            # xx·x² + xy·xy + yy·y² = 0 by the larger of its two forms
            half = -(xy + np.copysign(root.real, xy)) / 2
            return [complex(x, y) / np.hypot(x, y) for x, y in ((half, xx), (yy, half))]
        return [complex(self.axes[0, 1], self.axes[1, 1])]

    def nearest(self, place: complex, which: str = "moving") -> tuple[Circuit, float, float]:
        """The circle point or centre point nearest to a place: its circuit, its parameter, the distance.

        Parameters
        ----------
        place : complex
            In the task's units.
        which : {"moving", "fixed"}
            Whether it is to be a circle point or a centre point.
        """
        from scipy.optimize import minimize_scalar

        best: tuple[Circuit, float, float] | None = None
        for circuit in self.circuits:

            def distance(phi: Any, circuit: Circuit = circuit) -> Any:
                fixed, moving = self.dyads(circuit, phi)
                return np.abs((moving if which == "moving" else fixed) - place)

            phi = np.linspace(0.0, 2 * np.pi, FINE, endpoint=False)
            k = int(np.argmin(distance(phi)))
            step = 2 * np.pi / FINE
            fine = minimize_scalar(
                lambda t, d=distance: float(d(t)[0]) ** 2,
                bounds=(phi[k] - step, phi[k] + step),
                method="bounded",
                options={"xatol": 1e-12},
            )
            found = (circuit, float(fine.x) % (2 * np.pi), float(np.sqrt(fine.fun)))
            if best is None or found[2] < best[2]:
                best = found
        if best is None:
            raise ValueError("the four poses have no real circle points")
        return best


def inverse_poses(poses: Poses) -> Poses:
    """The motion of the frame as the body sees it, from pose 0: circle points and centre points change places.

    Examples
    --------
    >>> inverse_poses(Poses.of([(0, 0, 0), (1, 0, 90)])).points[1].round(12).item()
    (-0+1j)
    """
    moves = -poses.moves * np.exp(-1j * poses.angles)
    return Poses(poses.points[0] + moves, -poses.angles)


def _rows(e: NDArray[Any], p: NDArray[Any], z: complex, w: float) -> NDArray[np.float64]:
    """(d, −h), each linear in z and w, for the three displacements."""
    d = p * w + (e - 1) * z
    h = (np.conj(p) * e * z).real + np.abs(p) ** 2 / 2 * w
    return np.stack([d.real, d.imag, -h], axis=-1)


#: Exponents of x and y in the ten terms of a cubic.
_TERMS = [(3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)]


def _determinant(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients of det(x·rows[0] + y·rows[1] + w·rows[2]): a determinant is linear in each of its rows."""
    cubic = dict.fromkeys(_TERMS, 0.0)
    for choice in itertools.product(range(3), repeat=3):
        term = (choice.count(0), choice.count(1))
        cubic[term] += float(np.linalg.det(np.stack([rows[axis, j] for j, axis in enumerate(choice)])))
    return np.array([cubic[term] for term in _TERMS])


def _along_asymptote(cubic: NDArray[np.float64]) -> tuple[NDArray[np.float64], list[NDArray[np.float64]]]:
    """Axes (columns: across, along, w) and the coefficients A, B, C in powers of x, lowest first.

    The cubic's leading form is (x² + y²)(ax + by), so that the asymptote points along (−b, a).
    """
    a, b = cubic[0], cubic[3]
    size = np.hypot(a, b)
    cosine, sine = (a / size, b / size) if size > ROUNDING else (1.0, 0.0)
    axes = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    turned = dict.fromkeys(_TERMS, 0.0)
    for (i, j), coefficient in zip(_TERMS, cubic):
        # (cx − sy)^i (sx + cy)^j
        for m, n in itertools.product(range(i + 1), range(j + 1)):
            value = _binomial(i, m) * cosine ** (i - m) * (-sine) ** m
            value *= _binomial(j, n) * sine ** (j - n) * cosine**n
            turned[(i - m + j - n, m + n)] += coefficient * value
    quadratic = [np.array([turned.get((k, power), 0.0) for k in range(4 - power)]) for power in (2, 1, 0)]
    return axes, quadratic


def _binomial(n: int, k: int) -> int:
    from math import comb

    return comb(n, k)


def _trimmed(coefficients: NDArray[Any]) -> NDArray[Any]:
    """Without leading coefficients that are rounding."""
    keep = np.flatnonzero(np.abs(coefficients) > ROUNDING * np.abs(coefficients).max())
    return coefficients[: keep[-1] + 1] if len(keep) else coefficients[:1]
