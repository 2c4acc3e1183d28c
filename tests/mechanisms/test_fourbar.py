import numpy as np
import pytest
from motion_zoo import four_bar_at

from mechanisms.branches import Branches
from mechanisms.closure import Closure
from mechanisms.curve import trace
from mechanisms.fourbar import DRIVEN, four_bar_range, judge_four_bars
from mechanisms.linkage import Input, LinkageError
from mechanisms.motion import judge_inputs


def random_joints(rng):
    return rng.normal(size=4) + 1j * rng.normal(size=4)


def other_assembly(joints, x):
    """The configuration with the same crank and the triangle of coupler and follower turned over."""
    a, b, c, d = joints
    tip = a + (b - a) * np.exp(1j * x[0])
    line = (d - tip) / abs(d - tip)
    turned_over = [line * (v / line).conjugate() for v in ((c - b) * np.exp(1j * x[1]), (c - d) * np.exp(1j * x[2]))]
    return np.array([x[0], np.angle(turned_over[0] / (c - b)), np.angle(turned_over[1] / (c - d))])


def lengths(joints, driven):
    a, b, c, d = joints
    sides = {"crank": abs(b - a), "coupler": abs(c - b), "follower": abs(c - d)}
    x = sides.pop(driven)
    return abs(d - a), x, *sides.values()


def circuits_of(joints):
    """All circuits, from the two assemblies with the crank where it is: every circuit has one, or both."""
    closure = Closure.of(four_bar_at(*joints))
    circuits = [trace(closure)]
    second = other_assembly(joints, np.zeros(3))
    if circuits[0].locate(second) is None:
        circuits.append(trace(closure, second))
    elif four_bar_range(*lengths(joints, "crank")).circuits == 2:  # the other one has the crank mirrored
        a, b, _, d = joints
        mirror = np.zeros(3)
        mirror[0] = -2 * np.angle((b - a) / (d - a))
        c, e = (joints[2] - a) / (d - a), d - a
        flipped = a + c.conjugate() * e
        tip = a + ((b - a) / (d - a)).conjugate() * e
        mirror[1] = np.angle((flipped - tip) / (joints[2] - b))
        mirror[2] = np.angle((flipped - d) / (joints[2] - d))
        assert circuits[0].locate(mirror) is None
        circuits.append(trace(closure, mirror))
    return circuits


def compare(count, seed):
    """Compare circuits, branches and ranges with the closed form; return the classes seen."""
    rng = np.random.default_rng(seed)
    seen = {}
    for _ in range(count):
        joints = random_joints(rng)
        circuits = circuits_of(joints)
        kinds = []
        for driven in DRIVEN:
            expected = four_bar_range(*lengths(joints, driven))
            cut = [Branches.of(circuit, Input(driven)) for circuit in circuits]
            assert len(circuits) == expected.circuits
            assert sum(branches.count for branches in cut) == expected.branches
            assert all(branches.endless for branches in cut) == expected.rotates
            kinds.append((bool(expected.cut_zero), bool(expected.cut_pi)))
            if expected.cut_zero or expected.cut_pi:
                a, b, c, d = joints
                start = np.angle({"crank": b - a, "coupler": c - b, "follower": -(c - d)}[driven] / (d - a))
                for branches in cut:
                    for number in range(branches.count):
                        low, high = np.add(branches.range(number), start)
                        span = high - low
                        if expected.cut_zero and expected.cut_pi:
                            assert np.isclose(span, expected.high - expected.low, atol=1e-6)
                        elif expected.cut_zero:
                            assert np.isclose(span, 2 * np.pi - 2 * expected.low, atol=1e-6)
                        else:
                            assert np.isclose(span, 2 * expected.high, atol=1e-6)
        seen[tuple(kinds)] = seen.get(tuple(kinds), 0) + 1
    return seen


def test_traced_circuits_agree_with_the_closed_form():
    assert len(compare(400, seed=1)) == 8  # four Grashof classes and four that are not


@pytest.mark.slow
def test_ten_thousand_traced_four_bars_agree_with_the_closed_form():
    assert len(compare(10_000, seed=2)) == 8


def verdicts(count, seed):
    """Judge random poses by tracing and in closed form; return how many verdicts were compared."""
    rng = np.random.default_rng(seed)
    compared = 0
    for _ in range(count):
        joints = random_joints(rng)
        linkage = four_bar_at(*joints)
        circuit = trace(Closure.of(linkage))
        number = rng.integers(1, 5)
        # Some poses in order on a piece of the circuit, some anywhere, some on the other assembly.
        places = rng.uniform(0, circuit.arcs, number)
        if rng.random() < 0.7:
            places = (places[0] + np.sort(rng.uniform(0, 0.5 * circuit.arcs, number))) % circuit.arcs
        x = circuit.at(places)[0]
        if rng.random() < 0.2:
            x[-1] = other_assembly(joints, x[-1])
        poses = [dict(zip(DRIVEN, row)) for row in x]
        traced = judge_inputs(linkage, None, poses)
        for driven in DRIVEN:
            closed = judge_four_bars(joints[None], x[None], driven)
            for key, value in traced[driven].as_dict().items():
                if key == "min_transmission_deg":
                    assert value == pytest.approx(closed[key][0], abs=1e-3)
                else:
                    assert value == closed[key][0], (key, joints, x)
                compared += 1
    return compared


def test_verdicts_agree_with_the_closed_form():
    assert verdicts(300, seed=3) == 300 * 15


@pytest.mark.slow
def test_ten_thousand_verdicts_agree_with_the_closed_form():
    assert verdicts(10_000, seed=4) == 150_000


def test_the_classes_by_grashofs_rule():
    """Grashof: shortest + longest < the other two; the link next to the shortest rocks, the shortest turns."""
    rng = np.random.default_rng(5)
    for _ in range(2000):
        sides = rng.uniform(0.1, 1, 4)
        if 2 * sides.max() > sides.sum():
            continue
        ordered = np.sort(sides)
        grashof = ordered[0] + ordered[3] < ordered[1] + ordered[2]
        g, a, b, c = sides
        crank, coupler, follower = (
            four_bar_range(g, a, b, c),
            four_bar_range(g, b, c, a),
            four_bar_range(g, c, b, a),
        )
        assert crank.circuits == follower.circuits == coupler.circuits == (2 if grashof else 1)
        shortest = int(np.argmin(sides))
        assert crank.rotates == (grashof and shortest in (0, 1))
        assert follower.rotates == (grashof and shortest in (0, 3))
        assert coupler.rotates == (grashof and shortest in (0, 2))


def test_lengths_that_do_not_close_and_bad_input():
    assert not four_bar_range(10.0, 1.0, 1.0, 1.0).exists
    assert four_bar_range(10.0, 1.0, 1.0, 1.0).circuits == 0
    with pytest.raises(LinkageError, match="no length"):
        four_bar_range(1.0, 0.0, 1.0, 1.0)
    with pytest.raises(LinkageError, match="choose one of crank"):
        judge_four_bars([[0, 1j, 3 + 2j, 4]], np.zeros((1, 1, 3)), "krank")
