"""The modified Wanzer linkage: a rotatory trammel whose coupler's point A is led by a four-bar.

Three problems that do not know of each other, and their product:

1. every trammel for the poses (`mechanisms.families.trammel`);
2. the point A of the coupler, by L_AP and δ in Eq. (18), given or searched in ranges;
3. every four-bar whose coupler curve passes through the places of A (`mechanisms.families.four_bar_curve`), which
   depend on the poses and on A, not on the trammel.

Any trammel goes with any four-bar for the same A.  Most pairs are hopeless for reasons that one half shows alone,
and these are named on the half, so that the product is never written out:

- a four-bar must have A's places on one circuit, and where its crank or rocker is driven, on one branch of it and in
  order, whatever is attached to A;
- between two dead centres of the crank the determinant of the trammel's two slots by (θ, φ), with A led, keeps its
  sign: a trammel with both signs among the poses has a dead centre between them, or other circuits.  It says nothing
  when the disk is driven.

What is left is built and moved as a whole, by `mechanisms.motion`, which alone accepts a design.

Source: Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to eight
poses, Mech. Based Des. Struct. Mach. 46(6), 2018, Sections 3–8.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate, Family, Free, Problem, Solved
from mechanisms.families.curve_task import CURVE_FREE, CurveTask, Found
from mechanisms.families.eight_poses import (
    EIGHT,
    MAX_ANGLE_ERROR,
    TOLERANCE,
    EightPoses,
    eight_pose_answer,
    seven_of,
    solve_eight,
)
from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_choices import FREE
from mechanisms.families.trammel_linkage import modified_linkage, modified_poses
from mechanisms.families.trammel_positions import Near
from mechanisms.families.trammel_task import ANGLES, Placed, TrammelTask
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["WanzerModified", "trammel_signs"]

#: Where L_AP or δ is a range, so many points A are tried unless the task says otherwise.
SAMPLES = 8
#: Eight poses without an exact trammel: each trammel leads A to places of its own, so that each needs a four-bar
#: problem of its own; for each point A so many of the best trammels are completed.
COMPLETED = 2

_A_POINT = (
    Free("L_AP", "length", "distance of A from P", range=True),
    Free("delta", "angle", "direction of A, by Eq. (18)", range=True),
)


@dataclass(frozen=True, eq=False)
class _APoint:
    """One choice of A: Eq. (18)."""

    length: float
    delta: float

    def place(self, angle: float) -> complex:
        """A measured from P when the body is oriented at `angle`."""
        return self.length * cmath.exp(1j * (angle + self.delta - math.pi / 2))


class WanzerModified(Family):
    """One body through five, six or seven poses exactly, eight as well as can be, by an eight-link linkage."""

    name = "wanzer-modified"
    summary = "modified Wanzer linkage: slotted disk driven by a four-bar, eight links"
    source = (
        "Suárez-Velásquez, Cervantes-Sánchez, Rico-Martínez, Synthesis of a novel planar linkage to visit up to "
        "eight poses"
    )
    pose_counts = (5, 6, 7, 8)
    too_many = "the trammel has six essential parameters, and a four-bar nine"
    unknowns = "those of the trammel, and those of the four-bar"
    roots = "560 trammels and 3200 four-bars for seven poses"
    free = (*FREE, *CURVE_FREE, *_A_POINT, MAX_ANGLE_ERROR)
    inputs = ("crank", "rocker", "disk")
    many = True

    def check(self, task: Task) -> None:
        """Refuse choices that do not fit, and poses without sense for one of the halves."""
        seven_of(task).check()
        for name in ("L_AP", "delta"):
            if name not in task.free:
                key = "delta_deg" if name == "delta" else name
                raise TaskError(
                    f"{task.where}: free.{key}: missing; Eq. (18) places A by L_AP and delta_deg: give a number, or a "
                    f"range [low, high] to be searched"
                )
        low = task.free["L_AP"][0] if isinstance(task.free["L_AP"], tuple) else task.free["L_AP"]
        if low <= 0:
            raise TaskError(f"{task.where}: free.L_AP: {low:g} is no distance; A needs a place away from P")
        try:
            _curve(task, _a_points(task)[0]).check()
        except ValueError as error:
            raise TaskError(f"{task.where}: {error}") from None

    def system(self, task: Task) -> Problem | None:
        """The trammel's problem, which is the first of those that are solved."""
        return seven_of(task).problem()

    def solve(self, task: Task, solver: Callable[[Problem], Solutions]) -> list[Solved]:
        """The trammel (eight problems for eight poses), then the four-bar for each point A."""
        eight = len(task.poses[BODY]) == EIGHT
        problem = self.system(task)
        assert problem is not None
        solved = solve_eight(task, solver) if eight else [Solved(problem, solver(problem))]
        answer = eight_pose_answer(task, solved) if eight else None
        for a_point in _a_points(task):
            for near in _to_complete(task, answer, a_point):
                curve = _curve(task, a_point, near)
                problem = curve.problem()
                solved.append(Solved(problem, solver(problem)))
        return solved

    def designs_of(
        self, task: Task, solved: Sequence[Solved], progress: Callable[[str, float], None] | None = None
    ) -> Iterator[Candidate]:
        """The halves that fail alone, then the pairs."""
        eight = len(task.poses[BODY]) == EIGHT
        trammels: list[Placed | Near] = []
        answer = None
        part = seven_of(task)
        count = EIGHT if eight else 1
        if len(solved) < count:
            return
        if eight:
            answer = eight_pose_answer(task, solved[:count], progress)
            yield from answer.rejected
            trammels = [near for near in answer.ranked if near.exact]
            if not trammels:
                chosen = {id(n): n for a in _a_points(task) for n in _to_complete(task, answer, a) if n is not None}
                trammels = list(chosen.values())
            yield from _unused(answer, trammels)
        else:
            for found in part.trammels(solved[0].solutions):
                if isinstance(found, Placed):
                    trammels.append(found)
                else:
                    yield found
        first = sum(len(each.solutions.points) for each in solved[:count])
        signed = [self._signed(part, each) for each in trammels]
        parts = iter(solved[count:])
        for number, a_point in enumerate(_a_points(task)):
            for near in _to_complete(task, answer, a_point):
                each = next(parts, None)
                if each is None:
                    return
                those = [t for t in signed if near is None or t[0] is near]
                yield from self._product(task, part, a_point, near, those, each, first, number, progress)
                first += len(each.solutions.points)

    def _signed(self, part: TrammelTask, found: Placed | Near) -> tuple[Placed | Near, NDArray, NDArray, NDArray]:
        """A trammel, its poses, its coupler's rotations."""
        turns = found.coupler if isinstance(found, Near) else part.turns
        points = np.array([pose.point - part.task.poses[BODY][0].point for pose in part.task.poses[BODY]])
        return found, points[: len(turns)], turns, found.disk

    def _product(
        self,
        task: Task,
        part: TrammelTask,
        a_point: _APoint,
        near: Near | None,
        trammels: Sequence[tuple[Placed | Near, NDArray, NDArray, NDArray]],
        solved: Solved,
        first: int,
        number: int,
        progress: Callable[[str, float], None] | None,
    ) -> Iterator[Candidate]:
        curve = _curve(task, a_point, near)
        angle0 = task.poses[BODY][0].angle
        four_bars: list[Found] = []
        for found in curve.four_bars(solved.solutions, first):
            if isinstance(found, Found):
                four_bars.append(found)
            else:
                yield replace(found, note=found.note or "four-bar")
        good_bars, failed = _sound_four_bars(four_bars, task)
        yield from failed
        a0 = a_point.place(angle0)
        good: list[tuple[Placed | Near, NDArray, NDArray]] = []
        for trammel, points, turns, disk in trammels:
            signs = trammel_signs(trammel.trammel, a0, points, turns, disk)
            if _driven(task) is None or np.all(signs > 0) or np.all(signs < 0):
                good.append((trammel, turns, disk))
            elif number == 0:
                note = "trammel: its determinant changes sign between the poses, whatever leads A"
                yield Candidate(
                    None if trammel.root < 0 else trammel.root,
                    trammel.parameters(),
                    reasons=("branch",),
                    note=note,
                )
        for done, (trammel, turns, disk) in enumerate(good):
            if progress is not None:
                progress("pairing trammels and four-bars", done / max(len(good), 1))
            for found in good_bars:
                yield _pair(task, part, trammel, turns, disk, found, a_point)


