import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motion_zoo import (
    SIX_BARS,
    TABLE_4,
    WANZER,
    four_bar,
    kiper_crank_rotations,
    kiper_design,
    six_bar,
    two_effector_watt2,
    wanzer,
    watt2_poses,
)
from test_closure import geared_five_bar, slider_crank

from mechanisms.branches import Branches
from mechanisms.closure import Closure
from mechanisms.curve import trace
from mechanisms.linkage import Input, Linkage, LinkageError
from mechanisms.motion import Placed, Verdict, judge, judge_inputs, judge_many
from mechanisms.transmission import Transmission


@pytest.mark.parametrize("table", [5, 6])
def test_the_published_modified_wanzer_designs_are_free_of_defects(table):
    linkage, poses = wanzer(table)
    verdict = judge(linkage, "crank", poses)
    assert verdict.reasons == ()
    assert verdict.full_rotation
    assert verdict.clearance == math.inf
    assert max(verdict.moved) < 1e-3  # four printed decimals
    assert 0 < verdict.min_transmission_deg < 90
    assert verdict.certified is None
    assert judge(linkage, "crank", poses, certify=True).certified


def test_the_third_published_design_has_a_circuit_and_a_branch_defect():
    linkage, poses = wanzer(7)
    verdict = judge(linkage, "crank", poses)
    assert verdict.reasons == ("circuit",)
    on_first = [j for j, number in enumerate(verdict.circuits) if number == 0]
    assert on_first == [0, 1, 3, 5]
    assert verdict.circuits == (0, 0, 1, 0, 1, 0, 1, 1)
    # Those on the first circuit are not on one branch either: it has two dead centres.
    assert [verdict.branches[j] for j in on_first] == [0, 0, 1, 1]
    assert "Pose 2 is on circuit 1, pose 0 on circuit 0." in verdict.notes
    assert "Pose 3 is on branch 1, pose 0 on branch 0." in verdict.notes
    placed = Placed.of(linkage, poses)
    assert Branches.of(placed.circuits[0], Input("crank")).count == 2


def quartic_labels(table, configurations):
    """Which of the formulas (23), (24) of the paper gives the disc's angle, 1 to 4, for each configuration."""
    d = WANZER[table]
    linkage, _ = wanzer(table)
    closure = Closure.of(linkage)
    points = closure.points_at(configurations)
    disc = closure.link_rotations(configurations)["disc"] + math.radians(d["theta0"])
    a0 = linkage.points["A"]
    offset_b, offset_c = d["B"] - a0, d["C"] - a0
    unit = np.exp(1j * math.radians(d["theta0"]))
    a = ((d["B"] - d["Q"]) * (1j * unit).conjugate()).real
    b = -((d["C"] - d["Q"]) * unit.conjugate()).real
    dot, cross = (offset_b.conjugate() * offset_c).real, (offset_b.conjugate() * offset_c).imag
    labels = []
    for spot, theta in zip(points["A"], disc):
        w = spot - d["Q"]
        p = np.array([a + w.imag, 2 * w.real, a - w.imag])
        q = np.array([w.real - b, -2 * w.imag, -(b + w.real)])
        h = abs(offset_c) ** 2 * np.polymul(p, p) + abs(offset_b) ** 2 * np.polymul(q, q)
        h = h + 2 * cross * np.polymul(p, q) - dot**2 * np.array([1, 0, 2, 0, 1])
        h3, h2, h1, h0 = h[1:] / h[0]
        cubic = np.roots([1, -h2, h3 * h1 - 4 * h0, 4 * h2 * h0 - h1**2 - h3**2 * h0])
        y1 = max(z.real for z in cubic if abs(z.imag) < 1e-9 * (1 + abs(z)))
        r1 = np.sqrt(complex(h3**2 / 4 - h2 + y1))
        rest = (4 * h3 * h2 - 8 * h1 - h3**3) / (4 * r1)
        r2, r3 = np.sqrt(3 * h3**2 / 4 - r1**2 - 2 * h2 + rest), np.sqrt(3 * h3**2 / 4 - r1**2 - 2 * h2 - rest)
        roots = [-h3 / 4 + r1 / 2 + r2 / 2, -h3 / 4 + r1 / 2 - r2 / 2]
        roots += [-h3 / 4 - r1 / 2 + r3 / 2, -h3 / 4 - r1 / 2 - r3 / 2]
        distance = [abs(2 * np.arctan(z) - (theta + np.pi) % (2 * np.pi) + np.pi) for z in roots]
        assert min(distance) < 1e-5
        labels.append(1 + int(np.argmin(distance)))
    return labels


