"""Trammels with P in given places: every configuration, and designs that are judged by their orientations there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_task import Placed

__all__ = ["EXACT_ANGLE", "Near", "configurations", "same_trammel"]

#: A design whose orientation error is below this, radians, meets all its poses: rounding leaves 1e-9 and less.
EXACT_ANGLE = 1e-7
#: Designs of which the pins differ by less than this part of the task's size are one, found by several choices.
SAME = 1e-6


@dataclass(frozen=True, eq=False)
class Near:
    """A trammel that carries P to all eight positions.

    Attributes
    ----------
    root : int
        Of all roots of the eight problems, numbered through; −1 for a least-squares design.
    omitted : int or None
        The pose whose orientation is not met; None for a least-squares design.
    trammel : Trammel
        In the configuration of pose 0, measured from P there.
    disk, coupler : (8,) array
        Rotations from pose 0, radians.
    errors : (8,) array
        Orientation in each pose less the one wanted, radians.
    """

    root: int
    omitted: int | None
    trammel: Trammel
    disk: NDArray[np.float64]
    coupler: NDArray[np.float64]
    errors: NDArray[np.float64]

    def parameters(self) -> dict[str, float]:
        """By the paper's names."""
        return Placed(self.root, self.trammel, self.disk).parameters()

    @property
    def worst(self) -> float:
        """Largest orientation error, radians."""
        return float(np.abs(self.errors).max())

    @property
    def exact(self) -> bool:
        """Whether all eight poses are met."""
        return self.worst < EXACT_ANGLE


def configurations(trammel: Trammel, place: complex) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Every configuration of a trammel with P in a given place: Eq. (22) of the paper, for P instead of A.

    Let w = place − Q.  The slots say Im(e^{iχ} B) = a − w·v and Re(e^{iχ} C) = −b − w·u with χ = φ − θ.  Eliminating
    χ leaves a trigonometric equation of degree two in θ: a quartic in e^{iθ}, whose roots on the unit circle count.

    Parameters
    ----------
    trammel : Trammel
    place : complex
        Measured from P in pose 0, as the trammel is.

    Returns
    -------
    disk, coupler : (n,) arrays
        Rotations from pose 0, radians; n is 0, 2 or 4 in general.
    """
    b, c, w = trammel.B, trammel.C, place - trammel.Q
    first = np.array([-0.5j * w.conjugate(), trammel.a, 0.5j * w])  # a − w·v, coefficients of z, 1, 1/z
    second = np.array([-0.5 * w.conjugate(), -trammel.b, -0.5 * w])  # −b − w·u
    cross, scale = b.real * c.imag - b.imag * c.real, b.real * c.real + b.imag * c.imag
    quartic = abs(c) ** 2 * np.convolve(first, first) + abs(b) ** 2 * np.convolve(second, second)
    quartic = quartic + 2 * cross * np.convolve(first, second)
    quartic[2] -= scale**2
    roots = np.roots(quartic)
    theta = np.angle(roots[np.abs(np.abs(roots) - 1) < 1e-5])
    z = np.exp(1j * theta)
    alpha = (first[0] * z + first[1] + first[2] / z).real
    beta = (second[0] * z + second[1] + second[2] / z).real
    matrix = np.array([[b.imag, b.real], [c.real, -c.imag]])
    if abs(np.linalg.det(matrix)) < 1e-14 * abs(b) * abs(c):
        return np.zeros(0), np.zeros(0)
    chi = np.linalg.solve(matrix, np.stack([alpha, beta]))
    phi = theta + np.angle(chi[0] + 1j * chi[1])
    theta, phi, good = _settled(trammel, w, theta, phi)
    return theta[good] - trammel.theta0, phi[good]


def _settled(
    trammel: Trammel, w: complex, theta: NDArray[np.float64], phi: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Newton's method on the two slots; θ is absolute, φ from pose 0."""
    size = abs(trammel.B) + abs(trammel.C) + abs(w)
    change = np.full(len(theta), np.inf)
    for _ in range(6):
        v, e = 1j * np.exp(1j * theta), np.exp(1j * phi)
        b, c = w + e * trammel.B, w + e * trammel.C  # from Q
        f1 = (np.conj(v) * b).real - trammel.a
        f2 = (np.conj(v) * c).imag - trammel.b  # −C·u = b, and conj(v) C has the imaginary part −C·u
        f1_theta, f1_phi = (np.conj(v) * b).imag, (np.conj(v) * 1j * e * trammel.B).real
        f2_theta, f2_phi = -(np.conj(v) * c).real, (np.conj(v) * 1j * e * trammel.C).imag
        determinant = f1_theta * f2_phi - f1_phi * f2_theta
        with np.errstate(divide="ignore", invalid="ignore"):
            d_theta = (f1 * f2_phi - f1_phi * f2) / determinant
            d_phi = (f1_theta * f2 - f1 * f2_theta) / determinant
        change = np.abs(d_theta) + np.abs(d_phi)
        step = change < 1.0
        theta, phi = np.where(step, theta - d_theta, theta), np.where(step, phi - d_phi, phi)
    residual = np.abs(f1) + np.abs(f2)
    return theta, phi, (change < 1e-7) & (residual < 1e-9 * size)


def same_trammel(one: Near, other: Near, size: float) -> bool:
    """Whether two designs are one, up to the gauge; `size` is the task's."""
    pairs = zip(one.trammel.essential(), other.trammel.essential())
    return all(abs(a - b) < SAME * max(size, abs(a)) for a, b in pairs)
