"""The family from task to judged designs."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses, inverted_slider_crank_poses, slider_crank_poses

from mechanisms import Task, TaskError, synthesize
from mechanisms.families.motion_dyads import Poses
from mechanisms.motion import judge


def task_of(poses: Poses, **more) -> Task:
    rows = [
        {"x": z.real, "y": z.imag, "angle_deg": float(np.degrees(angle))}
        for z, angle in zip(poses.points, poses.angles)
    ]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, **more})


def test_four_real_dyads_make_six_four_bars():
    result = synthesize(Task.from_file("examples/four_bar_five_poses.toml"))
    assert len(result.designs) == 6
    assert result.roots["count"] == result.roots["certified_real"] == 4
    assert [stage["left"] for stage in result.funnel][:4] == [4, 4, 4, 6]
    for design in result.designs:
        assert design.worst_pose_error < 1e-12
        assert design.extra["kind"] == "four-bar"
        assert set(design.linkage.inputs) == {"crank", "follower"}


def test_the_sampled_four_bar_is_a_design_with_its_own_verdict():
    rng = np.random.default_rng(12)
    for _ in range(3):
        poses, true = four_bar_poses(rng)
        result = synthesize(task_of(poses))
        pivots = sorted((dyad.fixed for dyad in true), key=abs)
        hits = [
            design
            for design in result.designs
            if design.linkage is not None
            and np.allclose(sorted((design.linkage.points[n] for n in ("O1", "O2")), key=abs), pivots, atol=1e-8)
        ]
        assert len(hits) == 1


@pytest.mark.parametrize(
    ("sample", "kind"),
    [(slider_crank_poses, "slider-crank"), (inverted_slider_crank_poses, "inverted slider-crank")],
    ids=["PR", "RP"],
)
def test_sliders_become_slider_cranks_that_are_judged(sample, kind):
    poses, _ = sample(np.random.default_rng(3))
    result = synthesize(task_of(poses))
    kinds = [design.extra.get("kind") for design in result.designs]
    assert kind in kinds
    for design in result.designs:
        if design.extra.get("kind") == kind:
            assert design.worst_pose_error < 1e-8
            assert set(design.verdicts) == {"crank", "follower"}


def test_the_crank_is_the_side_that_drives_better():
    poses, _ = four_bar_poses(np.random.default_rng(8))
    for design in synthesize(task_of(poses)).designs:
        if design.linkage is None:
            continue
        defects = [len(judge(design.linkage, side, design.poses).reasons) for side in ("crank", "follower")]
        assert defects[0] <= defects[1]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([(0, 0, 10), (1, 0, 10), (2, 1, 10), (3, 5, 10), (4, 4, 10)], "no circle and no line"),
        ([(1, 0, 0), (0, 1, 90), (-1, 0, 180), (0, -1, 270), (-0.6, 0.8, 126.86989764584402)], "pin it there"),
    ],
)
def test_motions_that_need_no_four_bar_are_refused(rows, words):
    poses = [dict(zip(("x", "y", "angle_deg"), row)) for row in rows]
    with pytest.raises(TaskError, match=words):
        Task.from_dict({"mechanism": "four-bar-motion", "poses": poses})


def test_repeated_poses_are_refused_by_name():
    poses = [{"x": x, "y": 0.0, "angle_deg": 10.0 * x} for x in (0, 1, 2, 1, 4)]
    with pytest.raises(TaskError, match="pose 1 and pose 3 are the same"):
        Task.from_dict({"mechanism": "four-bar-motion", "poses": poses})


def test_a_place_far_beyond_the_others_is_judged_not_lost_to_rounding():
    rows = [(0.0, 0.0, 0.0), (1e15, 40.0, 20.0), (80.0, 55.0, 55.0), (125.0, 35.0, 90.0)]
    task = Task.from_dict(
        {"mechanism": "four-bar-motion", "poses": [{"x": x, "y": y, "angle_deg": a} for x, y, a in rows]}
    )
    assert all(np.isfinite(design.worst_pose_error) for design in synthesize(task).designs)
