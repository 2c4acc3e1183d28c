"""The curve of the trace test: roots over a line of parameters, cut by hyperbolas. See :mod:`solvers.trace`."""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers import parallel
from solvers.arithmetic import double_double
from solvers.arithmetic.double_double import DoubleDouble
from solvers.carry import carry, carry_each, random_bend
from solvers.from_sympy import program_from_sympy
from solvers.graph import Builder
from solvers.homotopy import parameter_homotopy
from solvers.kernel.engine import Engine
from solvers.legs import gaussian, sizes
from solvers.local import ORIGIN
from solvers.points import SAME, Group, PointSet, combined, pairs_of_equals
from solvers.refine import newton_double_double
from solvers.system import System, evaluate
from solvers.tracking import engine_of

#: With no more roots than this u is a random combination of all unknowns: the extra points cost little then.
FEW_ROOTS = 32
#: A point with t below this has come to the line t = 0.
ON_THE_LINE = 1e-7
#: Rounds along other arcs for points that were lost while s moved.
AGAIN = 8
#: Points whose sums a worker takes at once: what is known of them fits into its own memory.
AT_ONCE = 1024


class Curve:
    """The curve over a line of parameters, cut by hyperbolas: unknowns (x, t), parameters (p, v, τ, c, s).

    The test itself moves s alone. The line p + t·v moves only while points are looked for: a few points of the
    hyperbola lie far out, and loops of the hyperbola alone take very long to come by.
    """

    def __init__(
        self, system: System, parameters: np.ndarray, roots: np.ndarray, invariant: Any, rng: np.random.Generator
    ) -> None:
        n, m = roots.shape[1], len(parameters)
        builder = Builder(n + 1, 2 * m + 3)
        x, t = [builder.unknown(k) for k in range(n)], builder.unknown(n)
        values = [builder.add(builder.parameter(k), builder.multiply(t, builder.parameter(m + k))) for k in range(m)]
        equations = system.program.embed(builder, x, values)
        # The unknowns as parameters: u may be rational in them, and must not lose its denominator.
        self.u_of = program_from_sympy((invariant,), (), system.unknowns)[1] if invariant is not None else None
        self.weights, name = _functional(roots, system, rng)
        u = builder.total(
            x[k] if w == 1 else builder.multiply(builder.constant(w), x[k])
            for k, w in enumerate(self.weights.tolist())
            if w
        )
        if self.u_of is not None:
            u, name = self.u_of.embed(builder, [], x)[0], "the invariant"
        tau, c, s = (builder.parameter(2 * m + k) for k in range(3))
        hyperbola = builder.sub(builder.multiply(builder.sub(t, tau), builder.sub(u, c)), s)
        program = builder.finish({"F": [*equations, hyperbola]})
        heights = self.u(roots)
        spread = float(np.median(np.abs(heights))) or 1.0

        self._rng, self._sizes, self.count = rng, np.array([1.0, spread, spread]), m
        self._scale = sizes(parameters)
        size = max(float(np.abs(parameters).max()), 1e-300)
        direction = size * np.exp(2j * np.pi * rng.random(m))
        self.start = np.concatenate([roots, np.zeros((len(roots), 1))], axis=1)
        line = np.concatenate([parameters, direction])
        self.base = np.concatenate([line, self._hyperbola()])
        self.origin = np.concatenate([line, [0.0, self._hyperbola()[1], 0.0]])
        self.speed = np.zeros(2 * m + 3, np.complex128)
        self.speed[-1] = 0.3 * self._hyperbola()[2]
        self.moved = f"all parameters moved, u = {name}"
        self.typical = float(max(np.abs(self.start).max(), 1e-300))
        self.program = program
        self.engine: Engine = engine_of(parameter_homotopy(program, self.origin, self.base, self.start))

    def lift(self, symmetry: Any) -> Any:
        """A symmetry of the roots as one of the points (x, t)."""
        n, m = self.start.shape[1] - 1, self.count

        def lifted(points: np.ndarray, places: np.ndarray) -> np.ndarray:
            own = places[..., :m] + points[:, n:] * places[..., m : 2 * m]
            return np.concatenate([symmetry(points[:, :n], own), points[:, n:]], axis=1)

        return lifted

    def _hyperbola(self) -> np.ndarray:
        """Random τ, c and s, of a size in proportion to the curve's."""
        return np.asarray(0.5 * self._sizes * gaussian(self._rng, 3))

    def elsewhere(self) -> np.ndarray:
        """Another line of parameters and another hyperbola."""
        return np.concatenate([*(self._scale * gaussian(self._rng, 2, self.count)), self._hyperbola()])

    def u(self, points: np.ndarray) -> np.ndarray:
        """The function u at points (x, …)."""
        if self.u_of is None:
            return combined(points[:, : len(self.weights)], self.weights)
        return np.asarray(self.u_of.replay([], list(points.T[: self.u_of.parameters]))["F"][0])

    def move(self, points: np.ndarray, start: np.ndarray, end: np.ndarray, jobs: int = 1) -> np.ndarray:
        """Points carried along a straight line, with more care where they are lost; NaN where that fails too."""
        x, good = carry_each(self.engine, points, start, end, 1.0, jobs, typical=self.typical)
        return np.where(good[:, None], x, np.nan)

    def move_all(
        self, points: np.ndarray, target: np.ndarray, group: Group | None, jobs: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Points of the base carried straight to a target (NaN where lost), and all that are known there.

        When paths are lost on the way the whole set goes again along arcs, until as many points are known.
        """
        straight = self.move(points, self.base, target, jobs)
        known = PointSet(points.shape[1])
        ends = straight[np.isfinite(straight[:, 0])]
        known.add(ends if group is None else group.representatives(ends, target))
        for _ in range(AGAIN):
            if len(known) >= len(points):
                break
            bend = random_bend(self._rng)
            ends = carry(self.engine, points, self.base, target, bend, jobs, typical=self.typical, ladder=True)
            known.add(ends if group is None else group.representatives(ends, target))
        return straight, known.points

    def compare(self, points: np.ndarray, group: Group | None, jobs: int) -> tuple[bool, np.ndarray]:
        """Whether the points of a complete hyperbola fall back to just the roots given; roots beyond them.

        Monodromy finds the points of the hyperbola whether they belong to given roots or to others. Only when the
        hyperbola has become the pair of lines again do they part: t = 0 on the one, u = c on the other.
        """
        _, ends = self.move_all(points, self.origin, group, jobs)
        back = ends[np.abs(ends[:, -1]) < ON_THE_LINE]
        given = PointSet(points.shape[1], floor=ORIGIN * self.typical)
        given.add(self.start if group is None else group.representatives(self.start, self.origin))
        found = given.find(back)
        whole = len(ends) == len(points) and len(np.unique(found[found >= 0])) == len(given)
        return whole and bool(np.all(found >= 0)), back[found < 0, :-1]

    def residual(self, points: np.ndarray, group: Group | None, jobs: int, enough: float) -> float:
        """Second differences of the sums of u, t and ut as s moves, beside those of single points.

        What is below `enough` in double precision is found again in double-double: a root that hardly moves leaves a
        defect smaller than the rounding errors of those that move far.
        """
        paired, fibres = [self._heights(points)], [points]
        for k in (1, 2):
            straight, known = self.move_all(points, self.base + k * self.speed, group, jobs)
            paired.append(self._heights(straight))
            if len(known) != len(points):
                return float("inf")
            fibres.append(known)
        second = paired[0] - 2 * paired[1] + paired[2]
        size = np.maximum(np.sqrt(np.nansum(np.abs(second) ** 2, axis=1)), 1e-300)
        sums = [self._heights(known).sum(axis=1) for known in fibres]
        residual = float((np.abs(sums[0] - 2 * sums[1] + sums[2]) / size).max())
        if residual >= enough:
            return residual
        exact = self._exact_sums(fibres, jobs)
        return max(float(abs(complex(a - b - b + c)) / part) for a, b, c, part in zip(*exact, size))

    def _exact_sums(self, fibres: list[np.ndarray], jobs: int) -> list[list[DoubleDouble]]:
        """Sums of u, t and ut over the points where s has made 0, 1, … steps, in double-double."""
        parts = [(k, x[n : n + AT_ONCE]) for k, x in enumerate(fibres) for n in range(0, len(x), AT_ONCE)]
        sums = [[DoubleDouble(0)] * 3 for _ in fibres]
        found = dict(parallel.run(self._partial_sums, list(enumerate(parts)), jobs))
        for number, (k, _) in enumerate(parts):  # in order, so that the rounding does not depend on the workers
            sums[k] = [total + part for total, part in zip(sums[k], found[number])]
        return sums

    def _partial_sums(self, k: int, points: np.ndarray) -> list[DoubleDouble]:
        place = DoubleDouble(self.base) + DoubleDouble(k * self.speed)
        x, slopes = DoubleDouble(points), evaluate(self.engine.program, points, place.hi)[1]
        try:
            for _ in range(2):  # the first step gives most of the digits, the second what a large condition has cost
                F = double_double.replay(self.program, x, place)["F"]
                x = x - np.linalg.solve(slopes, F.hi[..., None])[..., 0]
        except np.linalg.LinAlgError:  # one of them is singular to all digits
            x, _ = newton_double_double(self.program, self.engine.program, DoubleDouble(points), place)
        t = x[:, -1]
        if self.u_of is None:
            weighted = x[:, : len(self.weights)] * DoubleDouble(self.weights)
            u = _total(DoubleDouble(weighted.hi.T, weighted.lo.T))
        else:
            own = x[:, : self.u_of.parameters]
            u = double_double.replay(self.u_of, DoubleDouble(np.zeros((len(points), 0))), own)["F"][:, 0]
        return [_total(part) for part in (u, t, u * t)]

    def _heights(self, points: np.ndarray) -> np.ndarray:
        """u, t and ut, shape (3, n)."""
        u, t = self.u(points), points[:, -1]
        return np.stack([u, t, u * t])


def _total(values: DoubleDouble) -> DoubleDouble:
    """The sum along the first axis, by halves."""
    hi, lo = values.hi, values.lo
    while len(hi) > 1:
        half = len(hi) // 2
        odd = DoubleDouble(hi[2 * half :], lo[2 * half :])
        both = DoubleDouble(hi[:half], lo[:half]) + DoubleDouble(hi[half : 2 * half], lo[half : 2 * half])
        hi, lo = np.concatenate([both.hi, odd.hi]), np.concatenate([both.lo, odd.lo])
    return DoubleDouble(hi[0], lo[0])


def _functional(roots: np.ndarray, system: System, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    """A function u of the unknowns that tells all roots apart, as weights, and its name."""
    n = roots.shape[1]
    if len(roots) > FEW_ROOTS:
        for k in range(n):
            if not len(pairs_of_equals(roots[:, k : k + 1], SAME)):
                return np.eye(1, n, k, dtype=complex)[0], str(system.unknowns[k])
    sizes = np.maximum(np.median(np.abs(roots), axis=0), 1e-6 * np.abs(roots).max())
    weights = np.exp(2j * np.pi * rng.random(n)) / np.where(sizes > 0, sizes, 1.0)
    return weights, "a combination of all unknowns"
