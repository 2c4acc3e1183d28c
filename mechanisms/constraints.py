"""What a task may demand of its designs beyond performing it: the ``[constraints]`` table.

Each entry is one test with one line in the funnel.  Those that need only the linkage at rest are tried
before it is moved, because moving is what costs time.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from mechanisms.designs import Design

__all__ = ["ANY_INPUT", "CONSTRAINTS", "Constraint", "violated"]

#: The value of ``input`` that accepts a design when it works with at least one of its inputs.
ANY_INPUT = "any"

ConstraintKind = Literal["box", "degrees", "positive", "ratio", "flag", "input"]


@dataclass(frozen=True)
class Constraint:
    """One entry that ``[constraints]`` may have.

    Parameters
    ----------
    key : str
        Its name in the file, in the funnel and in reasons (``constraint:key``).
    kind : str
        What its value is.
    meaning : str
        A few words.
    moving : bool
        Whether the linkage must have been moved before the test.
    holds : callable
        ``holds(design, value)``; None for entries that are no test of their own.
    """

    key: str
    kind: ConstraintKind
    meaning: str
    moving: bool
    holds: Callable[[Design, Any], bool] | None


def _in_box(design: Design, box: Mapping[str, tuple[float, float]]) -> bool:
    x, y = box.get("x"), box.get("y")
    return all(
        (x is None or x[0] <= pivot.real <= x[1]) and (y is None or y[0] <= pivot.imag <= y[1])
        for pivot in design.pivots.values()
    )


def _transmits(design: Design, least: float) -> bool:
    return (design.min_transmission_deg or 0.0) >= least


CONSTRAINTS: dict[str, Constraint] = {
    c.key: c
    for c in (
        Constraint("pivots_in", "box", "a box that holds every fixed pivot", False, _in_box),
        Constraint(
            "max_link_length",
            "positive",
            "longest link",
            False,
            lambda d, v: max(d.links.values(), default=0) <= v,
        ),
        Constraint(
            "min_link_length",
            "positive",
            "shortest link",
            False,
            lambda d, v: min(d.links.values(), default=0) >= v,
        ),
        Constraint(
            "max_link_ratio", "ratio", "longest link over the shortest", False, lambda d, v: d.link_ratio <= v
        ),
        Constraint(
            "max_pose_error",
            "positive",
            "worst distance from a pose",
            False,
            lambda d, v: d.worst_pose_error <= v,
        ),
        Constraint("min_transmission_deg", "degrees", "least transmission angle", True, _transmits),
        Constraint(
            "full_rotation", "flag", "the input can turn fully", True, lambda d, v: not v or d.full_rotation
        ),
        Constraint("input", "input", "the link that is driven", True, None),
    )
}


def violated(design: Design, constraints: Mapping[str, Any], moving: bool) -> list[str]:
    """The keys of the constraints that a design does not meet, of those that need motion or of the others."""
    return [
        key
        for key, value in constraints.items()
        if (test := CONSTRAINTS[key]).moving == moving and test.holds is not None and not test.holds(design, value)
    ]
