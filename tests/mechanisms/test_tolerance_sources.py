"""Tolerances of two, three and four poses: designs where the exact answer is none, and none where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.families.base import BODY
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance import Pair, tolerances_of
from mechanisms.families.tolerance_sources import FewerPoses

LIFT = [(0, 0, 0), (30, 40, 20), (80, 55, 55), (125, 35, 90)]
PIVOTS = {"O1_x": 0.0, "O1_y": -40.0, "O2_x": 60.0, "O2_y": -40.0}


def task(count, reach, free=None, **constraints) -> Task:
    rows = [dict(zip(("x", "y", "angle_deg"), map(float, row))) for row in LIFT[:count]]
    zone = [0.0] + [reach] * (count - 1)
    names = ("tolerance_x", "tolerance_y", "tolerance_angle_deg")
    free = {**(free or {}), **(dict.fromkeys(names, zone) if reach else {})}
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, "free": free, "constraints": constraints})


#: Poses, tolerance, what is given, constraints that no exact design meets.
CASES = {
    "four": (4, 5.0, {}, {"min_transmission_deg": 52.0}),
    "three": (3, 8.0, PIVOTS, {"min_transmission_deg": 20.0}),
    "two": (
        2,
        5.0,
        {**PIVOTS, "A1_x": [-80, -20], "A1_y": [-60, 60]},
        {"min_transmission_deg": 60.0, "max_link_ratio": 2.2},
    ),
}


@pytest.mark.parametrize("name", ["four", "three", "two"])
def test_designs_are_found_within_the_tolerances_where_no_exact_one_is_good(name):
    count, reach, free, constraints = CASES[name]
    assert not synthesize(task(count, 0, free, **constraints)).accepted
    asked = task(count, reach, free, **constraints)
    made = synthesize(asked).accepted
    assert 1 <= len(made) <= 6
    wanted = Poses.of(asked.poses[BODY])
    zones = tolerances_of(asked, count)
    for design in made:
        x, y, angle = np.array(design.extra["moved"]).T
        places = np.array([design.linkage.positions(pose)["P"] for pose in design.poses])
        turns = np.array([pose["coupler"] for pose in design.poses])
        assert np.allclose(places - wanted.points, x + 1j * y, atol=1e-8)
        assert np.allclose(turns - wanted.angles, np.radians(angle), atol=1e-9)
        for moved, zone in ((x, zones.x), (y, zones.y), (np.radians(angle), zones.angle)):
            assert np.all(np.abs(moved) <= design.extra["tolerance_used"] * zone + 1e-9)
        assert design.extra["tolerance_used"] <= 1 and design.worst_pose_error > 0
        assert "of their tolerances" in design.note
        if free:
            pivots = {complex(round(z.real, 6), round(z.imag, 6)) for z in design.pivots.values()}
            assert pivots == {-40j, 60 - 40j}


def test_good_exact_designs_leave_nothing_to_search():
    result = synthesize(task(3, 8.0, PIVOTS))
    assert len(result.accepted) == 1
    assert not any("moved" in design.extra for design in result.designs)


def test_tolerances_that_are_too_narrow_say_so():
    result = synthesize(task(3, 0.01, PIVOTS, min_transmission_deg=20.0))
    assert not result.accepted
    assert any("none of 128 tasks within the tolerances" in design.note for design in result.designs)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_a_four_bar_is_followed_to_poses_nearby(count):
    asked = task(count, 2.0, PIVOTS if count < 4 else None)
    source = FewerPoses(asked)
    poses = Poses.of(asked.poses[BODY])
    (pairs,) = source.pairs([poses])
    assert pairs
    moved = Poses(poses.points + 0.1 * np.arange(count), poses.angles + 0.001 * np.arange(count))
    for pair in pairs:
        (followed,) = source.follow(pair, moved)
        assert isinstance(followed, Pair)
        for before, after in zip(pair.dyads, followed.dyads):
            assert after.errors(moved).max() < 1e-7 * moved.size
            assert abs(after.fixed - before.fixed) + abs(after.moving - before.moving) < 0.3 * poses.size
        (again,) = source.follow(followed, poses)
        assert max(dyad.errors(poses).max() for dyad in again.dyads) < 1e-7 * poses.size


def test_the_same_seed_gives_the_same_designs():
    one, two = ([d.linkage.points for d in synthesize(task(*CASES["three"][:3], **CASES["three"][3])).accepted]
                for _ in range(2))  # fmt: skip
    assert one == two and one


def test_the_sheet_of_a_design_says_how_far_each_pose_moved():
    from mechanisms.tables import moved_rows

    count, reach, free, constraints = CASES["three"]
    result = synthesize(task(count, reach, free, **constraints))
    rows = moved_rows(result.accepted[0])
    assert [row[0] for row in rows] == ["0", "1", "2"] and rows[0][1:] == ("0", "0", "0")
    assert [float(cell) for cell in rows[1][1:]] == pytest.approx(result.accepted[0].extra["moved"][1], rel=1e-3)
    exact = next(design for design in result.designs if "moved" not in design.extra)
    assert moved_rows(exact) == []
