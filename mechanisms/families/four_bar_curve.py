"""Four-bars whose coupler curve passes through given points: the equations in which they are tracked.

**Six, seven, eight points** are met by Eq. (19) of Suárez-Velásquez, Cervantes-Sánchez and Rico-Martínez (Synthesis
of a novel planar linkage to visit up to eight poses, 2018) with three, two or one of its nine parameters chosen.
Eq. (19) is what is left of

    (A_i − M)(A_i − M)¯ + (A_i − M) ζ̄ T̄_i + (A_i − M)¯ ζ T_i = L_MR² − e² − g²,      ζ = −e − ig,
    (A_i − N)(A_i − N)¯ + (A_i − N) ω̄ T̄_i + (A_i − N)¯ ω T_i = L_NS² − f² − g²,      ω = f − ig,      T_i T̄_i = 1,

when the coupler's turn T_i, measured from the x-axis, is eliminated.  Here it is kept: three equations and two
local unknowns for each point, so that the Jacobian is block-arrow.  The unknowns of the paper stay unknowns, so that
any of them can be chosen; the right sides are the unknowns k_M and k_N.

**Nine points.**  With A_0 the first point, δ_i = A_i − A_0, a = A_0 − M, z = R_0 − A_0 and t_i the turn from point
0, each dyad gives

    δ_i ā + δ̄_i a + δ_i δ̄_i + z ((ā + δ̄_i) t_i − ā) + z̄ ((a + δ_i) t̄_i − a) = 0,      t_i t̄_i = 1,

and the other the same with b, w for a, z: 24 equations and unknowns, sixteen cubics and eight quadrics.  Generic
points have 8652 roots: 1442 coupler curves, each drawn by the three four-bars of Roberts, each counted twice because
its two dyads can change places (Wampler, Morgan, Sommese, Complete solution of the nine-point path synthesis
problem for four-bar linkages, J. Mech. Des. 114(1), 1992).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.reality import Mirror, exchange

if TYPE_CHECKING:
    from solvers import System

__all__ = [
    "NAMES",
    "cognate",
    "curve_columns",
    "curve_instance",
    "curve_mirror",
    "curve_system",
    "nine_point_instance",
    "nine_point_mirror",
    "nine_point_system",
    "swap",
    "swapped_curve",
]

#: The paper's parameters of a four-bar, in its order.
NAMES = ("x_M", "y_M", "x_N", "y_N", "L_MR", "L_NS", "e", "f", "g")
#: What stands for a link's length among the unknowns: L² less the squares of the coupler's sides.
_LENGTHS = {"L_MR": "k_M", "L_NS": "k_N"}


@cache
def curve_system(points: int, chosen: tuple[str, ...]) -> System:
    """Eq. (19) for some points, the coupler's turns kept as unknowns.

    Parameters
    ----------
    points : int
        6 to 9.
    chosen : tuple of str
        The 9 − points parameters that are given, in the order of `NAMES`.

    Returns
    -------
    System
        Unknowns: the other parameters (k_M and k_N in place of L_MR and L_NS), then T_i, T̄_i for each point.
        Parameters: A_i, Ā_i for each point, then the chosen ones.

    Examples
    --------
    >>> curve_system(8, ("g",)).size
    (24, 24)
    """
    from sympy import I, symbols

    from solvers import System

    s = {name: symbols(name) for name in NAMES}
    k = {length: symbols(name) for length, name in _LENGTHS.items()}
    e, f, g = s["e"], s["f"], s["g"]
    right_sides = {
        "L_MR": s["L_MR"] ** 2 - e**2 - g**2 if "L_MR" in chosen else k["L_MR"],
        "L_NS": s["L_NS"] ** 2 - f**2 - g**2 if "L_NS" in chosen else k["L_NS"],
    }
    dyads = (
        (s["x_M"] + I * s["y_M"], s["x_M"] - I * s["y_M"], -e - I * g, -e + I * g, right_sides["L_MR"]),
        (s["x_N"] + I * s["y_N"], s["x_N"] - I * s["y_N"], f - I * g, f + I * g, right_sides["L_NS"]),
    )
    equations, parameters = [], []
    unknowns = [k.get(name, s[name]) for name in NAMES if name not in chosen]
    for i in range(points):
        a, ac, t, tc = symbols(f"A{i} Ac{i} T{i} Tc{i}")
        for pivot, pivot_c, arm, arm_c, right in dyads:
            x, xc = a - pivot, ac - pivot_c
            equations.append(x * xc + x * arm_c * tc + xc * arm * t - right)
        equations.append(t * tc - 1)
        unknowns += [t, tc]
        parameters += [a, ac]
    return System(equations, unknowns, parameters + [s[name] for name in chosen])


def curve_columns(chosen: Iterable[str]) -> tuple[str, ...]:
    """The names of the design unknowns of `curve_system`, in order."""
    chosen = tuple(chosen)
    return tuple(_LENGTHS.get(name, name) for name in NAMES if name not in chosen)


def curve_mirror(points: int, chosen: Sequence[str]) -> Mirror:
    """What conjugation does: the paper's parameters are conjugated, T and T̄ change places."""
    design = len(NAMES) - len(chosen)
    order = list(range(design))
    for i in range(points):
        order += [design + 2 * i + 1, design + 2 * i]
    return exchange(order)


