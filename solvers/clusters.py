"""Multiple roots and clusters of simple ones, told apart by as many digits as it takes.

Four roots a millionth apart look like one of multiplicity four to 32 digits: the last of them decides. What is one
equation in one unknown for them is found by the reduction of Lyapunov and Schmidt: where the Jacobian has a kernel of
dimension one, spanned by v, with cokernel b, the equations F(x) = s·b and w·(x − c) = t have one solution (x, s) for
every small t, and it is well-conditioned. The roots near c are the zeros of s(t). On a circle round them the integrals

    Σ t_i^k = (1/2πi) ∮ t^k s'(t)/s(t) dt = (1/N) Σ t^(k+1) s'(t)/s(t)  at N points

give their number and their power sums (L. M. Delves, J. N. Lyness, *A numerical method for locating the zeros of an
analytic function*, Math. Comp. 21, 1967), and these a polynomial with just these zeros. If they have a common place, to
more digits than double-double would have, the root is multiple, and known to full accuracy. If not, and Krawczyk's test
proves a simple root for each and all of them distinct, these take the place of the singular end.

Where the kernel is larger nothing of this is needed: on the way to four or eight roots about a point at which the whole
Jacobian nearly vanishes paths part at larger radii, and the ladder tells all of them apart.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import comb
from typing import Any

import numpy as np

from solvers.arithmetic import balls
from solvers.arithmetic.values import exact_parameters
from solvers.certify import certify
from solvers.local import in_own_units
from solvers.simple_ends import with_roots_added
from solvers.solutions import Singular, Solutions
from solvers.system import System
from solvers.tape import Exact

__all__ = ["with_clusters_resolved"]

#: From this multiplicity on there can be a cluster that double-double has taken for one root …
FEWEST = 3
#: … or from 2 on, where all numbers are exact. Rounded ones make two roots 1e-8 apart of every double root, and the
#: double root is what was meant.
FEWEST_EXACT = 2
#: A binary fraction with a denominator beyond this is a decimal number, or a result, that has been rounded.
SHORT = 2**20
#: The circle round a cluster, relative to the unknowns. Clusters are a thousand times smaller, other roots farther out.
RADIUS = 2.0**-10
#: Points on it, and bits: what a cluster of size 1e-6 loses by N points is 1e-3^N, and so it is for roots at 1.
POINTS, BITS = 48, 512
#: Newton steps for one point; the first is off by the distance of two points, and each doubles the digits.
STEPS = 14
#: Zeros that agree to this part of the circle are one: six of them are known to the sixth root of what POINTS leaves.
TOGETHER = 1e-15
#: Added to the constant of the polynomial: it makes multiple zeros simple, which Arb can isolate, and moves none as far
#: as TOGETHER. What is lost on the way to the polynomial is smaller still.
NUDGE = 1e-100
#: Bits at which the proof that the roots are simple and distinct gives up.
PROOF_BITS = 1024


def with_clusters_resolved(system: System, solutions: Solutions) -> Solutions:
    """The same solutions, with singular ends that are clusters of simple roots resolved into these.

    Parameters
    ----------
    system : System
        A square one; solutions of others are given back as they are.
    solutions : Solutions

    Returns
    -------
    Solutions
        ``paths`` holds −1 for a root that has come out of a cluster. Multiple roots that have been looked at are known
        to full accuracy. The certificate is made anew if there was one.

    Examples
    --------
    >>> from sympy import Rational, prod, symbols
    >>> from solvers import solve
    >>> x = symbols("x")
    >>> near = prod(x - 1 - k * Rational(1, 10**6) for k in range(4))
    >>> sorted(solve(System([near.expand()], [x]), start="total-degree").points.real.ravel().round(9).tolist())
    [1.0, 1.000001, 1.000002, 1.000003]
    """
    ends = solutions.singular
    rows, unknowns = system.size
    wanted = (ends.multiplicity >= FEWEST_EXACT) & (ends.winding > 1) & (ends.dimension == 1)
    if rows != unknowns or not wanted.any():
        return solutions
    exact = exact_parameters(system, solutions.parameters)
    if not _are_exact([*system.program.constants, *exact]):
        wanted &= ends.multiplicity >= FEWEST
    points, kept = ends.points.copy(), np.ones(len(ends), bool)
    simple, multiple, degrees = [points[:0]], [points[:0]], [ends.multiplicity[:0]]
    for k in np.flatnonzero(wanted).tolist():
        reduction = _Reduction(system, exact, ends.points[k], solutions.parameters)
        found, degree = reduction.roots(int(ends.multiplicity[k]))
        if len(found) == 1:
            points[k] = found[0]
        elif len(found):
            proof = certify(system, found[degree == 1], solutions.parameters, max_bits=PROOF_BITS)
            if proof.distinct == len(proof):
                kept[k] = False
                simple.append(proof.boxes.midpoints)
                multiple.append(found[degree > 1])
                degrees.append(degree[degree > 1])
    fresh, more = np.concatenate(simple), np.concatenate(degrees)
    singular = Singular(
        np.concatenate([points[kept], *multiple]),
        np.concatenate([ends.multiplicity[kept], more]),
        np.concatenate([ends.winding[kept], more]),  # where s(t) has a zero of order m, t^m and r go to zero together
        np.concatenate([ends.dimension[kept], np.ones_like(more)]),
    )
    if not len(fresh):
        return replace(solutions, singular=singular)
    return with_roots_added(system, solutions, fresh, singular)


def _are_exact(numbers: Iterable[Exact]) -> bool:
    """Whether none of them looks like a rounded number.

    >>> from fractions import Fraction
    >>> from solvers.arithmetic.values import exact_value
    >>> [_are_exact([exact_value(number)]) for number in (3, 0.25, Fraction(1, 10), 0.1)]
    [True, True, True, False]
    """
    parts = {part.denominator for number in numbers for part in number}
    return all(part < SHORT or part & (part - 1) for part in parts)


@dataclass(frozen=True, eq=False)
class _Bordered:
    """The equations F(x) = s·b, w·(x − c) = t, in Arb's numbers."""

    program: Any
    parameters: tuple[Any, ...]
    constants: list[Any]
    centre: list[Any]
    b: list[Any]
    w: list[Any]

    def solve(self, start: list[Any], t: Any) -> tuple[list[Any], Any, Any] | None:
        """(x, s, ds/dt) at one t, from a guess (x, s); None if Newton's method does not converge."""
        from flint import ctx

        n = len(self.centre)
        z, last = list(start), np.inf
        for _ in range(STEPS):
            out = balls.replay(self.program, z[:n], self.parameters, self.constants)
            matrix = balls.dense(out["J"], self.program.pattern.tolist(), (n + 1, n + 1))
            for i in range(n):
                matrix[i, n], matrix[n, i] = -self.b[i], self.w[i]
            right = [f - z[n] * b for f, b in zip(out["F"], self.b)]
            right.append(sum(w * (x - c) for w, x, c in zip(self.w, z, self.centre)) - t)
            both = [[value.mid(), int(i == n)] for i, value in enumerate(right)]
            try:
                step = matrix.mid().solve(type(matrix)(both), algorithm="approx")
            except ZeroDivisionError:
                return None
            z = [(value - step[i, 0]).mid() for i, value in enumerate(z)]
            length = max(float(abs(step[i, 0]).upper()) for i in range(n))
            if not length < last and length > 2.0 ** (-ctx.prec / 2):
                return None
            last = length
            if length < 2.0 ** (-0.8 * ctx.prec):  # the slope is only as exact as the step is short
                return z[:n], z[n], step[n, 1]
        return None