def test_the_root_label_of_the_published_branch_test_jumps_where_nothing_is_singular():
    linkage, poses = wanzer(6)
    placed = Placed.of(linkage, poses)
    circuit = placed.circuits[0]
    labels = quartic_labels(6, circuit.at(np.array(placed.places))[0])
    assert labels == [2, 2, 2, 2, 4, 4, 4]
    # Between poses 3 and 4 all determinants stay away from zero: no dead centre, and no zero transmission angle.
    assert not len(circuit.turning_places(circuit.closure.gradient(Input("crank"))[0]))
    low, high = sorted(placed.places[3:5])
    between = circuit.at(np.linspace(low, high, 400))[0]
    assert set(quartic_labels(6, between)) == {2, 4}
    assert np.degrees(Transmission(linkage, Input("crank")).angle(between).min()) > 3


def test_kipers_two_pose_design_is_good():
    linkage = two_effector_watt2(
        -35 + 12.901924j, 6 + 1.267949j, -3.169873 + 12.267949j, -5.830127 + 1.901924j,
        -30 + 5j, -7.886751 + 10.207259j, -5 + 10j, -3.711462 + 2.803556j,
    )  # fmt: skip
    poses = watt2_poses([-90], [-120], [-60], [-60], [-100])
    for verdict in judge_inputs(linkage, None, poses).values():
        assert verdict.reasons == ()


def test_kipers_three_pose_designs():
    """The printed vectors belong to η3 = −31.703° and are good; the printed angle −20° gives a circuit defect."""
    rotations = kiper_crank_rotations()
    assert np.allclose(rotations, [(-118.092024, -64.815826), (-5.908323303, -13.575766579), (15.194042, 11.489420)])
    eta, phi = (-15.0, -31.70257), (-20.0, -45.0)
    printed = judge_inputs(*_with_inputs(kiper_design(rotations[1], eta, phi)))
    assert all(verdict.reasons == () for verdict in printed.values())
    misprint = judge_inputs(*_with_inputs(kiper_design(rotations[1], (-15.0, -20.0), phi)))
    assert all(verdict.reasons == ("circuit",) and verdict.circuits == (0, 1, 0) for verdict in misprint.values())
    # The two real designs that the paper does not print.
    for angles in (eta, (-15.0, -20.0)):
        first = judge_inputs(*_with_inputs(kiper_design(rotations[0], angles, phi)))
        assert all(verdict.reasons == ("branch",) for verdict in first.values())
        linkage, poses = kiper_design(rotations[2], angles, phi)
        assert judge(linkage, "crank", poses).reasons == ("order",)
        assert judge(linkage, "P-rocker", poses).reasons == ("branch",)
        assert linkage.length("crank", "O1", "A'") > 500  # ten times the size of the task


def _with_inputs(design):
    return design[0], None, design[1]


def test_json_keys():
    linkage, poses = wanzer(5)
    verdict = judge(linkage, "crank", poses)
    assert list(verdict.as_dict()) == [
        "same_circuit", "same_branch", "in_order", "full_rotation", "min_transmission_deg",
    ]  # fmt: skip
    assert all(type(value) in (bool, float) for value in verdict.as_dict().values())
    assert repr(verdict).startswith("Verdict(defect-free, full rotation, transmission angle at least")
    assert "circuit defect" in repr(Verdict(False, False, False, False, 0.0))


def test_many_designs_are_judged_alike_in_one_process_or_two():
    designs = [wanzer(table) for table in (5, 6, 7)] * 2
    linkages, poses = [d[0] for d in designs], [d[1] for d in designs]
    alone = judge_many(linkages, poses)
    assert alone == judge_many(linkages, poses, jobs=2)
    assert [verdicts["crank"].reasons for verdicts in alone] == [(), (), ("circuit",)] * 2


