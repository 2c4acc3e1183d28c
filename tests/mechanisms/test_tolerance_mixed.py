"""Tolerances of poses mixed with points: the sweep against single solves, designs within the zones."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses, mixed_task

from mechanisms import Task, TaskError, synthesize
from mechanisms.families.base import BODY
from mechanisms.families.mixed_motion import mixed_problem
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance_mixed import MixedPositions, positions_of
from solvers import solve


def rocker(count: int, noise: float) -> Poses:
    """Positions of a crank-rocker driven one way, each off by a little."""
    o2, crank, coupler, follower = 4.0, 1.5, 4.0, 3.0
    tips = crank * np.exp(1j * np.linspace(0.3, 2.0, count))
    way = o2 - tips
    d = np.abs(way)
    turn = way / d * np.exp(1j * np.arccos((coupler**2 + d**2 - follower**2) / (2 * coupler * d)))
    rng = np.random.default_rng(1)
    rng.normal(size=12)
    places = tips + (1.0 + 0.8j) * turn + noise * (rng.normal(size=count) + 1j * rng.normal(size=count))
    return Poses(places, np.angle(turn))


@pytest.mark.parametrize(("count", "points"), [(4, 2), (3, 4)])
def test_a_sweep_finds_the_real_roots_of_single_solves(count, points):
    samples = [four_bar_poses(np.random.default_rng(seed), count + points)[0] for seed in (5, 6, 7)]
    source = MixedPositions(mixed_task(samples[0], count))
    swept = source.pairs([positions_of(mixed_task(poses, count)) for poses in samples])
    single = source.problem
    (first, *_) = swept
    asked = mixed_task(samples[0], count)
    roots = solve(single.system, mixed_problem(asked).parameters, source.start, certificates=False).points
    assert 2 * len(first) == int(single.real(roots).sum())
    for poses, pairs in zip(samples, swept):
        for pair in pairs:
            assert max(dyad.errors(pair.poses).max() for dyad in pair.dyads) < 1e-8 * poses.size
            assert np.allclose(pair.poses.points, poses.points)


def test_designs_within_the_tolerances_where_no_exact_one_is_good():
    count, points, reach = 3, 4, 0.03
    poses = rocker(count + points, 0.01)
    constraints = {"max_link_ratio": 10.0, "min_transmission_deg": 15.0}
    zone = [0.0] + [reach] * (count + points - 1)
    free = {"tolerance_x": zone, "tolerance_y": zone, "tolerance_angle_deg": [0.0, 1.0, 1.0]}
    asked = mixed_task(poses, count, free=free, constraints=constraints)
    result = synthesize(asked)
    made = [design for design in result.designs if "moved" in design.extra]
    if exact := [design for design in result.accepted if "moved" not in design.extra]:
        pytest.fail(f"the sample has exact designs: {exact}")
    assert made and all(design.accepted for design in made)
    wanted = positions_of(asked)
    for design in made:
        x, y, angle = np.array(design.extra["moved"]).T
        assert len(x) == count + points
        assert np.abs([x, y]).max() <= reach + 1e-9 and np.all(angle[count:] == 0)
        places = np.array([design.linkage.positions(pose)["P"] for pose in design.poses])
        assert np.allclose(places - wanted.points, x + 1j * y, atol=1e-8)
        assert design.worst_pose_error == pytest.approx(np.abs(x + 1j * y).max())


def test_numbers_given_are_kept_within_the_tolerances():
    rows = [(0, 0, 0), (30, 40, 20), (80, 55, 55)]
    poses = [dict(zip(("x", "y", "angle_deg"), map(float, row))) for row in rows]
    free = {"O1_x": 0, "O1_y": -40, "L_ground": 70, "L_link2": 50}
    zone = {f"tolerance_{axis}": [0.0, 6.0, 6.0] for axis in "xy"}
    asked = Task.from_dict({"mechanism": "four-bar-motion", "poses": poses, "free": {**free, **zone}})
    source = MixedPositions(asked)
    for pair in source.pairs([positions_of(asked)])[0]:
        one, other = pair.dyads
        assert abs(one.fixed + 40j) < 1e-9 and abs(abs(one.fixed - other.fixed) - 70) < 1e-8
        assert abs(other.length - 50) < 1e-8
    for design in synthesize(asked).designs:
        if "moved" in design.extra:
            points = design.linkage.points
            assert abs(abs(points["O1"] - points["O2"]) - 70) < 1e-8


def test_a_root_is_followed_and_comes_back():
    poses, _ = four_bar_poses(np.random.default_rng(9), 6)
    asked = mixed_task(poses, 4)
    source, here = MixedPositions(asked), positions_of(asked)
    (pairs,) = source.pairs([here])
    moved = Poses(here.points + 1e-4 * (1 + 1j) * np.arange(6), here.angles)
    for pair in pairs[:4]:
        for there in source.follow(pair, moved):
            assert max(dyad.errors(there.poses).max() for dyad in there.dyads) < 1e-8
            (again,) = source.follow(there, here)
            assert abs(again.dyads[0].fixed - pair.dyads[0].fixed) < 1e-6 * (1 + abs(pair.dyads[0].fixed))


@pytest.mark.parametrize(
    ("free", "words"),
    [
        ({"tolerance_x": [1.0] * 4}, "4 values for 4 poses and 2 points"),
        ({"tolerance_angle_deg": [1.0] * 6}, "6 values for 4 poses"),
        ({"tolerance_y": [0, 1, 1, 1, -1, 0]}, "negative"),
    ],
)
def test_tolerances_that_do_not_fit_are_refused(free, words):
    poses, _ = four_bar_poses(np.random.default_rng(1), 6)
    with pytest.raises(TaskError, match=words):
        mixed_task(poses, 4, free=free)


def test_positions_are_poses_then_points():
    poses, _ = four_bar_poses(np.random.default_rng(1), 6)
    asked = mixed_task(poses, 4)
    assert np.allclose(positions_of(asked).points, poses.points)
    assert len(asked.poses[BODY]) == 4 and not positions_of(asked).angles[4:].any()
