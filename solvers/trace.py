"""The trace test: is a set of roots at generic parameters complete?

Let the parameters move on a line p + t·v. The roots trace a curve in the space of (x, t), and with u a function
of x they draw a plane curve in (u, t). Cut it with the hyperbolas (t - τ)(u - c) = s. At s = 0 the hyperbola is a
pair of lines: the line t = τ meets the curve in the roots that are wanted, the line u = c in some others, which
are found by monodromy as τ, c and s move. As s alone moves at constant speed, the sums of u, of t and of ut over
all the points move at constant speed too, and over no proper part of them do (Leykin, Rodriguez, Sottile, "Trace
test", *Arnold Math. J.* 4, 2018; Brake, Hauenstein, Liddell, *Numer. Algorithms* for the multihomogeneous case).
One missing point shows: its own second difference is the defect.

A complete hyperbola is carried back to the pair of lines at last. The points that come to the line t = τ are all the
roots there are; the test passes only if they are the ones that were given.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.from_sympy import program_from_sympy
from solvers.homotopy import parameter_homotopy
from solvers.kernel.engine import Engine
from solvers.kernel.reference import REACHED, Settings
from solvers.points import Group, PointSet
from solvers.system import System
from solvers.tape import Builder
from solvers.tracking import engine_of

#: Residuals below this pass. Complete sets show about 1e-10, sets with a missing point about one over the square
#: root of their size.
PASS = 1e-6
#: With no more roots than this all parameters move on the line, and u is a random combination of all unknowns. With
#: more roots one parameter moves and u is the first unknown: the plane curve has a lower degree then, but may fall
#: apart, or be run through twice, where the system falls apart; the test of a part of the roots can pass there, which
#: loops of monodromy that have moved all parameters make unlikely when there are many roots.
FEW_ROOTS = 24
#: A point with t below this has come to the line t = 0.
ON_THE_LINE = 1e-7
#: Legs of monodromy for the points of the other line.
MOST_LEGS = 60
#: A point has arrived when the last Newton step is below this, relative.
LAST_STEP = 1e-8
#: Rounds along other arcs for points that were lost while s moved.
AGAIN = 8
#: Two quiet legs and a failed test so many times in a row end the search: points are missing for good.
PATIENCE = 12


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
    """

    passed: bool
    residual: float
    points: int
    paths: int
    extra: np.ndarray


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
    from solvers.monodromy import _Node, _Search

    if group is not None and invariant is None:
        roots, group = group.members(roots, parameters), None
    rng = np.random.default_rng([seed, 17])
    curve = _Curve(system, parameters, roots, invariant, rng)
    if group is not None:
        group = Group([curve.lift(generator) for generator in group.generators], curve.start[:1], curve.origin)
    first = curve.move(curve.start, curve.origin, curve.base)
    first = first[np.isfinite(first[:, 0])]
    columns = roots.shape[1] + 1
    nodes = [_Node(place, PointSet(columns)) for place in (curve.base, curve.slice(1.0))]
    nodes[0].roots.add(first if group is None else group.representatives(first, curve.base))
    search = _Search(curve.engine, nodes, group, rng, jobs, "threads", curve.typical)
    quiet = failures = 0
    residual = np.inf
    while len(search.history) < MOST_LEGS and failures < PATIENCE:
        leg = search.leg(len(search.history) % 2)
        if progress is not None:
            progress("trace test", leg.known, max(leg.known, round(min(leg.estimate, 1e9))))
        if len(search.history) % 2:
            continue
        # The points of the other line lie far and wide: each round goes by way of another hyperbola.
        nodes[1] = _Node(curve.slice(10 ** rng.uniform(0.0, 3.0)), PointSet(columns))
        quiet = quiet + 1 if leg.new == 0 else 0
        if leg.new > 0.001 * leg.known:
            continue
        residual = curve.residual(nodes[0].roots.points, group)
        if residual < PASS:
            break
        failures += quiet > 0
    passed, extra = residual < PASS, np.zeros((0, columns - 1))
    if passed or len(roots) <= FEW_ROOTS:  # what was met is worth telling even if the sums do not agree
        same, extra = curve.compare(nodes[0].roots.points, group)
        passed = passed and same
    return Trace(bool(passed), float(residual), len(nodes[0].roots), search.tracked, extra)