def test_input_errors_are_one_sentence():
    linkage, poses = wanzer(5)
    with pytest.raises(LinkageError, match="no input 'krank'; known are 'crank', 'disc'"):
        judge(linkage, "krank", poses)
    with pytest.raises(LinkageError, match="no poses"):
        judge(linkage, "crank", [])
    with pytest.raises(LinkageError, match="no rotation of 'disc'"):
        judge(linkage, "crank", [{k: v for k, v in pose.items() if k != "disc"} for pose in poses])
    far = dict.fromkeys(linkage.moving_links, 2.0)
    verdict = judge(linkage, "crank", [poses[0], far])
    assert verdict.circuits == (0, -1)
    assert verdict.reasons == ("circuit",)
    assert "Pose 1 is not reached" in verdict.notes[0]


def test_a_pose_in_a_dead_centre_belongs_to_both_its_branches():
    linkage = four_bar(4, 3, 1.2, 3.5)
    circuit = trace(Closure.of(linkage))
    branches = Branches.of(circuit, Input("crank"))
    low, high = branches.interval(1)
    names = linkage.moving_links
    for places in ([low, 0.5 * (low + high), high], [high, 0.5 * (low + high), low]):
        poses = [dict(zip(names, x)) for x in circuit.at(np.array(places))[0]]
        verdict = judge(linkage, "crank", poses)
        assert verdict.reasons == ()
        assert verdict.clearance < 1e-6
        assert verdict.min_transmission_deg < 1e-3


def random_task(seed):
    """A random six-bar with poses on its circuit, or at random places of it."""
    rng = np.random.default_rng(seed)
    linkage = six_bar(list(SIX_BARS)[seed % len(SIX_BARS)], rng)
    circuit = trace(Closure.of(linkage))
    count = int(rng.integers(2, 5))
    spread = rng.choice([0.1, 0.4, 1.0]) * circuit.arcs
    places = (rng.uniform(0, circuit.arcs) + np.sort(rng.uniform(0, spread, count))) % circuit.arcs
    x = circuit.at(places)[0]
    turned = circuit.closure.link_rotations(x)
    return linkage, [{link: float(angle[j]) for link, angle in turned.items()} for j in range(count)]


def alike(one, other):
    assert one.keys() == other.keys()
    for name, verdict in one.items():
        second = other[name]
        assert verdict.reasons == second.reasons
        assert verdict.full_rotation == second.full_rotation
        assert second.min_transmission_deg == pytest.approx(verdict.min_transmission_deg, abs=1e-4)
        assert second.clearance == pytest.approx(verdict.clearance, rel=1e-6, abs=1e-6)


few = settings(max_examples=25, deadline=None, derandomize=True)


@few
@given(st.integers(0, 10**6))
def test_reversing_time_changes_no_verdict(seed):
    linkage, poses = random_task(seed)
    forward, backward = judge_inputs(linkage, None, poses), judge_inputs(linkage, None, poses[::-1])
    for name, verdict in forward.items():
        second = backward[name]
        assert (verdict.same_circuit, verdict.same_branch) == (second.same_circuit, second.same_branch)
        assert verdict.in_order == second.in_order
        if verdict.in_order and len(poses) > 2:
            assert second.min_transmission_deg == pytest.approx(verdict.min_transmission_deg, abs=1e-4)


@few
@given(st.integers(0, 10**6), st.randoms(use_true_random=False))
def test_names_and_their_order_change_no_verdict(seed, random):
    linkage, poses = random_task(seed)
    links, points = list(linkage.moving_links), list(linkage.points)
    random.shuffle(links)
    random.shuffle(points)
    new_link = {"ground": "ground"} | {link: f"link {i}" for i, link in enumerate(links)}
    new_point = {point: f"point {i}" for i, point in enumerate(points)}
    changed = Linkage(
        {new_point[p]: linkage.points[p] for p in points},
        {new_link[k]: tuple(new_point[p] for p in reversed(linkage.links[k])) for k in [*links, "ground"]},
        inputs={name: Input(new_link[driven.link]) for name, driven in linkage.inputs.items()},
    )
    renamed = [{new_link[link]: angle for link, angle in pose.items()} for pose in poses]
    alike(judge_inputs(linkage, None, poses), judge_inputs(changed, None, renamed))


