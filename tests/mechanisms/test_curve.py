import numpy as np
import pytest
from motion_zoo import SIX_BARS, four_bar, six_bar, wanzer
from test_closure import LINKAGES

from mechanisms.branches import Branches
from mechanisms.certified_trace import certify_trace
from mechanisms.closure import Closure
from mechanisms.curve import settle, trace, wrap
from mechanisms.linkage import Input, Linkage, LinkageError


@pytest.mark.parametrize("name", LINKAGES)
def test_a_circuit_closes_and_holds_all_its_points(name):
    closure = Closure.of(LINKAGES[name]())
    circuit = trace(closure)
    assert circuit.closed
    rng = np.random.default_rng(1)
    places = rng.uniform(0, circuit.arcs, 40)
    x, tangents = circuit.at(places)
    assert np.abs(closure.residual(x)).max() < 1e-12
    assert np.abs(np.einsum("ijk,ik->ij", closure.jacobian(x), tangents)).max() < 1e-10
    for place, row in zip(places, x):
        turned = row.copy()
        turned[: closure.rotations] += 2 * np.pi * rng.integers(-2, 3, closure.rotations)
        assert circuit.locate(turned) == pytest.approx(place, abs=1e-6)
        assert circuit.locate(row + 0.5) is None


@pytest.mark.parametrize("kind", SIX_BARS)
def test_circuits_do_not_depend_on_step_scale_turning_or_start(kind):
    rng = np.random.default_rng(len(kind))
    for _ in range(4):
        linkage = six_bar(kind, rng)
        closure = Closure.of(linkage)
        circuit = trace(closure)
        counts = [Branches.of(circuit, driven).count for driven in linkage.inputs.values()]
        turns = np.abs(np.round(circuit.turns()))
        factor = rng.uniform(0.01, 100) * np.exp(1j * rng.uniform(0, 6))
        shift = complex(*rng.normal(size=2))
        changed = Linkage(
            {name: factor * z + shift for name, z in linkage.points.items()}, linkage.links, inputs=linkage.inputs
        )
        start = circuit.at(rng.uniform(0, circuit.arcs))[0]
        others = [
            trace(closure, longest=0.05),
            trace(closure, longest=0.011),
            trace(closure, start),
            trace(Closure.of(changed)),
        ]
        for other in others:
            assert other.closed == circuit.closed
            assert [Branches.of(other, driven).count for driven in linkage.inputs.values()] == counts
            assert np.allclose(np.abs(np.round(other.turns())), turns)
            assert other.locate(circuit.at(0.37 * circuit.arcs)[0]) is not None


def certified(count, seed):
    rng = np.random.default_rng(seed)
    kinds = list(SIX_BARS)
    for number in range(count):
        linkage = six_bar(kinds[number % len(kinds)], rng)
        circuit = trace(Closure.of(linkage))
        assert circuit.closed
        assert certify_trace(circuit).certified


def test_traces_of_random_six_bars_are_proved():
    certified(15, seed=11)


@pytest.mark.slow
def test_traces_of_a_hundred_random_six_bars_are_proved():
    certified(100, seed=12)


@pytest.mark.parametrize("name", LINKAGES)
def test_traces_with_sliders_slots_and_gears_are_proved(name):
    assert certify_trace(trace(Closure.of(LINKAGES[name]()))).certified


def coarse(closure, step, count):
    """Predictor and Newton with a fixed long step, as is often done: nothing keeps it on its branch."""
    x, nodes = closure.reference(), []
    t = np.linalg.svd(closure.jacobian(x))[2][-1]
    for _ in range(count):
        guess = x + step * t
        y = guess.copy()
        for _ in range(20):
            matrix = np.vstack([closure.jacobian(y), t])
            y = y - np.linalg.solve(matrix, np.r_[closure.residual(y), t @ (y - guess)])
        if np.abs(closure.residual(y)).max() > 1e-9:
            break
        new = np.linalg.svd(closure.jacobian(y))[2][-1]
        x, t = y, new if new @ t > 0 else -new
        nodes.append(x)
    return nodes


def test_a_coarse_step_jumps_and_the_tubes_show_it():
    rng = np.random.default_rng(13)
    jumps = {0.02: 0, 0.9: 0}
    for _ in range(12):
        closure = Closure.of(six_bar("Stephenson III", rng))
        circuit = trace(closure)
        for step in jumps:
            jumps[step] += any(circuit.locate(x) is None for x in coarse(closure, step, 60))
    assert jumps[0.02] == 0
    assert jumps[0.9] >= 3


def test_a_certificate_fails_when_an_arc_is_skipped():
    from dataclasses import replace

    circuit = trace(Closure.of(four_bar(4, 1, 3, 3.5)))
    cut = [i for i in range(len(circuit.x)) if i != 5]
    broken = replace(
        circuit,
        x=circuit.x[cut], tangent=circuit.tangent[cut], bend=circuit.bend[cut],
        step=np.delete(circuit.step, 5), radius=np.delete(circuit.radius, 5),
    )  # fmt: skip
    assert not certify_trace(broken).certified


def test_turning_places_are_where_the_input_is_extreme():
    linkage, _ = wanzer(7)
    circuit = trace(Closure.of(linkage), longest=0.01)
    g = circuit.closure.gradient(Input("disc"))[0]
    places = circuit.turning_places(g)
    values = circuit.x @ g
    changes = np.flatnonzero(np.diff(np.sign(np.diff(np.r_[values, values[1] + values[-1] - values[0]]))))
    assert len(places) == len(changes)
    assert np.abs(np.einsum("ij,j->i", circuit.at(places)[1], g)).max() < 1e-10


def test_settle_moves_as_little_as_needed():
    closure = Closure.of(four_bar(4, 1, 3, 3.5))
    x = trace(closure).x[4]
    back, moved = settle(closure, x + 1e-4 * np.array([1, -1, 0.5]))
    assert moved < 2e-4
    assert np.abs(closure.residual(back)).max() < 1e-14
    assert np.abs(wrap(closure, back - x)).max() < 2e-4


def test_motion_needs_one_degree_of_freedom():
    five_bar = Linkage({"A": 0, "B": 1j, "C": 1 + 2j, "D": 3 + 1j, "E": 3},
                       {"ground": "AE", "1": "AB", "2": "BC", "3": "CD", "4": "DE"})  # fmt: skip
    with pytest.raises(LinkageError, match="this one has 2"):
        trace(Closure.of(five_bar))
    with pytest.raises(LinkageError, match="does not close"):
        trace(Closure.of(four_bar(4, 1, 3, 3.5)), np.ones(3))
