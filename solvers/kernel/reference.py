"""The tracker in NumPy: every path is a column, every column does the same work at each tick.

This is the method written once in plain sight. It needs no compiler, so it starts at once and runs anywhere;
the compiled kernel does the same with paths in SIMD lanes and is tested against it.

The path variable r runs from 1 to 0 along the line p(r) = base + r·direction of the parameters, or along the
toric path p(r) = base·exp(r·direction) of a polyhedral homotopy. One *tick* evaluates F, J and dF/dr at the
lane's trial point and solves J·dx = F and J·dr = -Ft. The tick serves as a Newton step; when the step is small
enough it serves as the tangent for the next prediction, so that no lane ever waits for another. At the end of
the line a lane goes on with Newton steps until they stop shrinking: the last one tells how well the end is known.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from solvers.tape import Program

# How a lane ended.
REACHED, PAUSED, STALLED, EXHAUSTED, DIVERGED = range(5)
STATUS = (
    "reached the end",
    "paused at the stop",
    "the step became too small",
    "too many steps",
    "the point ran to infinity",
)


@dataclass(frozen=True)
class Settings:
    """Constants of the step control.

    Attributes
    ----------
    contraction : float
        Largest accepted ratio of two successive Newton steps. The bound of Deuflhard's affine invariant theory
        for quadratic convergence is 1/4 per step.
    safety : float
        The predicted error is kept below the Newton radius for a step this many times longer. On the seven-pose
        trammel a contraction of 1/4 with a safety of 2 lets one path in 1,500 jump to another one, 0.125 with 2
        one in 20,000, 0.1 with 2.3 one in 400,000, for seven per cent more ticks.
    tolerance : float
        The correction ends when the next Newton step would be below it (relative to the unknowns).
    noise : float
        Newton steps of this size may be rounding errors.
    first_step, largest_step : float
        As fractions of the whole line from start to end; the first step is the smaller one of this and of a step
        that moves the unknowns by a few per cent.
    smallest_step : float
        Relative to r; below it double precision cannot tell the two ends of a step apart.
    ticks : int
        A path that has used so many is given up (retried elsewhere, never dropped).
    infinity : float
        A point farther away than this (in scaled unknowns) is given to the endgame as diverging.
    size : float
        Typical size of the unknowns; an engine fills it in from its samples.
    """

    contraction: float = 0.1
    safety: float = 2.3
    tolerance: float = 1e-7
    noise: float = 1e-6
    first_step: float = 0.05
    largest_step: float = 0.25
    smallest_step: float = 1e-11
    ticks: int = 4000
    infinity: float = 1e25
    size: float = math.inf

    def in_double_double(self) -> Settings:
        """The same for double-double numbers, where there is no noise to make allowance for.

        A point near infinity may hold what matters in the twelfth digit.
        """
        return replace(self, tolerance=1e-12, noise=1e-9, smallest_step=1e-15)

    def tighter(self) -> Settings:
        """The next rung of the ladder: half the contraction, shorter steps, more patience."""
        return replace(
            self,
            contraction=self.contraction / 2,
            safety=self.safety * 1.7,
            tolerance=self.tolerance / 10,
            largest_step=self.largest_step / 2.5,
            ticks=self.ticks * 3,
        )


@dataclass
class Tracked:
    """What a call of the tracker returns, one row a path.

    Attributes
    ----------
    x : ndarray, shape (paths, unknowns)
        Last accepted points.
    r : ndarray, shape (paths,)
        Where on the line they lie.
    tangent : ndarray, shape (paths, unknowns)
        dx/dr there.
    status : ndarray of int8
        An index into ``STATUS``.
    ticks, steps : ndarrays of int
    quality : ndarray, shape (paths,)
        Size of the last Newton step beside the unknowns. At a regular end it is the rounding error times the
        condition; near a singular one it stays large.
    """

    x: np.ndarray
    r: np.ndarray
    tangent: np.ndarray
    status: np.ndarray
    ticks: np.ndarray
    steps: np.ndarray
    quality: np.ndarray


#: Newton steps that stop shrinking below Settings.noise have met the rounding error of an ill-conditioned point.
#: They are good enough to go on from, where the next step would still be small by the curvature: ω·step below
#: this. Rejecting them would shorten the step again and again, to no avail.
HARMLESS = 0.01
#: The curvature is measured only with first Newton steps above so many times the noise: else it runs away.
ABOVE_NOISE = 10.0
#: A correction ends before its last step is seen only if the step before was below this, so that the tangent,
#: which is a Newton step older than the point, is good enough for the next prediction.
SMALL = 1e-3
#: Newton steps allowed after a prediction.
CORRECTIONS = 5
#: Newton steps allowed at the end of the line, and the size below which another one cannot help.
POLISHING, EXACT = 4, 1e-15
#: A polishing step that is not smaller than the one before by this factor has met rounding or a singularity.
SHRINKING = 0.25
#: On a toric path a step covers at most this part of r, until r falls below this part of 1 / largest exponent.
#: A parameter c·exp(-w·r) stays invisible until r is a few times 1/w; a step over all of that would not see it.
TORIC_PART = 0.5
#: How the parameters can move.
KINDS = ("line", "toric", "arc")
#: A start point that Newton's method has not confirmed after so many ticks is none.
START_TICKS = 8


def radius(contraction: np.ndarray | float) -> np.ndarray | float:
    """h(a) = 2a(sqrt(4a²+1) - 2a): the largest Newton-Kantorovich number that keeps the contraction a."""
    return 2 * contraction * (np.sqrt(4 * contraction**2 + 1) - 2 * contraction)


def track(
    program: Program,
    x: np.ndarray,
    base: np.ndarray,
    direction: np.ndarray,
    *,
    start: float = 1.0,
    end: float = 0.0,
    stop: float | None = None,
    settings: Settings | None = None,
    kind: str = "line",
    bend: complex = 1.0,
) -> Tracked:
    """Track paths from r = start down to r = end.

    Parameters
    ----------
    program : Program
        With outputs F, J and Ft.
    x : ndarray, shape (paths, unknowns)
        Solutions at `start`.
    base, direction : ndarray, shape (parameters,) or (paths, parameters)
    stop : float, optional
        Pause a path when it has come so far, unless its next step reaches `end` at once.
    kind : {"line", "toric", "arc"}
        p(r) = base + r·direction, or base·exp(r·direction) with a real direction, or base + s(r)·direction with
        s(r) = r / (r + bend·(1 - r)): a circular arc from 1 to 0 in the plane of s. Every complex `bend` gives
        another way between the same two parameters, which is what monodromy needs.

    Returns
    -------
    Tracked
    """
    settings = settings or Settings()
    lanes = _Lanes(program, x, base, direction, start, end, stop, settings, kind, bend)
    while lanes.active.size:
        lanes.tick()
    return lanes.result


class _Lanes:
    """The state of all lanes: columns of arrays."""

    def __init__(self, program, x, base, direction, start, end, stop, settings, kind, bend) -> None:
        self.program, self.settings, self.toric = program, settings, kind == "toric"
        self.bend = complex(bend) if kind == "arc" else None
        self.length = float(start) - float(end)
        self.end, self.stop = float(end), float(end if stop is None else stop)
        count, size = x.shape
        self.result = Tracked(
            x=np.array(x, np.complex128),
            r=np.full(count, float(start)),
            tangent=np.zeros((count, size), np.complex128),
            status=np.full(count, EXHAUSTED, np.int8),
            ticks=np.zeros(count, np.int64),
            steps=np.zeros(count, np.int64),
            quality=np.full(count, np.inf),
        )
        self.active = np.arange(count)
        parameters = len(np.atleast_1d(base).T)
        self.base = np.broadcast_to(np.atleast_2d(base), (count, parameters)).T.astype(np.complex128)
        self.direction = np.broadcast_to(np.atleast_2d(direction), (count, parameters)).T.astype(np.complex128)
        self.near = np.full(count, np.inf)
        if self.toric:
            self.near = TORIC_PART / np.maximum(np.abs(self.direction.real).max(axis=0), 1e-300)
        self.x = np.array(x.T, np.complex128)  # trial point
        self.r = np.full(count, float(start))
        self.h = np.zeros(count)
        self.accepted = np.array(x.T, np.complex128)
        self.tangent = np.zeros_like(self.x)
        self.r_accepted = np.full(count, float(start))
        self.before = np.array(x.T, np.complex128)
        self.tangent_before = np.zeros_like(self.x)
        self.h_before = np.zeros(count)
        self.omega = np.full(count, 1.0)
        self.iteration = np.zeros(count, np.int64)
        self.last = np.full(count, np.inf)  # size of the Newton step before this one
        self.first = np.zeros(count)  # size of the first Newton step
        self.rejected = np.zeros(count, bool)
        self.weights = self._weights(self.x)
        self.ticks = np.zeros(count, np.int64)
        self.steps = np.zeros(count, np.int64)
        self.polishing = np.zeros(count, np.int64)
        self.quality = np.full(count, np.inf)

    def _weights(self, x: np.ndarray) -> np.ndarray:
        """Relative scale of each unknown: its size, or a small part of the largest one.

        On its way to infinity an unknown must not drown the others, so what counts as small is bounded by the
        typical size of the unknowns.
        """
        size = np.abs(x)
        return np.maximum(size, np.maximum(1e-4 * np.minimum(size.max(axis=0), self.settings.size), 1e-30))

    def _solve(self) -> tuple[np.ndarray, np.ndarray]:
        with np.errstate(all="ignore"):
            if self.toric:
                parameters = self.base * np.exp(self.r * self.direction.real)
                velocity = parameters * self.direction.real
            elif self.bend is not None:
                d = self.r + self.bend * (1 - self.r)
                parameters = self.base + self.r / d * self.direction
                velocity = self.bend / d**2 * self.direction
            else:
                parameters, velocity = self.base + self.r * self.direction, self.direction
            out = self.program.replay(list(self.x), list(parameters), list(velocity))
            size, count = self.x.shape
            J = np.zeros((count, size, size), np.complex128)
            right = np.empty((count, size, 2), np.complex128)
            for (i, j), value in zip(self.program.pattern, out["J"]):
                J[:, i, j] = value
            for i in range(size):
                right[:, i, 0] = out["F"][i]
                right[:, i, 1] = -out["Ft"][i] if np.ndim(out["Ft"][i]) else -complex(out["Ft"][i])
            scale = 1 / np.maximum(np.abs(J).max(axis=2, keepdims=True), 1e-300)
            finite = np.isfinite(J).all(axis=(1, 2)) & np.isfinite(right).all(axis=(1, 2))
            J[~finite] = np.eye(size)
            try:
                solved = np.linalg.solve(J * scale, right * scale)
            except np.linalg.LinAlgError:
                J = J + 1e-290 * np.eye(size)
                solved = np.array([_solve_one(a, b) for a, b in zip(J * scale, right * scale)])
            solved[~finite] = np.nan
        return solved[:, :, 0].T, solved[:, :, 1].T

    def tick(self) -> None:
        s = self.settings
        dx, dr = self._solve()
        self.ticks += 1
        with np.errstate(all="ignore"):
            step = np.max(np.abs(dx) / self.weights, axis=0)
            ratio = step / self.last
            finite = np.isfinite(step)
            fresh = (self.iteration == 1) & (self.first > ABOVE_NOISE * s.noise) & finite
            self.omega = np.where(fresh, np.maximum(2 * step / self.first**2, 0.1), self.omega)
            stagnant = (self.iteration > 0) & (ratio > s.contraction)
            harmless = (step < s.noise) & (self.omega * step < HARMLESS)
            bad = ~finite | (stagnant & ~harmless)
            # Newton-Kantorovich: the first step alone tells that the majorant has no root.
            bad |= (self.iteration == 0) & (self.omega * step > 8 * radius(s.contraction)) & (self.steps > 0)
            # The size of the next step is foretold as ω/2·step²: it need not be computed to be known small.
            settled = (self.iteration > 0) & (step < SMALL) & (self.omega * step**2 < 2 * s.tolerance)
            good = ~bad & ((step < s.tolerance) | settled | (stagnant & harmless))
            bad |= ~good & (self.iteration >= CORRECTIONS)
            polishing = self.polishing > 0
            good, bad = good & ~polishing, bad & ~polishing
            shrunk = polishing & finite & (step < self.quality)
            finished = polishing & (
                ~finite | (step > SHRINKING * self.quality) | (step < EXACT) | (self.polishing >= POLISHING)
            )
            self.x = np.where(bad | polishing & ~shrunk, self.x, self.x - dx)
        self.accepted[:, shrunk] = self.x[:, shrunk]
        self.tangent[:, shrunk] = dr[:, shrunk]
        self.quality = np.where(good | polishing & finite, step, self.quality)
        self.polishing += polishing
        self.first = np.where(self.iteration == 0, step, self.first)
        self.last = np.where(good | bad, np.inf, step)
        theta = np.clip(ratio ** (1.0 / 2.0 ** np.maximum(self.iteration - 1, 0)), s.contraction / 2, 1e3)
        theta = np.where(finite & (self.iteration > 0), theta, 1e3)
        self.iteration = np.where(good | bad, 0, self.iteration + 1)
        if good.any():
            self._accept(good, dr)
        if bad.any():
            self._reject(bad, theta)
        self._retire(good, bad, finished)

    def _accept(self, good: np.ndarray, dr: np.ndarray) -> None:
        s = self.settings
        started = good & (self.steps > 0)
        with np.errstate(all="ignore"):
            error = self.first  # the first Newton step, but for a few per cent
            h, before = self.h, self.h_before
            cubic = before > 0
            order = np.where(cubic, h**2 * (h + before) ** 2, h**2)
            coefficient = np.maximum(error, 1e-14) / order
            budget = 0.1791 * (radius(s.contraction) / radius(0.125)) / np.maximum(self.omega, 0.1) / coefficient
            q = np.sqrt(budget)
            # solves (safety·h)²(safety·h + h)² = budget for the next step, with the last step behind it
            hermite = (-h + np.sqrt(h**2 + 4 * q)) / 2 / s.safety
            euler = np.minimum(np.sqrt(budget) / s.safety, h * 2)
            new = np.where(cubic, hermite, euler)
            new = np.minimum(new, np.where(self.rejected, h, 5 * h))
            new = np.minimum(new, np.maximum(TORIC_PART * self.r, self.near))
            new = np.where(started, np.minimum(new, s.largest_step * self.length), self._first_step(dr))
        for array, value in (
            (self.before, self.accepted),
            (self.tangent_before, self.tangent),
            (self.accepted, self.x),
            (self.tangent, dr),
        ):
            array[:, good] = value[:, good]
        self.h_before = np.where(good, np.where(started, self.h, 0.0), self.h_before)
        self.r_accepted = np.where(good, self.r, self.r_accepted)
        self.weights = np.where(good, self._weights(self.x), self.weights)
        self.omega = np.where(good, np.maximum(self.omega * 0.5, 0.1), self.omega)
        self.h = np.where(good, new, self.h)
        self.steps += good
        self.rejected &= ~good
        self._predict(good)

    def _first_step(self, tangent: np.ndarray) -> np.ndarray:
        """Move the unknowns by a few per cent at most."""
        with np.errstate(all="ignore"):
            speed = np.max(np.abs(tangent) / self.weights, axis=0)
            return np.minimum(0.03 / np.maximum(speed, 1e-30), self.settings.first_step * self.length)

    def _reject(self, bad: np.ndarray, theta: np.ndarray) -> None:
        a = self.settings.contraction
        with np.errstate(all="ignore"):
            top = np.sqrt(1 + 2 * radius(a / 2)) - 1
            factor = (top / (np.sqrt(1 + 2 * radius(theta)) - 1)) ** 0.25
        factor = np.clip(np.where(theta > 100, 0.25, factor), 0.1, 0.8)
        self.h = np.where(bad, self.h * factor, self.h)
        self.rejected |= bad
        self._predict(bad)

    def _predict(self, where: np.ndarray) -> None:
        """Cubic Hermite through the last two accepted points, Euler when there is one; clips at stop and end."""
        left = self.r_accepted - self.end
        to_stop = self.r_accepted - self.stop
        h = np.where(self.h >= left * 0.999, left, self.h)
        h = np.where((h < left) & (to_stop > 0) & (h >= to_stop * 0.999), to_stop, h)
        self.h = np.where(where, h, self.h)
        with np.errstate(all="ignore"):
            euler = self.accepted - h * self.tangent
            H = self.h_before
            u = h / np.where(H > 0, H, 1.0)
            # extrapolation of the cubic with values and slopes at r_accepted + H and r_accepted, slopes per -r
            slope, slope_before = -self.tangent * H, -self.tangent_before * H
            delta = self.accepted - self.before
            c2 = 2 * slope + slope_before - 3 * delta
            c3 = slope + slope_before - 2 * delta
            hermite = self.accepted + u * (slope + u * (c2 + u * c3))
            trial = np.where(H > 0, hermite, euler)
        self.x[:, where] = trial[:, where]
        place = np.where(h == to_stop, self.stop, self.r_accepted - h)
        self.r = np.where(where, np.where(h == left, self.end, place), self.r)

    def _retire(self, good: np.ndarray, bad: np.ndarray, finished: np.ndarray) -> None:
        s = self.settings
        self.polishing = np.where(good & (self.r_accepted <= self.end), 1, self.polishing)
        status = np.full(len(self.active), -1)
        status[self.ticks >= s.ticks] = EXHAUSTED
        status[
            bad
            & ((self.h < s.smallest_step * np.abs(self.r_accepted)) | (self.steps == 0) & (self.ticks > START_TICKS))
        ] = STALLED
        far = np.abs(self.accepted).max(axis=0) > s.infinity
        status[good & far] = DIVERGED
        status[good & (self.r_accepted <= self.stop) & (self.r_accepted > self.end)] = PAUSED
        status[finished] = REACHED
        done = status >= 0
        if not done.any():
            return
        where, result = self.active[done], self.result
        result.x[where] = self.accepted[:, done].T
        result.r[where] = self.r_accepted[done]
        result.tangent[where] = self.tangent[:, done].T
        result.status[where] = status[done]
        result.ticks[where] = self.ticks[done]
        result.steps[where] = self.steps[done]
        result.quality[where] = self.quality[done]
        keep = ~done
        self.active = self.active[keep]
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray) and name != "active":
                setattr(self, name, np.ascontiguousarray(value[..., keep]))


def _solve_one(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full_like(right, np.nan)
