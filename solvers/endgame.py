"""What happens near the target: finite, singular, or at infinity.

Most paths walk straight to r = 0. The others end on a singular root or at infinity, where the step control
would shrink without end. They are tracked to a shrinking sequence of radii, and at each one led once round r = 0
on an octagon, again and again until they come back to where they began. The number of turns is the winding
number m; along the loops x is an analytic function of s = r^(1/m), so its mean over the loops is its value at
r = 0 (Cauchy's integral, with an error of order r^8; Morgan, Sommese, Wampler, *Numer. Math.* 58, 1991). Finite
and infinite ends are treated alike by working in the chart of the largest coordinate: 1/x_j has a mean that is
zero, and m times its exponent is the order of the pole.

Nothing is decided on one radius: two in a row must agree on m and on the limit. That 1/x_j has a mean of zero proves
little: the reciprocals of roots far out that lie on a circle have one too. But a power of it, the first that comes back
after one turn, has at r = 0 the value zero only if all of them are at infinity. Its mean is known to rounding.
"""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from solvers.ends import FAILED, INFINITE, PRECISE, REGULAR, SINGULAR, Ends, fingerprints
from solvers.kernel.reference import DIVERGED, PAUSED, REACHED, STATUS, Settings
from solvers.limits import AGREE, EXACT, ROUNDING, VANISHES, Refined, Target, constant_part, surround_one_point
from solvers.local import CONFIRMED, ORIGIN, newton, newton_step, relative_weights
from solvers.tape import Program

#: The first radius: beyond it, a path that has not arrived is looked at.
FIRST_RADIUS = 0.01
#: No loop is worth its cost at a larger radius than this: most paths that have not arrived are on a regular course
#: past a branch point nearby; until then the radius shrinks in longer strides.
FIRST_LOOP, STRIDE = 2e-4, 0.1
#: Ratio of successive radii. Small enough that the error r^8 falls by a million between them.
SHRINK = 0.2
#: Corners of the loop.
CORNERS = 8
#: Winding numbers looked for: seldom is one larger than the first, and loops that do not close cost the more the longer
#: they are. Paths that are still undecided at EXPONENTS_DECIDE go round up to the second number of times: 252 of the
#: 5040 paths of cyclic-7 by total degree wind 126 times round a point at infinity.
LARGEST_WINDING, MOST_WINDINGS = 24, 192
#: A loop is closed when the path is back at its start to this precision, relative.
CLOSED = 1e-6
#: With winding number m the distance from the limit falls like r^(k/m), k ≥ 1; at least like r^(NEARER/m) it must.
NEARER = 0.8
#: A mean of 1/x_j below this, agreed on by two radii, is zero.
POLE = 1e-10
#: Exponents alone send nothing to infinity that is nearer than this, in typical sizes of the unknowns: with exponents
#: of −1/9 they have grown a hundredfold at r = 1e-18, and may turn yet.
FAR_ENOUGH = 1e4
#: Below this radius exponents that have settled decide alone, for paths that wind more often than is looked for …
EXPONENTS_DECIDE = 1e-9
#: … and those of paths that do close must be k/m to this precision, times m.
RATIONAL = 0.1
#: A coordinate with an exponent below this goes to infinity: 1/24 is the smallest that a short loop could show.
INFINITE_EXPONENT = -0.04
#: Exponents that change by less than this from one radius to the next have settled for good.
STILL = 0.002
#: A root whose scaled condition number is below this is regular. Above, a path on its way to a multiple root may
#: be taken for one that has arrived: double-double decides.
TRUSTED = 1e6
#: A path may go straight to r = 0 when its tangent moves it by less than this, relative …
SHORT_WAY = 0.1
#: … and the first Newton steps there shrink by this factor each.
STRONG = 0.2
#: The local exponents d log x / d log r must have settled this well before a loop is worth its cost.
SETTLED = 0.15
#: The way left to a regular end shrinks with the radius itself, that to a root with winding number m like r^(1/m):
#: an exponent above this, between 1/2 and 1, says that no loop is needed …
REGULAR_COURSE = 0.75
#: … unless Newton's method has refused to go there so many times.
REFUSALS = 4
#: The way left is measured beside this part of the largest coordinate: one that goes to zero must not hide it.
BESIDE = 1e-2


