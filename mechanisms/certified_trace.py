"""Proof, in ball arithmetic, that a traced circuit is one connected piece of the configuration curve.

For each arc the chart G(y; τ) = [f(x + τt + y); t·y] is enclosed over the whole step τ ∈ [−δ, h + δ] and the
whole tube |y| ≤ r with Arb balls. Where the Krawczyk image

    −C [f(x) + f'(x)t τ + ½ f''(x + τt)[t, t] τ²] + (1 − C G'(x + τt + y)) y

lies inside the tube, exactly one arc of the curve passes through it, from end to end. The end of each arc
is then shown to lie in the tube of the next one (of the first one, turned by full turns, where the circuit
closes), so that the arcs are one curve and no tracing could have jumped. The linkage meant is the one whose
loop equations have exactly the coefficients of the :class:`~mechanisms.closure.Closure`, which are double
precision numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from mechanisms.curve import Circuit

#: Bits of the balls; twice double precision, so that only the width of the tubes matters.
PRECISION = 106
#: Overlap δ of consecutive tubes: larger than the box in which the end of an arc is known.
OVERLAP = 1e-8
#: Into how many pieces a step is cut when its tube cannot be proved at once (boxes are coarser than norms).
PIECES = (1, 2, 4, 8, 16)


@dataclass(frozen=True)
class TraceCertificate:
    """What was proved of a circuit.

    Attributes
    ----------
    arcs : int
        Number of arcs.
    failed : tuple of int
        Arcs whose tube could not be shown to hold one arc only, or whose end could not be shown to be in
        the next.
    """

    arcs: int
    failed: tuple[int, ...]

    @property
    def certified(self) -> bool:
        """True if the whole circuit is proved."""
        return not self.failed

    def __repr__(self) -> str:
        if self.certified:
            return f"TraceCertificate(all {self.arcs} arcs)"
        return f"TraceCertificate({self.arcs - len(self.failed)} of {self.arcs} arcs; not {self.failed[:5]})"


def certify_trace(circuit: Circuit) -> TraceCertificate:
    """Prove a circuit, arc by arc.

    Parameters
    ----------
    circuit : Circuit
        As :func:`mechanisms.curve.trace` gives it.

    Returns
    -------
    TraceCertificate

    Examples
    --------
    >>> from mechanisms.closure import Closure
    >>> from mechanisms.curve import trace
    >>> from mechanisms.linkage import Linkage
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> certify_trace(trace(Closure.of(four_bar))).certified
    True
    """
    import flint

    with flint.ctx.workprec(PRECISION):
        balls = _Balls(circuit, flint)
        failed = [arc for arc in range(circuit.arcs) if not balls.holds_one_arc(arc) or not balls.goes_on(arc)]
    return TraceCertificate(circuit.arcs, tuple(failed))


class _Balls:
    """The closure equations over Arb balls."""

    def __init__(self, circuit: Circuit, flint: Any) -> None:
        self.flint, self.circuit = flint, circuit
        closure = circuit.closure
        self.rotations, self.size = closure.rotations, closure.size
        self.matrix = [[_complex(flint, z) for z in row] for row in closure.matrix]
        self.slides = [[_complex(flint, z) for z in row] for row in closure.slides]
        self.constant = [_complex(flint, z) for z in closure.constant]
        self.slide_class = [int(k) for k in closure.slide_class]
        self.gears = [[int(g) for g in row] for row in closure.gears]

    def turned(self, x: list[Any]) -> list[Any]:
        """Return e^{iq} for the rotations in x, with the ground's 1 at the end."""
        flint = self.flint
        units = [flint.acb(q.cos(), q.sin()) for q in x[: self.rotations]]
        return [*units, flint.acb(1)]

    def residual(self, x: list[Any]) -> list[Any]:
        """Return f(x); gears modulo 2π, with the number of turns of the midpoint."""
        e, s = self.turned(x), x[self.rotations :]
        rows = []
        for l, total in enumerate(self.constant):
            for k, z in enumerate(self.matrix[l]):
                total = total + z * e[k]
            for j, z in enumerate(self.slides[l]):
                total = total + z * e[self.slide_class[j]] * s[j]
            rows += [total.real, total.imag]
        turn = 2 * self.flint.arb.pi()
        for gear in self.gears:
            angle = sum((g * q for g, q in zip(gear, x)), self.flint.arb(0))
            rows.append(angle - turn * round(float((angle / turn).mid())))
        return rows

    def jacobian(self, x: list[Any]) -> list[list[Any]]:
        """Return f'(x)."""
        flint, zero = self.flint, self.flint.acb(0)
        e, s = self.turned(x), x[self.rotations :]
        rows = []
        for l in range(len(self.constant)):
            line = [z * e[k] for k, z in enumerate(self.matrix[l])] + [zero]
            tail = []
            for j, z in enumerate(self.slides[l]):
                k = self.slide_class[j]
                tail.append(z * e[k])
                line[k] = line[k] + tail[j] * s[j]
            # d/dq e^{iq} = i e^{iq}: real part −Im, imaginary part Re.
            rows.append([-z.imag for z in line[:-1]] + [z.real for z in tail])
            rows.append([z.real for z in line[:-1]] + [z.imag for z in tail])
        for gear in self.gears:
            rows.append([flint.arb(g) for g in gear] + [flint.arb(0)] * len(self.slide_class))
        return rows

    def holds_one_arc(self, arc: int) -> bool:
        """Krawczyk's test over the whole tube of an arc, if need be in pieces of the step."""
        h = float(self.circuit.step[arc])
        for pieces in PIECES:
            cuts = np.linspace(-OVERLAP, h + OVERLAP, pieces + 1)
            if all(self._holds(arc, low, high) for low, high in pairwise(cuts)):
                return True
        return False

    def _holds(self, arc: int, low: float, high: float) -> bool:
        """Krawczyk's test for τ in [low, high], all pieces with the same tube |y| ≤ r."""
        flint, c = self.flint, self.circuit
        x, r = c.x[arc], float(c.radius[arc])
        middle = c.at(arc + max(0.0, 0.5 * (low + high)) / c.step[arc])[0]
        chart = _Preconditioned(self, np.linalg.inv(np.vstack([c.closure.jacobian(middle), c.tangent[arc]])))
        point = [flint.arb(float(v)) for v in x]
        tangent = [flint.arb(float(v)) for v in c.tangent[arc]]
        reach = _between(flint, min(low, 0.0), high)
        tau = _between(flint, low, high)
        squares = sorted((low * low, high * high))
        half_square = _between(flint, 0.0 if low <= 0 else squares[0] / 2, squares[1] / 2)
        bend = chart.curvature([p + reach * d for p, d in zip(point, tangent)], tangent)
        base = chart.inverse * flint.arb_mat([[v] for v in [*self.residual(point), flint.arb(0)]])
        climb = flint.arb_mat(self.jacobian(point)) * flint.arb_mat([[d] for d in tangent])
        along = chart.inverse * flint.arb_mat([*climb.tolist(), [flint.arb(0)]])
        shift = [base[i, 0] + along[i, 0] * tau + bend[i] * half_square for i in range(self.size)]
        tube = [p + tau * d + flint.arb(0, r) for p, d in zip(point, tangent)]
        return self._inside(shift, chart.jacobian(tube, tangent), r)

    def _inside(self, shift: Any, slope: Any, r: float) -> bool:
        """Whether |shift| + |1 − slope| r < r in every coordinate."""
        for i in range(self.size):
            spread = self.flint.arb(0)
            for j in range(self.size):
                spread += abs((1 if i == j else 0) - slope[i][j])
            if not abs(shift[i]) + spread * r < r:
                return False
        return True

    def goes_on(self, arc: int) -> bool:
        """Show that the end of an arc lies on the arc of the next tube."""
        flint, c = self.flint, self.circuit
        following = arc + 1
        if following == c.arcs:
            if not c.closed:
                return True
            following = 0
        end = self._end(arc)
        if end is None:
            return False
        turn = 2 * flint.arb.pi()
        gap = []
        for j, (p, start) in enumerate(zip(end, c.x[following])):
            d = p - flint.arb(float(start))
            if j < self.rotations:
                d = d - turn * round(float((d / turn).mid()))
            gap.append(d)
        tangent = [flint.arb(float(v)) for v in c.tangent[following]]
        tau = sum((g * t for g, t in zip(gap, tangent)), flint.arb(0))
        h, r = float(c.step[following]), float(c.radius[following])
        inside = tau > -OVERLAP and tau < h + OVERLAP
        return bool(inside and all(abs(g - tau * t) < r for g, t in zip(gap, tangent)))

    def _end(self, arc: int) -> list[Any] | None:
        """Return a small box that holds the end (τ = h) of an arc, by Krawczyk round the next node."""
        flint, c = self.flint, self.circuit
        t, h = c.tangent[arc], float(c.step[arc])
        node = c.x[arc + 1]
        origin = c.x[arc]
        tangent = [flint.arb(float(v)) for v in t]
        point = [flint.arb(float(v)) for v in node]
        radius = 1e-9 * h
        box = [p + flint.arb(0, radius) for p in point]
        chart = _Preconditioned(self, np.linalg.inv(np.vstack([c.closure.jacobian(node), t])))
        last = sum((d * (p - flint.arb(float(o))) for d, p, o in zip(tangent, point, origin)), -flint.arb(h))
        shift = chart.inverse * flint.arb_mat([[v] for v in [*self.residual(point), last]])
        slope = chart.jacobian(box, tangent)
        return box if self._inside([row[0] for row in shift.tolist()], slope, radius) else None


