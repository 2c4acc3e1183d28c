"""Pools of dyads, the search among their pairs, and the four-pose map, against the general judge."""

from __future__ import annotations

import numpy as np
import pytest

from mechanisms import Task, TaskError, synthesize
from mechanisms.families.circle_points import CircleCurve
from mechanisms.families.dyad_pairs import pair_linkage
from mechanisms.families.dyad_pools import curve_pool, sampled_pool
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.pair_search import judge_pairs
from mechanisms.families.regions import Region
from mechanisms.families.solution_map import BRANCH, CIRCUIT, ORDER, SolutionMap
from mechanisms.motion import judge

LIFT = [(0, 0, 0), (30, 40, 20), (80, 55, 55), (125, 35, 90)]
ANY = Region()


def task(rows, **tables):
    poses = [dict(zip(("x", "y", "angle_deg"), map(float, row))) for row in rows]
    return Task.from_dict({"mechanism": "four-bar-motion", "poses": poses, **tables})


@pytest.fixture(scope="module")
def lift_map():
    return SolutionMap.of(Poses.of(LIFT), 80)


def test_the_map_says_what_the_general_judge_says(lift_map):
    rng = np.random.default_rng(3)
    seen = set()
    poses = lift_map.poses
    for _ in range(60):
        i, j = rng.integers(0, len(lift_map.stations), 2)
        if lift_map.link_ratio[i, j] > 30:  # near a slider, or the same dyad twice
            continue
        linkage, configurations = pair_linkage(
            poses, lift_map.dyad(lift_map.stations[j]), lift_map.dyad(lift_map.stations[i])
        )
        verdict = judge(linkage, "crank", configurations)
        expected = {(): None, ("circuit",): CIRCUIT, ("branch",): BRANCH, ("order",): ORDER}[verdict.reasons]
        code = int(lift_map.verdict[i, j])
        assert code >= 3 if expected is None else code == expected
        seen.add(code)
        if expected is None:
            assert abs(verdict.min_transmission_deg - lift_map.transmission[i, j]) < 0.6
    assert len(seen) >= 4


def test_a_design_is_picked_by_its_two_points(lift_map):
    driven, following = lift_map.best()
    candidate = lift_map.pick(driven, following)
    verdict = judge(candidate.linkage, "crank", candidate.poses)
    assert verdict.reasons == ()
    row, column = (int(np.argmin(np.abs(lift_map.stations - s))) for s in (following, driven))
    assert verdict.min_transmission_deg >= lift_map.transmission[row, column] - 0.5
    with pytest.raises(TaskError, match="from 0 to below 100"):
        lift_map.dyad(250)


def test_a_task_names_its_dyads_by_their_numbers_on_the_map(lift_map):
    driven, following = lift_map.best()
    (design,) = synthesize(task(LIFT, free={"dyad1": driven, "dyad2": following})).designs
    picked = lift_map.pick(driven, following)
    for name in ("O1", "A1", "O2", "A2"):
        assert abs(design.linkage.points[name] - picked.linkage.points[name]) < 1e-9
    assert (design.extra["dyad1"], design.extra["dyad2"]) == pytest.approx((driven, following))


def test_designs_tell_their_numbers_on_the_map(lift_map):
    for design in synthesize(Task.from_file("examples/four_bar_four_poses.toml")).designs:
        if design.extra["kind"] == "four-bar":
            crank = lift_map.dyad(design.extra["dyad1"])
            assert abs(crank.fixed - design.linkage.points["O1"]) < 1e-4 * lift_map.poses.size