def finish(
    engine: Any,
    equations: Program,
    x: np.ndarray,
    target: np.ndarray,
    direction: np.ndarray,
    settings: Settings,
    smallest: float = 1e-13,
    first_loop: float = FIRST_LOOP,
    deepest: float = 1.0,
) -> Ends:
    """Track paths from r = 1 to their ends.

    Parameters
    ----------
    engine : object with a method ``track`` and a ``program`` with outputs F and J
    equations : Program
        Output F.
    x : ndarray, shape (paths, unknowns)
        Solutions at r = 1.
    target, direction : ndarray, shape (parameters,)
    smallest : float
        The smallest radius at which the parameters can be told from the target's.
    first_loop : float
        The largest radius at which a loop is tried.
    deepest : float
        Where the arithmetic of the tracker is more precise than doubles: the smallest radius that it sees. Below
        `smallest` there are no loops, and exponents decide alone.
    """
    count = len(x)
    ends = Ends(
        x=np.array(x, np.complex128),
        kind=np.full(count, FAILED, np.int8),
        winding=np.zeros(count, np.int64),
        condition=np.full(count, np.inf),
        ticks=np.zeros(count, np.int64),
    )
    if not count:
        return ends
    walk = _Walk(engine, equations, target, direction, settings, ends, precise=deepest < smallest)
    radius = FIRST_RADIUS
    rows, points = walk.advance(np.arange(count), ends.x, 1.0, radius)
    if rows.size:
        there = newton(walk.program, points, target + radius * direction, walk.typical, steps=2)[0]
        ends.mark[rows] = fingerprints(there, ORIGIN * walk.typical)
    while rows.size and radius > min(smallest, deepest):
        if radius < first_loop:
            rows, points = walk.look(rows, points, radius, radius > smallest)
        if not rows.size:
            break
        shrink = SHRINK if radius < first_loop else STRIDE
        rows, points = walk.advance(rows, points, radius, radius * shrink, shrink)
        radius *= shrink
    ends.leaving[:] = walk.exponents.min(axis=1) < INFINITE_EXPONENT
    for row in rows.tolist():
        ends.why[row] = f"undecided at r = {radius:.1e}: its limit does not settle in double precision"
    return ends


