"""What the motion of a design is worth for one input."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Verdict:
    """What one input makes of the poses.

    Attributes
    ----------
    same_circuit : bool
        All poses can be reached without taking the linkage apart.
    same_branch : bool
        They are joined by a motion on which the input never stands still.
    in_order : bool
        Turning the input one way, either way, visits them in the order given (round and round, if it can).
    full_rotation : bool
        The input can make a full turn on the branch of pose 0.
    min_transmission_deg : float
        Least transmission angle (:mod:`mechanisms.transmission`) on the way from the first pose to the
        last, or, if they are out of order, anywhere between them on the branch. Zero if no such way exists.
    max_speed_ratio : float
        Largest |rate of a link's turning / rate of the input| on that way, per radian or per length unit;
        infinite if there is no way. This is the largest mechanical disadvantage.
    clearance : float
        How much further the input may go, beyond that way, until the nearest dead centre: radians or
        length.
    input_range : (float, float)
        Least and largest input on the branch of pose 0, from the reference: radians or length.
    circuits, branches : tuple of int
        For each pose the number of its circuit (pose 0 has 0; −1 if it closes nowhere) and of its branch
        there.
    moved : tuple of float
        How far each pose had to move to close the loops exactly, radians or parts of the linkage's size.
    notes : tuple of str
        Sentences about what is wrong or could not be decided.
    certified : bool or None
        Whether the traces that this rests on were proved in ball arithmetic; None if that was not asked for.
    """

    same_circuit: bool
    same_branch: bool
    in_order: bool
    full_rotation: bool
    min_transmission_deg: float
    max_speed_ratio: float = math.inf
    clearance: float = 0.0
    input_range: tuple[float, float] = (0.0, 0.0)
    circuits: tuple[int, ...] = ()
    branches: tuple[int, ...] = ()
    moved: tuple[float, ...] = ()
    notes: tuple[str, ...] = ()
    certified: bool | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the five keys of the JSON output."""
        keys = ("same_circuit", "same_branch", "in_order", "full_rotation", "min_transmission_deg")
        return {key: getattr(self, key) for key in keys}

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why the design is rejected for this input: ``circuit``, ``branch`` or ``order``; empty if not."""
        if not self.same_circuit:
            return ("circuit",)
        if not self.same_branch:
            return ("branch",)
        return () if self.in_order else ("order",)

    def __repr__(self) -> str:
        if self.reasons:
            return f"Verdict({self.reasons[0]} defect; {' '.join(self.notes)})"
        turn = "full rotation" if self.full_rotation else "rocks"
        return f"Verdict(defect-free, {turn}, transmission angle at least {self.min_transmission_deg:.1f}°)"
