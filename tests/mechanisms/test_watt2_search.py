"""The search for free dyads agrees with the judgement of motion, which traces the whole configuration curve."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from watt2_zoo import three_pose_task, two_pose_task

from mechanisms import families, synthesize
from mechanisms.families.sweep import loop_sweep
from mechanisms.linkage import Input, Linkage
from mechanisms.motion import judge
from solvers import solve


def four_bar(crank: complex, rocker: complex, foot: complex) -> Linkage:
    return Linkage(
        points={"O": 0, "A": crank, "B": foot + rocker, "R": foot},
        links={"ground": ("O", "R"), "crank": ("O", "A"), "coupler": ("A", "B"), "rocker": ("R", "B")},
        inputs={"crank": Input("crank")},
    )


def test_sweep_agrees_with_the_traced_motion_of_random_four_bars():
    """Random loops, random crank angles, both assemblies: the closed form and the traced curve say the same."""
    rng = np.random.default_rng(3)
    verdicts = []
    while len(verdicts) < 60:
        crank, rocker, foot = (complex(*rng.uniform(-2, 2, 2)) for _ in range(3))
        turns = np.sort(rng.uniform(0.1, 5.5, 2))
        coupler = abs(foot + rocker - crank)
        poses, rocker_turns = [{"crank": 0.0, "coupler": 0.0, "rocker": 0.0}], []
        for angle in turns:
            tip = crank * np.exp(1j * angle)
            gap = foot - tip
            d, r = abs(gap), abs(rocker)
            cosine = (d**2 + coupler**2 - r**2) / (2 * d * coupler)
            if abs(cosine) > 0.999:
                break
            side = (
                rng.choice([-1, 1])
                if rng.uniform() < 0.3
                else np.sign(np.imag(np.conj(foot + rocker - crank) * -rocker))
            )
            joint = tip + coupler * gap / d * np.exp(-1j * side * math.acos(cosine))
            rocker_turns.append(float(np.angle((joint - foot) / rocker)))
            turned = float(np.angle((joint - tip) / (foot + rocker - crank)))
            poses.append({"crank": float(angle), "coupler": turned, "rocker": rocker_turns[-1]})
        if len(poses) < 3:
            continue
        sweep = loop_sweep(
            crank, 0, turns, np.array([rocker]), np.array([foot]), np.array(rocker_turns)[:, None], 1
        )
        linkage = four_bar(crank, rocker, foot)
        verdict = judge(linkage, "crank", poses)
        free = bool(sweep.defect_free[0])
        assert free == (verdict.reasons == ()), (crank, rocker, foot, turns, verdict)
        if free:
            assert math.degrees(sweep.transmission[0]) == pytest.approx(verdict.min_transmission_deg, abs=1e-4)
        verdicts.append(free)
    assert 10 < sum(verdicts) < 50  # the sample has both kinds


@pytest.fixture(scope="module")
def searched():
    return synthesize(replace(three_pose_task(), free={}, solve={"seed": 3, "samples": 2048}))


def test_what_the_search_finds_is_accepted_by_the_judge(searched):
    found = [d for d in searched.designs if d.note.startswith("best")]
    assert found and all(design.accepted for design in found)
    assert all(0 < design.extra["defect_free_share"] < 0.1 for design in found)


def test_best_is_best_of_its_root(searched):
    by_root: dict[int, list] = {}
    for design in searched.accepted:
        by_root.setdefault(design.root, []).append(design)
    for group in by_root.values():
        best = next(d for d in group if "transmission" in d.note)
        assert best.min_transmission_deg == max(d.min_transmission_deg for d in group)
        ratio = next(d for d in group if "link ratio" in d.note)
        usable = [d for d in group if d.min_transmission_deg >= 20]
        assert ratio.link_ratio == min(d.link_ratio for d in (usable or group))


def test_same_seed_same_designs_and_jobs_do_not_matter(searched):
    again = synthesize(searched.task, jobs=2)
    assert [d.as_dict() for d in again.designs] == [d.as_dict() for d in searched.designs]


def test_ranges_of_free_angles_are_kept():
    task = three_pose_task().to_dict()
    task["free"] = {"eta2_deg": [-40, -10], "eta3_deg": [-60, -20], "phi2_deg": -20.0, "phi3_deg": -45.0}
    result = synthesize(type(three_pose_task()).from_dict(task))
    built = [d for d in result.designs if d.linkage is not None]
    assert built
    for design in built:
        assert -40 <= design.parameters["eta2_deg"] <= -10 and -60 <= design.parameters["eta3_deg"] <= -20
        assert design.parameters["phi2_deg"] == pytest.approx(-20)


def test_two_poses_search_keeps_what_is_chosen():
    task = two_pose_task(beta2_deg=-90.0, W1_x=-35.0, Z1_x=6.0, Z3_x=-7.0, W4_y=[-20.0, -5.0])
    result = synthesize(task.with_solve(samples=1024))
    assert result.accepted
    for design in result.designs:
        assert design.parameters["Z3"].real == pytest.approx(-7.0, abs=1e-9)
        assert -20 <= design.parameters["W4"].imag <= -5
        assert design.worst_pose_error < 1e-10


def test_constraints_are_met_inside_the_search():
    box = {"pivots_in": {"x": (-60.0, 120.0), "y": (-100.0, 60.0)}, "min_transmission_deg": 25.0}
    result = synthesize(replace(three_pose_task(), free={}, constraints=box, solve={"samples": 4096, "seed": 1}))
    assert result.accepted
    for design in result.accepted:
        assert all(-60 <= z.real <= 120 and -100 <= z.imag <= 60 for z in design.pivots.values())
        assert design.min_transmission_deg >= 25
    stages = [stage["stage"] for stage in result.funnel]
    assert (
        stages.index("constraint:pivots_in")
        < stages.index("one circuit")
        < stages.index("constraint:min_transmission_deg")
    )


def test_the_share_is_the_share_of_sampled_pairs():
    """Counted pair by pair on a few samples, against the formula from the halves."""
    from mechanisms.families.watt2_search import sample_side, search
    from mechanisms.families.watt2_two_effectors import Half, _body

    task = replace(three_pose_task(), free={}, solve={"samples": 512, "seed": 5})
    family = families.family(task.mechanism)
    problem = family.system(task)
    cranks = [c for c in family._roots(task, solve(problem.system, problem.parameters)) if isinstance(c, tuple)]
    _, beta, one, two = cranks[0]
    halves = (
        Half("W3", "Z3", ("eta2", "eta3"), *_body(task, "P"), one.W, one.Z, beta),
        Half("W4", "Z4", ("phi2", "phi3"), *_body(task, "Q"), two.W, two.Z, beta),
    )
    sides = tuple(sample_side(task, half, k) for k, half in enumerate(halves))
    share, _ = search(task, halves, sides)
    good = sum(
        bool(sides[0].good(way)[i] and sides[1].good(way)[j])
        for i in range(512)
        for j in range(512)
        for way in (1, -1)
    )
    assert share == pytest.approx(good / 512**2)  # three poses come in order one way only


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("turns", [(0.0, 0.0), (-45.0, -30.0), (1e-7, 1e-7)])
def test_a_free_dyad_at_infinity_is_degenerate_and_says_so(turns):
    task = three_pose_task().to_dict()
    task["free"]["eta2_deg"], task["free"]["eta3_deg"] = turns
    result = synthesize(type(three_pose_task()).from_dict(task))
    real = [d for d in result.designs if "not determined" in d.note or d.linkage is not None]
    assert len(real) == 3 and not result.accepted
    assert all("degenerate" in design.reasons or design.link_ratio > 1e3 for design in real)


@pytest.mark.filterwarnings("error")
def test_a_body_that_does_not_turn_between_two_poses():
    """P is translated: Eq. (2) gives W1, Eq. (4) gives W3, and the vectors Z are what is chosen or searched."""
    mapping = two_pose_task().to_dict()
    mapping["effectors"]["P"]["poses"][1]["angle_deg"] = 0.0
    mapping["free"] = {"beta2_deg": -90.0, "Z1_x": 3.0, "Z1_y": 4.0}
    mapping["solve"] = {"samples": 512}
    result = synthesize(type(two_pose_task()).from_dict(mapping))
    assert result.accepted
    for design in result.designs:
        assert design.parameters["Z1"] == pytest.approx(3 + 4j)
        assert design.worst_pose_error < 1e-9
