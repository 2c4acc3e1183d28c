import numpy as np
import pytest
from motion_zoo import four_bar, two_effector_watt2, wanzer
from test_closure import geared_five_bar, slider_crank

from mechanisms.closure import Closure
from mechanisms.curve import trace
from mechanisms.linkage import Gear, Input, Linkage, LinkageError
from mechanisms.transmission import Transmission, assur_groups


def acute(a, b):
    """Angle between two directions, in [0, π/2]."""
    return np.arcsin(np.abs((a.conj() * b).imag) / np.abs(a * b))


def test_a_four_bar_has_the_textbook_angle():
    linkage = four_bar(4, 1, 3, 3.5)
    closure = Closure.of(linkage)
    x = trace(closure).x
    p = closure.points_at(x)
    expected = acute(p["C"] - p["B"], p["C"] - p["D"])
    assert np.allclose(Transmission(linkage, Input("crank")).angle(x), expected, atol=1e-12)
    # Driven by the coupler, crank and follower jam when they are parallel.
    expected = acute(p["B"] - p["A"], p["C"] - p["D"])
    assert np.allclose(Transmission(linkage, Input("coupler")).angle(x), expected, atol=1e-12)
    # Driven by a motor between crank and coupler, the dyad is crank-and-coupler as one piece, with the follower.
    expected = acute(p["C"] - p["A"], p["C"] - p["D"])
    assert np.allclose(Transmission(linkage, Input("crank", "coupler")).angle(x), expected, atol=1e-12)


def test_a_slider_crank_has_the_textbook_angle():
    linkage = slider_crank()
    closure = Closure.of(linkage)
    x = trace(closure).x
    p = closure.points_at(x)
    rod = p["C"] - p["B"]
    expected = np.pi / 2 - acute(rod, np.ones_like(rod))
    assert np.allclose(Transmission(linkage, linkage.inputs["crank"]).angle(x), expected, atol=1e-12)
    expected = acute(rod, p["B"] - p["A"])
    assert np.allclose(Transmission(linkage, linkage.inputs["block"]).angle(x), expected, atol=1e-12)


def test_a_watt_six_bar_has_the_least_of_its_dyads():
    linkage = two_effector_watt2(
        -35 + 12.9j, 6 + 1.3j, -3.2 + 12.3j, -5.8 + 1.9j, -30 + 5j, -7.9 + 10.2j, -5 + 10j, -3.7 + 2.8j
    )
    assert assur_groups(linkage, Input("crank")) == (
        ("crank",),
        ("P-coupler", "P-rocker"),
        ("Q-coupler", "Q-rocker"),
    )
    closure = Closure.of(linkage)
    x = trace(closure).x
    p = closure.points_at(x)
    dyads = [acute(p["C"] - p["A"], p["C"] - p["O3"]), acute(p["C'"] - p["A'"], p["C'"] - p["O4"])]
    assert np.allclose(Transmission(linkage, Input("crank")).angle(x), np.minimum(*dyads), atol=1e-12)


def test_the_angle_is_zero_exactly_where_the_input_stands_still():
    for linkage in (wanzer(6)[0], geared_five_bar(), four_bar(4, 3, 1.2, 3.5)):
        circuit = trace(Closure.of(linkage))
        for driven in [*linkage.inputs.values(), *map(Input, linkage.moving_links)]:
            gradient = circuit.closure.gradient(driven)[0]
            cuts = circuit.turning_places(gradient)
            angle = Transmission(linkage, driven).angle
            assert np.all(angle(circuit.at(cuts)[0]) < 1e-6)
            away = np.setdiff1d(np.arange(circuit.arcs), np.r_[np.floor(cuts), np.floor(cuts) + 1, np.floor(cuts) - 1])
            assert np.all(angle(circuit.x[away.astype(int)]) > 1e-6)


def test_a_group_of_four_links_does_not_depend_on_names():
    # Stephenson III driven at the far dyad's crank: one group of four links remains.
    points = {"A": 0, "B": 1 + 2j, "C": 4 + 3j, "D": 5, "E": 3 + 5j, "F": 7 + 4j, "G": 8 + 0.5j}
    links = {"ground": "ADG", "a": "AB", "b": "BCE", "c": "CD", "d": "EF", "e": "FG"}
    linkage = Linkage(points, links)
    assert [len(group) for group in assur_groups(linkage, Input("e"))] == [1, 4]
    x = trace(Closure.of(linkage)).x
    turned = Closure.of(linkage).link_rotations(x)
    angle = Transmission(linkage, Input("e")).angle(x)
    assert 0 < angle.max() < np.pi / 2
    new = dict(zip("abcde", "qzkyx"))
    other = Linkage(
        {k: points[k] for k in "GFEDCBA"},
        {"ground": "GAD"} | {new[k]: links[k][::-1] for k in "ecadb"},
    )
    y = Closure.of(other).configuration({new[k]: v for k, v in turned.items()})
    assert np.allclose(Transmission(other, Input(new["e"])).angle(y), angle, atol=1e-9)


def test_links_held_too_often_or_not_at_all_are_named():
    points = {"A": 0, "B": 1j, "C": 2 + 1j, "D": 2, "E": 3 + 2j, "F": 4}
    # A crank, a rocker geared to it, and a rod between them: locked; a link hangs loose instead.
    linkage = Linkage(
        points,
        {"ground": "AD", "a": "AB", "b": "DC", "rod": "BC", "loose": "CE", "more": "EF"},
        gears=[Gear({"a": 1, "b": 2})],
    )
    with pytest.raises(LinkageError, match="'rod' is held too often"):
        assur_groups(linkage, Input("a"))
    with pytest.raises(LinkageError, match="can still move"):
        assur_groups(Linkage(points, {"ground": "AF", "a": "AB", "b": "BCD", "c": "DE", "d": "EF"}), Input("a"))