def test_the_map_is_drawn(lift_map, tmp_path):
    figure = lift_map.plot(tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 20_000
    labels = [text.get_text() for ax in figure.axes for text in ax.get_xticklabels()]
    assert "50" in labels


def test_the_map_needs_four_poses():
    with pytest.raises(TaskError, match="belongs to four"):
        SolutionMap.of(Poses.of(LIFT[:3]))


def test_parallel_poses_have_no_map():
    with pytest.raises(TaskError, match="have no map: the body never turns"):
        SolutionMap.of(Poses.of([(3, 0, 5), (0, 3, 5), (-3, 0, 5), (0, -3, 5)]))


def test_every_dyad_of_a_pool_carries_the_body():
    for count in (2, 3):
        poses = Poses.of(LIFT[:count])
        for fixed, moving in ((ANY, ANY), (Region((0, 0), (-50, -50)), ANY), (ANY, Region((10, 60), (0, 20)))):
            pool = sampled_pool(poses, 64, fixed, moving, seed=1)
            assert len(pool) > 0
            errors = [pool.dyad(k).errors(poses).max() for k in range(len(pool))]
            assert max(errors) < 1e-7
            if fixed.point is not None:
                assert np.all(pool.fixed == fixed.point)
            if moving.given:
                assert np.all(moving.holds(pool.moving))
        kinds = set(sampled_pool(poses, 64, ANY, ANY, seed=1).kinds)
        assert kinds == {"RR", "PR", "RP"}
    four = curve_pool(CircleCurve(Poses.of(LIFT)), 60, ANY, ANY)
    assert set(four.kinds) == {"RR", "PR", "RP"}
    assert max(four.dyad(k).errors(Poses.of(LIFT)).max() for k in range(len(four))) < 1e-6


@pytest.mark.parametrize(
    ("kind", "rows"),
    [("PR", LIFT), ("RP", [(0, 0, 0), (1, 0.2, 27), (1.8, -0.1, 47), (2.5, -0.3, 62)])],
    ids=["PR", "RP"],
)
def test_sliders_are_judged_in_closed_form_as_by_the_general_judge(kind, rows):
    poses = Poses.of(rows)
    pool = curve_pool(CircleCurve(poses), 60, ANY, ANY)
    table = judge_pairs(poses, pool, pool)
    (slider,) = np.flatnonzero(pool.kinds == kind)
    usable = 0
    for crank in np.flatnonzero(pool.kinds == "RR"):
        if abs(pool.fixed[crank]) + abs(pool.moving[crank]) > 20 * poses.size:
            continue
        linkage, configurations = pair_linkage(poses, pool.dyad(crank), pool.dyad(slider))
        verdict = judge(linkage, "crank", configurations)
        for key in ("same_circuit", "same_branch", "in_order", "full_rotation"):
            assert bool(table.driven_first[key][crank, slider]) == getattr(verdict, key)
            assert bool(table.driven_second[key][slider, crank]) == getattr(verdict, key)
        if verdict.in_order:
            usable += 1
            for angle in (
                table.driven_first["min_transmission_deg"][crank, slider],
                table.driven_second["min_transmission_deg"][slider, crank],
            ):
                assert abs(angle - verdict.min_transmission_deg) < 0.2
    assert usable > 15


def test_four_poses_give_designs_free_of_defects():
    result = synthesize(Task.from_file("examples/four_bar_four_poses.toml"))
    assert len(result.accepted) == 8
    assert "curve of dyads" in result.roots["evidence"]
    assert result.roots["complete"] is None
    assert {"slider-crank", "four-bar"} <= {design.extra["kind"] for design in result.designs}
    for design in result.accepted:
        assert design.worst_pose_error < 1e-9
        assert design.min_transmission_deg >= 35


def test_given_pivots_are_kept():
    found = synthesize(task(LIFT[:3], free={"O1_x": 0, "O1_y": -40, "O2_x": 60, "O2_y": -40}))
    assert len(found.designs) == 1
    (design,) = found.designs
    assert {complex(round(z.real, 9), round(z.imag, 9)) for z in design.pivots.values()} == {-40j, 60 - 40j}
    assert design.worst_pose_error < 1e-9


def test_a_pivot_on_the_curve_is_the_nearest_to_the_one_given():
    curve = CircleCurve(Poses.of(LIFT))
    place = 60 - 60j
    circuit, phi, distance = curve.nearest(place)
    around = curve.dyads(circuit, np.linspace(0, 2 * np.pi, 20001))[1]
    assert distance <= np.abs(around - place).min() + 1e-9
    found = synthesize(task(LIFT, free={"A1_x": 60, "A1_y": -60}))
    wanted = curve.dyads(circuit, phi)[1][0]
    for design in found.designs:
        moving = [design.linkage.points[name] for name in ("A1", "A2") if name in design.linkage.points]
        assert min(abs(z - wanted) for z in moving) < 1e-6
        assert any(name.startswith("distance_from_pick") for name in design.extra)


@pytest.mark.parametrize(
    ("rows", "free", "words"),
    [
        (LIFT[:3], {"O1_x": 0, "O1_y": 0, "A1_x": 1, "A1_y": 1}, "either pivot of a dyad determines"),
        (LIFT, {"O1_x": 0}, "or only whole pivots, or ranges"),
        (LIFT, {"dyad1": 120}, "from 0 to below 100"),
        (LIFT, {"dyad1": 20, "A1_x": [0, 1]}, "leave out O1 and A1"),
        (LIFT[:3], {"dyad1": 20}, "3 poses have no map"),
    ],
)
def test_choices_that_the_poses_do_not_leave_are_refused(rows, free, words):
    with pytest.raises(TaskError, match=words):
        task(rows, free=free)


def test_a_number_beside_a_range_puts_a_pivot_on_a_line():
    free = {"O1_x": [-60, 60], "O1_y": -40, "O2_x": [0, 120], "O2_y": -40}
    found = synthesize(task(LIFT[:3], free=free)).designs
    pivots = [z for design in found for z in design.pivots.values()]
    assert len(pivots) >= 4 and max(abs(z.imag + 40) for z in pivots) < 1e-9


def test_pivots_are_looked_for_inside_their_regions():
    fixed, moving = Region((-20, 20), (-80, 0)), Region((-90, 90), (-60, 60))
    for count in (2, 3):
        pool = sampled_pool(Poses.of(LIFT[:count]), 128, fixed, moving, seed=1)
        assert len(pool) > 40
        assert np.all(fixed.holds(pool.fixed)) and np.all(moving.holds(pool.moving))
        assert max(pool.dyad(k).errors(Poses.of(LIFT[:count])).max() for k in range(len(pool))) < 1e-9


def test_regions_that_no_dyad_has_are_said():
    free = {"O1_x": [500, 501], "O1_y": [0, 1], "A1_x": [0, 1], "A1_y": [0, 1]}
    (design,) = synthesize(task(LIFT[:3], free=free)).designs
    assert design.reasons == ("degenerate",) and "no dyad 1 has its pivots where" in design.note