class _Curve:
    """The curve over a line of parameters, cut by hyperbolas: unknowns (x, t), parameters (τ, c, s)."""

    def __init__(
        self, system: System, parameters: np.ndarray, roots: np.ndarray, invariant: Any, rng: np.random.Generator
    ) -> None:
        n, m = roots.shape[1], len(parameters)
        builder = Builder(n + 1, 3)
        x, t = [builder.unknown(k) for k in range(n)], builder.unknown(n)
        direction = np.zeros(m, np.complex128)
        size = max(float(np.abs(parameters).max()), 1e-300)
        moving = [rng.integers(m)] if len(roots) > FEW_ROOTS else slice(None)
        direction[moving] = size * np.exp(2j * np.pi * rng.random(m))[moving]
        self.parameters, self.direction = parameters, direction
        values = []
        for p, v in zip(parameters.tolist(), direction.tolist()):
            node = builder.constant(p)
            values.append(builder.add(node, builder.multiply(t, builder.constant(v))) if v else node)
        equations = system.program.embed(builder, x, values)
        # The unknowns as parameters: u may be rational in them, and must not lose its denominator.
        self.u_of = program_from_sympy((invariant,), (), system.unknowns)[1] if invariant is not None else None
        u, self.weights = x[0], np.eye(1, n, dtype=complex)[0]
        if len(roots) <= FEW_ROOTS:
            sizes = np.maximum(np.median(np.abs(roots), axis=0), 1e-6 * np.abs(roots).max())
            self.weights = np.exp(2j * np.pi * rng.random(n)) / np.where(sizes > 0, sizes, 1.0)
            u = builder.total(builder.multiply(builder.constant(w), x[k]) for k, w in enumerate(self.weights.tolist()))
        if self.u_of is not None:
            u = self.u_of.embed(builder, [], x)[0]
        tau, c, s = (builder.parameter(k) for k in range(3))
        hyperbola = builder.sub(builder.multiply(builder.sub(t, tau), builder.sub(u, c)), s)
        program = builder.finish({"F": [*equations, hyperbola]})
        heights = self.u(roots)
        spread = float(np.median(np.abs(heights))) or 1.0

        self._rng, self._sizes = rng, np.array([1.0, spread, spread])
        self.start = np.concatenate([roots, np.zeros((len(roots), 1))], axis=1)
        self.base = self.slice(0.5)
        self.origin = np.array([0.0, self.slice(0.5)[1], 0.0], np.complex128)
        self.step = 0.3 * self.slice(0.5)[2]
        self.typical = float(np.abs(self.start).max())
        self.engine: Engine = engine_of(parameter_homotopy(program, self.origin, self.base, self.start))

    def lift(self, symmetry: Any) -> Any:
        """A symmetry of the roots as one of the points (x, t)."""
        n = self.start.shape[1] - 1

        def lifted(points: np.ndarray, slices: np.ndarray) -> np.ndarray:
            own = self.parameters + points[:, n:] * self.direction
            return np.concatenate([symmetry(points[:, :n], own), points[:, n:]], axis=1)

        return lifted

    def slice(self, scale: float) -> np.ndarray:
        """A random hyperbola (τ, c, s), of a size in proportion to the curve's."""
        z = (self._rng.normal(size=3) + 1j * self._rng.normal(size=3)) / np.sqrt(2)
        return np.asarray(scale * self._sizes * z)

    def u(self, points: np.ndarray) -> np.ndarray:
        """The function u at points (x, …)."""
        if self.u_of is None:
            return np.asarray(points[:, : len(self.weights)] @ self.weights)
        return np.asarray(self.u_of.replay([], list(points.T[: self.u_of.parameters]))["F"][0])

    def move(self, points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        """Points carried along a straight line, with more digits where they are lost; NaN where that fails too."""
        done = self.engine.track(points, end, start - end, settings=Settings())
        lost = np.flatnonzero((done.status != REACHED) | (done.quality > LAST_STEP))
        if lost.size:
            careful = Settings().tighter()
            again = self.engine.track(points[lost], end, start - end, settings=careful, arithmetic="double-double")
            good = (again.status == REACHED) & (again.quality < LAST_STEP)
            done.x[lost] = np.where(good[:, None], again.x, np.nan)
        return done.x

    def move_all(self, points: np.ndarray, target: np.ndarray, group: Group | None) -> tuple[np.ndarray, np.ndarray]:
        """Points of the base carried straight to a target (NaN where lost), and all that are known there.

        When paths are lost on the way the whole set goes again along arcs, until as many points are known.
        """
        from solvers.monodromy import carry, random_bend

        straight = self.move(points, self.base, target)
        known = PointSet(points.shape[1])
        ends = straight[np.isfinite(straight[:, 0])]
        known.add(ends if group is None else group.representatives(ends, target))
        for _ in range(AGAIN):
            if len(known) >= len(points):
                break
            bend = random_bend(self._rng)
            ends = carry(self.engine, points, self.base, target, bend, typical=self.typical)
            known.add(ends if group is None else group.representatives(ends, target))
        return straight, known.points

    def compare(self, points: np.ndarray, group: Group | None) -> tuple[bool, np.ndarray]:
        """Whether the points of a complete hyperbola fall back to just the roots given; roots beyond them.

        Monodromy finds the points of the hyperbola whether they belong to given roots or to others. Only when the
        hyperbola has become the pair of lines again do they part: t = 0 on the one, u = c on the other.
        """
        _, ends = self.move_all(points, self.origin, group)
        back = ends[np.abs(ends[:, -1]) < ON_THE_LINE]
        given = PointSet(points.shape[1])
        given.add(self.start if group is None else group.representatives(self.start, self.origin))
        found = given.find(back)
        whole = len(ends) == len(points) and len(np.unique(found[found >= 0])) == len(given)
        return whole and bool(np.all(found >= 0)), back[found < 0, :-1]

    def residual(self, points: np.ndarray, group: Group | None) -> float:
        """Second differences of the sums of u, t and ut as s moves, beside those of single points."""
        paired, sums = [self._heights(points)], [self._heights(points).sum(axis=1)]
        for k in (1, 2):
            target = self.base + np.array([0, 0, k * self.step])
            straight, known = self.move_all(points, target, group)
            paired.append(self._heights(straight))
            if len(known) != len(points):
                return float("inf")
            sums.append(self._heights(known).sum(axis=1))
        second = paired[0] - 2 * paired[1] + paired[2]
        size = np.sqrt(np.nansum(np.abs(second) ** 2, axis=1))
        defect = np.abs(sums[0] - 2 * sums[1] + sums[2])
        return float((defect / np.maximum(size, 1e-300)).max())

    def _heights(self, points: np.ndarray) -> np.ndarray:
        """u, t and ut, shape (3, n)."""
        u, t = self.u(points), points[:, -1]
        return np.stack([u, t, u * t])
