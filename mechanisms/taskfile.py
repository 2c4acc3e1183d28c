"""From the text of a task file to a `Task`, and back.

Every refusal is one sentence that names the file, the key and the remedy.  Values are numbers, texts and
tables as TOML defines them; no text is ever turned into anything but itself.
"""

from __future__ import annotations

import csv
import math
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from mechanisms import families
from mechanisms.checks import LARGEST, Checker, short, suggest
from mechanisms.constraints import ANY_INPUT, CONSTRAINTS, Constraint
from mechanisms.families.base import BODY, Family, Free
from mechanisms.task import Pose, Task, TaskError, tidy_degrees

__all__ = ["mapping_from_task", "read_toml", "task_from_mapping"]

#: A task file is a page of text; anything of this size is something else.
LARGEST_FILE = 4_000_000
#: Two poses closer than this part of the task's extent (and than this many radians) are one pose.
SAME_POSE = 1e-9

_TOP = ("mechanism", "title", "length_unit", "effectors", "free", "constraints", "solve")
_POSITIONS = ("poses", "points", "poses_csv", "points_csv")
_SOLVE = {"seed": (0, 2**63 - 1), "samples": (16, 2**20)}
_STARTS = ("auto", "total-degree", "multihomogeneous", "polyhedral")

TaskType = TypeVar("TaskType", bound=Task)


