"""The real configuration curve of a linkage with one degree of freedom, traced whole, without a jump.

A :class:`Circuit` is one connected piece of the curve: a chain of short arcs, each inside a tube that holds
this arc and nothing else (see :mod:`mechanisms.tube`). Whether a configuration is on the circuit is
therefore decided, not guessed: it is in one of the tubes or it is not on this circuit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.linkage import LinkageError

#: Nodes of one trace. A four-bar has about 25, a six-bar 200, one of extreme dimensions thousands.
#: thousands.
ROOM = 100_000
#: Relative slack for round-off when asking whether a configuration is in a tube.
ROUND_OFF = 1e-7

#: Residual of a configuration that rounding alone explains.
EXACT = 2e-15
#: A rate below this all along a circuit is zero: the link does not move on it (a kite folded on its crank).
STILL = 1e-9
#: Length that an open trace may lose at the end where it is begun again; beyond it waits a double point.
TAIL = 1e-5

ENDS = ("closed", "goes to infinity", "ends in a double point", "is longer than the room for it")


@dataclass(frozen=True, eq=False)
class Circuit:
    """One circuit: nodes x with unit tangents, and for each arc from a node to the next its step and tube.

    Attributes
    ----------
    closure : Closure
    x, tangent, bend : (nodes, n) float arrays
        Configurations, unit tangents, second derivatives by arc length.
    step, radius : (nodes − 1,) float arrays
        Length h of the chart of each arc, and radius of its tube in the maximum norm.
    closed : bool
        A closed circuit ends where it starts (its last node is the first one, plus full turns of links).
    ends : (str, str)
        How the trace ended at its beginning and its end, ``"closed"`` twice when it closed.

    Examples
    --------
    >>> from mechanisms.linkage import Linkage
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> circuit = trace(Closure.of(four_bar))
    >>> circuit.closed
    True
    >>> [round(float(turns), 9) for turns in circuit.turns()]  # the crank goes round, the others rock
    [1.0, 0.0, 0.0]
    """

    closure: Closure
    x: np.ndarray
    tangent: np.ndarray
    bend: np.ndarray
    step: np.ndarray
    radius: np.ndarray
    closed: bool
    ends: tuple[str, str]

    def __repr__(self) -> str:
        return f"Circuit({len(self.step)} arcs, {'closed' if self.closed else ' and '.join(self.ends)})"

    @property
    def arcs(self) -> int:
        """Number of arcs."""
        return len(self.step)

    def turns(self) -> np.ndarray:
        """Return how many full turns each rotation makes from the first to the last node, (rotations,)."""
        r = self.closure.rotations
        return (self.x[-1, :r] - self.x[0, :r]) / (2 * math.pi)

    def locate(self, x: np.ndarray) -> float | None:
        """Return the place of a configuration on the circuit, or None if it is not on it.

        Parameters
        ----------
        x : (n,) float array
            A configuration that closes the loops (see :func:`settle`).

        Returns
        -------
        float or None
            Arc number plus the fraction of its step; grows along the circuit.
        """
        if not self.arcs:
            return None
        gap = wrap(self.closure, x - self.x[:-1])
        along = (gap * self.tangent[:-1]).sum(axis=1)
        off = np.abs(gap - along[:, None] * self.tangent[:-1]).max(axis=1)
        slack = ROUND_OFF * self.step
        inside = (along >= -slack) & (along <= self.step + slack) & (off <= self.radius)
        if not inside.any():
            return None
        arc = int(np.flatnonzero(inside)[np.argmin(off[inside])])
        return arc + float(np.clip(along[arc] / self.step[arc], 0.0, 1.0))

    def at(self, place: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return configurations and unit tangents at places (scalar or (k,)) of the circuit."""
        places = np.atleast_1d(np.asarray(place, dtype=float))
        nodes = self.x, self.tangent, self.bend, self.step
        xs, ts = _charts().on_arcs(*kernel(self.closure), *nodes, places)
        return (xs, ts) if np.ndim(place) else (xs[0], ts[0])

    def sample(self, places: np.ndarray) -> dict[str, np.ndarray]:
        """Return the positions of all points at places of the circuit."""
        return self.closure.points_at(self.at(np.asarray(places))[0])

    def turning_places(self, gradient: np.ndarray) -> np.ndarray:
        """Return the places where g·x changes from growing to falling or back, in order.

        Parameters
        ----------
        gradient : (n,) float array
            g, for an input as :meth:`Closure.gradient` gives it.

        Returns
        -------
        (k,) float array

        Notes
        -----
        A sign change between nodes cannot be missed; two of them within one arc show in the cubic that has
        the rate and its derivative of both nodes, and the arc is then cut where that cubic turns.
        """
        chart = _charts()
        rate, slope = self.tangent @ gradient, self.bend @ gradient
        if np.median(np.abs(rate)) < STILL:  # rounding is larger close to double points
            return np.array([])
        length = np.linalg.norm(np.diff(self.x, axis=0), axis=1)
        places: list[float] = []
        for arc in np.flatnonzero(_suspicious(rate, slope, length)):
            cuts = [0.0, *_turns_of_cubic(*rate[arc : arc + 2], *(slope[arc : arc + 2] * length[arc])), 1.0]
            tau = np.array(cuts) * self.step[arc]
            where = (*kernel(self.closure), self.x[arc], self.tangent[arc], self.bend[arc])
            signs = chart.on_arc(*where, tau)[1] @ gradient
            # A node may stand in a dead centre: both arcs that meet there must see the same sign.
            signs[0], signs[-1] = rate[arc], rate[arc + 1]
            for low, high, p, q in zip(tau[:-1], tau[1:], signs[:-1], signs[1:]):
                if (p > 0) != (q > 0):
                    places.append(arc + chart.turning(*where, low, high, gradient) / self.step[arc])
        return np.array(places)


