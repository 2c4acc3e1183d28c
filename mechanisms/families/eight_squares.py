"""Least-squares trammels for eight poses, from those that meet seven of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_positions import Near, same_trammel
from mechanisms.families.trammel_task import TrammelTask
from mechanisms.task import Task

__all__ = ["best_polished", "polished"]

#: Least-squares designs are polished from this many of the best.
POLISHED_FROM = 24


def polished(task: Task, near: Near) -> Near | None:
    """The least-squares trammel over all eight orientations, from one that meets seven; None where it leads nowhere.

    Unknown are m, Q, R and |d|: seven numbers, as no pose is preferred.  P is in every position exactly.
    """
    from scipy.optimize import least_squares

    part = TrammelTask(task)
    points, wanted = part.points, part.turns
    m, d, R = near.trammel.essential()
    direction = d / abs(d)
    # orientation 0 is that wanted in pose 0, so that no pose is preferred
    offset = near.errors[0]
    state = {"theta": near.disk.copy(), "phi": near.coupler + offset}
    turn = np.exp(-1j * offset)
    start = np.array([(m * turn).real, (m * turn).imag, near.trammel.Q.real, near.trammel.Q.imag])
    start = np.concatenate([start, [(R / turn).real, (R / turn).imag, abs(d)]])

    def parts(x: NDArray[np.float64]) -> tuple[complex, complex, complex, complex]:
        return complex(x[0], x[1]), complex(x[2], x[3]), complex(x[4], x[5]), x[6] * direction

    def closed(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angles with P in its places, followed from the last ones."""
        m, q, r, d = parts(x)
        theta, phi = state["theta"].copy(), state["phi"].copy()
        for _ in range(12):
            gap, by_theta, by_phi = _closure(m, q, r, d, points, theta, phi)
            determinant = (np.conj(by_theta) * by_phi).imag
            with np.errstate(divide="ignore", invalid="ignore"):
                step_theta = (np.conj(gap) * by_phi).imag / determinant
                step_phi = (np.conj(by_theta) * gap).imag / determinant
            length = np.nan_to_num(np.abs(step_theta) + np.abs(step_phi), nan=1e9)
            damp = np.minimum(1.0, 0.3 / np.maximum(length, 1e-300))
            theta, phi = theta - damp * np.nan_to_num(step_theta), phi - damp * np.nan_to_num(step_phi)
            if length.max() < 1e-14:
                break
        return theta, phi

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        theta, phi = closed(x)
        gap = _closure(*parts(x), points, theta, phi)[0]
        if np.abs(gap).max() > 1e-9 * task.size:
            return np.full(len(points), 1e3)
        return phi - wanted_near

    wanted_near = state["phi"] - np.angle(np.exp(1j * (state["phi"] - wanted)))
    scale = np.maximum(np.abs(start), 1e-3 * task.size)
    found = least_squares(residuals, start, x_scale=scale, xtol=1e-12, ftol=1e-14, gtol=1e-15, max_nfev=60)
    theta, phi = closed(found.x)
    m, _, R, d = parts(found.x)
    errors = phi - wanted_near
    if not np.abs(errors).max() < 0.5 * math.pi or not np.sum(errors**2) <= np.sum(near.errors**2) * (1 + 1e-9):
        return None
    turned, t0 = np.exp(1j * phi[0]), np.exp(1j * theta[0])
    trammel = Trammel.from_essential(m * turned, d * t0, R * t0**2 / turned, near.trammel.theta0)
    return Near(-1, None, trammel, theta - theta[0], phi - phi[0], errors)


def _closure(
    m: complex,
    q: complex,
    r: complex,
    d: complex,
    points: NDArray[np.complex128],
    theta: NDArray[np.float64],
    phi: NDArray[np.float64],
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]:
    """The gap of p + m e^{iφ} = Q + d e^{iθ} + R e^{i(2θ−φ)}, and its derivatives by θ and φ."""
    e, t = np.exp(1j * phi), np.exp(1j * theta)
    carried, first, second = m * e, d * t, r * t**2 / e
    gap = points + carried - q - first - second
    return gap, -1j * first - 2j * second, 1j * carried + 1j * second


def best_polished(task: Task, near: Sequence[Near]) -> list[Near]:
    """Distinct least-squares designs from the best of the others, the best first."""
    found: list[Near] = []
    for each in sorted(near, key=lambda n: n.worst)[:POLISHED_FROM]:
        better = polished(task, each)
        if better is not None and not any(same_trammel(better, other, task.size) for other in found):
            found.append(better)
    return sorted(found, key=lambda n: float(np.sum(n.errors**2)))
