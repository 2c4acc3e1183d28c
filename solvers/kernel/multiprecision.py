"""The tracker of reference.py with ticks in Arb numbers of any precision: the last rung, for a few paths.

Step control stays in double precision, where it belongs. What gains digits is the tick: parameters, equations,
Jacobian and solution, and the iterate itself, which is carried from one Newton step to the next with all its
digits. A point that has been predicted afresh is a double again: predictions are never better than that.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from solvers.kernel.reference import Settings, Tracked, _Lanes
from solvers.tape import Program

#: Significant digits: twice those of double-double.
DIGITS = 64


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
    digits: int = DIGITS,
) -> Tracked:
    """Track paths as :func:`solvers.kernel.reference.track` does, with ticks of so many digits.

    Some thousand times slower than double precision: half a second for a path.

    Examples
    --------
    >>> from solvers.kernel.engine import make_engine
    >>> from solvers.graph import Builder
    >>> b = Builder(1, 1)
    >>> engine = make_engine(b, [b.sub(b.square(b.unknown(0)), b.parameter(0))], ([[1.0]], [1.0]))
    >>> done = track(engine.program, np.array([[1.0]]), np.array([2.0]), np.array([-1.0]))
    >>> bool(done.x[0, 0] == np.sqrt(2))
    True
    """
    from flint import ctx

    settings = (settings or Settings()).in_double_double()
    lanes = _PreciseLanes(program, x, base, direction, start, end, stop, settings, kind, bend)
    before = ctx.dps
    ctx.dps = digits
    try:
        while lanes.active.size:
            lanes.tick()
    finally:
        ctx.dps = before
    return lanes.result


class _PreciseLanes(_Lanes):
    """Lanes whose point keeps its digits between Newton steps."""

    def __init__(self, program: Program, *arguments: Any) -> None:
        super().__init__(program, *arguments)
        self.digits = np.full(self.x.shape, None, object)
        self.seen = np.full(self.x.shape, np.nan, np.complex128)

    def _solve(self) -> tuple[np.ndarray, np.ndarray]:
        dx, dr = np.full(self.x.shape, np.nan, np.complex128), np.full(self.x.shape, np.nan, np.complex128)
        for lane in range(self.x.shape[1]):
            if not np.isfinite(self.x[:, lane]).all():
                continue
            fresh = self.x[:, lane] != self.seen[:, lane]
            point = [_number(z) if new else kept for z, new, kept in zip(self.x[:, lane], fresh, self.digits[:, lane])]
            solved = _tick(self.program, point, *self._line(lane))
            if solved is None:
                continue
            step, dr[:, lane] = solved
            moved = [(a - b).mid() for a, b in zip(point, step)]
            self.digits[:, lane] = moved
            new = np.array([complex(z) for z in moved])
            dx[:, lane] = self.x[:, lane] - new
            # What the lane will hold when it has subtracted dx, to the last bit.
            self.seen[:, lane] = self.x[:, lane] - dx[:, lane]
        return dx, dr

    def _line(self, lane: int) -> tuple[list[Any], list[Any]]:
        """Parameters and velocities at the lane's place, with all digits."""
        r = _number(self.r[lane])
        base = [_number(z) for z in self.base[:, lane]]
        direction = [_number(z) for z in self.direction[:, lane]]
        if self.toric:
            values = [b * (r * d).exp() for b, d in zip(base, direction)]
            return values, [p * d for p, d in zip(values, direction)]
        if self.bend is not None:
            bend = _number(self.bend)
            along = r + bend * (1 - r)
            return [b + r / along * d for b, d in zip(base, direction)], [bend / along**2 * d for d in direction]
        return [b + r * d for b, d in zip(base, direction)], direction


def _number(z: Any) -> Any:
    from flint import acb

    return acb(float(np.real(z)), float(np.imag(z)))


def _tick(program: Program, point: list[Any], values: list[Any], velocities: list[Any]) -> Any:
    """Newton step (with its digits) and tangent (double); None where J is singular to this precision."""
    from flint import acb, acb_mat, arb, fmpq

    constants = [acb(*(arb(fmpq(part.numerator, part.denominator)) for part in number)) for number in program.constants]
    out = program.replay(point, values, velocities, constants)
    size = len(point)
    matrix = [[acb(0)] * size for _ in range(size)]
    for (i, j), value in zip(program.pattern.tolist(), out["J"]):
        matrix[i][j] = acb(value).mid()
    right = [[acb(f).mid(), -acb(ft).mid()] for f, ft in zip(out["F"], out["Ft"])]
    try:
        solved = acb_mat(matrix).solve(acb_mat(right), algorithm="approx")
    except ZeroDivisionError:
        return None
    return [solved[i, 0] for i in range(size)], [complex(solved[i, 1]) for i in range(size)]
