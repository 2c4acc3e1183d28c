"""Branches of a circuit for one input: the pieces between its dead centres.

At a dead centre the input's rate along the circuit changes sign: the determinant of the closure equations
without the input vanishes, and the input cannot go on. Where the rate touches zero without a change of sign
(no random linkage does so) the input goes on; that is no dead centre, but the transmission angle is zero
there too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from mechanisms.curve import ENDS, STILL, Circuit
from mechanisms.linkage import Input

#: Places nearer than this (in arcs) count as the same place.
SAME_PLACE = 1e-7


@dataclass(frozen=True, eq=False)
class Branches:
    """A circuit cut at the dead centres of an input.

    Attributes
    ----------
    circuit : Circuit
    gradient : (n,) float array
        The input is ``unit`` times gradient · x.
    unit : float
        1 for a rotation; the length of a scaled displacement for a slider.
    cuts : (k,) float array
        Places of the dead centres, in order. A closed circuit has an even number of them.

    Examples
    --------
    >>> from mechanisms.closure import Closure
    >>> from mechanisms.curve import trace
    >>> from mechanisms.linkage import Input, Linkage
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> circuit = trace(Closure.of(four_bar))
    >>> Branches.of(circuit, Input("crank")).count, Branches.of(circuit, Input("follower")).count
    (1, 2)
    """

    circuit: Circuit
    gradient: np.ndarray
    unit: float
    cuts: np.ndarray

    @classmethod
    def of(cls, circuit: Circuit, driven: Input) -> Branches:
        """Cut a circuit at the dead centres of an input."""
        gradient, unit = circuit.closure.gradient(driven)
        return cls(circuit, gradient, unit, circuit.turning_places(gradient))

    @property
    def count(self) -> int:
        """Number of branches."""
        if self.circuit.closed:
            return max(1, len(self.cuts))
        return len(self.cuts) + 1

    @property
    def endless(self) -> bool:
        """True for a closed circuit without dead centre: the input may turn on and on."""
        return self.circuit.closed and not len(self.cuts)

    @property
    def still(self) -> bool:
        """True if the input stands still on the whole circuit (as the crank of a kite that is folded on it)."""
        return bool(np.median(np.abs(self.circuit.tangent @ self.gradient)) < STILL)

    def index(self, place: float) -> int:
        """Return the number of the branch that holds a place."""
        number = int(np.searchsorted(self.cuts, place))
        return number % self.count if self.circuit.closed else number

    def near_cut(self, place: float) -> bool:
        """True for a place in a dead centre itself, which belongs to both its branches."""
        gap = np.abs(self.cuts - place)
        if self.circuit.closed:
            gap = np.minimum(gap, self.circuit.arcs - gap)
        return bool((gap < SAME_PLACE).any())

    def holds(self, number: int, place: float) -> bool:
        """True if the place is on the branch of this number, ends included."""
        if self.index(place) == number:
            return True
        if not self.near_cut(place):
            return False
        beside = (self._round(place + 2 * SAME_PLACE), self._round(place - 2 * SAME_PLACE))
        return number in {self.index(p) for p in beside}

    def interval(self, number: int) -> tuple[float, float]:
        """Return the first and last place of a branch; the last may exceed the number of arcs (one time round)."""
        arcs = float(self.circuit.arcs)
        if self.endless:
            return 0.0, arcs
        if self.circuit.closed:
            if number == 0:
                return float(self.cuts[-1]), float(self.cuts[0]) + arcs
            return float(self.cuts[number - 1]), float(self.cuts[number])
        ends = [0.0, *map(float, self.cuts), arcs]
        return ends[number], ends[number + 1]

    def value(self, place: float) -> float:
        """Return the input at a place (also beyond one time round): radians or length, without a jump."""
        rounds, rest = divmod(place, self.circuit.arcs) if self.circuit.closed else (0.0, place)
        x = self.circuit.at(rest)[0]
        drift = self.circuit.x[-1] - self.circuit.x[0]
        return float(self.unit * (self.gradient @ (x + rounds * drift)))

    def range(self, number: int) -> tuple[float, float]:
        """Return the least and the largest input on a branch."""
        a, b = (self.value(place) for place in self.interval(number))
        return min(a, b), max(a, b)

    def place_at(self, number: int, value: float) -> float | None:
        """Return the place on a branch where the input has a value, or None if it has it nowhere.

        On an endless branch values count modulo its full turns.
        """
        low, high = self.interval(number)
        ends = self.value(low), self.value(high)
        if self.endless:
            value = min(ends) + (value - min(ends)) % abs(ends[1] - ends[0])
        if not min(ends) <= value <= max(ends):
            return None
        rises = ends[1] > ends[0]
        while high - low > 1e-12 * self.circuit.arcs:
            middle = 0.5 * (low + high)
            if (self.value(middle) < value) == rises:
                low = middle
            else:
                high = middle
        return self._round(0.5 * (low + high))

    def order(self, places: Sequence[float], number: int) -> tuple[float, float] | None:
        """Return the travel that visits places in the order given, never turning back, or None.

        Returns
        -------
        (float, float) or None
            Place of the first and of the last; the last lies beyond the ends of the circuit where the
            travel passes its start. On an endless branch with two ways round, the shorter travel of the
            input.
        """
        arcs = float(self.circuit.arcs)
        travels = []
        for sign in (1.0, -1.0):
            if self.endless:
                offset = [(sign * (p - places[0])) % arcs for p in places]
                offset = [0.0 if arcs - o < SAME_PLACE else o for o in offset]
            else:
                low, high = self.interval(number)
                steps = [low + ((p - low) % arcs) if self.circuit.closed else p for p in places]
                steps = [p - arcs if p > high + SAME_PLACE else p for p in steps]
                offset = [sign * (p - steps[0]) for p in steps]
            if all(b >= a - SAME_PLACE for a, b in pairwise(offset)):
                travels.append((float(places[0]), float(places[0] + sign * max(offset))))
        return min(travels, key=lambda ends: abs(self.value(ends[1]) - self.value(ends[0])), default=None)

    def clearance(self, travel: tuple[float, float], number: int) -> float:
        """Return how far the input may go on from a travel until the nearest dead centre (inf if none)."""
        if self.endless:
            return math.inf
        low, high = self.interval(number)
        start, end = sorted(travel)
        if self.circuit.closed and start < low - SAME_PLACE:
            start, end = start + self.circuit.arcs, end + self.circuit.arcs
        rooms = []
        for edge, place, name in ((low, start, self.circuit.ends[0]), (high, end, self.circuit.ends[1])):
            inside = self.circuit.closed or 0.0 < edge < self.circuit.arcs
            if inside or name == ENDS[2]:  # at a double point every input is dead
                rooms.append(abs(self.value(edge) - self.value(place)))
        return min(rooms, default=math.inf)

    def _round(self, place: float) -> float:
        return place % self.circuit.arcs if self.circuit.closed else place
