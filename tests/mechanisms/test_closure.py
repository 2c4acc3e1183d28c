from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from motion_zoo import four_bar, two_effector_watt2, wanzer

from mechanisms.closure import Closure
from mechanisms.curve import settle, trace
from mechanisms.linkage import Gear, Input, Linkage, LinkageError, PinSlot, Slider


def slider_crank():
    return Linkage(
        points={"A": 0, "B": 0.6 + 0.8j, "C": 3.5},
        links={"ground": "A", "crank": "AB", "rod": "BC", "block": "C"},
        sliders=[Slider("ground", "block", 1, "C")],
        inputs={"crank": Input("crank"), "block": Input("block", translation=True)},
    )


def inverted_slider_crank():
    return Linkage(
        points={"A": 0, "B": 0.6 + 0.8j, "C": -2},
        links={"ground": "AC", "crank": "AB", "arm": "C"},
        slots=[PinSlot("arm", "B", 2.6 + 0.8j)],
        inputs={"crank": Input("crank")},
    )


def geared_five_bar():
    return Linkage(
        points={"A": 0, "B": 1j, "C": 1.5 + 2j, "D": 3 + 1j, "E": 3},
        links={"ground": "AE", "1": "AB", "2": "BC", "3": "CD", "4": "DE"},
        gears=[Gear({"4": 1, "1": Fraction(3, 2)})],
        inputs={"1": Input("1")},
    )


def watt2():
    return two_effector_watt2(
        -35 + 12.9j, 6 + 1.3j, -3.2 + 12.3j, -5.8 + 1.9j, -30 + 5j, -7.9 + 10.2j, -5 + 10j, -3.7 + 2.8j
    )


LINKAGES = {
    "four-bar": lambda: four_bar(4, 1, 3, 3.5),
    "Watt II": watt2,
    "modified Wanzer": lambda: wanzer(5)[0],
    "slider-crank": slider_crank,
    "inverted slider-crank": inverted_slider_crank,
    "geared five-bar": geared_five_bar,
}
every = pytest.mark.parametrize("name", LINKAGES)


@every
def test_the_reference_closes_and_one_freedom_is_left(name):
    closure = Closure.of(LINKAGES[name]())
    assert np.abs(closure.residual(closure.reference())).max() < 1e-14
    assert closure.size - closure.equations == 1


@every
def test_derivatives_agree_with_finite_differences(name):
    closure = Closure.of(LINKAGES[name]())
    rng = np.random.default_rng(3)
    x, v = 0.3 * rng.normal(size=(2, closure.size))
    if len(closure.gears):
        x = settle(closure, x)[0]
        v = v - np.linalg.pinv(closure.gears) @ closure.gears @ v  # a jump of a whole tooth is no derivative
    h = 1e-5
    first = (closure.residual(x + h * v) - closure.residual(x - h * v)) / (2 * h)
    second = (closure.residual(x + h * v) - 2 * closure.residual(x) + closure.residual(x - h * v)) / h**2
    assert np.allclose(closure.jacobian(x) @ v, first, atol=1e-8)
    assert np.allclose(closure.curvature(x, v), second, atol=1e-4)


@every
def test_along_the_whole_circuit_links_stay_rigid_and_gears_mesh(name):
    linkage = LINKAGES[name]()
    closure = Closure.of(linkage)
    circuit = trace(closure)
    points = closure.points_at(circuit.x)
    turned = closure.link_rotations(circuit.x)
    for link, members in linkage.links.items():
        angle = turned.get(link, np.zeros(len(circuit.x)))
        for a, b in pairwise(members):
            expected = np.exp(1j * angle) * (linkage.points[b] - linkage.points[a])
            assert np.allclose(points[b] - points[a], expected, atol=1e-12 * closure.scale)
    for gear in linkage.gears:
        meshing = sum(c * turned[link] for link, c in gear.whole_numbers().items()) / (2 * np.pi)
        assert np.allclose(meshing, np.round(meshing), atol=1e-12)


def test_a_slider_keeps_to_its_line_and_a_pin_to_its_slot():
    closure = Closure.of(slider_crank())
    c = closure.points_at(trace(closure).x)["C"]
    assert np.allclose(c.imag, 0, atol=1e-12)
    assert np.isclose(c.real.max() - c.real.min(), 2, atol=0.02)  # the stroke of a central slider-crank is two cranks
    linkage = inverted_slider_crank()
    closure = Closure.of(linkage)
    x = trace(closure).x
    points = closure.points_at(x)
    arm = np.exp(1j * x[:, closure.class_of["arm"]]) * (2.6 + 0.8j)
    assert np.allclose(((points["B"] - points["C"]) * arm.conj()).imag, 0, atol=1e-12)


def test_a_configuration_is_found_from_rotations_alone():
    closure = Closure.of(wanzer(5)[0])
    x = trace(closure).x[::7]
    again = closure.configuration(closure.link_rotations(x))
    assert np.allclose(again, x, atol=1e-12)


def test_missing_and_unknown_rotations_are_named():
    closure = Closure.of(four_bar(4, 1, 3, 3.5))
    with pytest.raises(LinkageError, match="no rotation of 'coupler', 'follower'"):
        closure.configuration({"crank": 0.1})
    with pytest.raises(LinkageError, match="'krank'"):
        closure.configuration({"krank": 0.1})


def test_an_input_that_cannot_turn_is_refused():
    linkage = slider_crank()
    with pytest.raises(LinkageError, match="never turns"):
        Closure.of(linkage).gradient(Input("block"))
    with pytest.raises(LinkageError, match="these links do not turn apart"):
        Closure.of(Linkage(linkage.points, linkage.links, linkage.sliders, gears=[Gear({"block": 1})]))