def read_toml(data: bytes, where: str) -> dict[str, Any]:
    """Parse TOML, saying where it breaks."""
    if len(data) > LARGEST_FILE:
        raise TaskError(f"{where} has more than {LARGEST_FILE} bytes: that is no task file")
    try:
        return tomllib.loads(data.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise TaskError(f"{where} is not UTF-8 text (byte {error.start}): is it a task file?") from None
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else str(error)
        raise TaskError(f"{where} is not valid TOML: {reason}") from None


def task_from_mapping(cls: type[TaskType], mapping: Mapping[str, Any], where: str, folder: Path) -> TaskType:
    """Check a mapping of the shape of a task file and make a `Task` of it.

    Parameters
    ----------
    cls : type
        `Task` or a subclass.
    mapping : mapping
        As TOML gives it.
    where : str
        The file, for messages.
    folder : path
        Where relative paths of CSV files start.

    Raises
    ------
    TaskError
        At the first thing that is wrong.
    """
    reader = _Reader(where, folder)
    if not isinstance(mapping, Mapping):
        reader.fail("", "a task is a table of keys and values")
    for key in mapping:
        if key not in _TOP + _POSITIONS:
            reader.fail(key, f"unknown key; {suggest(str(key), _TOP + _POSITIONS)}")
    family = reader.family(mapping)
    poses, points = reader.positions(mapping, family)
    task = cls(
        mechanism=family.name,
        poses=poses,
        points=points,
        free=reader.free(mapping.get("free", {}), family, poses, points),
        constraints=reader.constraints(mapping.get("constraints", {}), family),
        solve=reader.solve(mapping.get("solve", {})),
        title=reader.text(mapping.get("title", ""), "title"),
        length_unit=reader.text(mapping.get("length_unit", ""), "length_unit"),
        where=where,
    )
    family.check(task)
    return task


class _Reader(Checker):
    """The checks of a task's parts."""

    def __init__(self, where: str, folder: Path) -> None:
        super().__init__(where)
        self.folder = folder

    # -- parts of a task

    def family(self, mapping: Mapping[str, Any]) -> Family:
        if "mechanism" not in mapping:
            self.fail("mechanism", f"missing; name one of {', '.join(families.names())}")
        name = self.text(mapping["mechanism"], "mechanism")
        if name not in families.names():
            self.fail("mechanism", f"there is no mechanism {short(name)}; {suggest(name, families.names())}")
        return families.family(name)

    def positions(
        self, mapping: Mapping[str, Any], family: Family
    ) -> tuple[dict[str, tuple[Pose, ...]], dict[str, tuple[complex, ...]]]:
        """The poses and points of every body."""
        tables = self._tables(mapping, family)
        poses: dict[str, tuple[Pose, ...]] = {}
        points: dict[str, tuple[complex, ...]] = {}
        for name, (place, table) in tables.items():
            self.keys(table, _POSITIONS, place) if place else None
            prefix = f"{place}." if place else ""
            read = {what: self._positions_of(table, what, prefix) for what in ("poses", "points")}
            for what, counts in (("poses", family.pose_counts), ("points", family.point_counts)):
                if read[what] and not counts:
                    other = "points" if what == "poses" else "poses"
                    self.fail(prefix + what, f"{family.name} is synthesised for {other}, not for {what}")
            if not read["poses"] and not read["points"]:
                what = "poses" if family.pose_counts else "points"
                example = "{x = 0.0, y = 0.0" + (", angle_deg = 0.0}" if what == "poses" else "}")
                self.fail(prefix + what, f"missing; write {what} = [{example}, …]")
            if read["poses"]:
                poses[name] = read["poses"]
                self._distinct([(p.point, p.angle) for p in read["poses"]], prefix + "poses", "poses", "pose")
            if read["points"]:
                points[name] = read["points"]
                self._distinct([(p, 0.0) for p in read["points"]], prefix + "points", "points", "point")
        self._counts(poses, family.pose_counts, "poses", family)
        self._counts(points, family.point_counts, "points", family)
        return poses, points

    def _tables(self, mapping: Mapping[str, Any], family: Family) -> dict[str, tuple[str, Mapping[str, Any]]]:
        """body -> (place in the file, table with its poses or points)"""
        top = [key for key in _POSITIONS if key in mapping]
        if family.effectors == (BODY,):
            if "effectors" in mapping:
                self.fail("effectors", f"{family.name} moves one body; write its poses or points at the top level")
            return {BODY: ("", {key: mapping[key] for key in top})}
        wanted = " and ".join(f"[effectors.{name}]" for name in family.effectors)
        if top:
            self.fail(top[0], f"{family.name} moves {len(family.effectors)} bodies; write {wanted}")
        if "effectors" not in mapping:
            self.fail("effectors", f"missing; {family.name} needs {wanted}")
        effectors = self.table(mapping["effectors"], "effectors")
        self.keys(effectors, family.effectors, "effectors")
        for name in family.effectors:
            if name not in effectors:
                self.fail("effectors", f"{name} is missing; {family.name} needs {wanted}")
        return {n: (f"effectors.{n}", self.table(effectors[n], f"effectors.{n}")) for n in family.effectors}

    def _positions_of(self, table: Mapping[str, Any], what: str, prefix: str) -> tuple[Any, ...]:
        columns = ("x", "y", "angle_deg") if what == "poses" else ("x", "y")
        key, from_csv = prefix + what, f"{what}_csv"
        if what in table and from_csv in table:
            self.fail(key, f"give either {what} or {from_csv}, not both")
        if from_csv in table:
            rows = self._csv(self.text(table[from_csv], prefix + from_csv), columns, prefix + from_csv)
        else:
            given = table.get(what, [])
            if not isinstance(given, Sequence) or isinstance(given, str):
                self.fail(key, f"{short(given)} is not a list; write {what} = [{{x = 0.0, y = 0.0, …}}, …]")
            rows = [self._row(row, columns, f"{key}[{n}]") for n, row in enumerate(given)]
        if what == "poses":
            return tuple(Pose.of(*row) for row in rows)
        return tuple(complex(*row) for row in rows)

    def _row(self, row: Any, columns: Sequence[str], key: str) -> list[float]:
        if not isinstance(row, Mapping):
            self.fail(key, f"{short(row)} is not a table; write {{{' = …, '.join(columns)} = …}}")
        self.keys(row, columns, key, angles=("angle_deg",))
        for column in columns:
            if column not in row:
                self.fail(key, f"{column} is missing")
        return [self.number(row[column], f"{key}.{column}") for column in columns]

    def _csv(self, name: str, columns: Sequence[str], key: str) -> list[list[float]]:
        path = self.folder / name
        try:
            with path.open("rb") as file:
                data = file.read(LARGEST_FILE + 1)
            text = data.decode("utf-8-sig")
        except (OSError, UnicodeDecodeError, ValueError) as error:
            reason = getattr(error, "strerror", None) or "it is not UTF-8 text"
            self.fail(key, f"cannot read {path}: {reason}")
        if len(data) > LARGEST_FILE:
            self.fail(key, f"{path} has more than {LARGEST_FILE} bytes: that is no list of positions")
        lines = [(n, row) for n, row in enumerate(_csv_rows(text), start=1) if any(cell.strip() for cell in row)]
        header = [cell.strip() for cell in lines[0][1]] if lines else []
        if header != list(columns):
            self.fail(
                key,
                f"{path} must begin with the header {','.join(columns)}, not with {short(','.join(header))}",
            )
        rows = []
        for n, row in lines[1:]:
            if len(row) != len(columns):
                self.fail(key, f"{path}, line {n}: {len(row)} values where {','.join(columns)} are needed")
            rows.append([self._cell(cell, f"{key}, line {n}") for cell in row])
        return rows

    def _cell(self, cell: str, key: str) -> float:
        try:
            value = float(cell)
        except ValueError:
            self.fail(key, f"{short(cell)} is not a number")
        return self.number(value, key)

    def _distinct(self, found: Sequence[tuple[complex, float]], key: str, what: str, one: str) -> None:
        size = max((abs(a - b) for a, _ in found for b, _ in found), default=0.0)
        for j, (b, angle_b) in enumerate(found):
            for i, (a, angle_a) in enumerate(found[:j]):
                turn = abs(math.remainder(angle_b - angle_a, 2 * math.pi))
                if abs(b - a) <= SAME_POSE * size and turn <= SAME_POSE:
                    self.fail(key, f"{one} {i} and {one} {j} are the same; the {what} of a body must differ")

    def _counts(
        self, found: Mapping[str, Sequence[Any]], counts: Sequence[int], what: str, family: Family
    ) -> None:
        if not counts:
            return
        numbers = {name: len(items) for name, items in found.items()}
        if len(set(numbers.values())) > 1:
            each = " and ".join(f"{name} has {count}" for name, count in numbers.items())
            self.fail(
                "effectors", f"{each} {what}; every body needs one at each instant, so the numbers must agree"
            )
        for name, count in numbers.items():
            if count not in counts:
                allowed = _either(counts)
                reason = f": {family.too_many}" if count > max(counts) and family.too_many else ""
                place = what if name == BODY else f"effectors.{name}.{what}"
                hint = self._others(count, what, family)
                self.fail(place, f"{count} given, but {family.name} takes {allowed} {what}{reason}{hint}")

    def _others(self, count: int, what: str, family: Family) -> str:
        """Which mechanisms of one body take so many poses or points, as a hint."""
        every = map(families.family, families.names())
        fitting = [
            other.name
            for other in every
            if other.effectors == family.effectors == (BODY,)
            and count in (other.pose_counts if what == "poses" else other.point_counts)
        ]
        return f"; {' or '.join(fitting)} takes {count}" if fitting else ""

    def free(
        self,
        given: Any,
        family: Family,
        poses: Mapping[str, Sequence[Any]],
        points: Mapping[str, Sequence[Any]],
    ) -> dict[str, Any]:
        """The free choices, angles in radians."""
        table = self.table(given, "free")
        known = {item.key: item for item in family.free}
        self.keys(table, list(known), "free", angles=[k for k, item in known.items() if item.kind == "angle"])
        return {known[key].name: self._choice(value, known[key], f"free.{key}") for key, value in table.items()}

    def _choice(self, value: Any, item: Free, key: str) -> Any:
        if item.kind == "text":
            word = self.text(value, key)
            if item.choices and word not in item.choices:
                self.fail(key, f"{short(word)} is not a choice; {suggest(word, item.choices)}")
            return word
        unit = math.radians(1.0) if item.kind == "angle" else 1.0
        if isinstance(value, (list, tuple)):
            if item.many:
                return tuple(unit * self.number(part, f"{key}[{n}]") for n, part in enumerate(value))
            if not item.range:
                self.fail(key, "a list where one number is needed")
            low, high = self.pair(value, key)
            return (unit * low, unit * high)
        if item.many:
            self.fail(key, f"{short(value)} is not a list of numbers")
        if item.kind == "integer":
            return self.integer(value, key, -(2**31), 2**31)
        return unit * self.number(value, key)

    def constraints(self, given: Any, family: Family) -> dict[str, Any]:
        """The constraints, as in the file but checked."""
        table = self.table(given, "constraints")
        known = list(CONSTRAINTS)
        self.keys(table, known, "constraints", angles=[k for k in known if k.endswith("_deg")])
        return {k: self._constraint(v, CONSTRAINTS[k], f"constraints.{k}", family) for k, v in table.items()}

    def _constraint(self, value: Any, item: Constraint, key: str, family: Family) -> Any:
        if item.kind == "flag":
            if not isinstance(value, bool):
                self.fail(key, f"{short(value)} is neither true nor false")
            return value
        if item.kind == "input":
            word, known = self.text(value, key), (*family.inputs, ANY_INPUT)
            if word not in known:
                self.fail(key, f"{family.name} has no input {short(word)}; {suggest(word, known)}")
            return word
        if item.kind == "box":
            box = self.table(value, key)
            self.keys(box, ("x", "y"), key)
            if not box:
                self.fail(key, "an empty box; write {x = [lowest, highest], y = [lowest, highest]}")
            return {axis: self.pair(box[axis], f"{key}.{axis}") for axis in ("x", "y") if axis in box}
        number = self.number(value, key)
        low, high = {"degrees": (0.0, 90.0), "positive": (0.0, LARGEST), "ratio": (1.0, LARGEST)}[item.kind]
        if not low <= number <= high:
            self.fail(key, f"{number:g} is out of range; it lies between {low:g} and {high:g}")
        return number

    def solve(self, given: Any) -> dict[str, Any]:
        """The options of the solver."""
        table = self.table(given, "solve")
        self.keys(table, (*_SOLVE, "start"), "solve")
        options: dict[str, Any] = {}
        for key, value in table.items():
            if key == "start":
                options[key] = self.text(value, "solve.start")
                if value not in _STARTS:
                    self.fail("solve.start", f"there is no start system {short(value)}; {suggest(value, _STARTS)}")
            else:
                options[key] = self.integer(value, f"solve.{key}", *_SOLVE[key])
        return options


def mapping_from_task(task: Task) -> dict[str, Any]:
    """A task as a mapping of the shape of its file, with lists in place of CSV files."""
    family = families.family(task.mechanism)
    bodies: dict[str, dict[str, Any]] = {}
    for name, poses in task.poses.items():
        bodies.setdefault(name, {})["poses"] = [pose.as_dict() for pose in poses]
    for name, points in task.points.items():
        bodies.setdefault(name, {})["points"] = [{"x": p.real, "y": p.imag} for p in points]
    labels = {"title": task.title, "length_unit": task.length_unit}
    mapping: dict[str, Any] = {"mechanism": task.mechanism, **{k: v for k, v in labels.items() if v}}
    if family.effectors == (BODY,):
        mapping.update(bodies.get(BODY, {}))
    else:
        mapping["effectors"] = bodies
    kinds = {item.name: item for item in family.free}
    free = {kinds[name].key: _outward(value, kinds[name]) for name, value in task.free.items()}
    tables = {"free": free, "constraints": _plain(task.constraints), "solve": dict(task.solve)}
    mapping.update({name: table for name, table in tables.items() if table})
    return mapping


def _outward(value: Any, item: Free) -> Any:
    """A free choice as in a file."""
    if isinstance(value, tuple):
        return [_outward(part, item) for part in value]
    return tidy_degrees(value) if item.kind == "angle" else value


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(part) for key, part in value.items()}
    return list(value) if isinstance(value, tuple) else value


def _csv_rows(text: str) -> list[list[str]]:
    try:
        return list(csv.reader(text.splitlines(), strict=False))
    except csv.Error:
        return []


def _either(counts: Sequence[int]) -> str:
    return " or ".join(str(count) for count in counts) if len(counts) < 4 else f"{min(counts)} to {max(counts)}"