def trammel_signs(
    trammel: Trammel,
    a_point: complex,
    points: NDArray[np.complex128],
    turns: NDArray[np.float64],
    disk: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Sign of the determinant of the two slots by θ and φ, when A is led, in each pose.

    Parameters
    ----------
    trammel : Trammel
    a_point : complex
        A in pose 0, measured from P.
    points, turns, disk : (poses,) arrays
        P from pose 0, rotations of coupler and disk, radians.

    Returns
    -------
    (poses,) array of −1, 0, 1
    """
    e, u = np.exp(1j * turns), trammel.u * np.exp(1j * disk)
    b, c = points + e * trammel.B - trammel.Q, points + e * trammel.C - trammel.Q
    arm_b, arm_c = 1j * e * (trammel.B - a_point), 1j * e * (trammel.C - a_point)
    # slots: Im(ū b) = a, −Re(ū c) = b; derivatives by φ, by θ
    f_phi, f_theta = (np.conj(u) * arm_b).imag, -(np.conj(u) * b).real
    g_phi, g_theta = -(np.conj(u) * arm_c).real, -(np.conj(u) * c).imag
    return np.sign(f_phi * g_theta - f_theta * g_phi)


def _a_points(task: Task) -> list[_APoint]:
    """The points A to try: one, or random ones in the ranges."""
    length, delta = task.free["L_AP"], task.free["delta"]
    if not isinstance(length, tuple) and not isinstance(delta, tuple):
        return [_APoint(float(length), float(delta))]
    rng = np.random.default_rng(task.seed)
    count = int(task.solve.get("samples", SAMPLES))

    def draw(value: float | tuple[float, float]) -> NDArray[np.float64]:
        return rng.uniform(*value, count) if isinstance(value, tuple) else np.full(count, float(value))

    return [_APoint(float(a), float(b)) for a, b in zip(draw(length), draw(delta))]


def _curve(task: Task, a_point: _APoint, near: Near | None = None) -> CurveTask:
    """The four-bar's points: places of A, measured from P in pose 0, in the poses or in those that a trammel takes."""
    poses = task.poses[BODY]
    origin = poses[0].point
    angles = [pose.angle for pose in poses] if near is None else poses[0].angle + near.coupler
    points = [pose.point - origin + a_point.place(angle) for pose, angle in zip(poses, angles)]
    chosen = {item.name: float(task.free[item.name]) for item in CURVE_FREE if item.name in task.free}
    return CurveTask(np.array(points, np.complex128), chosen)


def _driven(task: Task) -> str | None:
    """What drives the four-bar, in the words of `mechanisms.fourbar`; None when the trammel may drive it."""
    wanted = str(task.constraints.get("input", "crank"))
    return {"crank": "crank", "rocker": "follower"}.get(wanted)


def _sound_four_bars(found: Sequence[Found], task: Task) -> tuple[list[Found], list[Candidate]]:
    """Those which take A through its places, and the others with their defect."""
    from mechanisms.fourbar import judge_four_bars

    if not found:
        return [], []
    joints = [[f.four_bar.M, f.four_bar.R[0], f.four_bar.S[0], f.four_bar.N] for f in found]
    rotations = np.stack([f.four_bar.rotations() for f in found])
    driven = _driven(task)
    tests: tuple[tuple[str, str], ...] = (("circuit", "same_circuit"), ("branch", "same_branch"), ("order", "in_order"))
    if driven is None:  # driven from the trammel, a four-bar passes its own dead centres
        tests = tests[:1]
    verdict = judge_four_bars(joints, rotations, driven or "crank")
    good, failed = [], []
    for k, each in enumerate(found):
        for reason, key in tests:
            if not verdict[key][k]:
                failed.append(
                    Candidate(
                        each.root,
                        each.four_bar.parameters(),
                        reasons=(reason,),
                        note="four-bar, whatever is attached to it",
                    )
                )
                break
        else:
            good.append(each)
    return good, failed


def _pair(
    task: Task,
    part: TrammelTask,
    trammel: Placed | Near,
    turns: NDArray[np.float64],
    disk: NDArray[np.float64],
    found: Found,
    a_point: _APoint,
) -> Candidate:
    four_bar = found.four_bar
    origin = task.poses[BODY][0].point
    parameters = trammel.parameters() | four_bar.parameters() | {"L_AP": a_point.length, "delta": a_point.delta}
    error = trammel.worst if isinstance(trammel, Near) and not trammel.exact else None
    too_far = error is not None and error > float(task.free.get("max_angle_error", TOLERANCE))
    roots = [root for root in (trammel.root, found.root) if root >= 0]
    return Candidate(
        roots[0],
        parameters,
        modified_linkage(trammel.trammel, four_bar, origin, task.title, task.length_unit),
        modified_poses(disk, turns, four_bar),
        reasons=("inexact",) if too_far else (),
        note="" if not isinstance(trammel, Near) else _note(trammel),
        angles=ANGLES | {"delta"},
        pose_error=None if error is None else 0.0,
        angle_error=error,
        extra={"roots": roots, "curve": found.curve},
    )


def _note(near: Near) -> str:
    if near.exact:
        return "meets all eight poses"
    return "least squares" if near.omitted is None else f"pose {near.omitted}: position exact, orientation near"


def _to_complete(task: Task, answer: EightPoses | None, a_point: _APoint) -> Sequence[Near | None]:
    """What each four-bar problem of a point A belongs to: None is for all exact trammels together, which lead A to
    the same places; trammels that are not exact, the best ones whose determinant keeps its sign, have one each."""
    if answer is None or (answer.ranked and answer.ranked[0].exact):
        return [None]
    a0 = a_point.place(task.poses[BODY][0].angle)
    points = np.array([pose.point - task.poses[BODY][0].point for pose in task.poses[BODY]])
    good: list[Near | None] = []
    for near in answer.ranked:
        signs = trammel_signs(near.trammel, a0, points, near.coupler, near.disk)
        if _driven(task) is None or np.all(signs > 0) or np.all(signs < 0):
            good.append(near)
        if len(good) == COMPLETED:
            break
    return good


def _unused(answer: EightPoses, used: Sequence[Placed | Near]) -> Iterator[Candidate]:
    """Trammels for eight poses that are not completed by a four-bar, with their error."""
    for near in answer.ranked:
        if near not in used and near.root >= 0:
            degrees = math.degrees(near.worst)
            note = f"{answer.note(near)}, orientation {degrees:.3g}° off: better ones were completed"
            yield Candidate(near.root, near.parameters(), reasons=("inexact",), note=note, angles=ANGLES)
