"""From a task's poses to the trammel's problem, and from its roots back to trammels."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate, Problem
from mechanisms.families.reality import real_roots
from mechanisms.families.trammel import MOST_POSES, Trammel, pose_values, trammel_mirror, trammel_system
from mechanisms.families.trammel_choices import FREE, Choices, choices
from mechanisms.families.trammel_generic import COUNTS, trammel_name
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["ANGLES", "Placed", "TrammelTask"]

#: Names of parameters that are angles.
ANGLES = frozenset({"theta0"})
#: A body that turns less than this between two poses, radians, is not turned.
TURNED = 1e-9
#: |d| or |R| below this part of the task's size: a circle of the trammel has shrunk to a point, and what is left is
#: a crank, which needs no slots.
SHRUNK = 1e-9


@dataclass(frozen=True, eq=False)
class Placed:
    """A real trammel and its disk's rotation in each pose.

    Attributes
    ----------
    root : int
        Index of the root.
    trammel : Trammel
        Measured from P in pose 0.
    disk : (poses,) array
        Rotation of the disk from pose 0, radians.
    """

    root: int
    trammel: Trammel
    disk: NDArray[np.float64]

    def parameters(self) -> dict[str, float]:
        """By the paper's names."""
        t = self.trammel
        return {
            "x_B": t.B.real,
            "y_B": t.B.imag,
            "x_C": t.C.real,
            "y_C": t.C.imag,
            "x_Q": t.Q.real,
            "y_Q": t.Q.imag,
            "theta0": t.theta0,
            "a": t.a,
            "b": t.b,
        }


@dataclass(frozen=True, eq=False)
class TrammelTask:
    """The trammel's part of a task.

    Parameters
    ----------
    task : Task
    used : tuple of int, optional
        The poses that are to be met, pose 0 of the paper first; all by default.
    """

    task: Task
    used: tuple[int, ...] = ()

    @cached_property
    def poses(self) -> tuple[int, ...]:
        return self.used or tuple(range(len(self.task.poses[BODY])))

    @cached_property
    def origin(self) -> complex:
        """P in the first of the poses, in the world."""
        return self.task.poses[BODY][self.poses[0]].point

    @cached_property
    def points(self) -> NDArray[np.complex128]:
        """P in each pose, measured from the first."""
        return np.array([self.task.poses[BODY][k].point - self.origin for k in self.poses])

    @cached_property
    def turns(self) -> NDArray[np.float64]:
        """Rotations from the first pose, in (−π, π]."""
        first = self.task.poses[BODY][self.poses[0]].angle
        return np.array([math.remainder(self.task.poses[BODY][k].angle - first, math.tau) for k in self.poses])

    @cached_property
    def choices(self) -> Choices:
        """What the task chooses of the trammel; lengths in units of its size."""
        names = {item.name for item in FREE}
        free = {name: value for name, value in self.task.free.items() if name in names}
        try:
            return choices(free, len(self.poses), self.task.size)
        except ValueError as error:
            raise TaskError(f"{self.task.where}: {error}") from None

    def check(self) -> None:
        """Refuse choices that do not fit, and poses for which the equations say nothing.

        Raises
        ------
        TaskError
        """
        turns = [pose.angle for pose in self.task.poses[BODY]]
        if all(abs(math.remainder(turn - turns[0], math.tau)) < TURNED for turn in turns):
            raise TaskError(
                f"{self.task.where}: poses: a pure translation; all points of the body then move alike, so that with "
                f"one trammel its shifted copies would do as well and no finite number of designs can be listed; turn "
                f"the body in one pose, or use points with four-bar-path and parallelogram links"
            )
        centre = self._centre()
        if centre is not None:
            raise TaskError(
                f"{self.task.where}: poses: the body only turns about the point ({centre.real:g}, {centre.imag:g}), "
                f"and a pin there carries it; a disk that turns with the body about that point would do with any two "
                f"pins, so that no finite number of trammels can be listed; move one pose"
            )
        _ = self.choices

    def _centre(self) -> complex | None:
        """The point of the world about which all poses turn the body, if there is one."""
        factors = 1 - np.exp(1j * self.turns)
        turned = np.abs(factors) > TURNED
        centre = np.mean(self.points[turned] / factors[turned])
        if np.abs(self.points - factors * centre).max() > TURNED * max(self.task.size, abs(centre)):
            return None
        return complex(self.origin + centre)

    def problem(self) -> Problem:
        """The tracking form with this task's parameters."""
        count, quadratic = len(self.poses), self.choices.quadratic
        values = pose_values(self.points[1:] / self.task.size, self.turns[1:], self.choices.rows, quadratic)
        # Choices such as x_C are special conditions, for which fewer roots may be finite.
        known = COUNTS[7, False] if count == MOST_POSES else None
        return Problem(
            trammel_system(count, quadratic),
            values,
            finite=known,
            evidence="total degree and monodromy agree" if known else "",
            mirror=trammel_mirror(count),
            catalogue=trammel_name(count, quadratic),
        )

    def trammels(self, solutions: Solutions, first_root: int = 0) -> Iterator[Candidate | Placed]:
        """Every root: a real trammel in each gauge that the choices allow, or why it is none.

        Parameters
        ----------
        first_root : int
            Number of the first root, where several systems are numbered through.
        """
        points = solutions.points
        mirror = trammel_mirror(len(self.poses))
        images, is_real = mirror.image(points), real_roots(points, mirror)
        for k, point in enumerate(points):
            root = first_root + k
            if not is_real[k]:
                yield Candidate(root, _complex_parameters(point, self.task.size), reasons=("complex",))
                continue
            m, d, R = (complex(z) for z in ((point + images[k]) / 2)[[0, 2, 4]])
            if min(abs(d), abs(R)) < SHRUNK:
                note = "a circle of the trammel has shrunk to a point: what is left is a crank"
                yield Candidate(root, {}, reasons=("degenerate",), note=note)
                continue
            gauges = self.choices.gauges(m, d, R)
            if not gauges:
                note = f"no turn of B and C about their midpoint gives the chosen {self.choices.words}"
                yield Candidate(root, {}, reasons=("complex",), note=note)
            disk = np.angle(np.exp(1j * (self.turns + np.concatenate([[0.0], np.angle(point[6:])]))))
            for theta0 in gauges:
                size = self.task.size
                yield Placed(root, Trammel.from_essential(m * size, d * size, R * size, theta0), disk)


def _complex_parameters(point: Sequence[complex], size: float) -> Mapping[str, complex]:
    """The essential unknowns of a root that is no trammel, for who wants to see them."""
    return {name: complex(point[k]) * size for name, k in (("m", 0), ("d", 2), ("R", 4))}
