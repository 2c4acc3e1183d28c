"""The trace test: is a set of roots at generic parameters complete?

Let the parameters move on a line p + t·v. The roots trace a curve in the space of (x, t), and with u a function
of x they draw a plane curve in (u, t). Cut it with the hyperbolas (t - τ)(u - c) = s. At s = 0 the hyperbola is a
pair of lines: the line t = τ meets the curve in the roots that are wanted, the line u = c in some others, which
are found by monodromy. As s alone moves at constant speed, the sums of u, of t and of ut over all the points move
at constant speed too, and over no proper part of them do (Leykin, Rodriguez, Sottile, "Trace test", *Arnold Math.
J.* 4, 2018; Brake, Hauenstein, Liddell, *Numer. Algorithms* for the multihomogeneous case). One missing point
shows: its own second difference is the defect.

All parameters move, in a random direction: over such a line roots hang together that hang together at all. If a
single one moved the curve would have a lower degree, but it may fall apart, and a part of the roots pass. What u must
do is tell the roots apart. A random combination of all unknowns does, but meets the curve in five times as many
points as one of the unknowns; when there are many roots the first unknown is taken that tells those apart which are
given. One root out of each pair with equal u could still pass for all, so the roots are first led round some
loops, from which they must all come back to roots that were given.

The points of the other line are looked for by loops that move the line p + t·v as well as the hyperbola. Loops of the
hyperbola alone seldom come by the points that lie far out: after sixty legs some dozens of 23,000 were still missing.

A root that hardly moves beside others leaves a small defect: 1e-7 of the whole where it has a condition of 1e9, or lies
a million times farther out than the rest. So sums that agree in double precision are taken again in double-double,
where those of a complete set agree to twenty digits and more.

A complete hyperbola is carried back to the pair of lines at last. The points that come to the line t = τ are all the
roots there are; the test passes only if they are the ones that were given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.homotopy import parameter_homotopy
from solvers.legs import Node, Search, gaussian, sizes
from solvers.local import ORIGIN
from solvers.points import Group, PointSet
from solvers.system import System
from solvers.trace_curve import Curve
from solvers.tracking import engine_of

#: Residuals below this pass. Complete sets show 1e-30 to 1e-24 in double-double, sets with a missing point about one
#: over the square root of their size; 1e-7 where that point hardly moves.
PASS = 1e-13
#: Residuals above this, in double precision, are no rounding error: sums in double-double are not asked for.
NEARLY_PASS = 1e-4
#: Loops on which the roots must meet no others before the sums are asked: at least, at most, and as many as make so
#: many paths. Each loop meets a missing root with a chance of about a half.
LOOPS, LOOP_PATHS = (6, 20), 20_000
#: Legs of monodromy for the points of the other line.
MOST_LEGS = 80
#: The sums are looked at after a leg with a smaller share of news than this: they cost less than another leg.
NEARLY = 1e-3
#: When they disagree after so many legs without any, the loops go on by way of another place.
QUIET_LEGS = 2
#: So many sums that disagree after quiet legs end the search: points are missing for good.
PATIENCE = 6


@dataclass(frozen=True)
class Trace:
    """Result of a trace test.

    Attributes
    ----------
    passed : bool
    residual : float
        Second difference of the sums beside those of the single points.
    points : int
        Points of the curve on the hyperbola.
    paths : int
        Paths tracked.
    extra : ndarray, shape (k, unknowns)
        Roots that were not among those given: the points of the hyperbola, carried back to the pair of lines,
        lead to all roots, and the test may have met more than it was given.
    moved : str
        What moved, and what u was, in words.
    """

    passed: bool
    residual: float
    points: int
    paths: int
    extra: np.ndarray
    moved: str = ""

    def __str__(self) -> str:
        verdict = "passed" if self.passed else "failed"
        return f"trace test {verdict} (residual {self.residual:.1e}, {self.points} points, {self.moved})"


def trace_test(
    system: System,
    parameters: np.ndarray,
    roots: np.ndarray,
    seed: int = 0,
    jobs: int = 1,
    invariant: Any = None,
    group: Group | None = None,
    progress: Callable[[str, int, int], None] | None = None,
) -> Trace:
    """Test whether `roots` are all the roots of a system at generic parameters.

    Parameters
    ----------
    system : System
    parameters : ndarray, shape (parameters,)
        Generic complex values.
    roots : ndarray, shape (n, unknowns)
    invariant : SymPy expression, optional
        The function u. By default the first unknown, which makes few points on the other line where it is a
        design unknown, or a random combination of all unknowns when there are few roots.
    group : Group, optional
        Roots are representatives of its orbits. With an invariant u the orbits are tested, else all their members.

    Returns
    -------
    Trace
    """
    if group is not None and invariant is None:
        roots, group = group.members(roots, parameters), None
    rng = np.random.default_rng([seed, 17])
    extra, paths = _round_loops(system, parameters, roots, group, rng, jobs)
    if len(extra):
        return Trace(False, float("inf"), 0, paths, extra, "loops of all parameters led to other roots")
    curve = Curve(system, parameters, roots, invariant, rng)
    if group is not None:
        group = Group([curve.lift(generator) for generator in group.generators], curve.start[:1], curve.origin)
    first = curve.move(curve.start, curve.origin, curve.base)
    first = first[np.isfinite(first[:, 0])]
    columns = roots.shape[1] + 1
    floor = ORIGIN * curve.typical
    nodes = [Node(place, PointSet(columns, floor=floor)) for place in (curve.base, curve.elsewhere())]
    nodes[0].roots.add(first if group is None else group.representatives(first, curve.base))
    search = Search(curve.engine, nodes, group, int(rng.integers(2**31)), jobs, "threads", curve.typical, ladder=True)
    quiet = failures = 0
    residual = np.inf
    while len(search.history) < MOST_LEGS and failures < PATIENCE:
        leg = search.leg(len(search.history) % 2)
        known = [len(node.roots) for node in nodes]
        if progress is not None:
            progress("trace test", max(known), max(max(known), round(min(leg.estimate, 1e9))))
        quiet = 0 if leg.new or known[0] != known[1] else quiet + 1
        if leg.new > NEARLY * leg.known or known[0] < known[1]:
            continue
        residual = curve.residual(nodes[0].roots.points, group, jobs, NEARLY_PASS)
        if residual < PASS:
            break
        if quiet >= QUIET_LEGS:
            failures, quiet = failures + 1, 0
            nodes[1] = Node(curve.elsewhere(), PointSet(columns, floor=floor))
    same, extra = curve.compare(nodes[0].roots.points, group, jobs)
    passed = bool(residual < PASS and same)
    return Trace(passed, float(residual), len(nodes[0].roots), paths + search.tracked, extra, curve.moved)


def _round_loops(
    system: System,
    parameters: np.ndarray,
    roots: np.ndarray,
    group: Group | None,
    rng: np.random.Generator,
    jobs: int,
) -> tuple[np.ndarray, int]:
    """Roots beyond those given that loops of the parameters lead to, and the number of paths."""
    columns = roots.shape[1]
    typical = float(max(np.abs(roots).max(), 1e-300))
    known = PointSet(columns, floor=ORIGIN * typical)
    known.add(roots if group is None else group.representatives(roots, parameters))
    given = len(known)
    engine = engine_of(parameter_homotopy(system.program, parameters, parameters, roots))
    nodes = [Node(parameters, known), Node(parameters, known)]
    search = Search(engine, nodes, group, int(rng.integers(2**31)), jobs, "threads", typical, ladder=True)
    loops = int(np.clip(LOOP_PATHS / (2 * given), *LOOPS))
    while len(search.history) < 2 * loops and len(known) == given:
        nodes[1] = Node(sizes(parameters) * gaussian(rng, len(parameters)), PointSet(columns, floor=known.floor))
        search.leg(0)
        search.leg(1)
    return known.points[given:], search.tracked
