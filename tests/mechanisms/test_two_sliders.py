"""Two sliders: poses of known trammels lead back to them, and the closed verdicts are those of the general judge."""

from __future__ import annotations

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.families.circle_points import inverse_poses
from mechanisms.families.dyad_pairs import pair_linkage
from mechanisms.families.dyad_pools import sampled_pool, sliders_of_circles
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.regions import Region
from mechanisms.families.two_sliders import pivot, slider_pairs, slider_verdict
from mechanisms.motion import judge


def trammel(rng, turns):
    """Two pins of the body on two lines."""
    u1, u2 = np.exp(1j * rng.uniform(0, 2 * np.pi, 2))
    a1, way, p = (complex(*rng.uniform(-1, 1, 2)) for _ in range(3))
    turn = np.exp(1j * np.asarray(turns))
    # s2 u2 − s1 u1 = way (e − 1)
    s1 = -(np.conj(u2) * way * (turn - 1)).imag / (np.conj(u2) * u1).imag
    poses = Poses(a1 + s1 * u1 + turn * (p - a1), np.asarray(turns, dtype=float))
    return poses, [MotionDyad("PR", complex(u1), a1), MotionDyad("PR", complex(u2), a1 + way)]


def inverted_trammel(rng, turns):
    """Two lines of the body through two pivots of the frame: what the frame of a trammel sees."""
    poses, dyads = trammel(rng, -np.asarray(turns))
    return inverse_poses(poses), [MotionDyad("RP", dyad.moving, dyad.fixed) for dyad in dyads]


def swinging_block(rng, turns):
    """A pin of the body on a line, and a line of the body through a pivot of the frame."""
    u, b = np.exp(1j * rng.uniform(0, 2 * np.pi, 2))
    a1, o2, p = (complex(*rng.uniform(-1, 1, 2)) for _ in range(3))
    turn = np.exp(1j * np.asarray(turns))
    # Im(conj(b e)(o2 − a1 − s u)) is constant
    s = ((np.conj(b * turn) * (o2 - a1)).imag - (np.conj(b) * (o2 - a1)).imag) / (np.conj(b * turn) * u).imag
    poses = Poses(a1 + s * u + turn * (p - a1), np.asarray(turns, dtype=float))
    return poses, [MotionDyad("RP", o2, complex(b)), MotionDyad("PR", complex(u), a1)]


SAMPLES = (trammel, inverted_trammel, swinging_block)


def random_turns(rng, count, most=3.0):
    return np.concatenate([[0.0], rng.uniform(-most, most, count - 1)])


def task(poses: Poses, **tables) -> Task:
    rows = [{"x": z.real, "y": z.imag, "angle_deg": float(np.degrees(a))} for z, a in zip(poses.points, poses.angles)]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, **tables})


def parallel(one: complex, other: complex) -> float:
    return abs((one * other.conjugate()).imag) / abs(one * other)


@pytest.mark.parametrize("sample", SAMPLES)
def test_the_samples_are_what_they_say(sample):
    rng = np.random.default_rng(0)
    poses, dyads = sample(rng, random_turns(rng, 5))
    assert max(dyad.errors(poses).max() for dyad in dyads) < 1e-12


@pytest.mark.parametrize("sample", SAMPLES)
def test_the_closed_verdict_is_that_of_the_general_judge(sample):
    rng = np.random.default_rng(1)
    seen = set()
    for trial in range(30):
        turns = random_turns(rng, 4, 1.0 + trial % 3)
        turns = np.sort(turns) - turns.min() if trial % 2 else turns
        poses, dyads = sample(rng, turns)
        for driver, other in (dyads, dyads[::-1]) if sample is trammel else (dyads,):
            closed = slider_verdict(poses, driver, other)
            linkage, positions = pair_linkage(poses, driver, other)
            general = judge(linkage, "crank", positions)
            seen.add(general.reasons)
            for key in ("same_circuit", "same_branch", "in_order", "full_rotation"):
                assert closed[key] == getattr(general, key), (key, general)
            assert closed["min_transmission_deg"] == pytest.approx(general.min_transmission_deg, abs=1e-5)
    assert len(seen) >= 2


@pytest.mark.parametrize("sample", [trammel, inverted_trammel])
@pytest.mark.parametrize("count", [3, 4, 5])
def test_poses_of_a_trammel_lead_back_to_its_circle_of_sliders(sample, count):
    rng = np.random.default_rng(count)
    for _ in range(10):
        poses, true = sample(rng, random_turns(rng, count))
        found = [dyad for dyad in sliders_of_circles(poses) if dyad.kind == true[0].kind]
        assert max(dyad.errors(poses).max() for dyad in found) < 1e-8 * poses.size
        # the pins that the poses come from lie on the circle through three of the pins found
        a, b, c = (pivot(dyad) for dyad in found[::8])
        for dyad in true:
            ratio = (pivot(dyad) - a) * (b - c) / ((pivot(dyad) - c) * (b - a))
            assert abs(ratio.imag) < 1e-6 * abs(ratio)


def test_four_poses_of_a_swinging_block_lead_back_to_it():
    rng = np.random.default_rng(7)
    for _ in range(5):
        poses, (block, slide) = swinging_block(rng, random_turns(rng, 4))
        (design,) = [d for d in synthesize(task(poses)).designs if d.extra["kind"] == "slide and swinging block"]
        assert abs(design.linkage.points["O1"] - block.fixed) < 1e-7
        assert abs(design.linkage.points["A2"] - slide.moving) < 1e-7
        assert design.worst_pose_error < 1e-9


