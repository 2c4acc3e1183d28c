"""Invariance of the designs, and motions that are special."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from four_bar_samples import four_bar_poses

from mechanisms import Pose, Task, TaskError, synthesize
from mechanisms.families.burmester import dyad_parameters, generic_dyads, projective_system
from mechanisms.families.motion_dyads import Poses, common_pole
from solvers import solve


def task(poses) -> Task:
    rows = [pose.as_dict() for pose in poses]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows})


def sample(seed):
    poses, _ = four_bar_poses(np.random.default_rng(seed))
    return [Pose(complex(z), float(a)) for z, a in zip(poses.points, poses.angles)]


def fingerprints(result, undo=lambda z: z):
    """For each design its fixed pivots and what does not depend on the order of the poses."""
    found = []
    for design in result.designs:
        if design.linkage is None:
            continue
        fixed = sorted((undo(z) for z in design.pivots.values()), key=lambda z: (round(z.real, 5), z.imag))
        verdicts = [design.verdicts[name] for name in ("crank", "follower")]
        facts = sorted((v["same_circuit"], v["same_branch"], v["full_rotation"]) for v in verdicts)
        found.append((fixed, facts, design.link_ratio))
    return sorted(found, key=lambda item: (round(item[2], 6), round(item[0][0].real, 5)))


def same(one, two):
    assert len(one) == len(two) > 0
    for (fixed, facts, ratio), (fixed2, facts2, ratio2) in zip(one, two):
        assert np.allclose(fixed, fixed2, atol=1e-6)
        assert facts == facts2
        assert ratio == pytest.approx(ratio2, rel=1e-6)


@pytest.mark.parametrize("seed", [1, 2])
def test_designs_move_with_the_task(seed):
    poses = sample(seed)
    before = fingerprints(synthesize(task(poses)))
    turn, factor, shift = 0.7, 12.5, 40 - 25j
    change = factor * cmath.exp(1j * turn)
    moved = [Pose(change * pose.point + shift, pose.angle + turn) for pose in poses]
    same(before, fingerprints(synthesize(task(moved)), lambda z: (z - shift) / change))


@pytest.mark.parametrize("order", [[4, 3, 2, 1, 0], [2, 0, 4, 1, 3]])
def test_order_of_the_poses_only_changes_the_verdict_on_order(order):
    poses = sample(3)
    same(fingerprints(synthesize(task(poses))), fingerprints(synthesize(task([poses[k] for k in order]))))


def test_reversing_the_poses_keeps_even_the_order():
    poses = sample(4)
    verdicts = []
    for given in (poses, poses[::-1]):
        result = synthesize(task(given))
        rows = [(round(d.link_ratio, 6), d.reasons) for d in result.designs if d.linkage is not None]
        verdicts.append(sorted(rows))
    assert verdicts[0] == verdicts[1]


def test_a_mirrored_task_has_mirrored_designs():
    poses = sample(5)
    mirrored = [Pose(pose.point.conjugate(), -pose.angle) for pose in poses]
    same(
        fingerprints(synthesize(task(poses))),
        fingerprints(synthesize(task(mirrored)), lambda z: z.conjugate()),
    )


def test_the_place_of_the_reference_point_in_the_body_does_not_matter():
    poses = sample(6)
    arm = 0.8 - 0.3j
    shifted = [Pose(pose.carry(arm), pose.angle) for pose in poses]
    same(fingerprints(synthesize(task(poses))), fingerprints(synthesize(task(shifted))))


def test_four_turns_about_one_point_are_refused_with_the_point():
    poses = [Pose.of(3 + math.cos(a), 1 + math.sin(a), math.degrees(a)) for a in (0, 0.5, 1.4, 2.0)]
    with pytest.raises(TaskError, match=r"poses 0, 1, 2, 3 are turns about one point, \(3, 1\)"):
        task([*poses, Pose.of(9, 9, 12)])


def test_four_parallel_poses_on_a_circle_are_refused_and_others_have_no_design():
    circle = [Pose.of(math.cos(a), math.sin(a), 30) for a in (0, 0.5, 1.4, 2.0)]
    with pytest.raises(TaskError, match="poses 0, 1, 2, 3 are parallel with positions on one circle"):
        task([*circle, Pose.of(9, 9, 12)])
    scattered = [Pose.of(x, y, 30) for x, y in ((0, 0), (1, 0.2), (2, 1), (3, 0))]
    result = synthesize(task([*scattered, Pose.of(4, 2, 130)]))
    assert not any(design.accepted for design in result.designs)
    assert result.roots["real"] == 0


def test_three_turns_about_one_point_leave_dyads_that_are_held_there():
    poses = Poses.of([(1, 0, 0), (0, 1, 90), (-1, 0, 180), (3, -1, 210), (2, 1, 33)])
    three = Poses(poses.points[:3], poses.angles[:3])
    assert abs(common_pole(three)) < 1e-12
    result = synthesize(task([Pose(complex(z), float(a)) for z, a in zip(poses.points, poses.angles)]))
    (design,) = [design for design in result.designs if design.linkage is not None]
    points = design.linkage.points
    assert min(abs(points[name]) for name in ("O1", "O2")) < 1e-9  # a fixed pivot at the pole …
    assert min(abs(points[name]) for name in ("A1", "A2")) < 1e-9  # … and a moving pivot of the other dyad


def test_a_whole_circle_of_sliders_is_said_not_hidden():
    """Cardan motion: every point of a circle of the body moves on a line, its centre on a circle."""
    points, angles = [], []
    for turn in (0.3, 0.5, 0.8, 1.1, 1.3):
        first, second = 2 * math.cos(turn), 2j * math.sin(turn)
        angle = cmath.phase(second - first)
        points.append(first + (0.4 + 0.6j) * cmath.exp(1j * angle))
        angles.append(angle)
    poses = Poses(np.array(points), np.array(angles) - angles[0])
    found = solve(projective_system(), dyad_parameters(poses), generic_dyads(), certificates=False)
    assert (len(found), int(found.singular.multiplicity.sum())) == (1, 3)
    result = synthesize(task([Pose(z, a) for z, a in zip(points, angles)]))
    assert any("fill a whole curve" in design.note for design in result.designs)