@few
@given(st.integers(0, 10**6), st.floats(-3, 3), st.floats(1e-3, 1e3))
def test_mirroring_turning_and_scaling_change_no_verdict(seed, angle, factor):
    linkage, poses = random_task(seed)
    turn = factor * np.exp(1j * angle)
    mirrored = Linkage(
        {p: turn * z.conjugate() + 5 for p, z in linkage.points.items()}, linkage.links, inputs=linkage.inputs
    )
    other = [{link: -rotation for link, rotation in pose.items()} for pose in poses]
    alike(judge_inputs(linkage, None, poses), judge_inputs(mirrored, None, other))


@few
@given(st.integers(0, 10**6))
def test_full_turns_of_links_change_no_verdict(seed):
    linkage, poses = random_task(seed)
    rng = np.random.default_rng(seed)
    turned = [{link: a + 2 * np.pi * int(rng.integers(-2, 3)) for link, a in pose.items()} for pose in poses]
    alike(judge_inputs(linkage, None, poses), judge_inputs(linkage, None, turned))


def test_table_4_is_not_used_up():
    assert [WANZER[t]["poses"] for t in (5, 6, 7)] == [6, 7, len(TABLE_4)]


def test_a_parallelogram_keeps_its_circuit_but_not_its_branch_through_the_fold():
    linkage = four_bar(4, 1, 4, 1, crank_angle=1.0, side=1)
    # As a parallelogram the coupler never turns; folded over at 180° it goes on as an antiparallelogram.
    parallel = [{"crank": a, "coupler": 0.0, "follower": a} for a in (0.0, 0.5, 1.5)]
    verdict = judge(linkage, "crank", parallel)
    assert verdict.reasons == ()
    assert verdict.clearance == pytest.approx(math.pi - 1 - 1.5, abs=1e-3)
    beyond = judge(linkage, "crank", [*parallel, {"crank": 3.0, "coupler": 0.0, "follower": 3.0}])
    assert beyond.reasons == ("branch",)
    assert beyond.circuits == (0, 0, 0, 0)


def test_a_kites_crank_does_not_move_where_it_is_folded_on_the_frame():
    linkage = four_bar(2, 2, 3, 3, crank_angle=1.0)
    circuit = trace(Closure.of(linkage))
    poses = [dict(zip(linkage.moving_links, x)) for x in circuit.at(np.array([90.0, 100.0, 110.0]))[0]]
    assert judge(linkage, "crank", poses).reasons == ()
    # Folded: the crank on the frame, coupler and follower turning about D as one.
    folded = Linkage(
        {"A": 0, "B": 2, "C": 2 + 3j, "D": 2},
        {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"},
    )
    turns = [{"crank": 0.0, "coupler": a, "follower": a} for a in (0.0, 0.3)]
    assert judge(folded, Input("crank"), turns).reasons == ("branch",)
    assert judge(folded, Input("follower"), turns).reasons == ()


def test_a_slider_may_be_the_input():
    linkage = slider_crank()
    circuit = trace(Closure.of(linkage))
    start = circuit.locate(np.zeros(3))
    places = (start + np.array([0.0, 1.0, 2.0])) % circuit.arcs
    turned = circuit.closure.link_rotations(circuit.at(places)[0])
    poses = [{link: float(angle[j]) for link, angle in turned.items()} for j in range(3)]
    verdict = judge(linkage, "block", poses)
    assert verdict.reasons == ()
    assert not verdict.full_rotation
    low, high = verdict.input_range  # of the block: it stands at 3.5, and the rod is |BC| long
    rod = linkage.length("rod", "B", "C")
    assert (3.5 + low, 3.5 + high) == pytest.approx((rod - 1, rod + 1), abs=1e-9)
    assert judge(linkage, "crank", poses).full_rotation


def test_a_geared_five_bar_may_need_more_than_one_turn():
    linkage = geared_five_bar()
    circuit = trace(Closure.of(linkage))
    turns = np.abs(np.round(circuit.turns(), 9))
    assert turns[0] in (0, 2)  # wheel 4 makes three turns while wheel 1 makes two
    turned = circuit.closure.link_rotations(circuit.at(np.array([0.0, 3.0, 6.0]))[0])
    poses = [{link: float(angle[j]) for link, angle in turned.items()} for j in range(3)]
    verdict = judge(linkage, "1", poses)
    assert verdict.same_circuit
    assert verdict.full_rotation == (Branches.of(circuit, Input("1")).endless)
