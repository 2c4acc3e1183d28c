"""Invariance of the designs, and motions that are special."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest
from four_bar_samples import four_bar_poses

from mechanisms import Pose, Task, TaskError, synthesize
from mechanisms.families.burmester import dyad_parameters, generic_dyads, projective_system
from mechanisms.families.circle_points import CircleCurve
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
    return sorted(found, key=lambda item: (round(item[2], 6), [round(z.real, 5) for z in item[0]]))


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


def mixture(poses, points, **free) -> Task:
    places = [{"x": float(x), "y": float(y)} for x, y in points]
    rows = [pose.as_dict() for pose in poses]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, "points": places, "free": free})


TURNS = [Pose.of(3 + math.cos(a), 1 + math.sin(a), math.degrees(a)) for a in (0, 0.5, 1.4, 2.0)]
LEVEL = [Pose.of(x, y, 30) for x, y in ((0, 0), (1, 0.2), (2, 1), (3, 0))]
BENT = [Pose.of(0, 0, 0), Pose.of(1, 0.5, 20), Pose.of(2, 0.2, 50), Pose.of(3, 1, 70)]


@pytest.mark.parametrize(
    ("poses", "points", "free", "words"),
    [
        (TURNS, [(4, 2), (5, 1)], {}, r"turns about one point, \(3, 1\)"),
        (TURNS[:3], [], {"L_ground": 1, "L_link1": 1, "L_link2": 1, "O1_x": 0}, "turns about one point"),
        (LEVEL, [(4, 1), (5, 0.5)], {}, "never turns in them, .*; turn one of them"),
        (LEVEL[:3], [], {"O1_x": 0, "O1_y": 0, "L_ground": 70, "L_link2": 50}, "never turns in them, .*; give pivots"),
        (BENT, [(1, 0.5), (4, 1)], {}, "point 0 is where pose 1 is"),
        (BENT, [(4, 1), (4, 1)], {}, "point 0 and point 1 are the same"),
        ([*BENT[:3], BENT[0]], [(4, 1), (5, 1)], {}, "pose 0 and pose 3 are the same"),
    ],
)
def test_mixtures_that_are_special_are_refused(poses, points, free, words):
    with pytest.raises(TaskError, match=words):
        mixture(poses, points, **free)


def test_points_on_one_line_are_said_to_leave_families_of_sliders():
    poses = [Pose.of(0, 0, 10), Pose.of(1, 0, 30), Pose.of(2, 0, -20)]
    result = synthesize(mixture(poses, [(4, 0), (5, 0), (6, 0), (7, 0)]))
    assert result.ledger["at_infinity"] == result.ledger["tracked"] == 402
    assert any("sliders come in whole families" in design.note for design in result.designs)


@pytest.mark.parametrize("count", [2, 3, 4, 5])
def test_repeated_poses_and_whole_turns_are_refused_whatever_their_number(count):
    rows = [Pose.of(0.5 * k, 0.3 * k * k, 17 * k) for k in range(count - 1)]
    with pytest.raises(TaskError, match=f"pose 0 and pose {count - 1} are the same"):
        task([*rows, rows[0]])
    with pytest.raises(TaskError, match=f"pose 0 and pose {count - 1} are the same"):
        task([*rows, Pose(rows[0].point, rows[0].angle + 2 * math.pi)])


@pytest.mark.parametrize("count", [3, 4, 5])
def test_pure_rotations_are_refused_with_their_pole(count):
    angles = (0, 0.5, 1.4, 2.0, 2.9)[:count]
    with pytest.raises(TaskError, match=r"only turns about the point \(3, 1\); pin it there"):
        task([Pose.of(3 + math.cos(a), 1 + math.sin(a), math.degrees(a)) for a in angles])


def test_two_poses_of_a_rotation_have_four_bars_like_any_two():
    result = synthesize(task(TURNS[:2]))
    assert result.accepted and max(design.worst_pose_error for design in result.accepted) < 1e-9


# --- two, three and four poses: choices that move with the task ---------------------------------------------------


def given_pivots(change=lambda z: z):
    """Fixed pivots at (0, −40) and (60, −40), moved with the task."""
    places = {"O1": change(-40j), "O2": change(60 - 40j)}
    parts = (("x", "real"), ("y", "imag"))
    return {f"{name}_{axis}": getattr(z, part) for name, z in places.items() for axis, part in parts}


LIFT = [Pose.of(0, 0, 0), Pose.of(30, 40, 20), Pose.of(80, 55, 55), Pose.of(125, 35, 90)]
TURN, FACTOR, SHIFT = 0.7, 12.5, 40 - 25j


def moved(poses):
    change = FACTOR * cmath.exp(1j * TURN)
    return [Pose(change * pose.point + SHIFT, pose.angle + TURN) for pose in poses]


def forward(z):
    return FACTOR * cmath.exp(1j * TURN) * z + SHIFT


def backward(z):
    return (z - SHIFT) / (FACTOR * cmath.exp(1j * TURN))


def free_task(poses, **free) -> Task:
    rows = [pose.as_dict() for pose in poses]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, "free": free})


def test_four_poses_have_the_same_designs_wherever_they_are():
    same(
        fingerprints(synthesize(free_task(LIFT))),
        fingerprints(synthesize(free_task(moved(LIFT))), backward),
    )


def test_three_poses_with_given_pivots_have_the_same_design_wherever_and_in_whatever_order():
    before = fingerprints(synthesize(free_task(LIFT[:3], **given_pivots())))
    same(before, fingerprints(synthesize(free_task(moved(LIFT[:3]), **given_pivots(forward))), backward))
    for order in ([2, 1, 0], [1, 0, 2], [1, 2, 0]):
        same(before, fingerprints(synthesize(free_task([LIFT[k] for k in order], **given_pivots()))))


def test_two_poses_have_the_same_designs_after_a_shift_in_another_unit():
    """Regions and samples are along the axes, so that only a turn changes what is looked at."""
    poses = LIFT[:2]
    scaled = [Pose(FACTOR * pose.point + SHIFT, pose.angle) for pose in poses]
    same(fingerprints(synthesize(free_task(poses))),
         fingerprints(synthesize(free_task(scaled)), lambda z: (z - SHIFT) / FACTOR))  # fmt: skip
    pivots = {"O1_x": 0.0, "O1_y": -40.0, "A2_x": 40.0, "A2_y": 10.0}
    for design in synthesize(free_task(poses, **pivots)).accepted:
        assert design.worst_pose_error < 1e-9


@pytest.mark.parametrize("order", [[3, 2, 1, 0], [1, 3, 0, 2]], ids=["reversed", "permuted"])
def test_the_curves_of_four_poses_do_not_depend_on_their_order(order):
    """Centre points stay; circle points are the same points of the body, seen from another pose."""
    poses = Poses.of(LIFT)
    other = Poses.of([LIFT[k] for k in order])
    one, two = CircleCurve(poses), CircleCurve(other)
    assert len(one.circuits) == len(two.circuits)
    for circuit in one.circuits:
        fixed, moving = one.dyads(circuit, np.linspace(0.2, 6.0, 25))
        carried = poses.carry(moving)[:, order[0]]
        for g, z in zip(fixed, carried):
            found, phi, distance = two.nearest(complex(z))
            assert distance < 1e-5 * (poses.size + abs(z - poses.points[0]))
            again = two.dyads(found, phi)[0][0]
            assert abs(again - g) < 1e-3 * (poses.size + abs(g - poses.points[0]))
    (slide, block), (slide2, block2) = one.sliders(), two.sliders()
    assert abs(block.fixed - block2.fixed) < 1e-6 * poses.size
    assert abs(poses.carry(slide.moving)[order[0]] - slide2.moving) < 1e-6 * poses.size
    assert abs((slide.fixed * slide2.fixed.conjugate()).imag) < 1e-9


# --- poses and points ---------------------------------------------------------------------------------------------


def mixed_sample(seed=24):
    poses, _ = four_bar_poses(np.random.default_rng(seed), 6)
    return [Pose(complex(z), float(a)) for z, a in zip(poses.points, poses.angles)]


def mixed_task(positions, **free) -> Task:
    return mixture(positions[:4], [(p.point.real, p.point.imag) for p in positions[4:]], **free)


def test_designs_of_poses_and_points_move_with_the_task():
    positions = mixed_sample()
    before = fingerprints(synthesize(mixed_task(positions)))
    same(before, fingerprints(synthesize(mixed_task(moved(positions))), backward))


@pytest.mark.parametrize("order", [[0, 2, 3, 1, 5, 4], [3, 2, 1, 0, 5, 4]], ids=["permuted", "another reference"])
def test_order_of_poses_and_points_only_changes_the_verdict_on_order(order):
    positions = mixed_sample()
    before = synthesize(mixed_task(positions))
    after = synthesize(mixed_task([positions[k] for k in order]))
    assert (before.roots["count"], before.roots["real"]) == (after.roots["count"], after.roots["real"])
    same(fingerprints(before), fingerprints(after))


def test_a_mirrored_task_of_poses_and_points_has_mirrored_designs():
    positions = mixed_sample()
    mirrored = [Pose(pose.point.conjugate(), -pose.angle) for pose in positions]
    same(
        fingerprints(synthesize(mixed_task(positions))),
        fingerprints(synthesize(mixed_task(mirrored)), lambda z: z.conjugate()),
    )
