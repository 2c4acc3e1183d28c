"""Dimensions of a RoboMech manipulator from the paths of its end-effectors: chains, group by group and all
together.

The end-effectors are carried by two *passive* chains ABC and DEF, which constrain nothing.  The *active* chain
GHKI and the *negative* chains LM and NQ constrain them by (12), (13) and (31), (32),

    q1 = |R_K + Γ7 r_H − R_B − Γ2 r_G|² − l_HG²,      q2 = |R_K + Γ7 r_H − R_E − Γ4 r_I|² − l_HI²,
    q3 = |R_G + Γ5 r_M − R_A − Γ1 r_L|² − l_ML²,      q4 = |R_I + Γ6 r_N − R_D − Γ3 r_Q|² − l_NQ².

Equations: Structurally parametric synthesis and position analysis of a RoboMech class parallel manipulator with
two end-effectors, IAENG Int. J. Applied Mathematics 50(2), 2020.  There, q1 and q2 are made small group by
group: each is linear in K, r_H or r_G with one more constant, by linear programming or least squares.  That
descends, but the limit need not be a minimum: least squares creep along a narrow valley, linear programs jam.
`alternate` does it; `finish` then moves all dimensions together.  q3 and q4 are dyads between moving bodies:
all their critical points are known (`mechanisms.dyad_fit`), of which one is trivial, link 2 itself (L = B, M =
G), and link 4 (Q = E, N = I).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from mechanisms.approximate import Fit, least_squares_fit, linear_minimax, minimax_fit
from mechanisms.dyad_fit import Dyad, DyadFits, dyad_residuals, fit_dyads
from mechanisms.families.robomech_model import Half
from mechanisms.task import TaskError

if TYPE_CHECKING:
    from solvers import System

__all__ = [
    "ActiveChain", "PassiveChain", "active_residuals", "alternate", "exact_active", "finish", "negative_chain",
    "passive_chain",
]  # fmt: skip

Norm = Literal["least-squares", "minimax"]
#: A negative chain whose pins are this near to the pins of link 2, relative to its length, is link 2 itself.
TRIVIAL = 1e-4


@dataclass(frozen=True)
class PassiveChain:
    """A two-link chain that carries an end-effector along its path.

    Attributes
    ----------
    pivot : complex
    crank, rod : float
    elbow : float
        +1 or −1, the sign in (8).
    phi1, phi2 : (N,) arrays
        Angles of the two links.
    joint : (N,) complex array
        B.
    """

    pivot: complex
    crank: float
    rod: float
    elbow: float
    phi1: NDArray[np.float64]
    phi2: NDArray[np.float64]
    joint: NDArray[np.complex128]


def passive_chain(
    points: Sequence[complex], pivot: complex, crank: float, rod: float, elbow: float = 1.0
) -> PassiveChain:
    """The motion of a two-link chain whose end passes the points; (4)–(9) with two-argument arc tangents.

    Raises
    ------
    TaskError
        For lengths that are not positive, or a point out of reach.

    Examples
    --------
    >>> chain = passive_chain([2, 1 + 1j], 0, 1.5, 1.0)
    >>> bool(np.allclose(chain.joint + np.exp(1j * chain.phi2), [2, 1 + 1j]))
    True
    """
    wanted = np.array(points, dtype=complex)
    if not (crank > 0 and rod > 0):
        raise TaskError(f"links of the lengths {crank:g} and {rod:g}: lengths are positive")
    line = wanted - pivot
    reach = np.abs(line)
    cosine = (reach**2 + crank**2 - rod**2) / (2 * np.maximum(reach, 1e-300) * crank)
    if np.abs(cosine).max() > 1:
        bad = int(np.argmax(np.abs(cosine)))
        raise TaskError(
            f"point {bad} is {reach[bad]:g} away from the pivot; links of {crank:g} and {rod:g} do not reach it"
        )
    phi1 = np.angle(line) + elbow * np.arccos(cosine)
    joint = pivot + crank * np.exp(1j * phi1)
    return PassiveChain(pivot, crank, rod, elbow, phi1, np.angle(wanted - joint), joint)


@dataclass(frozen=True)
class ActiveChain:
    """K, r_H and, for one or two passive chains, the points r_G (r_I) and lengths l_HG (l_HI)."""

    pivot: complex
    h: complex
    points: tuple[complex, ...]
    lengths: tuple[float, ...]

    def as_vector(self) -> NDArray[np.float64]:
        """p1, p2, p6, p7, then (p4, p5, p3) and (p8, p9, p10): all groups of the synthesis parameters."""
        x = [self.pivot.real, self.pivot.imag, self.h.real, self.h.imag]
        for point, length in zip(self.points, self.lengths):
            constant = 0.5 * (abs(self.pivot) ** 2 + abs(self.h) ** 2 + abs(point) ** 2 - length**2)
            x += [point.real, point.imag, constant]
        return np.array(x)

    @classmethod
    def from_vector(cls, x: NDArray[np.float64]) -> ActiveChain:
        """Back from `as_vector`; a length whose square is negative becomes NaN."""
        pivot, h = complex(x[0], x[1]), complex(x[2], x[3])
        points, lengths = [], []
        for k in range(4, len(x), 3):
            point = complex(x[k], x[k + 1])
            square = abs(pivot) ** 2 + abs(h) ** 2 + abs(point) ** 2 - 2 * x[k + 2]
            points.append(point)
            lengths.append(float(np.sqrt(square)) if square >= 0 else float("nan"))
        return cls(pivot, h, tuple(points), tuple(lengths))


def active_residuals(x: NDArray[np.float64], chains: Sequence[PassiveChain], phi7: NDArray[np.float64]) -> NDArray:
    """q1/2 (and q2/2) at all positions: affine in each group of `ActiveChain.as_vector`."""
    u = complex(x[2], x[3]) * np.exp(1j * phi7)
    k = complex(x[0], x[1])
    parts = []
    for number, chain in enumerate(chains):
        p = x[4 + 3 * number : 7 + 3 * number]
        v, b = complex(p[0], p[1]) * np.exp(1j * chain.phi2), chain.joint
        products = k * np.conj(u - b - v) - u * np.conj(b + v) + b * np.conj(v) + 0.5 * b * np.conj(b)
        parts.append(p[2] + products.real)
    return np.concatenate(parts)


def groups(count: int) -> list[list[int]]:
    """The groups of (14), (15): (K, constants), (r_G, r_I, constants), (r_H, constants)."""
    constants = [6 + 3 * k for k in range(count)]
    points = [4 + 3 * k + i for k in range(count) for i in range(2)]
    return [[0, 1, *constants], [*points, *constants], [2, 3, *constants]]


def alternate(
    start: ActiveChain, chains: Sequence[PassiveChain], phi7: Sequence[float], norm: Norm, sweeps: int
) -> tuple[ActiveChain, list[float]]:
    """The published descent: one group after the other, each by one linear problem.

    Returns
    -------
    chain : ActiveChain
    history : list of float
        max |q| after each sweep (not increasing for the norm ``"minimax"``).
    """
    crank, x = np.array(phi7, dtype=float), start.as_vector()
    history = []
    for _ in range(sweeps):
        for group in groups(len(chains)):
            matrix, constant = _affine(x, group, chains, crank)
            if norm == "least-squares":
                x[group] = np.linalg.lstsq(matrix, -constant, rcond=None)[0]
                continue
            found, worst = linear_minimax(matrix, -constant)
            if worst < np.abs(matrix @ x[group] + constant).max():
                x[group] = found
        history.append(2 * float(np.abs(active_residuals(x, chains, crank)).max()))
    return ActiveChain.from_vector(x), history


def finish(
    start: ActiveChain, chains: Sequence[PassiveChain], phi7: Sequence[float], norm: Norm = "least-squares"
) -> Fit:
    """All groups together: Levenberg–Marquardt, or sequential linear programs for the Chebyshev norm."""
    crank = np.array(phi7, dtype=float)

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return 2 * active_residuals(x, chains, crank)

    def jacobian(x: NDArray[np.float64]) -> NDArray[np.float64]:
        out = np.empty((len(chains) * len(crank), len(x)))
        for group in groups(len(chains)):
            out[:, group] = 2 * _affine(x, group, chains, crank)[0]
        return out

    if norm == "minimax":
        return minimax_fit(residuals, start.as_vector(), jacobian=jacobian)
    return least_squares_fit(residuals, start.as_vector(), jacobian=jacobian)


def exact_active(
    chains: Sequence[PassiveChain], phi7: Sequence[float], chosen: Sequence[int], seed: int = 0
) -> list[ActiveChain]:
    """Every active chain of two passive ones that is exact at five positions, by a complete solve.

    The constants p3 and p10 are taken out by differences, which leaves eight quadrics in K, r_H, r_G, r_I.

    Parameters
    ----------
    chosen : sequence of 5 int
        The positions.
    """
    from solvers import solve

    crank = np.array(phi7, dtype=float)
    values: list[complex] = []
    spots = np.concatenate([chain.joint for chain in chains])
    middle, size = spots.mean(), float(np.abs(spots - spots.mean()).max())
    for j in chosen:
        values += [np.cos(crank[j]), np.sin(crank[j])]
        for chain in chains:
            b = (chain.joint[j] - middle) / size
            values += [np.cos(chain.phi2[j]), np.sin(chain.phi2[j]), b.real, b.imag]
    found = solve(_exact_system(), values, seed=seed, certificates=False)
    active = []
    for root in found.real_points:
        z = root[0::2] + 1j * root[1::2]
        x = np.zeros(10)
        x[:4] = (np.array([z[0] * size + middle, z[1] * size])).view(float)
        for k in range(2):
            point = z[2 + k] * size
            x[4 + 3 * k : 6 + 3 * k] = point.real, point.imag
        free = active_residuals(x, chains, crank).reshape(2, -1)
        x[[6, 9]] = -free[:, list(chosen)].mean(axis=1)
        active.append(ActiveChain.from_vector(x))
    return active


@lru_cache(maxsize=1)
def _exact_system() -> System:
    """q/2 at four positions minus q/2 at a fifth, for both passive chains."""
    from sympy import symbols

    from solvers import System

    unknowns = symbols("Kx Ky Hx Hy Gx Gy Ix Iy")
    kx, ky, hx, hy = unknowns[:4]
    parameters, halves = [], []
    for j in range(5):
        c7, s7 = symbols(f"c7_{j} s7_{j}")
        parameters += [c7, s7]
        ux, uy = c7 * hx - s7 * hy, s7 * hx + c7 * hy
        row = []
        for number, (gx, gy) in enumerate((unknowns[4:6], unknowns[6:8])):
            c, s, bx, by = symbols(f"c{number}_{j} s{number}_{j} bx{number}_{j} by{number}_{j}")
            parameters += [c, s, bx, by]
            vx, vy = c * gx - s * gy, s * gx + c * gy
            products = kx * (ux - bx - vx) + ky * (uy - by - vy) - ux * (bx + vx) - uy * (by + vy)
            row.append(products + bx * vx + by * vy + (bx**2 + by**2) / 2)
        halves.append(row)
    equations = [halves[j][n] - halves[0][n] for n in range(2) for j in range(1, 5)]
    return System(equations, unknowns, parameters)


def negative_chain(
    chain: PassiveChain, active: ActiveChain, number: int, phi7: Sequence[float], seed: int = 0
) -> tuple[Dyad, Half, DyadFits]:
    """The best link LM (or NQ) between links 1 and 5, the trivial one left out; proved by all critical points.

    Parameters
    ----------
    number : int
        Which of the passive chains this is, 0 or 1.

    Returns
    -------
    Dyad, Half, DyadFits
        The dyad with `fixed` = r_L in frame (1) and `moving` = r_M in frame (5).

    Raises
    ------
    TaskError
        When the active chain does not assemble at a position.
    """
    crank = np.array(phi7, dtype=float)
    h = active.pivot + active.h * np.exp(1j * crank)
    point, length = active.points[number], active.lengths[number]
    # The links have fixed lengths: H and the passive chain move as they are, G is where BGH puts it.
    blank = Half(chain.pivot, chain.crank, chain.rod, point, length, 0j, 0j, 0.0)
    g = chain.joint + point * np.exp(1j * chain.phi2)
    line, to_g = h - chain.joint, g - chain.joint
    side = float(np.sign(np.median((np.conj(line) * to_g).imag))) or 1.0
    blank = Half(chain.pivot, chain.crank, chain.rod, point, length, 0j, 0j, 0.0, side)
    assembled = blank.assembled(h, chain.phi1)
    if not np.all(np.isfinite(assembled["phi5"])):
        raise TaskError("the active chain does not assemble at every position; its error is too large")
    frame = np.exp(-1j * chain.phi1)
    places = (assembled["G"] - chain.pivot) * frame
    fits = fit_dyads(places, assembled["phi5"] - chain.phi1, seed)
    scale = max(chain.crank, abs(point))
    useful = [
        d
        for d in fits.minima
        if abs(d.fixed - chain.crank) + abs(d.moving) > TRIVIAL * scale and np.isfinite(d.length) and d.length > 0
    ]
    if not useful:
        raise TaskError("no link but the trivial one joins links 1 and 5 at these positions")
    best = _sharpened(useful[0], places, assembled["phi5"] - chain.phi1)
    half = Half(chain.pivot, chain.crank, chain.rod, point, length, best.fixed, best.moving, best.length, side)
    return best, half, fits


def _sharpened(dyad: Dyad, places: NDArray[np.complex128], turns: NDArray[np.float64]) -> Dyad:
    """The same minimum from its residuals: sums of squares know a narrow minimum to half of the digits only."""

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return dyad_residuals(places, turns, complex(x[0], x[1]), complex(x[2], x[3]), float(x[4]))

    def jacobian(x: NDArray[np.float64]) -> NDArray[np.float64]:
        turned = np.exp(1j * turns)
        gap = places + turned * complex(x[2], x[3]) - complex(x[0], x[1])
        moving = np.conj(gap) * turned
        return np.stack([-gap.real, -gap.imag, moving.real, -moving.imag, np.full(len(gap), -x[4])], axis=1)

    start = [dyad.fixed.real, dyad.fixed.imag, dyad.moving.real, dyad.moving.imag, dyad.length]
    fit = least_squares_fit(residuals, start, jacobian=jacobian)
    x = fit.x
    return replace(
        dyad, fixed=complex(x[0], x[1]), moving=complex(x[2], x[3]), length=float(x[4]), residuals=fit.residuals
    )


def _affine(
    x: NDArray[np.float64], group: list[int], chains: Sequence[PassiveChain], crank: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Matrix and constant of q/2 as an affine function of one group; exact, as the function is affine."""
    base = x.copy()
    base[group] = 0.0
    constant = active_residuals(base, chains, crank)
    columns = []
    for index in group:
        unit = base.copy()
        unit[index] = 1.0
        columns.append(active_residuals(unit, chains, crank) - constant)
    return np.array(columns).T, constant
