"""Designs: candidates that were measured, moved and judged; their ranking, and the funnel they came through.

Reason codes of a design that is not accepted, in the order of the funnel:

``degenerate``        the root is no linkage, in any task
``complex``           the root is not real
``inexact``           the linkage does not reach a pose
``constraint:NAME``   it does not meet a constraint of the task
``circuit``           the poses lie on different circuits: it would have to be taken apart
``branch``            the poses lie on different branches: a dead centre lies between them
``order``             the poses are passed in another order
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.constraints import CONSTRAINTS
from mechanisms.documents import linkage_document, linkage_from_document, number_document
from mechanisms.families.base import Candidate, Family
from mechanisms.linkage import GROUND, Linkage
from mechanisms.task import Task, tidy_degrees

if TYPE_CHECKING:
    from mechanisms.motion import Verdict

__all__ = ["Design", "design_from_candidate", "funnel", "rank"]

#: An exact design may miss its poses by this part of the task's size (and its angles by this many radians).
EXACT = 1e-6
#: The motion defects in the order in which the funnel asks for them.
DEFECTS = ("circuit", "branch", "order")


@dataclass(frozen=True)
class Design:
    """A linkage for a task, or the reason why a root is none.

    Attributes
    ----------
    id : str
        ``"D001"`` and so on, in the order of the roots.
    root : int or None
        Index of the root it came from.
    reasons : tuple of str
        Empty when it is accepted.
    parameters : mapping
        The family's parameters by the paper's names; angles under ``name_deg``.
    linkage : Linkage or None
    poses : sequence of {link: rotation}
        Its configuration in each pose.
    worst_pose_error, worst_angle_error : float or None
        How far it misses the task, in its length unit and in radians.
    verdicts : mapping of input name to {verdict: value}
        What `mechanisms.motion.judge` says.
    input : str
        The driven link that decided; one of `verdicts`, or "".
    note : str
        A few words for a reader.
    extra : mapping
        The family's own numbers.
    """

    id: str
    root: int | None
    reasons: tuple[str, ...] = ()
    parameters: Mapping[str, Any] = field(default_factory=dict)
    linkage: Linkage | None = None
    poses: Sequence[Mapping[str, float]] = ()
    worst_pose_error: float | None = None
    worst_angle_error: float | None = None
    verdicts: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    input: str = ""
    note: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)

    @property
    def accepted(self) -> bool:
        """Whether it performs the task without any defect, within the constraints."""
        return not self.reasons

    @cached_property
    def links(self) -> dict[str, float]:
        """Distances between the points of each link, joints and effectors: ``{"O1-A1": 37.3, …}``."""
        if self.linkage is None:
            return {}
        pairs: dict[str, float] = {}
        for link, points in self.linkage.links.items():
            for a, b in itertools.combinations(points, 2):
                if not (link == GROUND and len(points) > 4):
                    pairs.setdefault(f"{a}-{b}", abs(self.linkage.points[a] - self.linkage.points[b]))
        return pairs

    @cached_property
    def pivots(self) -> dict[str, complex]:
        """The fixed pivots."""
        if self.linkage is None:
            return {}
        joints = self._joints()
        return {name: self.linkage.points[name] for name in self.linkage.links[GROUND] if name in joints}

    @property
    def link_ratio(self) -> float:
        """Longest over shortest distance between two joints of one link (infinite when two coincide).

        On a link with a single joint the carried points count as joints: they are its far ends.
        """
        lengths = [self.links[pair] for pair in self._spans() if pair in self.links]
        return max(lengths) / min(lengths) if lengths and min(lengths) > 0 else math.inf

    @property
    def extent(self) -> float:
        """Largest distance between two joints (or far ends) in pose 0."""
        if self.linkage is None:
            return math.inf
        ends = {name for pair in self._spans().values() for name in pair} | self._joints()
        places = [self.linkage.points[name] for name in ends]
        return max((abs(a - b) for a in places for b in places), default=0.0)

    @property
    def min_transmission_deg(self) -> float | None:
        """Least transmission angle over the working range of the input that decided."""
        return self.verdicts.get(self.input, {}).get("min_transmission_deg")

    @property
    def full_rotation(self) -> bool:
        """Whether the input that decided can turn fully."""
        return bool(self.verdicts.get(self.input, {}).get("full_rotation", False))

    def motion(self, input: str = "") -> Verdict:
        """Judge the motion again and return the whole verdict of one input (the deciding one by default)."""
        from mechanisms.motion import judge

        if self.linkage is None:
            raise ValueError(f"{self.id} is no linkage ({', '.join(self.reasons)}), so that it cannot be moved")
        name = input or self.input or next(iter(self.linkage.inputs))
        if name not in self.linkage.inputs:
            raise ValueError(f"{self.id} has no input '{name}'; there are {', '.join(self.linkage.inputs)}")
        return judge(self.linkage, name, self.poses)

    def plot(self, ax: Any = None, **options: Any) -> Any:
        """Draw the design in its poses; see `mechanisms.plots.draw_design`."""
        from mechanisms.plots import draw_design

        return draw_design(self, ax, **options)

    def animate(self, path: str | Path, **options: Any) -> None:
        """Write a moving picture; see `mechanisms.plots.save_design`."""
        from mechanisms.plots import save_design

        save_design(self, path, **options)

    def fields(self) -> dict[str, float | bool | str]:
        """Everything that can be sorted by or compared, under flat names."""
        row: dict[str, Any] = {"id": self.id, "accepted": self.accepted}
        if self.root is not None:
            row["root"] = float(self.root)
        if self.linkage is not None:
            row |= {"link_ratio": self.link_ratio, "extent": self.extent}
        if self.min_transmission_deg is not None:
            row |= {"min_transmission_deg": self.min_transmission_deg, "full_rotation": self.full_rotation}
        if self.worst_pose_error is not None:
            row["worst_pose_error"] = self.worst_pose_error
        if self.worst_angle_error is not None:
            row["worst_angle_error_deg"] = math.degrees(self.worst_angle_error)
        for name, value in (*self.parameters.items(), *self.pivots.items()):
            if isinstance(value, complex):
                row |= {f"{name}_x": value.real, f"{name}_y": value.imag}
            else:
                row[name] = float(value)
        row |= {name: value for name, value in self.links.items() if name not in row}
        return row | {name: value for name, value in self.extra.items() if isinstance(value, (int, float))}

    def as_dict(self) -> dict[str, Any]:
        """As in the JSON output."""
        document: dict[str, Any] = {
            "id": self.id,
            "root": self.root,
            "accepted": self.accepted,
            "reasons": list(self.reasons),
            "parameters": {name: number_document(value) for name, value in self.parameters.items()},
            "links": dict(self.links),
            "pivots": {name: [z.real, z.imag] for name, z in self.pivots.items()},
            "worst_pose_error": self.worst_pose_error,
            "worst_angle_error_deg": None
            if self.worst_angle_error is None
            else math.degrees(self.worst_angle_error),
            "motion": {name: dict(verdict) for name, verdict in self.verdicts.items()},
        }
        if self.input:
            document["input"] = self.input
        if self.note:
            document["note"] = self.note
        if self.linkage is not None:
            document |= {"link_ratio": _finite(self.link_ratio), "extent": _finite(self.extent)}
        return document | ({"extra": dict(self.extra)} if self.extra else {})

    def to_document(self) -> dict[str, Any]:
        """As in the run file: `as_dict` with the linkage and its configurations."""
        linkage = None if self.linkage is None else linkage_document(self.linkage)
        poses = [{link: float(angle) for link, angle in pose.items()} for pose in self.poses]
        return {**self.as_dict(), "linkage": linkage, "poses": poses}

    @classmethod
    def from_document(cls, document: Mapping[str, Any]) -> Design:
        """Back from the run file.

        Raises
        ------
        KeyError, TypeError, ValueError
            When the document is damaged.
        """
        linkage = document.get("linkage")
        error = document["worst_angle_error_deg"]
        return cls(
            id=str(document["id"]),
            root=None if document["root"] is None else int(document["root"]),
            reasons=tuple(map(str, document["reasons"])),
            parameters={n: complex(*v) if isinstance(v, list) else v for n, v in document["parameters"].items()},
            linkage=None if linkage is None else linkage_from_document(linkage),
            poses=[{str(k): float(v) for k, v in pose.items()} for pose in document["poses"]],
            worst_pose_error=document["worst_pose_error"],
            worst_angle_error=None if error is None else math.radians(error),
            verdicts=document["motion"],
            input=document.get("input", ""),
            note=document.get("note", ""),
            extra=document.get("extra", {}),
        )

    def __repr__(self) -> str:
        state = "accepted" if self.accepted else ", ".join(self.reasons)
        angle = self.min_transmission_deg
        transmission = "" if angle is None else f", transmission {angle:.1f}°"
        return f"Design({self.id}, {state}{transmission})"

    def _spans(self) -> dict[str, tuple[str, str]]:
        """The pairs of points between which links have their lengths, by their names in `links`."""
        joints, spans = self._joints(), {}
        carried = set() if self.linkage is None else {point for _, point in self.linkage.bodies.values()}
        for points in self.linkage.links.values() if self.linkage is not None else ():
            own = [point for point in points if point in joints]
            ends = own if len(own) > 1 else [point for point in points if point in joints | carried]
            spans.update({f"{a}-{b}": (a, b) for a, b in itertools.combinations(ends, 2)})
        return spans

    def _joints(self) -> set[str]:
        """The points that are joints, as opposed to points of interest."""
        if self.linkage is None:
            return set()
        joints = {point for _, _, point in self.linkage.revolute_joints()}
        joints |= {slot.point for slot in self.linkage.slots}
        return joints | {s.at for s in self.linkage.sliders if isinstance(s.at, str)}


def design_from_candidate(number: int, candidate: Candidate, task: Task, family: Family) -> Design:
    """Name a candidate and measure how well it meets the task; it is not moved yet.

    Parameters
    ----------
    number : int
        Its place, from 1.
    """
    parameters: dict[str, Any] = {}
    for name, value in candidate.parameters.items():
        if name in candidate.angles:
            parameters[f"{name}_deg"] = tidy_degrees(complex(value).real)
        else:
            parameters[name] = complex(value) if np.iscomplexobj(value) else complex(value).real
    reasons = list(candidate.reasons)
    distance, angle = candidate.pose_error, candidate.angle_error
    if candidate.linkage is not None and distance is None:
        distance, angle = measured_errors(candidate.linkage, candidate.poses, task)
        missed = not (distance <= EXACT * task.size and (angle or 0.0) <= EXACT)
        if family.exact and missed and "inexact" not in reasons:
            reasons.append("inexact")
    return Design(
        id=f"D{number:03d}",
        root=candidate.root,
        reasons=tuple(reasons),
        parameters=parameters,
        linkage=candidate.linkage,
        poses=tuple(candidate.poses),
        worst_pose_error=distance,
        worst_angle_error=angle,
        note=candidate.note,
        extra=dict(candidate.extra),
    )


def measured_errors(
    linkage: Linkage, poses: Sequence[Mapping[str, float]], task: Task
) -> tuple[float, float | None]:
    """How far a linkage misses its task: worst distance and worst angle (radians; None without poses).

    The joints are measured too: a pin that two links do not share counts as a distance.
    """
    from mechanisms.closure import Closure

    closure = Closure.of(linkage)
    distances, angles = [0.0], []
    for pose, rotations in enumerate(poses):
        x = closure.configuration(rotations)
        distances.append(closure.scale * float(np.abs(closure.residual(x)).max(initial=0.0)))
        places = closure.points_at(x)
        for body, (link, point) in linkage.bodies.items():
            wanted = task.poses.get(body, ())
            if pose < len(wanted):
                distances.append(abs(places[point] - wanted[pose].point))
                turned = rotations.get(link, 0.0) + wanted[0].angle - wanted[pose].angle
                angles.append(abs(math.remainder(turned, 2 * math.pi)))
            elif pose - len(wanted) < len(task.points.get(body, ())):
                distances.append(abs(places[point] - task.points[body][pose - len(wanted)]))
    return max(distances), max(angles, default=None)


def rank(designs: Iterable[Design]) -> list[Design]:
    """The accepted designs first, by transmission angle, then the rejected ones, those nearest to use first."""

    def key(design: Design) -> tuple[Any, ...]:
        angle = design.min_transmission_deg
        unreal = any(reason in ("complex", "degenerate") for reason in design.reasons)
        return (not design.accepted, unreal, -(angle or 0.0), design.link_ratio, design.id)

    return sorted(designs, key=key)


def funnel(designs: Sequence[Design], task: Task, roots: int | None) -> list[dict[str, Any]]:
    """What was left after each test, and how many each one removed.

    Parameters
    ----------
    designs : sequence of Design
        All of them, rejected ones too.
    task : Task
        For the names of the constraints.
    roots : int or None
        How many roots there were; None when nothing had to be solved.

    Returns
    -------
    list of {"stage", "left", "removed"}
        Roots first; from the stage ``"designs"`` on, designs: a root may give several.
    """
    by_root: dict[int | None, list[Design]] = {}
    for design in designs:
        for root in design.extra.get("roots", [design.root]):  # a pair of dyads stands on two roots
            by_root.setdefault(root, []).append(design)
    stages: list[dict[str, Any]] = []
    rootless = by_root.pop(None, []) if roots is not None else []
    left = dict(by_root)
    if roots is not None:
        stages.append({"stage": "roots", "left": roots, "removed": {}})
        for code, name in (("degenerate", "linkages"), ("complex", "real")):
            gone = {root for root, group in left.items() if all(code in design.reasons for design in group)}
            left = {root: group for root, group in left.items() if root not in gone}
            stages.append({"stage": name, "left": len(left), "removed": {code: len(gone)} if gone else {}})
    standing = list({design.id: design for group in [*left.values(), rootless] for design in group}.values())
    stages.append({"stage": "designs", "left": len(standing), "removed": {}})
    wanted = {key: f"constraint:{key}" for key in task.constraints if CONSTRAINTS[key].holds is not None}
    tests: list[tuple[str, str]] = [("degenerate", "not degenerate"), ("complex", "real"), ("inexact", "exact")]
    tests += [(code, code) for key, code in wanted.items() if not CONSTRAINTS[key].moving]
    tests += [(code, f"one {code}" if code != "order" else "in order") for code in DEFECTS]
    tests += [(code, code) for key, code in wanted.items() if CONSTRAINTS[key].moving]
    for code, name in tests:
        gone_now = [design for design in standing if code in design.reasons]
        standing = [design for design in standing if code not in design.reasons]
        if gone_now or code in DEFECTS or code in wanted.values():
            stages.append(
                {"stage": name, "left": len(standing), "removed": {code: len(gone_now)} if gone_now else {}}
            )
    stages.append({"stage": "accepted", "left": sum(design.accepted for design in designs), "removed": {}})
    return stages


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