class _Reduction:
    """One equation s(t) = 0 for the roots near a point where the Jacobian has a kernel of dimension one."""

    def __init__(self, system: System, exact: tuple[Any, ...], point: np.ndarray, values: np.ndarray) -> None:
        self.program, self.exact = system.jacobian_program, exact
        (scaled,), (weights,), (rows,) = in_own_units(self.program, point[None], values)[1:]
        left, _, right = np.linalg.svd(scaled)
        self.point = point
        self.b, self.w, self.v = left[:, -1] * rows, right[-1] / weights, right[-1].conj() * weights

    def roots(self, multiplicity: int) -> tuple[np.ndarray, np.ndarray]:
        """The roots in the circle and the multiplicity of each; none if these do not add up to what is given."""
        from flint import ctx

        with ctx.workprec(BITS):
            bordered = self._bordered()
            sums = self._power_sums(bordered, multiplicity)
            if sums is None or abs(complex(sums[0]) - multiplicity) > TOGETHER:
                return np.zeros((0, len(self.point)), complex), np.zeros(0, np.int64)
            found, degrees = [], []
            for t, degree in _zeros(sums):
                solved = bordered.solve([*bordered.centre, 0 * t], t)
                if solved is not None:
                    found.append([complex(value) for value in solved[0]])
                    degrees.append(degree)
        if sum(degrees) < multiplicity:
            found, degrees = [], []
        return np.array(found).reshape(-1, len(self.point)), np.array(degrees, np.int64)

    def _bordered(self) -> _Bordered:
        from flint import acb

        constants = [balls.ball(value) for value in self.program.constants]
        vectors = ([acb(z) for z in vector] for vector in (self.point, self.b, self.w))
        return _Bordered(self.program, self.exact, constants, *vectors)

    def _power_sums(self, bordered: _Bordered, largest: int) -> list[Any] | None:
        """Σ t_i^k for k = 0, …, largest over the zeros in the circle."""
        from flint import acb

        sums = [acb(0)] * (largest + 1)
        z: list[Any] = [acb(a + RADIUS * v) for a, v in zip(self.point, self.v)] + [acb(0)]
        for k in range(POINTS):
            t = RADIUS * (acb(2 * k) / POINTS).exp_pi_i()
            solved = bordered.solve(z, t)
            if solved is None:
                return None
            x, s, slope = solved
            z = [*x, s]
            part = t * slope / s / POINTS
            for power in range(largest + 1):
                sums[power] = (sums[power] + part).mid()
                part = part * t
        return sums


