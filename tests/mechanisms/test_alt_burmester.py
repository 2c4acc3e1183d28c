"""Poses mixed with points: published counts, sampled four-bars, what may be given."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses, mixed_task

from mechanisms import Task, TaskError, synthesize
from mechanisms.catalogue import load, recipe
from mechanisms.families.alt_burmester import (
    COUNTS,
    mixed_instance,
    mixed_system,
    swap,
)
from mechanisms.families.burmester import five_pose_dyads
from mechanisms.families.motion_dyads import Poses
from solvers import monodromy, solve
from solvers.points import PointSet


def pairs(poses: int, points: int, seed: int, trace: bool = True):
    start = mixed_instance(poses, points, np.random.default_rng(seed))
    return monodromy(mixed_system(poses, points), seed, (swap,), start, trace=trace)


@pytest.mark.parametrize(("poses", "points"), [(5, 0), (4, 2), (3, 4)])
def test_the_published_counts_are_found_with_a_trace_test(poses, points):
    for seed in (1, 2, 3):  # a trace test may fail by paths that it loses itself, never pass by them
        found = pairs(poses, points, seed)
        assert len(found) == COUNTS[poses, points]
        if found.complete:
            break
    assert found.complete
    assert "trace test passed" in found.evidence


@pytest.mark.parametrize(("poses", "points"), [(4, 2), pytest.param(3, 4, marks=pytest.mark.slow)], ids=["4,2", "3,4"])
def test_a_polyhedral_start_ends_in_the_same_roots(poses, points):
    """Another route to the counts: every other path ends singular, where the two dyads are one."""
    generic = load(f"alt-burmester:{poses}:{points}")
    found = solve(mixed_system(poses, points), generic.parameters, "polyhedral", certificates=False)
    assert found.ledger.failed == 0
    assert len(found) == COUNTS[poses, points]
    known = PointSet(found.points.shape[1])
    known.add(generic.points)
    assert np.all(known.find(found.points) >= 0)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_two_poses_and_six_points_have_one_count_for_every_seed(seed):
    found = pairs(2, 6, seed, trace=False)
    assert len(found) == 2224 and "estimate 2224" in found.evidence


@pytest.mark.slow
def test_one_pose_and_eight_points_have_as_many_as_nine_points():
    found = pairs(1, 8, 1, trace=False)
    assert len(found) == 8652 and "estimate 8652" in found.evidence


def test_one_pose_and_eight_points_are_the_nine_point_problem():
    """The entries of the catalogue come from searches of their own; a = −G and z carry the roots over."""
    nine, mixed = load("four-bar-path:9"), load("alt-burmester:1:8")
    ours = solve(mixed_system(1, 8), nine.parameters, mixed, certificates=False)
    assert ours.ledger.failed == 0
    known = PointSet(8)
    known.add(ours.points[:, :8])
    a, z, b, w = (nine.points[:, k : k + 2] for k in (0, 2, 4, 6))
    assert np.all(known.find(np.concatenate([z, -a, w, -b], axis=1)) >= 0)
    assert len(known) == len(nine) == 8652


def test_cognates_are_roots_of_the_same_task():
    made_from = recipe("alt-burmester:1:8")
    point, values = made_from.start(np.random.default_rng(6))
    images = made_from.orbit(point[None], values)[:, 0]
    assert np.abs(made_from.system.evaluate(images, values)[0]).max() < 1e-9
    assert len(np.unique(np.round(images[:, :8], 6), axis=0)) == 6


def test_eight_points_and_a_pose_of_a_four_bar_lead_back_to_it():
    from mechanisms.families.alt_burmester import mixed_parameters

    poses, true = four_bar_poses(np.random.default_rng(41), 9)
    first = Poses(poses.points[:1], poses.angles[:1])
    values = mixed_parameters(first, poses.points[1:], poses.size)
    found = solve(mixed_system(1, 8), values, load("alt-burmester:1:8"), certificates=False).points
    places = [(place - poses.points[0]) / poses.size for d in true for place in (d.moving, d.fixed)]
    wanted = np.array([part for place in places for part in (place, np.conj(place))])
    assert np.abs(found[:, :8] - wanted).max(axis=1).min() < 1e-8


def test_five_points_with_both_pivots_given_have_36_four_bars():
    made_from = recipe("alt-burmester:1:4:O1_x,O1_y,O2_x,O2_y")
    assert made_from.count == 36
    found = monodromy(made_from.system, 1, (), made_from.start(np.random.default_rng(1)))
    assert (len(found), found.complete) == (36, True)


def test_the_twelve_pairs_of_five_poses_are_those_of_the_four_dyads():
    from mechanisms.families.alt_burmester import mixed_parameters

    poses = Poses.of([(0, 0, 0), (-0.5, -1.9, 90), (1.7, 0, 45), (-1.6, 0.4, 35), (-1.5, 0.1, 25)])
    generic = pairs(5, 0, 1)
    values = mixed_parameters(poses, np.zeros(0, complex), poses.size)
    found = solve(mixed_system(5, 0), values, generic, certificates=False).points
    dyads = [(d.moving / poses.size, d.fixed / poses.size) for d in five_pose_dyads(poses)]
    expected = {tuple(np.round([*a, *b], 6).tolist()) for a in dyads for b in dyads if a != b}
    assert {tuple(np.round(row[[0, 2, 4, 6]], 6).tolist()) for row in found} == expected
    assert len(expected) == 12


def test_stored_columns_are_restored_to_roots():
    for name in ("alt-burmester:2:6", "alt-burmester:4:2"):
        made_from = recipe(name)
        point, values = made_from.start(np.random.default_rng(4))
        restored = made_from.restore(point[None, : made_from.kept], values)
        assert np.abs(restored - point).max() < 1e-9 * np.abs(point).max()


@pytest.mark.parametrize(
    ("count", "points"), [(4, 2), (3, 4), (2, 6), pytest.param(1, 8, marks=pytest.mark.slow)], ids=str
)
def test_the_sampled_four_bar_is_found_among_the_designs(count, points):
    poses, true = four_bar_poses(np.random.default_rng(20 + count), count + points)
    result = synthesize(mixed_task(poses, count))
    # close clusters of an ill-conditioned task end as singular ones
    assert result.roots["count"] + result.ledger["singular"] == COUNTS[count, points]
    wanted = {complex(round(d.fixed.real, 6), round(d.fixed.imag, 6)) for d in true}
    hits = [
        design
        for design in result.designs
        if design.linkage is not None
        and {complex(round(z.real, 6), round(z.imag, 6)) for z in design.pivots.values()} == wanted
    ]
    assert len(hits) == 1
    assert hits[0].worst_pose_error < 1e-8
    real = [design for design in result.designs if design.linkage is not None]
    assert 2 * len(real) == result.roots["real"]
    assert max(design.worst_pose_error for design in real) < 1e-6


def test_positions_are_visited_in_the_sequence_given():
    """Poses of a four-bar driven one way, the second and the last but one left as poses, the others as points."""
    angles = np.linspace(0.3, 1.5, 6)
    o2, crank, coupler, rocker = 4.0, 1.5, 4.0, 3.0
    tips = crank * np.exp(1j * angles)
    way = o2 - tips
    d = np.abs(way)
    turn = way / d * np.exp(1j * np.arccos((coupler**2 + d**2 - rocker**2) / (2 * coupler * d)))
    points, turns = tips + (1.0 + 0.8j) * turn, np.angle(turn)
    rows = [{"x": float(z.real), "y": float(z.imag), "angle_deg": float(np.degrees(a))} for z, a in zip(points, turns)]
    places = [{"x": row["x"], "y": row["y"]} for row in rows]
    given = {"mechanism": "four-bar-motion", "poses": [rows[k] for k in (0, 2, 3, 5)]}
    given["points"] = [places[k] for k in (1, 4)]
    verdicts = []
    for free in ({}, {"sequence": [0, 4, 1, 2, 5, 3]}):
        result = synthesize(Task.from_dict({**given, "free": free}))
        (hit,) = [
            design
            for design in result.designs
            if design.linkage is not None and sorted(abs(z) for z in design.pivots.values()) == pytest.approx([0, 4])
        ]
        assert hit.worst_pose_error < 1e-8
        verdicts.append(hit.reasons)
    assert verdicts == [("order",), ()]


def test_given_pivots_stand_where_they_are_given():
    poses, true = four_bar_poses(np.random.default_rng(31), 5)
    free = {f"O{k}_{axis}": getattr(true[k - 1].fixed, part) for k in (1, 2)
            for axis, part in (("x", "real"), ("y", "imag"))}  # fmt: skip
    result = synthesize(mixed_task(poses, 1, free=free))
    assert result.roots["count"] == 36
    moving = sorted((d.moving for d in true), key=lambda z: z.real)
    found = [
        sorted((design.linkage.points[n] for n in ("A1", "A2")), key=lambda z: z.real)
        for design in result.designs
        if design.linkage is not None
    ]
    assert min(np.abs(np.subtract(pair, moving)).max() for pair in found) < 1e-7


def test_given_lengths_are_kept():
    rows = [
        {"x": 0, "y": 0, "angle_deg": 0},
        {"x": 30, "y": 40, "angle_deg": 20},
        {"x": 80, "y": 55, "angle_deg": 55},
    ]
    free = {"O1_x": 0, "O1_y": -40, "L_ground": 70, "L_link2": 50}
    result = synthesize(Task.from_dict({"mechanism": "four-bar-motion", "poses": rows, "free": free}))
    built = [design for design in result.designs if design.linkage is not None]
    assert len(built) == result.roots["real"] > 0
    for design in built:
        points = design.linkage.points
        assert abs(abs(points["O1"] - points["O2"]) - 70) < 1e-8
        lengths = [abs(points[f"O{k}"] - points[f"A{k}"]) for k in (1, 2)]
        assert min(abs(length - 50) for length in lengths) < 1e-8


@pytest.mark.parametrize(
    ("poses", "points", "free", "words"),
    [
        (3, 2, {}, "leave 2 free"),
        (4, 3, {}, "are 1 too many"),
        (3, 2, {"O1_x": [0, 1], "O1_y": 3}, "a range where"),
        (4, 0, {"L_link1": 1.0, "L_ground": 2.0}, None),
        (4, 0, {"L_link1": 1.0, "O1_x": 2.0}, "leave 1 numbers of dyad 1"),
        (4, 2, {"sequence": [0, 1, 2, 3, 4]}, "give the numbers 0 to 5"),
        (4, 2, {"sequence": [1, 0, 2, 3, 4, 5]}, "0 first"),
        (5, 0, {"sequence": [0, 1, 2, 3, 4]}, "reorder it"),
        (4, 2, {"dyad1": 3.0}, "leave it out"),
    ],
)
def test_tasks_that_do_not_add_up_are_refused(poses, points, free, words):
    sample, _ = four_bar_poses(np.random.default_rng(1), poses + points)
    if words is None:
        assert mixed_task(sample, poses, free=free).free == free
        return
    with pytest.raises(TaskError, match=words):
        mixed_task(sample, poses, free=free)


def test_points_without_a_pose_are_sent_to_the_path_family():
    rows = [{"x": float(k), "y": float(k * k % 5)} for k in range(8)]
    with pytest.raises(TaskError, match="four-bar-path"):
        Task.from_dict({"mechanism": "four-bar-motion", "points": rows})
