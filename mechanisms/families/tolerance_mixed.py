"""Four-bars through many sets of poses and points near those of a task, for the search within tolerances.

All tasks are reached in one sweep of parameter homotopies from the same generic roots, of which one stands for the
two that differ by the names of the dyads.  As many tasks are tried as some ten thousand paths allow.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.alt_burmester import mixed_dyads, mixed_parameters, mixed_poses
from mechanisms.families.base import BODY
from mechanisms.families.mixed_motion import in_sequence, mixed_problem, numbers_given, partners
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance import Pair
from mechanisms.task import Task

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["MixedPositions", "positions_of"]

#: Paths of a sweep, about two seconds; and the most and the fewest tasks that it is to reach.
PATHS, MOST, FEWEST = 60_000, 512, 16
#: A dyad that misses a position by more than this part of its size and the task's comes from a path that was lost.
ACCURATE = 1e-9


def positions_of(task: Task) -> Poses:
    """The poses and then the points of a task as poses; the angle of a point is zero and means nothing."""
    poses = Poses.of(task.poses[BODY])
    points = np.array(task.points.get(BODY, ()), dtype=complex)
    return Poses(np.concatenate([poses.points, points]), np.concatenate([poses.angles, np.zeros(len(points))]))


class MixedPositions:
    """Poses and points, or poses and numbers, that determine the four-bar."""

    always = False

    def __init__(self, task: Task) -> None:
        self.task = task
        self.given = numbers_given(task)
        self.problem = mixed_problem(task)
        self.count = len(task.poses[BODY])

    @cached_property
    def start(self) -> Solutions:
        """Generic solutions, from the catalogue or by monodromy; without points, by total degree."""
        from solvers import solve

        if self.problem.catalogue:
            from mechanisms.catalogue import generic

            return generic(self.problem.catalogue)
        rng = np.random.default_rng([self.task.seed, 10])
        size = len(self.problem.system.parameters)
        values = rng.normal(size=size) + 1j * rng.normal(size=size)
        return solve(self.problem.system, values, self.problem.start, seed=self.task.seed, certificates=False)

    @cached_property
    def roots(self) -> NDArray[np.complex128]:
        """One generic root of each four-bar."""
        points = self.start.points
        if self.given:
            return points
        other = partners(points)
        return points[(other < 0) | (other > np.arange(len(points)))]

    @property
    def trials(self) -> int:
        """Tasks within a sweep."""
        return int(np.clip(PATHS // max(1, len(self.roots)), FEWEST, MOST))

    @cached_property
    def _engine(self) -> Any:
        from solvers.homotopy import parameter_homotopy
        from solvers.tracking import engine_of

        start = self.start
        program = self.problem.system.program
        return engine_of(parameter_homotopy(program, start.parameters, start.parameters, start.points))

    def pairs(self, many: list[Poses]) -> list[list[Pair]]:
        """Every real four-bar of each set of positions."""
        values = np.array([self._values(poses) for poses in many])
        per_path = np.repeat(values, len(self.roots), axis=0)
        points = np.tile(self.roots, (len(many), 1))
        ends = self._engine.track(points, per_path, self.start.parameters - per_path).x
        found = ends.reshape(len(many), len(self.roots), -1)
        return [self._real(*item) for item in zip(many, values, found)]

    def follow(self, pair: Pair, moved: Poses) -> list[Pair]:
        """The root of the four-bar, carried along the straight way of the positions."""
        root, before = pair.state
        values = self._values(moved)
        ends = self._engine.track(root[None], values[None], (before - values)[None]).x
        return self._real(moved, values, ends)

    def _split(self, poses: Poses) -> tuple[Poses, NDArray[np.complex128]]:
        return Poses(poses.points[: self.count], poses.angles[: self.count]), poses.points[self.count :]

    def _values(self, poses: Poses) -> NDArray[np.complex128]:
        return np.array(mixed_parameters(*self._split(poses), self.task.size, self.given))

    def _real(self, poses: Poses, values: NDArray[np.complex128], roots: NDArray[np.complex128]) -> list[Pair]:
        """The real roots that were not lost, as four-bars in the order of visit."""
        roots = roots[np.all(np.isfinite(roots), axis=1)]
        found = []
        for root in roots[self.problem.real(roots)]:
            dyads = mixed_dyads(root, complex(poses.points[0]), self.task.size)
            everywhere = mixed_poses(*self._split(poses), root)
            misses = [float(dyad.errors(everywhere).max()) / (self.task.size + dyad.length) for dyad in dyads]
            if max(misses) > ACCURATE:
                continue
            found.append(Pair(dyads, in_sequence(self.task, everywhere), (root, values)))
        return found
