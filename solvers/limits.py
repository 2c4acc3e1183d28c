"""What a limit is: a simple root, a multiple one, the mean of several, or a root at infinity.

The endgame finds limits of paths, known to some digits only. Here is decided, at the target system itself, what
they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from solvers.arithmetic import double_double
from solvers.arithmetic.double_double import DoubleDouble
from solvers.krawczyk import inverses
from solvers.local import ORIGIN, in_own_units, magnitudes, newton_step, relative_weights
from solvers.refine import newton_double_double
from solvers.system import evaluate
from solvers.tape import Program

#: Two radii agree on a limit to this precision, relative.
AGREE = 1e-7
#: How far out a direction is tried, and how well the highest terms must cancel there, relative.
FAR, HIGHEST_TERMS = 1e13, 1e-6
#: The constant part of 1/x_j^p that rounding leaves: 1e-15 to 1e-10. A root that is not at infinity leaves its distance
#: from there beside that of the loop, 1e-5 where it is of size 1e7.
VANISHES = 1e-8
#: Roots farther out than this, in typical sizes of the unknowns, are at infinity: data of twelve digits say no more.
FARTHEST = 1e10
#: A root whose Jacobian has a scaled condition number above this is no regular root.
SUSPECT = 1e9
#: Residual along the cokernel below which a limit is a root; pairs of roots 3e-7 apart are told from double ones.
COKERNEL = 2e-14
#: From a multiple root Newton's method goes no farther than so many times the error of the limit …
STEP_OF_ERRORS = 3.0
#: … in the directions whose singular values are above this; below, they are rounding errors.
VANISHED = 1e-15
#: A Newton step cannot be smaller than about this times the condition number.
ROUNDING = 1e-15
#: At a singular root that has been refined in double-double the condition number is 1e15 or more; at the simple
#: roots of a cluster of three, a millionth apart, it is 1e13.
HOPELESS = 2e14
#: Simple roots this near to a limit, relative, make it doubtful that it is a multiple root.
CLUSTER = 1e-4
#: Points tracked in double-double are known this well, relative.
EXACT = 1e-13
#: Last step in double-double of a Newton iteration that converges quadratically.
QUADRATIC = 1e-18
#: One that goes by halves to a root with a coordinate zero takes steps as small as any. But there a further step,
#: times the condition number, stays near 1/4 or more; at a simple root rounding alone leaves it below 1e-3.
HALVING = 0.02
#: Loops round a multiple root leave this of negative powers, beside how far they go: 1e-18 to 1e-8. A pair of simple
#: roots 2e-6 apart, which meets a distance 1e-12 beside the target, leaves 3e-8 on loops of radius 2e-5 …
NEGATIVE = 3e-8
#: … but no less than so many times the rounding error, which is the larger the nearer a loop comes to the root …
LOOP_ROUNDING = 1e-15
#: … and this much, relative to the unknowns, where the root is ill-conditioned in other ways.
LOOP_ERROR = 1e-10
#: A branch point nearer to the target than this may be there by the rounding of parameters: COKERNEL allows as much.
AT_TARGET = 2e-14


@dataclass(frozen=True, eq=False)
class Refined:
    """Limits as Newton's method in double-double sees them.

    Attributes
    ----------
    points : ndarray, shape (n, unknowns)
    condition : ndarray, shape (n,)
        Scaled condition numbers there.
    simple : ndarray of bool
        The limit is a simple root, only an ill-conditioned one.
    beside : ndarray of bool
        It is one, or one is near.
    """

    points: np.ndarray
    condition: np.ndarray
    simple: np.ndarray
    beside: np.ndarray


@dataclass(frozen=True, eq=False)
class Target:
    """The system at the end of a homotopy.

    Attributes
    ----------
    equations : Program
        Output F.
    program : Program
        Outputs F and J.
    parameters : ndarray, shape (parameters,)
    typical : float
        Typical size of the unknowns.
    """

    equations: Program
    program: Program
    parameters: np.ndarray
    typical: float

    def is_singular(self, x: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Whether limits, known to `error`, really are singular roots, and not means of regular ones.

        The mean of two roots of a quadratic has a singular Jacobian too, but it is no root. A limit known to
        1e-12 has residuals of that size; along the cokernel of J they would be of second order, so there the
        distance of a pair shows: a pair a distance d apart leaves d²/4. Where a third root is as near, the residual
        is smaller still; but a Newton step from the mean would lead as far as the roots are away, while from a
        multiple root it leads no farther than the error of the limit.

        Returns the answers and the scaled condition numbers, shape (n,).
        """
        residual, scaled, _, size = in_own_units(self.program, x, self.parameters, self.typical)
        left, values, right = np.linalg.svd(scaled)
        along = np.abs(np.einsum("ki,ki->k", left[:, :, -1].conj(), residual))
        exact = double_double.replay(self.equations, x, self.parameters)["F"].hi / size
        with np.errstate(all="ignore"):
            condition = np.maximum(values[:, 0], 1) / values[:, -1]
            along_each = np.einsum("kji,kj->ki", left.conj(), exact) / values
            along_each[values < VANISHED] = 0.0
            step = np.abs(np.einsum("kij,ki->kj", right.conj(), along_each)).max(axis=1)
        settled = (condition > SUSPECT) & (np.abs(residual).max(axis=1) < AGREE) & (along < COKERNEL)
        return settled & (step < STEP_OF_ERRORS * np.maximum(error, EXACT)), condition

    def refine(self, x: np.ndarray, reach: np.ndarray | None = None) -> Refined:
        """Whether limits that no path winds round are simple roots after all, only ill-conditioned ones.

        Newton's method in double-double converges quadratically to a simple root, by halves to a multiple one.
        The limits are known to `reach`, or to what double precision allows.
        """
        parameters = DoubleDouble(self.parameters, np.zeros_like(self.parameters))
        start = DoubleDouble(x, np.zeros_like(x))
        floor = max(ORIGIN * self.typical, 1e-300)
        refined, errors = newton_double_double(self.equations, self.program, start, parameters, floor)
        way = np.abs(refined.hi - x).max(axis=1) / np.maximum(np.abs(x).max(axis=1), floor)
        _, _, condition = newton_step(self.program, refined.hi, self.parameters, self.typical)
        if reach is None:  # a limit is known to its rounding error, which is the larger the worse the condition
            reach = np.maximum(AGREE, 10 * ROUNDING * condition)
        quadratic = (errors < QUADRATIC) & (condition < HOPELESS)
        near = np.flatnonzero(quadratic)
        if near.size:
            points = DoubleDouble(refined.hi[near], refined.lo[near])
            quadratic[near] = condition[near] * self._further_step(points) < HALVING
        simple = quadratic & (way < reach)
        return Refined(refined.hi, condition, simple, simple | (quadratic & (way < CLUSTER)))

    def _further_step(self, points: DoubleDouble) -> np.ndarray:
        """Newton steps with residuals in double-double, each unknown beside its own size, shape (n,)."""
        residual = double_double.replay(self.equations, points, self.parameters)["F"].hi
        _, scaled, _, size = in_own_units(self.program, points.hi, self.parameters, self.typical)
        with np.errstate(all="ignore"):
            steps = inverses(scaled) @ (residual / size)[:, :, None]
        return np.asarray(np.abs(steps[:, :, 0]).max(axis=1))

    def is_infinite(self, direction: np.ndarray) -> np.ndarray:
        """Whether limit directions are roots at infinity: there the terms of highest degree cancel.

        Roots that lie along one ray, x = λv with λ^m = c, have a mean of 1/λ that is zero by symmetry as long as
        the loop surrounds the place where λ would be infinite; but then the highest terms do not vanish at v.
        """
        far = FAR * direction / np.abs(direction).max(axis=1, keepdims=True)
        F, _ = evaluate(self.program, far, self.parameters)
        residual = np.abs(F) / magnitudes(self.program, far, self.parameters)
        return np.asarray(residual.max(axis=1, initial=0.0) < HIGHEST_TERMS)


