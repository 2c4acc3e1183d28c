"""Tasks: what a linkage is asked to do, read from a TOML file and checked before anything is solved.

Degrees stand in files, radians in Python; a point is a complex number; pose 0 is the reference.  Whatever is
wrong with a task is said in one sentence with the file and the key, by raising `TaskError`; nothing is
guessed, filled in or ignored, and nothing in a file is ever evaluated.
"""

from __future__ import annotations

import cmath
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

__all__ = ["Pose", "Task", "TaskError"]


class TaskError(ValueError):
    """Something is wrong with a task or an option; the message says what, where, and what to do."""


@dataclass(frozen=True)
class Pose:
    """The position and orientation of a body.

    Parameters
    ----------
    point : complex
        Position of the body's reference point, in the task's length unit.
    angle : float
        Orientation in radians, anticlockwise.

    Examples
    --------
    >>> Pose.of(3, 4, 90).carry(1)
    (3+5j)
    """

    point: complex
    angle: float = 0.0

    @classmethod
    def of(cls, x: float, y: float, angle_deg: float = 0.0) -> Self:
        """A pose from coordinates and an angle in degrees."""
        return cls(complex(x, y), math.radians(angle_deg))

    def carry(self, point: complex) -> complex:
        """Where a point of the body's own frame lies in the world."""
        return self.point + cmath.exp(1j * self.angle) * point

    def as_dict(self) -> dict[str, float]:
        """As in a task file."""
        return {"x": self.point.real, "y": self.point.imag, "angle_deg": tidy_degrees(self.angle)}


@dataclass(frozen=True)
class Task:
    """What is asked of a linkage.

    Parameters
    ----------
    mechanism : str
        The name of the family.
    poses : mapping of str to tuple of Pose
        The poses of each body; a family with one body calls it ``"body"``.
    points : mapping of str to tuple of complex
        The path points of each body.
    free : mapping
        The free choices by the paper's names; angles in radians.  A number, a pair (low, high) that is to be
        searched, a tuple of numbers, or a text, as the family declares.
    constraints : mapping
        As in the file: see `mechanisms.designs`.
    solve : mapping
        ``seed``, ``samples``, ``start``.
    title, length_unit : str
        Labels.
    where : str
        Where the task was read, for messages.

    Examples
    --------
    >>> task = Task.from_dict({
    ...     "mechanism": "watt2-two-effectors",
    ...     "effectors": {
    ...         "P": {"poses": [{"x": 0, "y": 0, "angle_deg": 0}, {"x": 15, "y": 5, "angle_deg": -45},
    ...                         {"x": 25, "y": 10, "angle_deg": -30}]},
    ...         "Q": {"poses": [{"x": 45, "y": 15, "angle_deg": 0}, {"x": 65, "y": 25, "angle_deg": -60},
    ...                         {"x": 75, "y": 20, "angle_deg": -45}]}}})
    >>> task
    Task('watt2-two-effectors', P: 3 poses, Q: 3 poses)
    >>> task.poses["Q"][1].point
    (65+25j)
    """

    mechanism: str
    poses: Mapping[str, tuple[Pose, ...]] = field(default_factory=dict)
    points: Mapping[str, tuple[complex, ...]] = field(default_factory=dict)
    free: Mapping[str, Any] = field(default_factory=dict)
    constraints: Mapping[str, Any] = field(default_factory=dict)
    solve: Mapping[str, Any] = field(default_factory=dict)
    title: str = ""
    length_unit: str = ""
    where: str = field(default="task", compare=False)

    @classmethod
    def from_file(cls, path: str | Path) -> Self:
        """Read a TOML task file; ``-`` reads standard input.

        Raises
        ------
        TaskError
            When there is no such file, or anything in it is wrong.
        """
        from mechanisms.taskfile import LARGEST_FILE, read_toml, task_from_mapping

        name = "standard input" if str(path) == "-" else str(path)
        folder = Path.cwd() if str(path) == "-" else Path(path).parent
        most = LARGEST_FILE + 1  # a file without end, such as a device, must not fill the memory
        data = sys.stdin.buffer.read(most) if str(path) == "-" else _read_bytes(Path(path), most)
        return task_from_mapping(cls, read_toml(data, name), where=name, folder=folder)

    @classmethod
    def from_toml(cls, text: str, where: str = "task") -> Self:
        """Read a task from TOML text."""
        from mechanisms.taskfile import read_toml, task_from_mapping

        return task_from_mapping(cls, read_toml(text.encode(), where), where=where, folder=Path.cwd())

    @classmethod
    def from_dict(cls, mapping: Mapping[str, Any], where: str = "task") -> Self:
        """Read a task from a mapping of the shape of a task file."""
        from mechanisms.taskfile import task_from_mapping

        return task_from_mapping(cls, mapping, where=where, folder=Path.cwd())

    def to_dict(self) -> dict[str, Any]:
        """The task as a mapping of the shape of a task file; `from_dict` takes it back."""
        from mechanisms.taskfile import mapping_from_task

        return mapping_from_task(self)

    @property
    def seed(self) -> int:
        """The seed of every random choice."""
        return int(self.solve.get("seed", 0))

    def with_solve(self, **options: Any) -> Task:
        """The same task with other entries in ``[solve]``; None leaves an entry as it is."""
        changed = {key: value for key, value in options.items() if value is not None}
        return replace(self, solve={**self.solve, **changed})

    @property
    def size(self) -> float:
        """The extent of the task: the largest distance between any two of its positions (at least tiny)."""
        spots = [pose.point for poses in self.poses.values() for pose in poses]
        spots += [point for points in self.points.values() for point in points]
        return max((abs(a - b) for a in spots for b in spots), default=0.0) or 1.0

    def __repr__(self) -> str:
        parts = [f"{name}: {len(poses)} poses" for name, poses in self.poses.items()]
        parts += [f"{name}: {len(points)} points" for name, points in self.points.items()]
        return f"Task({', '.join([repr(self.mechanism), *parts])})"


def _read_bytes(path: Path, most: int) -> bytes:
    if path.is_dir():
        raise TaskError(f"{path} is a folder; name a task file in it")
    try:
        with path.open("rb") as file:
            return file.read(most)
    except FileNotFoundError:
        raise TaskError(f"there is no task file {path}") from None
    except OSError as error:
        raise TaskError(f"cannot read {path}: {error.strerror}") from None


def tidy_degrees(angle: float) -> float:
    """Radians in degrees, without the dust that the way through radians leaves.

    >>> math.degrees(math.radians(-45.3)), tidy_degrees(math.radians(-45.3))
    (-45.3, -45.3)
    """
    degrees = math.degrees(angle)
    shorter = (round(degrees, 9), float(f"{degrees:.15g}"))
    neighbours = (math.nextafter(degrees, -math.inf), math.nextafter(degrees, math.inf))
    # What is written must be read as the same angle.
    return next((number for number in (*shorter, degrees, *neighbours) if math.radians(number) == angle), degrees)