class _Walk:
    """Paths on their last stretch, with what earlier radii have told about each."""

    def __init__(self, engine, equations, target, direction, settings, ends: Ends, precise: bool) -> None:
        self.engine, self.settings, self.ends = engine, settings, ends
        self.precise = precise  # whether points are known to more than double precision
        # A corner of a loop is short: most are turned in one step.
        self.round = replace(settings, first_step=1.0, largest_step=1.0)
        self.program, self.typical = engine.program, engine.size
        self.target, self.direction = target, direction
        self.limits = Target(equations, self.program, target, self.typical)
        count, size = ends.x.shape
        self.exponents = np.full((count, size), np.nan)
        self.mean = np.full((count, size + 1), np.nan + 0j)
        self.turns = np.zeros(count, np.int64)
        self.vanishing = np.full(count, np.nan)
        self.distance = np.full(count, np.nan)
        self.way = np.full(count, np.nan)
        self.refusals = np.zeros(count, np.int64)

    # -- on the real line -----------------------------------------------------------------------------------
    def advance(
        self, rows: np.ndarray, points: np.ndarray, r: float, to: float, shrink: float = SHRINK
    ) -> tuple[np.ndarray, np.ndarray]:
        """Track to the next radius; a path whose step reaches r = 0 is done if its end is regular."""
        done = self.engine.track(points, self.target, self.direction, start=r, end=0.0, stop=to, settings=self.settings)
        self.ends.ticks[rows] += done.ticks
        arrived = done.status == REACHED
        if arrived.any():
            good = self._regular(rows[arrived], done.x[arrived], done.x[arrived])
            again = np.flatnonzero(arrived)[~good]
            if again.size:  # an ill-conditioned end: go back and stop at the radius
                redo = self.engine.track(
                    points[again], self.target, self.direction, start=r, end=to, settings=self.settings
                )
                for name in ("x", "r", "tangent", "status"):
                    getattr(done, name)[again] = getattr(redo, name)
                done.status[again[redo.status == REACHED]] = PAUSED
        paused = done.status == PAUSED
        lost = ~paused & (done.status != REACHED)
        far = done.status == DIVERGED
        if far.any():
            # No path passes so near to infinity and comes back: it is on its way there with a large exponent.
            whole = np.abs(done.x[far]).max(axis=1, keepdims=True)
            self._close(rows[far], done.x[far] / whole, np.zeros(int(far.sum()), np.int64), INFINITE)
            lost &= ~far
        for row, status, where in zip(rows[lost], done.status[lost], done.r[lost]):
            self.ends.why[int(row)] = f"{STATUS[status]} at r = {where:.3e}"
        self.ends.x[rows[lost]] = done.x[lost]
        rows, points, slope = rows[paused], done.x[paused], to * done.tangent[paused]
        with np.errstate(all="ignore"):
            largest = np.abs(points).max(axis=1, keepdims=True)
            size = np.maximum(relative_weights(points, self.typical), BESIDE * largest)
            way = (np.abs(slope) / size).max(axis=1, initial=0.0)
        shorter = way < shrink**REGULAR_COURSE * self.way[rows]
        self.way[rows] = way
        stay = ~self._jump(rows, points, slope, way)
        rows, points, slope = rows[stay], points[stay], slope[stay]
        self.regular_course = shorter[stay] & (self.refusals[rows] < REFUSALS)
        with np.errstate(all="ignore"):
            exponents = np.where(points == 0, 0.0, (slope / points).real)  # an unknown may be zero all the way
        change = np.abs(exponents - self.exponents[rows]).max(axis=1)
        self.settled = change < SETTLED
        self.still = change < STILL
        self.exponents[rows] = exponents
        return rows, points

    def _jump(self, rows: np.ndarray, points: np.ndarray, slope: np.ndarray, way: np.ndarray) -> np.ndarray:
        """Go to r = 0 along the tangent where that is a short way and Newton's method confirms it strongly."""
        near = np.flatnonzero(way < SHORT_WAY)
        jumped = np.zeros(len(rows), bool)
        if not near.size:
            return jumped
        x = first = points[near] - slope[near]
        sizes, noise = [], np.zeros(len(near))
        for _ in range(2):
            step, size, condition = newton_step(self.program, x, self.target, self.typical)
            sizes.append(size)
            noise = ROUNDING * condition
            x = x - step
        good = (sizes[0] < STRONG * way[near] + noise) & (sizes[1] < STRONG * sizes[0] + noise)
        good[good] = self._regular(rows[near[good]], x[good], first[good], STRONG * way[near[good]])
        jumped[near[good]] = True
        self.refusals[rows[near[~good]]] += 1
        return jumped

    def _regular(self, rows: np.ndarray, points: np.ndarray, first: np.ndarray, reach: Any = 0.0) -> np.ndarray:
        """Whether points are the regular ends of paths that led to `first`, as near as `reach` (relative)."""
        polished, size, condition = newton(self.program, points, self.target, self.typical)
        good = (condition < TRUSTED) & (size < CONFIRMED)
        self.ends.x[rows[good]] = polished[good]
        self.ends.condition[rows[good]] = condition[good]
        self.ends.kind[rows[good]] = REGULAR
        unsure = np.flatnonzero(~good & np.isfinite(condition))
        if unsure.size:
            if self.precise:  # in double precision Newton's method has lost what the path knew
                reach = np.broadcast_to(reach, len(rows))[unsure] + EXACT
                limits = self.limits.refine(first[unsure], reach)
            else:
                limits = self.limits.refine(polished[unsure])
            self._close_simple(rows[unsure], limits, limits.simple)
            good[unsure] = limits.simple
        return good

    # -- round the circle -----------------------------------------------------------------------------------
    def look(
        self, rows: np.ndarray, points: np.ndarray, radius: float, loops: bool = True
    ) -> tuple[np.ndarray, np.ndarray]:
        """Loop the paths whose exponents have settled; return those that stay undecided."""
        ripe = np.flatnonzero(self.settled & ~self.regular_course & loops)
        decided = np.zeros(len(rows), bool)
        if ripe.size:
            turns, mean, distance, order, walked = self._loop(points[ripe], radius, rows[ripe])
            known = self.mean[rows[ripe]]
            with np.errstate(all="ignore"):
                change = np.abs(mean - known).max(axis=1)
                agree = change < AGREE
                # The path must come nearer, too: the mean of a cluster may happen to be one of its roots.
                nearer = distance < self.distance[rows[ripe]] * SHRINK ** (NEARER / np.maximum(turns, 1))
            agree &= (turns > 0) & (turns == self.turns[rows[ripe]])
            self.mean[rows[ripe]], self.turns[rows[ripe]], self.distance[rows[ripe]] = mean, turns, distance
            at_infinity = agree & (order > 0) & (np.abs(mean[:, -1]) < POLE)
            wanted = at_infinity | (radius < EXPONENTS_DECIDE)
            self.vanishing[rows[ripe]] = constant_part(
                walked, self.exponents[rows[ripe]], np.where(wanted, turns, 0), CORNERS, self.typical
            )
            at_infinity &= self.vanishing[rows[ripe]] < VANISHES
            at_infinity[at_infinity] = self.limits.is_infinite(mean[at_infinity, :-1])
            finite = agree & (order == 0) & (np.abs(mean[:, -1]) >= POLE) & (nearer | (distance < AGREE))
            self._close(rows[ripe[at_infinity]], mean[at_infinity, :-1], turns[at_infinity], INFINITE)
            decided[ripe[at_infinity]] = True
            if finite.any():
                ends = mean[finite, :-1] / mean[finite, -1:]
                where = ripe[finite]
                singular, self.ends.condition[rows[where]] = self.limits.is_singular(ends, change[finite])
                doubtful = np.flatnonzero(singular)
                if doubtful.size:
                    alone = turns[finite][doubtful] == 1
                    refined = self.limits.refine(ends[doubtful])
                    self._close_simple(rows[where[doubtful]], refined, refined.simple & alone)
                    decided[where[doubtful[refined.simple & alone]]] = True
                    # The mean of a path that winds round it can be a simple root too, the middle one of three, or
                    # lie among them.
                    singular[doubtful[refined.beside]] = False
                closing = np.zeros(len(ripe), np.int64)
                closing[np.flatnonzero(finite)[singular]] = turns[finite][singular]
                limit = np.zeros_like(mean[:, :-1])
                limit[finite] = ends
                singular &= surround_one_point(walked, limit, closing, CORNERS, self.typical, radius)[finite]
                self._close(rows[where[singular]], ends[singular], turns[finite][singular], SINGULAR)
                decided[where[singular]] = True
        if radius < EXPONENTS_DECIDE:
            # Exponents are multiples of 1/m: a path that only looks settled on its way to a far root has others.
            exponents = self.exponents[rows]
            steps = exponents * self.turns[rows, None]
            rational = np.abs(steps - np.rint(steps)).max(axis=1) < RATIONAL
            leaving = ~decided & self.still & rational & (exponents.min(axis=1) < INFINITE_EXPONENT)
            leaving &= ~(self.vanishing[rows] > VANISHES) & self._is_far(rows, points)
            whole = np.abs(points[leaving]).max(axis=1, keepdims=True)
            self._close(rows[leaving], points[leaving] / whole, np.zeros(int(leaving.sum()), np.int64), INFINITE)
            decided |= leaving
        return rows[~decided], points[~decided]

    def _is_far(self, rows: np.ndarray, points: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs(points).max(axis=1) > FAR_ENOUGH * self.typical)

    def _close(self, rows: np.ndarray, x: np.ndarray, turns: np.ndarray, kind: int) -> None:
        self.ends.x[rows], self.ends.winding[rows], self.ends.kind[rows] = x, turns, kind

    def _close_simple(self, rows: np.ndarray, limits: Refined, own: np.ndarray) -> None:
        self.ends.condition[rows[own]] = PRECISE if self.precise else limits.condition[own]
        self.ends.x[rows[own]] = limits.points[own]
        self.ends.kind[rows[own]] = REGULAR

    def _loop(
        self, points: np.ndarray, radius: float, rows: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[tuple[np.ndarray, np.ndarray]]]:
        """Loops round r = 0: turns until closed (0: not closed), and in the chart of the largest coordinate the
        mean, the distance of the point from it, and the order of the pole. Last, which paths came to
        each corner, and where they were."""
        count = len(points)
        pick = np.arange(count)
        chart = np.argmax(np.abs(_homogeneous(points)), axis=1)

        def charted(x: np.ndarray, which: np.ndarray) -> np.ndarray:
            whole = _homogeneous(x)
            return whole / whole[np.arange(len(x)), chart[which]][:, None]

        first, weights = charted(points, pick), relative_weights(points, self.typical)
        total = np.zeros_like(first)
        turns = np.zeros(count, np.int64)
        active, x = pick, points
        walked: list[tuple[np.ndarray, np.ndarray]] = []
        corners = radius * np.exp(2j * np.pi * np.arange(CORNERS + 1) / CORNERS)
        corners[-1] = corners[0]
        for turn in range(1, (LARGEST_WINDING if radius >= EXPONENTS_DECIDE else MOST_WINDINGS) + 1):
            for a, b in itertools.pairwise(corners):
                done = self.engine.track(
                    x,
                    self.target + b * self.direction,
                    (a - b) * self.direction,
                    settings=self.round,
                )
                self.ends.ticks[rows[active]] += done.ticks
                alive = done.status == REACHED
                active, x = active[alive], done.x[alive]
                # The first corner counts when it is come back to: it has been corrected then.
                total[active] += charted(x, active)
                walked.append((active, x))
                if not active.size:
                    break
            if not active.size:
                break
            # Each unknown beside its own size: in the chart, points far out hardly differ.
            back = (np.abs(x - points[active]) / weights[active]).max(axis=1) < CLOSED
            turns[active[back]] = turn
            active, x = active[~back], x[~back]
            if not active.size:
                break
        mean = total / (CORNERS * np.maximum(turns, 1))[:, None]
        exponents = np.concatenate([self.exponents[rows], np.zeros((count, 1))], axis=1)
        distance = np.abs(first - mean).max(axis=1)
        return turns, mean, distance, np.rint(-exponents[pick, chart] * turns), walked


def _homogeneous(x: np.ndarray) -> np.ndarray:
    """(x, 1): a point of projective space."""
    return np.concatenate([x, np.ones((len(x), 1))], axis=1)