def constant_part(
    walked: list[tuple[np.ndarray, np.ndarray]],
    exponents: np.ndarray,
    turns: np.ndarray,
    corners: int,
    typical: float,
) -> np.ndarray:
    """How far growing coordinates are from a pole at r = 0, as loops round it show.

    x_j ~ r^(−k/m) has a power p = m/gcd(k, m) without a branch, and 1/x_j^p is analytic round r = 0 with a zero of
    order q = pk/m there. If it vanishes at −ε instead, (r + ε)^q leaves qε r^(q−1): what the mean over the loop of
    r^(1−q) / x_j^p leaves beside its modulus, is returned: qε beside the radius. It says how large x_j is at r = 0, and
    if that is farther than roots are looked for, zero is returned. One coordinate that goes to infinity is enough.

    Parameters
    ----------
    walked : list of (rows, points)
        The rows that came to each corner, and where they were, shape (rows, unknowns). The last corner of a turn lies
        where it began.
    exponents : ndarray, shape (n, unknowns)
    turns : ndarray, shape (n,)
        Turns until each path was back; 0 if it never was.
    corners : int
        Of one turn.
    typical : float
        Typical size of the unknowns.

    Returns
    -------
    ndarray, shape (n,)
        The smallest of all growing coordinates; not a number where there were no turns.
    """
    far = np.full(len(turns), np.nan)
    for m in np.unique(turns[turns > 0]).tolist():
        rows = np.flatnonzero(turns == m)
        chosen = np.zeros(len(turns), bool)
        chosen[rows] = True
        path = np.stack([x[chosen[active]] for active, x in walked[: corners * m]])
        order = np.maximum(np.rint(-exponents[rows] * m), 0).astype(np.int64)
        power = m // np.gcd(order, m)
        back = np.exp(-2j * np.pi * np.arange(1, len(path) + 1) / corners)[:, None, None] ** (order * power // m - 1)
        with np.errstate(all="ignore"):
            powers = (np.abs(path).min(axis=0) / path) ** power
            share = np.abs((powers * back).mean(axis=0)) / np.abs(powers).mean(axis=0)
            quotient = np.maximum(order * power // m, 1)
            size = np.abs(path).max(axis=0) * (share / quotient) ** (-order / m)
        share[~(size < FARTHEST * typical)] = 0.0
        share[order == 0] = np.inf
        smallest = share.min(axis=1)
        far[rows] = np.where(np.isfinite(smallest), smallest, 0.0)
    return far


def surround_one_point(
    walked: list[tuple[np.ndarray, np.ndarray]],
    mean: np.ndarray,
    turns: np.ndarray,
    corners: int,
    typical: float,
    radius: float,
) -> np.ndarray:
    """Whether loops go round the target and no other branch point, so that their means are limits there.

    On a path that winds m times x is an analytic function of s = r^(1/m). If the branch point lies at r = −ε instead,
    (r + ε)^(k/m) has negative powers of s: the first, s^(k−m), is εk/(rm) beside s^k. That is seen where the mean is a
    multiple root by accident, as it is where a curve of them passes. A pole s^(−m) = 1/r says nothing: where a curve of
    roots is one up to rounding only, paths drift along it like that.

    Parameters
    ----------
    walked : list of (rows, points)
        As :func:`constant_part` takes them.
    mean : ndarray, shape (n, unknowns)
    turns : ndarray, shape (n,)
        Turns until each path was back; paths with 0 are passed over, and with 1 there is no branch point to be seen.
    corners : int
        Of one turn.
    typical : float
        Typical size of the unknowns.
    radius : float
        Of the loops.

    Returns
    -------
    ndarray of bool, shape (n,)
    """
    single = turns == 1
    for m in np.unique(turns[turns > 1]).tolist():
        rows = np.flatnonzero(turns == m)
        chosen = np.zeros(len(turns), bool)
        chosen[rows] = True
        path = np.stack([x[chosen[active]] for active, x in walked[: corners * m]])
        seen = max(NEGATIVE, AT_TARGET / (radius * m))
        with np.errstate(all="ignore"):
            beside = (path - mean[rows]) / relative_weights(mean[rows], typical)
            powers = np.abs(np.fft.fft(beside, axis=0))[1 - m :].max(axis=(0, 2)) / len(path)
            reach = np.abs(beside).max(axis=(0, 2))
            single[rows] = powers <= np.maximum(seen * reach, LOOP_ROUNDING / reach + LOOP_ERROR)
    return single