def _tubes() -> Any:
    from mechanisms import tube

    return tube


def _charts() -> Any:
    from mechanisms import chart

    return chart


def kernel(closure: Closure) -> tuple[Any, ...]:
    """Return the arrays of a closure in the order in which the compiled functions take them."""
    return closure.matrix, closure.slides, closure.slide_class, closure.constant, closure.gears


def wrap(closure: Closure, gap: np.ndarray) -> np.ndarray:
    """Return differences of configurations with the rotations taken to [−π, π]."""
    gap = np.array(gap, dtype=float)
    r = closure.rotations
    gap[..., :r] -= 2 * math.pi * np.round(gap[..., :r] / (2 * math.pi))
    return gap


def settle(closure: Closure, x: np.ndarray, steps: int = 20) -> tuple[np.ndarray, float]:
    """Return the closing configuration nearest to x (Gauss–Newton, least change) and how far it moved.

    Returns
    -------
    x : (n,) float array
    moved : float
        Largest change of a coordinate, radians or fractions of the linkage's size; infinite if it does not
        close.
    """
    start, x = x, np.array(x, dtype=float)
    if np.abs(closure.residual(x)).max() < EXACT:
        return x, 0.0
    for _ in range(steps):
        change = np.linalg.lstsq(closure.jacobian(x), -closure.residual(x), rcond=1e-13)[0]
        x = x + change
        if np.abs(change).max() < 1e-14:
            break
    closes = np.abs(closure.residual(x)).max() < 1e-10
    return x, float(np.abs(x - start).max()) if closes else math.inf


def trace(closure: Closure, x: np.ndarray | None = None, longest: float = 0.4, room: int = ROOM) -> Circuit:
    """Trace the circuit through a configuration, all of it.

    Parameters
    ----------
    closure : Closure
        Of a linkage with one degree of freedom.
    x : (n,) float array, optional
        A configuration that closes the loops; the reference if not given.
    longest : float
        Longest step, radians. The tubes shorten it where they must, so it is for finer output only.
    room : int
        Most nodes in each direction.

    Returns
    -------
    Circuit
        It starts at x if it is closed.

    Raises
    ------
    LinkageError
        If the linkage has not one degree of freedom, or x does not close the loops.
    """
    tube = _tubes()
    need_one_freedom(closure)
    x = closure.reference() if x is None else np.asarray(x, dtype=float)
    if np.abs(closure.residual(x)).max() > 1e-9:
        raise LinkageError("the configuration to trace from does not close the loops; settle() it first")
    direction = np.linalg.svd(closure.jacobian(x))[2][-1]
    direction = direction * (1.0 if direction[np.argmax(np.abs(direction))] > 0 else -1.0)
    forward = _run(tube.trace(*kernel(closure), x, direction, room, min(longest, tube.LONGEST)), closure)
    if forward.closed:
        return forward
    back = _run(tube.trace(*kernel(closure), x, -direction, room, min(longest, tube.LONGEST)), closure)
    return _joined(back, forward)


def need_one_freedom(closure: Closure) -> None:
    """Raise LinkageError unless there is one more unknown than equations."""
    freedom = closure.size - closure.equations
    if freedom != 1:
        raise LinkageError(
            f"motion needs a linkage with one degree of freedom; this one has {freedom} "
            f"({closure.size} unknowns, {closure.equations} closure equations)"
        )


def _run(result: tuple[Any, ...], closure: Closure) -> Circuit:
    status, _, x, t, d, h, r = result
    end = ENDS[status]
    return Circuit(closure, x, t, d, h, r, status == 0, ("closed" if status == 0 else "start", end))


def _joined(back: Circuit, forward: Circuit) -> Circuit:
    """Trace once more, from the far end of the trace the other way, so that all charts look forward."""
    tube = _tubes()
    # Begin where steps are not yet tiny: the last nodes before a double point are too near it to step away.
    far = int(np.flatnonzero(back.step > TAIL)[-1]) if (back.step > TAIL).any() else 0
    result = tube.trace(*kernel(back.closure), back.x[far], -back.tangent[far], 2 * ROOM, tube.LONGEST)
    whole = _run(result, back.closure)
    return replace(whole, ends=(back.ends[1], whole.ends[1]))


def _suspicious(rate: np.ndarray, slope: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Arcs with a sign change at the nodes, or whose Hermite cubic comes near zero inside."""
    p, q, dp, dq = rate[:-1], rate[1:], slope[:-1] * length, slope[1:] * length
    # Bernstein coefficients of the cubic: it stays within their hull.
    hull = np.stack([p, p + dp / 3, q - dq / 3, q])
    spread = hull.max(axis=0) - hull.min(axis=0)
    return (hull.min(axis=0) < 0.5 * spread) & (hull.max(axis=0) > -0.5 * spread)


def _turns_of_cubic(p: float, q: float, dp: float, dq: float) -> list[float]:
    """Parameters in (0, 1) where the Hermite cubic with values p, q and slopes dp, dq is stationary."""
    a, b, c = 3 * (2 * p + dp - 2 * q + dq), 2 * (-3 * p - 2 * dp + 3 * q - dq), dp
    square = b * b - 4 * a * c
    if square < 0 or (a == 0 and b == 0):
        return []
    # The stable form of the two roots, which also serves when a is zero.
    half = -0.5 * (b + math.copysign(math.sqrt(square), b))
    roots = [half / a if a else math.inf, c / half if half else math.inf]
    return sorted(z for z in roots if 0 < z < 1)
