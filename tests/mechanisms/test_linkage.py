from fractions import Fraction

import numpy as np
import pytest
from motion_zoo import four_bar, wanzer

from mechanisms.linkage import Gear, Input, Linkage, LinkageError, PinSlot, Slider

SQUARE = {"A": 0, "B": 1j, "C": 3 + 2j, "D": 4}
BARS = {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": SQUARE | {"A": complex("nan")}}, "point A"),
        ({"points": SQUARE | {"A": "zero"}}, "not a number"),
        ({"links": {k: v for k, v in BARS.items() if k != "ground"}}, 'named "ground"'),
        ({"links": BARS | {"coupler": "BX"}}, "'X' is not known"),
        ({"links": BARS | {"coupler": "BCB"}}, "twice"),
        ({"links": BARS | {"extra": ()}}, "no point"),
        ({"links": BARS | {"loose": "E"}, "points": SQUARE | {"E": 9}}, "no chain of joints"),
        ({"points": SQUARE | {"E": 9}}, "belongs to no link"),
        ({"inputs": {"crank": Input("krank")}}, "did you mean 'crank'"),
        ({"inputs": {"crank": Input("crank", "crank")}}, "against itself"),
        ({"inputs": {"crank": Input("crank", translation=True)}}, "no slider joins"),
        ({"bodies": {"P": ("coupler", "D")}}, "no point 'D'"),
        ({"bodies": {"P": ("coupler",)}}, "(link, point)"),
        ({"slots": [PinSlot("crank", "B", 1)]}, "fixed to the link"),
        ({"sliders": [Slider("crank", "crank", 1)]}, "itself"),
        ({"gears": [Gear({"crank": 1, "wheel": 2})]}, "'wheel' is not known"),
    ],
)
def test_a_bad_description_is_refused_with_its_place(change, words):
    with pytest.raises(LinkageError, match=words.replace("(", r"\(").replace(")", r"\)")):
        Linkage(**({"points": SQUARE, "links": BARS} | change))


def test_bad_joints_are_refused():
    with pytest.raises(LinkageError, match="direction is zero"):
        Slider("a", "b", 0)
    with pytest.raises(LinkageError, match="not a rational number"):
        Gear({"a": 1.5})
    with pytest.raises(LinkageError, match="at least one link"):
        Gear({"a": 0})


def test_gears_reduce_to_whole_numbers():
    assert Gear({"a": Fraction(2, 3), "b": Fraction(-4, 5)}).whole_numbers() == {"a": 5, "b": -6}


def test_counts_and_repr():
    linkage, _ = wanzer(5)
    assert repr(linkage) == "Linkage(6 links, 9 points, 6 revolute joints, 2 slots, 1 degree of freedom)"
    assert four_bar(4, 1, 3, 3.5).degrees_of_freedom == 1
    five_bar = Linkage({"A": 0, "B": 1j, "C": 1 + 2j, "D": 3 + 1j, "E": 3},
                       {"ground": "AE", "1": "AB", "2": "BC", "3": "CD", "4": "DE"})  # fmt: skip
    assert five_bar.degrees_of_freedom == 2


def test_a_point_of_three_links_is_two_joints():
    linkage = Linkage(
        {"A": 0, "B": 1j, "C": 3 + 2j, "D": 4, "E": 5 + 1j, "F": 6},
        BARS | {"ground": "ADF", "bar": "CE", "rocker": "EF"},
    )
    assert len(linkage.revolute_joints()) == 7
    assert linkage.degrees_of_freedom == 1


def test_positions_keep_every_link_rigid():
    linkage, poses = wanzer(5)
    motion = {link: np.array([pose[link] for pose in poses[:1] * 3]) for link in poses[0]}
    places = linkage.positions(motion)
    for point, at in places.items():
        assert np.allclose(at, linkage.points[point], atol=1e-14)
