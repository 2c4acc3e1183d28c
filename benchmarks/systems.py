"""Systems of mechanisms to measure the tracker with, and their roots at generic parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy

from solvers.graph import Builder
from solvers.kernel.engine import Engine, make_engine
from solvers.system import System


def trammel_system() -> System:
    """The rotatory trammel through seven poses: 12 unknowns, 18 parameters, 560 roots.

    p_i + m e_i = Q + d t_i + R t_i² / e_i with Q = m - d - R and its conjugate, cleared of denominators; the
    trammel's rotation t_i at each pose stays a local unknown.
    """
    m, mc, d, dc, R, Rc = sympy.symbols("m mc d dc R Rc")
    t, p, pc, e = (sympy.symbols(f"{name}1:7") for name in ("t", "p", "pc", "e"))
    equations = []
    for k in range(6):
        A = m - d - R - p[k] - m * e[k]
        Ac = mc - dc - Rc - pc[k] - mc / e[k]
        equations += [R / e[k] * t[k] ** 2 + d * t[k] + A, Ac * t[k] ** 2 + dc * t[k] + Rc * e[k]]
    return System(equations, [m, mc, d, dc, R, Rc, *t], [*p, *pc, *e])


def trammel_seed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A generic root and its parameters: the displacements are what the linkage makes of random rotations."""
    m, mc, d, dc, R, Rc, *rest = gauss(rng, 18)
    t, e = np.array(rest[:6]), np.array(rest[6:])
    p = R / e * t**2 + d * t + (m - d - R) - m * e
    pc = Rc * e / t**2 + dc / t + (mc - dc - Rc) - mc / e
    return np.array([m, mc, d, dc, R, Rc, *t]), np.concatenate([p, pc, e])


def four_bar_system() -> System:
    """The four-bar through nine points (Alt): 24 unknowns, 16 parameters, 8652 roots.

    |δ_j + x θ_j - a| = |x - a| for the dyad (x, a) and for the dyad (y, b), θ_j the coupler's rotation.
    """
    x, xc, a, ac, y, yc, b, bc = sympy.symbols("x xc a ac y yc b bc")
    turn, back, delta, deltac = (sympy.symbols(f"{name}1:9") for name in ("turn", "back", "delta", "deltac"))
    equations = []
    for k in range(8):
        D, Dc = delta[k], deltac[k]
        for u, uc, c, cc in ((x, xc, a, ac), (y, yc, b, bc)):
            equations.append(
                D * Dc + D * (uc * back[k] - cc) + Dc * (u * turn[k] - c)
                - cc * u * (turn[k] - 1) - c * uc * (back[k] - 1)
            )  # fmt: skip
        equations.append(turn[k] * back[k] - 1)
    rotations = [angle for pair in zip(turn, back) for angle in pair]
    return System(equations, [x, xc, a, ac, y, yc, b, bc, *rotations], [*delta, *deltac])


def four_bar_seed(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A generic root and its parameters."""
    x, xc, a, ac, y, yc, b, bc, *turns = gauss(rng, 16)
    turn = np.array(turns) / np.abs(turns) * np.exp(0.3 * rng.normal(size=8))
    back = 1 / turn

    def coefficients(u, uc, c, cc):
        """Of δ, δ̄ and 1 in the closure δδ̄ + αδ + βδ̄ + κ = 0."""
        return uc * back - cc, u * turn - c, -cc * u * (turn - 1) - c * uc * (back - 1)

    (a1, b1, c1), (a2, b2, c2) = coefficients(x, xc, a, ac), coefficients(y, yc, b, bc)
    # δ̄ = s + w δ from the difference of the two closures, then a quadratic for δ
    s, w = -(c1 - c2) / (b1 - b2), -(a1 - a2) / (b1 - b2)
    half = (s + a1 + b1 * w) / 2
    delta = (-half + np.sqrt(half**2 - w * (b1 * s + c1))) / w
    point = [x, xc, a, ac, y, yc, b, bc, *np.stack([turn, back], axis=1).ravel()]
    return np.array(point), np.concatenate([delta, s + w * delta])


def gauss(rng: np.random.Generator, count: int) -> np.ndarray:
    return (rng.normal(size=count) + 1j * rng.normal(size=count)) / np.sqrt(2)


@dataclass
class Fibre:
    """All roots that were found at generic parameters."""

    engine: Engine
    points: np.ndarray
    parameters: np.ndarray
    loops: int
    paths: int


def engine_of(system: System, points: np.ndarray, parameters: np.ndarray) -> Engine:
    """The tracker's engine for a system whose parameters all move."""
    builder = Builder(len(system.unknowns), len(system.parameters))
    return make_engine(builder, system.embed(builder), (points, parameters))


def fibre(system: System, seed, count: int, rng: np.random.Generator, loops: int = 80) -> Fibre:
    """Loops through the parameter space from one seed until `count` roots are known, or patience ends.

    The best-conditioned of a dozen seeds is moved to a random base first: seeds are special.
    """
    seeds = [seed(rng) for _ in range(12)]
    condition = []
    for point, parameters in seeds:
        _, J = system.evaluate(point, parameters)
        J = J[0] / np.abs(J[0]).max(axis=1, keepdims=True)
        condition.append(np.linalg.cond(J / np.abs(J).max(axis=0)))
    point, at = seeds[int(np.argmin(condition))]
    engine = engine_of(system, point[None], at)
    known, tracked = point[None], 0
    for loop in range(loops):
        corners = [_generic(rng, at) for _ in range(2 if loop else 1)]
        where, points = at, known
        for corner in (*corners, at) if loop else corners:
            end = engine.track(points, corner, where - corner)
            tracked += len(points)
            points, where = end.x[end.status == 0], corner
        if not loop:
            at, known = where, points
            continue
        known = distinct(np.concatenate([known, points]))
        if len(known) >= count:
            break
    return Fibre(engine, known, at, loop, tracked)


def _generic(rng: np.random.Generator, like: np.ndarray) -> np.ndarray:
    return gauss(rng, len(like))


def distinct(points: np.ndarray, tolerance: float = 1e-7) -> np.ndarray:
    """Points without repetition: sorted along a random functional, neighbours within a window compared."""
    rng = np.random.default_rng(7)
    functional = rng.normal(size=points.shape[1]) + 1j * rng.normal(size=points.shape[1])
    value = (points @ functional).real
    order = np.argsort(value)
    points, value = points[order], value[order]
    size = np.abs(points).max(axis=1)
    keep = np.ones(len(points), bool)
    for shift in range(1, 12):
        if shift >= len(points):
            break
        near = np.abs(points[shift:] - points[:-shift]).max(axis=1) < tolerance * (1 + size[shift:])
        keep[shift:] &= ~near
    return points[keep]