def _zeros(sums: list[Any]) -> list[tuple[Any, int]]:
    """The numbers with given power sums (their number first), and how often each is among them."""
    from flint import acb, acb_poly

    count = len(sums) - 1
    mean = (sums[1] / count).mid()
    # Power sums about the mean, in units of the circle, and from them a polynomial by Newton's identities.
    central = [
        (sum(comb(k, j) * sums[j] * (-mean) ** (k - j) for j in range(k + 1)) / RADIUS**k).mid()
        for k in range(count + 1)
    ]
    if all(float(abs(c)) < TOGETHER**k for k, c in enumerate(central) if k > 1):
        return [(mean, count)]
    e = [acb(1)]
    for k in range(1, count + 1):
        e.append((sum((-1) ** (i - 1) * e[k - i] * central[i] for i in range(1, k + 1)) / k).mid())
    e[-1] = (e[-1] + NUDGE).mid()
    try:
        zeros = acb_poly([(-1) ** k * e[k] for k in range(count, -1, -1)]).roots(tol=NUDGE, maxprec=64 * BITS)
    except ValueError:  # Arb cannot isolate them
        return []
    groups: list[list[Any]] = []
    for zero in zeros:
        near = [group for group in groups if float(abs(group[0] - zero).mid()) < TOGETHER]
        if near:
            near[0].append(zero)
        else:
            groups.append([zero])
    return [((mean + RADIUS * sum(group) / len(group)).mid(), len(group)) for group in groups]
