"""Path generation by a four-bar: every coupler curve through six, seven, eight or nine points.

Each real root is a design: a four-bar with its dyads in one order, so that a linkage that can be driven from either
side is listed twice.  ``extra["curve"]`` names the roots that draw the same curve: the two orders of one four-bar, and
with nine points the three cognates of Roberts too.

See `mechanisms.families.four_bar_curve` for the equations.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechanisms.families.base import BODY, Candidate, Family, Problem
from mechanisms.families.curve_task import CURVE_FREE, CurveTask
from mechanisms.families.trammel_linkage import CurveFourBar
from mechanisms.linkage import Input, Linkage
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["FourBarPath", "four_bar_linkage", "four_bar_poses"]


class FourBarPath(Family):
    """A point of a four-bar's coupler through six to nine points."""

    name = "four-bar-path"
    summary = "four-bar whose coupler curve passes through points"
    source = (
        "Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to "
        "eight poses, Eq. (19); nine points: Wampler, Morgan, Sommese, Complete solution of the nine-point path "
        "synthesis problem for four-bar linkages"
    )
    point_counts = (6, 7, 8, 9)
    too_many = "a four-bar has nine parameters"
    unknowns = "those of x_M … g that are not chosen, and the coupler's turns"
    roots = "8652 for nine points"
    free = CURVE_FREE
    inputs = ("crank", "rocker")

    def check(self, task: Task) -> None:
        """Refuse a wrong number of choices and degenerate points."""
        try:
            _part(task).check()
        except ValueError as error:
            raise TaskError(f"{task.where}: {error}") from None

    def system(self, task: Task) -> Problem | None:
        """Eq. (19), or the nine-point problem."""
        return _part(task).problem()

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Every root as a four-bar."""
        assert solutions is not None
        for found in _part(task).four_bars(solutions):
            if isinstance(found, Candidate):
                yield found
                continue
            yield Candidate(
                found.root,
                found.four_bar.parameters(),
                four_bar_linkage(found.four_bar, task.title, task.length_unit),
                four_bar_poses(found.four_bar),
                extra={"curve": found.curve},
            )


def four_bar_linkage(four_bar: CurveFourBar, title: str = "", length_unit: str = "") -> Linkage:
    """The four-bar at its first point."""
    points = {
        "M": four_bar.M,
        "N": four_bar.N,
        "R": complex(four_bar.R[0]),
        "S": complex(four_bar.S[0]),
        "A": complex(four_bar.places[0]),
    }
    links = {"ground": ("M", "N"), "crank": ("M", "R"), "coupler": ("R", "S", "A"), "rocker": ("N", "S")}
    return Linkage(
        points,
        links,
        bodies={"body": ("coupler", "A")},
        inputs={name: Input(name) for name in ("crank", "rocker")},
        title=title,
        length_unit=length_unit,
    )


def four_bar_poses(four_bar: CurveFourBar) -> list[dict[str, float]]:
    """Configurations of `four_bar_linkage` at the points."""
    return [dict(zip(("crank", "coupler", "rocker"), map(float, angles))) for angles in four_bar.rotations()]


def _part(task: Task) -> CurveTask:
    chosen = {item.name: float(task.free[item.name]) for item in CURVE_FREE if item.name in task.free}
    return CurveTask(np.array(task.points[BODY], np.complex128), chosen)