class _Preconditioned:
    """C times the derivatives of the equations, with C multiplied into the coefficients before any ball is
    turned.

    Row i of C meets loop l as Re(γ̄_il · loop_l) with γ_il = C[i, 2l] + i C[i, 2l+1]; summing over the
    loops first keeps what cancels between them.
    """

    def __init__(self, balls: _Balls, inverse: np.ndarray) -> None:
        flint, loops = balls.flint, len(balls.constant)
        self.balls, self.inverse = balls, flint.arb_mat(inverse.tolist())
        gamma = [[_complex(flint, complex(row[2 * l], -row[2 * l + 1])) for l in range(loops)] for row in inverse]
        zero = flint.acb(0)
        self.matrix, self.slides = (
            [[sum((g * table[l][k] for l, g in enumerate(row)), zero) for k in range(width)] for row in gamma]
            for table, width in ((balls.matrix, balls.rotations), (balls.slides, len(balls.slide_class)))
        )

    def jacobian(self, x: list[Any], tangent: list[Any]) -> list[list[Any]]:
        """Return C G'(y) at x, the chart's own row t·y included."""
        balls, flint = self.balls, self.balls.flint
        e, s = balls.turned(x), x[balls.rotations :]
        loops = len(balls.constant)
        rows = []
        for i, (turned, slid) in enumerate(zip(self.matrix, self.slides)):
            line = [*turned, flint.acb(0)]
            for j, z in enumerate(slid):
                line[balls.slide_class[j]] += z * s[j]
            row = [-(z * e[k]).imag for k, z in enumerate(line[:-1])]
            row += [(z * e[balls.slide_class[j]]).real for j, z in enumerate(slid)]
            for g, gear in enumerate(balls.gears):
                for k, teeth in enumerate(gear):
                    row[k] += self.inverse[i, 2 * loops + g] * teeth
            rows.append([v + self.inverse[i, balls.size - 1] * t for v, t in zip(row, tangent)])
        return rows

    def curvature(self, x: list[Any], v: list[Any]) -> list[Any]:
        """Return C f''(x)[v, v]."""
        balls, flint = self.balls, self.balls.flint
        e, s, vs = balls.turned(x), x[balls.rotations :], v[balls.rotations :]
        w = [*v[: balls.rotations], flint.arb(0)]
        rows = []
        for turned, slid in zip(self.matrix, self.slides):
            total = flint.acb(0)
            for k, z in enumerate(turned):
                total -= z * e[k] * w[k] ** 2
            for j, z in enumerate(slid):
                k = balls.slide_class[j]
                total += z * e[k] * flint.acb(-s[j] * w[k] ** 2, 2 * vs[j] * w[k])
            rows.append(total.real)
        return rows


def _complex(flint: Any, z: complex) -> Any:
    return flint.acb(float(z.real), float(z.imag))


def _between(flint: Any, low: float, high: float) -> Any:
    return flint.arb((low + high) / 2, (high - low) / 2 * (1 + 1e-15) + 1e-300)
