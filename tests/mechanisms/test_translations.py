"""Parallel poses: what is built carries the body, and the closed formulas agree with the general judge."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from mechanisms import Task, TaskError, synthesize
from mechanisms.families.dyad_pairs import four_bar_verdicts, pair_candidate, pair_linkage
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.translations import circle_of, line_of
from mechanisms.linkage import LinkageError
from mechanisms.motion import judge

THREE = [(0, 0, 10), (70, 40, 10), (140, 20, 10)]
LINE = [(0, 0, 25), (60, 80, 25), (30, 40, 25)]


def task(rows, **tables) -> Task:
    poses = [dict(zip(("x", "y", "angle_deg"), map(float, row))) for row in rows]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": poses, **tables})


def on_circle(*degrees, centre=0j, radius=3.0):
    places = [centre + radius * cmath.exp(1j * math.radians(a)) for a in degrees]
    return [(z.real, z.imag, 20.0) for z in places]


def parallelogram(degrees, way):
    """Poses of a parallelogram with a crank of length one and the frame `way`, and its dyads."""
    poses = Poses.of([(math.cos(math.radians(a)), math.sin(math.radians(a)), 0.0) for a in degrees])
    first = complex(poses.points[0])
    return poses, MotionDyad("RR", 0j, first), MotionDyad("RR", way, first + way)


@pytest.mark.parametrize("rows", [THREE, on_circle(10, 40, 75, 130), on_circle(0, 20, 60, 75, 110)], ids=len)
def test_parallelograms_carry_the_body_and_never_turn_it(rows):
    result = synthesize(task(rows))
    made = [design for design in result.designs if design.extra["kind"] == "parallelogram"]
    assert made and all(design.accepted for design in made)
    for design in made:
        points = design.linkage.points
        assert abs((points["A1"] - points["O1"]) - (points["A2"] - points["O2"])) < 1e-9 * 140
        assert design.worst_pose_error < 1e-11 * 140
        assert all(pose["coupler"] == 0 for pose in design.poses)
        assert "change point" in design.note and not design.full_rotation


def test_the_best_parallelogram_stands_across_the_middle_of_the_swing():
    """The transmission angle cannot be more than a right angle less half of the swing."""
    poses = Poses.of(THREE)
    centre, radius = circle_of(poses)
    swing = abs(np.angle((poses.points[-1] - centre) / (poses.points[0] - centre)))
    best = max(d.min_transmission_deg for d in synthesize(task(THREE)).designs if d.extra["kind"] == "parallelogram")
    assert 90 - np.degrees(swing) / 2 - 0.5 < best <= 90 - np.degrees(swing) / 2 + 1e-9
    assert np.abs(np.abs(poses.points - centre) - radius).max() < 1e-12 * radius


def test_a_sampled_parallelogram_is_found_from_its_pivots():
    rng = np.random.default_rng(4)
    for _ in range(5):
        arm, o1, o2 = (complex(*rng.uniform(-1, 1, 2)) for _ in range(3))
        turns = np.sort(rng.uniform(0, 2 * np.pi, 4))
        places = 0.3 - 0.7j + arm * np.exp(1j * turns)
        free = {"O1_x": o1.real, "O1_y": o1.imag, "O2_x": o2.real, "O2_y": o2.imag}
        result = synthesize(task([(z.real, z.imag, 33) for z in places], free=free))
        (found,) = [d for d in result.designs if d.extra.get("kind") == "parallelogram"]
        expected = {0: o1 + arm * cmath.exp(1j * turns[0]), 1: o2 + arm * cmath.exp(1j * turns[0])}
        names = ("A1", "A2") if abs(found.linkage.points["O1"] - o1) < 1e-9 else ("A2", "A1")
        for k, name in enumerate(names):
            assert abs(found.linkage.points[name] - expected[k]) < 1e-9


@pytest.mark.parametrize(
    ("degrees", "way", "reason"),
    [
        ((30, 60, 100), 2, ()),
        ((30, 100, 60), 2, ("order",)),
        ((30, 60, 200), 2, ("branch",)),
        ((200, 250, 340), 0.4 + 0.1j, ()),
        ((-60, 30, 70), 1.5j, ()),
    ],
)
def test_parallelograms_are_judged_in_closed_form_as_by_the_general_judge(degrees, way, reason):
    poses, one, two = parallelogram(degrees, way)
    closed = four_bar_verdicts(poses, (one.fixed, two.fixed), (one.moving, two.moving))
    linkage, positions = pair_linkage(poses, one, two)
    for name, verdict in zip(("crank", "follower"), closed):
        general = judge(linkage, name, positions)
        assert general.reasons == reason
        for key in ("same_circuit", "same_branch", "in_order", "full_rotation"):
            assert bool(verdict[key][0]) == getattr(general, key)
        assert float(verdict["min_transmission_deg"][0]) == pytest.approx(general.min_transmission_deg, abs=1e-6)


def test_change_points_are_named():
    poses, one, two = parallelogram((30, 60, 200), 2)
    assert "a change point between poses 1 and 2" in pair_candidate(poses, one, two).note
    poses, one, two = parallelogram((30, 60, 100), 2)
    assert "folds flat (a change point) 30° beyond pose 0" in pair_candidate(poses, one, two).note
    poses, one, two = parallelogram((30, 60, 180), 2)
    candidate = pair_candidate(poses, one, two)
    assert "folded flat in pose 2" in candidate.note
    with pytest.raises(LinkageError, match="double point"):
        judge(candidate.linkage, "crank", candidate.poses)


def test_a_scotch_yoke_goes_on_where_parallelograms_fold():
    result = synthesize(task(on_circle(0, 90, 180, 270)))
    (accepted,) = result.accepted
    assert accepted.extra["kind"] == "Scotch yoke" and accepted.full_rotation
    assert accepted.worst_pose_error < 1e-12
    assert {d.reasons for d in result.designs if d is not accepted} == {("branch",)}
    (yoke,) = [d for d in synthesize(task(on_circle(0, 180, 90, 270))).designs if d.extra["kind"] == "Scotch yoke"]
    assert yoke.reasons == ("order",)


def test_positions_on_a_line_are_met_by_a_slide_and_its_crank():
    result = synthesize(task(LINE))
    assert len(result.accepted) == 2
    for design in result.accepted:
        assert design.extra["kind"] == "slide driven by a crank" and design.full_rotation
        assert design.worst_pose_error < 1e-11
        # the rod is three cranks long: its least angle with the normal of the slide is acos(1/3)
        assert design.min_transmission_deg >= math.degrees(math.acos(1 / 3)) - 1e-6
    given = synthesize(task(LINE, free={"O1_x": -80, "O1_y": -40, "A2_x": 5, "A2_y": 9})).designs
    assert [(d.linkage.points["O1"], d.linkage.points["A2"]) for d in given] == [(-80 - 40j, 5 + 9j)]
    assert given[0].worst_pose_error < 1e-11


def test_a_crank_that_does_not_reach_is_said():
    (design,) = synthesize(task(LINE, free={"O1_x": 30.0, "O1_y": 41.0})).designs
    assert design.reasons == ("degenerate",) and "does not reach" in design.note


def test_two_parallel_poses_leave_everything_open():
    kinds = {d.extra.get("kind") for d in synthesize(task(THREE[:2])).accepted}
    assert {"parallelogram", "Scotch yoke", "slide driven by a crank", "slider-crank"} <= kinds


def test_what_there_is_moves_with_the_task():
    poses = Poses.of(THREE)
    moved = 12.5 * cmath.exp(0.7j) * poses.points + 40 - 25j
    rows = [(z.real, z.imag, 10 + math.degrees(0.7)) for z in moved]
    (before,), (after,) = ([d for d in synthesize(task(given)).designs if d.extra["kind"] == "Scotch yoke"]
                           for given in (THREE, rows))  # fmt: skip
    assert abs(12.5 * cmath.exp(0.7j) * before.pivots["O1"] + 40 - 25j - after.pivots["O1"]) < 1e-9
    order = [1, 2, 0]
    assert abs(circle_of(Poses(poses.points[order], poses.angles))[0] - circle_of(poses)[0]) < 1e-10
    assert line_of(Poses.of(LINE)) is not None and line_of(poses) is None


@pytest.mark.parametrize(
    ("rows", "free", "words"),
    [
        ([(0, 0, 5), (1, 0, 5), (2, 1, 5), (3, 5, 5)], {}, "two crossed slides with a drive for each"),
        (THREE, {"O1_x": 0, "O1_y": 0, "L_ground": 70, "L_link2": 50}, "leave its place open; give pivots"),
    ],
)
def test_parallel_poses_without_such_a_linkage_are_refused(rows, free, words):
    with pytest.raises(TaskError, match=words):
        task(rows, free=free)