def curve_instance(
    points: int, chosen: Sequence[str], rng: np.random.Generator
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """A random root of `curve_system` and parameters that it solves: points are put on a random complex four-bar.

    Returns
    -------
    point : (unknowns,) array
    parameters : (parameters,) array
    """
    values = dict(zip(NAMES, rng.normal(size=9) + 1j * rng.normal(size=9)))
    e, f, g = values["e"], values["f"], values["g"]
    m, mc = values["x_M"] + 1j * values["y_M"], values["x_M"] - 1j * values["y_M"]
    n, nc = values["x_N"] + 1j * values["y_N"], values["x_N"] - 1j * values["y_N"]
    k_m = values["L_MR"] ** 2 - e**2 - g**2
    k_n = values["L_NS"] ** 2 - f**2 - g**2
    zeta, zeta_c, omega, omega_c = -e - 1j * g, -e + 1j * g, f - 1j * g, f + 1j * g
    t = np.exp(2j * np.pi * rng.random(points)) * rng.uniform(0.7, 1.4, points)
    tc = 1 / t
    # The difference of the two equations is linear in X = A − M and X̄, which leaves a quadratic for X.
    d, dc = m - n, mc - nc
    alpha = dc + (omega_c - zeta_c) * tc
    beta = d + (omega - zeta) * t
    gamma = d * dc + d * omega_c * tc + dc * omega * t - k_n + k_m
    quadratic = -alpha / beta
    linear = -gamma / beta + zeta_c * tc - alpha * zeta * t / beta
    constant = -gamma * zeta * t / beta - k_m
    root = np.sqrt(linear**2 - 4 * quadratic * constant) * rng.choice([-1.0, 1.0], points)
    x = (root - linear) / (2 * quadratic)
    xc = -(alpha * x + gamma) / beta
    values |= {"k_M": k_m, "k_N": k_n}
    design = [values[name] for name in curve_columns(chosen)]
    point = np.concatenate([design, np.stack([t, tc], axis=1).ravel()])
    places = np.stack([m + x, mc + xc], axis=1).ravel()
    return point, np.concatenate([places, [values[name] for name in chosen]])


def swapped_curve(chosen: Sequence[str]) -> Any:
    """The map of roots of `curve_system` that exchanges the dyads, or None where a choice tells them apart.

    M ↔ N, k_M ↔ k_N, (e, f) → (−f, −e): the coupler's arms ζ and ω change places.
    """
    if not set(chosen) <= {"g"}:
        return None
    free = curve_columns(chosen)
    order, signs = [], []
    for name in free:
        other = {"x_M": "x_N", "x_N": "x_M", "y_M": "y_N", "y_N": "y_M", "k_M": "k_N", "k_N": "k_M"}.get(name)
        other = {"e": "f", "f": "e"}.get(name, other or name)
        order.append(free.index(other))
        signs.append(-1.0 if name in "ef" else 1.0)
    weights = np.array(signs)

    def exchanged(points: NDArray[Any]) -> NDArray[Any]:
        points = np.asarray(points)
        return np.concatenate([points[..., order] * weights, points[..., len(order) :]], axis=-1)

    return exchanged


@cache
def nine_point_system() -> System:
    """Nine points: unknowns a, ā, z, z̄, b, b̄, w, w̄, then t_i, t̄_i; parameters δ_i, δ̄_i, i = 1 … 8.

    Examples
    --------
    >>> nine_point_system().size
    (24, 24)
    """
    from sympy import symbols

    from solvers import System

    design = symbols("a ac z zc b bc w wc")
    equations, parameters, unknowns = [], [], list(design)
    for i in range(1, 9):
        delta, delta_c, t, tc = symbols(f"d{i} dc{i} t{i} tc{i}")
        for a, ac, z, zc in (design[:4], design[4:]):
            equations.append(
                delta * ac + delta_c * a + delta * delta_c + z * ((ac + delta_c) * t - ac) + zc * ((a + delta) * tc - a)
            )
        equations.append(t * tc - 1)
        unknowns += [t, tc]
        parameters += [delta, delta_c]
    return System(equations, unknowns, parameters)


def nine_point_mirror() -> Mirror:
    """Conjugation exchanges every unknown with its barred partner."""
    return exchange([k ^ 1 for k in range(24)])


def nine_point_instance(rng: np.random.Generator) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """A random root of `nine_point_system` and the δ_i that it solves."""
    a, ac, z, zc, b, bc, w, wc = design = rng.normal(size=8) + 1j * rng.normal(size=8)
    t = np.exp(2j * np.pi * rng.random(8)) * rng.uniform(0.7, 1.4, 8)
    tc = 1 / t
    # Dyad 1: δ δ̄ + p δ + q δ̄ + r = 0, dyad 2 the same with p', q', r': their difference is linear.
    p, q, r = ac + zc * tc, a + z * t, z * ac * (t - 1) + zc * a * (tc - 1)
    p2, q2, r2 = bc + wc * tc, b + w * t, w * bc * (t - 1) + wc * b * (tc - 1)
    alpha, beta, gamma = p - p2, q - q2, r - r2
    # δ̄ = −(αδ + γ)/β
    quadratic, linear, constant = -alpha / beta, p - gamma / beta - q * alpha / beta, r - q * gamma / beta
    root = np.sqrt(linear**2 - 4 * quadratic * constant) * rng.choice([-1.0, 1.0], 8)
    delta = (root - linear) / (2 * quadratic)
    delta_c = -(alpha * delta + gamma) / beta
    point = np.concatenate([design, np.stack([t, tc], axis=1).ravel()])
    return point, np.stack([delta, delta_c], axis=1).ravel()


def swap(points: NDArray[Any]) -> NDArray[Any]:
    """Exchange the two dyads of roots of `nine_point_system`, (…, 24) to (…, 24)."""
    points = np.asarray(points)
    return points[..., [4, 5, 6, 7, 0, 1, 2, 3, *range(8, points.shape[-1])]]


def cognate(points: NDArray[Any], parameters: NDArray[Any]) -> NDArray[Any]:
    """Roberts' cognate that keeps the first fixed pivot, for roots of `nine_point_system`.

    With c = R − M, v = S − R, A = R + κv the point A can be reached by the sides c and κv in either order: the
    cognate's crank is κv, its coupler turns as the crank did and holds A at the distance c, and its second pivot is
    K = M + κ(N − M), about which κ(S − N) turns.

    Parameters
    ----------
    points : (n, 24) complex array
    parameters : (16,) or (n, 16) complex array
        δ_i, δ̄_i.

    Returns
    -------
    (n, 24) complex array
    """
    points = np.asarray(points)
    a, z, b, w = (points[:, k] for k in (0, 2, 4, 6))
    ac, zc, bc, wc = (points[:, k] for k in (1, 3, 5, 7))
    with np.errstate(divide="ignore", invalid="ignore"):
        kappa, kappa_c = z / (z - w), zc / (zc - wc)
        b2, b2c = a - kappa * (a - b), ac - kappa_c * (ac - bc)
        design = [a, ac, -(a + z), -(ac + zc), b2, b2c, -b2 + kappa * (w + b), -b2c + kappa_c * (wc + bc)]
        t, tc = points[:, 8::2], points[:, 9::2]
        crank = (a[:, None] + parameters[..., 0::2] + z[:, None] * t) / (a + z)[:, None]
        crank_c = (ac[:, None] + parameters[..., 1::2] + zc[:, None] * tc) / (ac + zc)[:, None]
    turns = np.stack([crank, crank_c], axis=2).reshape(len(points), -1)
    return np.concatenate([np.stack(design, axis=1), turns], axis=1)