@pytest.mark.parametrize("count", [2, 3])
def test_given_pins_of_a_trammel_are_put_on_their_lines(count):
    rng = np.random.default_rng(11)
    poses, true = trammel(rng, np.linspace(0, 0.9, count))
    free = {f"A{k}_{axis}": getattr(dyad.moving, part) for k, dyad in enumerate(true, 1)
            for axis, part in (("x", "real"), ("y", "imag"))}  # fmt: skip
    designs = [d for d in synthesize(task(poses, free=free)).designs if d.extra["kind"] == "double slider"]
    (design,) = designs
    assert design.worst_pose_error < 1e-10
    lines = {round(design.linkage.points[s.at].real, 6): s.direction for s in design.linkage.sliders}
    for dyad in true:
        line = lines[round(dyad.moving.real, 6)]
        expected = dyad.fixed if count == 3 else poses.carry(dyad.moving)[1] - dyad.moving
        assert parallel(line, expected) < 1e-8


@pytest.mark.parametrize(("sample", "kind"), [(trammel, "double slider"), (inverted_trammel, "double inverted slider")])
@pytest.mark.parametrize("count", [4, 5])
def test_designs_of_two_sliders_reach_the_poses_of_a_trammel(sample, kind, count):
    rng = np.random.default_rng(20 + count)
    poses, _ = sample(rng, np.linspace(0, 0.8, count))
    made = [d for d in synthesize(task(poses)).designs if d.extra.get("kind") == kind]
    assert made and all(design.worst_pose_error < 1e-9 for design in made)
    assert any(design.accepted for design in made)


def test_a_centre_of_the_circle_makes_a_scott_russell_linkage():
    """The centre of Cardan's circle moves on a circle about the crossing of the lines, at the same distance."""
    rng = np.random.default_rng(4)
    poses, (one, two) = trammel(rng, np.linspace(0, 0.8, 5))
    crossing = one.moving + one.fixed * (
        (np.conj(two.fixed) * (two.moving - one.moving)).imag / (np.conj(two.fixed) * one.fixed).imag
    )
    cranks = [d for d in synthesize(task(poses)).designs if d.extra.get("kind") == "slider-crank"]
    assert cranks
    for design in cranks:
        points = design.linkage.points
        assert abs(points["O1"] - crossing) < 1e-6
        assert abs(abs(points["A1"] - points["O1"]) - abs(points["A2"] - points["A1"])) < 1e-6


@pytest.mark.parametrize("count", [2, 3])
def test_pools_hold_both_sliders_for_all_regions(count):
    poses = Poses.of([(0, 0, 0), (30, 40, 20), (80, 55, 55)][:count])
    anywhere, here = Region(), Region((-50, 200), (-200, 300))
    for fixed, moving, kinds in (
        (anywhere, anywhere, {"RR", "PR", "RP"}),
        (here, anywhere, {"RR", "RP"}),
        (anywhere, here, {"RR", "PR"}),
        (Region((0, 0), (0, 0)), anywhere, {"RR", "RP"} if count == 2 else {"RR"}),
        (anywhere, Region((0, 0), (9, 9)), {"RR", "PR"} if count == 2 else {"RR"}),
    ):
        pool = sampled_pool(poses, 64, fixed, moving, 1)
        assert set(pool.kinds) == kinds
        assert max(pool.dyad(k).errors(poses).max() for k in range(len(pool))) < 1e-7


def test_two_of_three_poses_may_be_parallel():
    poses = Poses.of([(0, 0, 0), (30, 40, 0), (80, 55, 55)])
    pool = sampled_pool(poses, 16, Region(), Region(), 1)
    sliders = [pool.dyad(int(k)) for k in np.flatnonzero(pool.kinds != "RR")]
    assert {dyad.kind for dyad in sliders} == {"PR", "RP"}
    pins = np.array([dyad.moving for dyad in sliders if dyad.kind == "PR"])
    assert np.abs(((pins - pins[0]) * np.conj(pins[1] - pins[0])).imag).max() < 1e-6 * np.abs(pins).max() ** 2


def test_sliders_outside_the_allowed_box_are_left_out():
    poses, dyads = inverted_trammel(np.random.default_rng(2), np.array([0.0, 0.4, 0.9]))
    box = {"pivots_in": {"x": (50.0, 60.0)}}
    assert len(list(slider_pairs(poses, dyads, dyads, {}))) == 1
    assert list(slider_pairs(poses, dyads, dyads, box)) == []


@pytest.mark.parametrize("sample", [inverted_trammel, swinging_block])
def test_bars_reach_their_blocks_in_every_pose(sample):
    rng = np.random.default_rng(8)
    poses, dyads = sample(rng, random_turns(rng, 4))
    linkage, positions = pair_linkage(poses, *dyads)
    for number, dyad in enumerate(dyads, start=1):
        if dyad.kind != "RP":
            continue
        for pose in positions:
            places = linkage.positions(pose)
            b, c, o = (places[f"{letter}{number}"] for letter in "BCO")
            share = (o - b) / (c - b)
            assert 0.05 < share.real < 0.95 and abs(share.imag) < 1e-9


def test_a_slide_and_a_block_that_are_parallel_in_a_pose_are_no_linkage():
    """Poses without a turn between them: the slide on the frame and that of the body point along the way."""
    poses = Poses.of([(0, 0, 0), (3, 1, 0)])
    way = complex(*np.array([3, 1]) / np.sqrt(10))
    pair = [MotionDyad("RP", 2j, way), MotionDyad("PR", way, 1 + 0j)]
    assert max(dyad.errors(poses).max() for dyad in pair) < 1e-12
    assert list(slider_pairs(poses, pair, pair, {})) == []
    assert not any("inexact" in design.reasons for design in synthesize(task(poses)).designs)
