"""Tolerance zones: the sweep against single solves, and designs against the general judge."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses

from mechanisms import Task, TaskError, synthesize
from mechanisms.families.base import BODY
from mechanisms.families.burmester import five_pose_dyads
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance import Tolerances, tolerance_candidates
from mechanisms.families.tolerance_sources import FivePoses, dyads_of_many

EXAMPLE = "examples/four_bar_tolerances.toml"


def test_a_sweep_finds_what_single_solves_find():
    rng = np.random.default_rng(2)
    many = [four_bar_poses(rng)[0] for _ in range(20)]
    for poses, swept in zip(many, dyads_of_many(many)):
        single = five_pose_dyads(poses)
        assert len(swept) == len(single)
        for dyad in single:
            assert min(abs(dyad.fixed - other.fixed) + abs(dyad.moving - other.moving) for other in swept) < 1e-7


def test_every_reported_design_takes_poses_within_the_tolerances_without_defect():
    task = Task.from_file(EXAMPLE)
    result = synthesize(task)
    exact = [design for design in result.designs if "moved" not in design.extra]
    moved = [design for design in result.designs if "moved" in design.extra]
    assert exact and not any(design.accepted for design in exact)
    assert len(moved) == 6 and all(design.accepted for design in moved)
    wanted = Poses.of(task.poses[BODY])
    bounds = np.array([task.free[name] for name in ("tolerance_x", "tolerance_y", "tolerance_angle")])
    for design in moved:
        places = [design.linkage.positions(pose)["P"] for pose in design.poses]
        turns = np.array([pose["coupler"] for pose in design.poses])
        x, y, angle = np.array(design.extra["moved"]).T
        assert np.allclose(places - wanted.points, x + 1j * y, atol=1e-8)
        assert np.allclose(turns - wanted.angles, np.radians(angle), atol=1e-9)
        assert np.all(np.abs([x, y, np.radians(angle)]) <= bounds + 1e-9)
        assert design.worst_pose_error == pytest.approx(np.abs(x + 1j * y).max())
        used = np.abs([x, y, np.radians(angle)])[bounds > 0] / bounds[bounds > 0]
        assert design.extra["tolerance_used"] == pytest.approx(used.max())
    assert [stage["left"] for stage in result.funnel][:3] == [4, 4, 2]


def test_the_same_seed_gives_the_same_designs():
    poses = Poses.of(Task.from_file(EXAMPLE).poses[BODY])
    zones = Tolerances(*np.array([[0, 3, 3, 3, 0], [0, 3, 3, 3, 0], [0, 0.05, 0.05, 0.05, 0]], float))
    one, two = (
        [candidate.parameters["O1"] for candidate in tolerance_candidates(FivePoses(), poses, zones, 7, {}, trials=128)]
        for _ in range(2)
    )
    assert one == two and len(one) > 1


def test_without_tolerance_nothing_moves():
    poses, _ = four_bar_poses(np.random.default_rng(3))
    zero = np.zeros(5)
    for candidate in tolerance_candidates(FivePoses(), poses, Tolerances(zero, zero, zero), 0, {}, trials=16):
        assert candidate.pose_error == 0.0
        assert candidate.extra["tolerance_used"] == 0.0


@pytest.mark.parametrize(
    ("count", "values", "words"),
    [
        (4, [1.0] * 5, "5 values for 4 poses"),
        (5, [1.0] * 4, "4 values for 5 poses"),
        (5, [1, 1, -1, 1, 1], "negative"),
    ],
)
def test_tolerances_that_do_not_fit_are_refused(count, values, words):
    rows = [{"x": float(k), "y": float(k * k), "angle_deg": 20.0 * k} for k in range(count)]
    with pytest.raises(TaskError, match=words):
        Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, "free": {"tolerance_x": values}})
