"""Two poses of the two-effector Watt II: three scalars of the shared dyads are free, and any three may be chosen.

Nine scalars (β₂ and the coordinates of W1, Z1, W2, Z2) stand against six equations, Kiper's (1)–(3).  With
β₂ among the three choices the rest is linear; his Eqs. (8)–(11) are the case β₂, W1x, Z1x.  Without it, β₂
is an unknown like the others: its cosine and sine are, the six equations are bilinear, and a few roots take
the place of one.

The linear case is degenerate where a determinant vanishes.  For W1x, Z1x (and for W1y, Z1y) it is

    D = sin(α−β) − sin α + sin β = 4 sin((α−β)/2) sin(α/2) sin(β/2),

so that β₂ may be neither 0 nor α₂; and Eqs. (1), (3) ask that β₂ is not γ₂.  In general the solutions for a
given β₂ are W1 = w + (E(α)−1)k and so on with one complex k.  W2 changes by (E(γ)−1)(E(α)−E(β))/(E(γ)−E(β)) k,
which is a real multiple of (E(α)−1)k: the arguments of the four chords add up to α/2.  So W1x and W2x can never
be chosen together, nor W1y and W2y; any other pair can, for general poses.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Problem
from mechanisms.families.dyads import Dyads, dyad_equations, turn
from mechanisms.families.reality import real_roots
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["COORDINATES", "SHARED", "check_two_poses", "shared_dyads", "two_pose_problem"]

VECTORS = ("W1", "Z1", "W2", "Z2")
COORDINATES = tuple(f"{vector}_{axis}" for vector in VECTORS for axis in "xy")
#: What three may be chosen of.
SHARED = ("beta2", *COORDINATES)
#: Relative size under which a determinant counts as zero: it would cost all but five digits.
SINGULAR = 1e-11


def check_two_poses(task: Task) -> None:
    """Refuse a choice of free scalars that is not three, or that determines nothing."""
    chosen = [name for name in SHARED if name in task.free]
    if len(chosen) != 3:
        raise TaskError(
            f"{task.where}: free: two poses leave exactly three free choices among beta2_deg, "
            f"{', '.join(COORDINATES)}; {len(chosen)} given"
        )
    if "beta2" in chosen:
        _refuse_special_angle(task)
        _linear(task)


def two_pose_problem(task: Task) -> Problem | None:
    """The polynomials when β₂ is not chosen; None when it is, because the rest is linear then.

    The unknowns are cos β₂, sin β₂ and the coordinates that are not chosen, all real for a real design;
    lengths are in units of the task's size.
    """
    if "beta2" in task.free:
        return None
    from sympy import I, expand, im, re, symbols

    from solvers import System

    cosine, sine = symbols("cos_beta2 sin_beta2", real=True)
    coordinates = dict(zip(COORDINATES, symbols(" ".join(COORDINATES), real=True)))
    data = {name: symbols(f"{name}_x {name}_y", real=True) for name in ("alpha2", "gamma2", "dPQ", "dP2", "dQ2")}
    vectors = {v: coordinates[f"{v}_x"] + I * coordinates[f"{v}_y"] for v in VECTORS}
    values = {symbols(name): expression for name, expression in vectors.items()}
    values |= {symbols(name): x + I * y for name, (x, y) in data.items()}
    values[symbols("beta2")] = cosine + I * sine
    equations = [cosine**2 + sine**2 - 1]
    for number in (1, 2, 3):
        equation = expand(dyad_equations(2)[number].subs(values))
        equations += [re(equation), im(equation)]
    chosen = [name for name in COORDINATES if name in task.free]
    unknowns = [cosine, sine, *(symbol for name, symbol in coordinates.items() if name not in chosen)]
    parameters = [part for pair in data.values() for part in pair] + [coordinates[name] for name in chosen]
    alpha, gamma, d_pq, d_p, d_q = two_pose_data(task)
    numbers = [np.exp(1j * alpha), np.exp(1j * gamma), *(d / task.size for d in (d_pq, d_p, d_q))]
    numeric = [float(part) for z in numbers for part in (z.real, z.imag)]
    numeric += [task.free[name] / task.size for name in chosen]
    return Problem(System(equations, unknowns, parameters), numeric)


def shared_dyads(
    task: Task, solutions: Solutions | None
) -> Iterator[tuple[int | None, float, Dyads, Dyads] | int]:
    """Every (root, β₂, (W1, Z1), (W2, Z2)) of a two-pose task; the bare index of a root that is not real."""
    if solutions is None:
        vectors = _linear(task)
        yield None, float(task.free["beta2"]), Dyads(*vectors[:2]), Dyads(*vectors[2:])
        return
    open_names = [name for name in COORDINATES if name not in task.free]
    real = real_roots(solutions.points)
    for root, point in enumerate(solutions.points):
        if not real[root]:
            yield root
            continue
        coordinates = {name: float(task.free[name]) for name in COORDINATES if name in task.free}
        coordinates |= dict(zip(open_names, task.size * point[2:].real))
        found = [complex(coordinates[f"{v}_x"], coordinates[f"{v}_y"]) for v in VECTORS]
        beta = math.atan2(point[1].real, point[0].real)
        yield root, beta, Dyads(*found[:2]), Dyads(*found[2:])  # type: ignore[arg-type]


def two_pose_data(task: Task) -> tuple[float, float, complex, complex, complex]:
    """α₂, γ₂, δ_PQ, δ_P2, δ_Q2."""
    p, q = task.poses["P"], task.poses["Q"]
    return (
        p[1].angle - p[0].angle,
        q[1].angle - q[0].angle,
        q[0].point - p[0].point,
        p[1].point - p[0].point,
        q[1].point - q[0].point,
    )


def _linear(task: Task) -> NDArray[np.complex128]:
    """W1, Z1, W2, Z2 from Eqs. (1)–(3) for a given β₂ and two of their coordinates."""
    alpha, gamma, d_pq, d_p, d_q = two_pose_data(task)
    a, b, g = (complex(turn(angle)) for angle in (alpha, task.free["beta2"], gamma))
    size = task.size
    coefficients = np.array([[-1, -1, 1, 1], [b, a, 0, 0], [0, 0, b, g]])
    complex_right = np.array([d_pq, d_p, d_q]) / size
    chosen = [name for name in COORDINATES if name in task.free]
    matrix, right = np.zeros((8, 8)), np.zeros(8)
    matrix[0:6:2, 0::2], matrix[0:6:2, 1::2] = coefficients.real, -coefficients.imag
    matrix[1:6:2, 0::2], matrix[1:6:2, 1::2] = coefficients.imag, coefficients.real
    right[0:6:2], right[1:6:2] = complex_right.real, complex_right.imag
    for row, name in enumerate(chosen, start=6):
        matrix[row, COORDINATES.index(name)] = 1.0
        right[row] = task.free[name] / size
    determinant, bound = abs(np.linalg.det(matrix)), float(np.prod(np.linalg.norm(matrix, axis=1)))
    if determinant <= SINGULAR * bound:
        always = {name[:2] for name in chosen} == {"W1", "W2"} and chosen[0][-1] == chosen[1][-1]
        first_dyad = {name[:2] for name in chosen} == {"W1", "Z1"} and chosen[0][-1] == chosen[1][-1]
        reason = "the determinant of Eqs. (1)–(3) in the other coordinates vanishes"
        if always:
            reason = "W1 and W2 change by real multiples of each other, whatever the poses"
        elif first_dyad:
            reason = "D = 4 sin((α−β)/2) sin(α/2) sin(β/2) = 0, as P does not turn"
        raise TaskError(
            f"{task.where}: free: {chosen[0]} and {chosen[1]} do not determine the dyads when beta2 is given: "
            f"{reason}; choose another pair"
        )
    solved = size * np.linalg.solve(matrix, right)
    return solved[0::2] + 1j * solved[1::2]


def _refuse_special_angle(task: Task) -> None:
    alpha, gamma, *_ = two_pose_data(task)
    beta = task.free["beta2"]
    reasons = {
        0.0: "the crank does not turn",
        alpha: "it turns as P does (alpha2), so that D = 4 sin((α−β)/2) sin(α/2) sin(β/2) vanishes",
        gamma: "it turns as Q does (gamma2), so that Eqs. (1) and (3) lose their unique solution",
    }
    for angle, reason in reasons.items():
        if abs(turn(beta - angle)) < 1e-9:
            raise TaskError(
                f"{task.where}: free.beta2_deg: {math.degrees(beta):g} leaves nothing to solve: {reason}; "
                f"choose another angle"
            )
