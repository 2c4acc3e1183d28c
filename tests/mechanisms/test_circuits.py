import numpy as np
import pytest
from motion_zoo import SIX_BARS, four_bar, robomech, six_bar, wanzer
from test_closure import LINKAGES, slider_crank

from mechanisms.assemblies import assemblies, generic_assemblies
from mechanisms.circuits import all_circuits
from mechanisms.closure import Closure
from mechanisms.completions import completions
from mechanisms.critical import dead_centres
from mechanisms.linkage import Input, Linkage, PinSlot, Slider

#: Complex and real assemblies at an input: two for each dyad, six for each group of four links with one
#: loop of four joints (Stephenson II, and III driven at its far dyad).
ASSEMBLIES = {
    "Watt I": {"t": 4, "l": 4},
    "Watt II": {"u": 4, "k": 4, "m": 4},
    "Stephenson I": {"t": 4, "u": 4},
    "Stephenson II": {"t": 6, "n": 6},
    "Stephenson III": {"k": 4, "l": 4, "m": 6},
}


@pytest.mark.parametrize("kind", SIX_BARS)
def test_the_number_of_assemblies_is_the_published_one(kind):
    linkage = six_bar(kind, np.random.default_rng(1))
    counts = {name: len(generic_assemblies(linkage, driven).points) for name, driven in linkage.inputs.items()}
    assert counts == ASSEMBLIES[kind]


def test_the_modified_wanzer_has_eight_assemblies_at_its_crank():
    """Two of the four-bar times four of the trammel."""
    linkage, _ = wanzer(5)
    assert len(generic_assemblies(linkage, Input("crank")).points) == 8


def test_assemblies_are_those_of_the_closed_form():
    linkage = four_bar(4, 1, 3, 3.5)
    for value in np.linspace(0, 6, 7):
        found = assemblies(linkage, "crank", value)
        assert len(found.x) == 2
        assert found.complex_count == 0
        for x in found.x:
            p = Closure.of(linkage).points_at(x)
            assert p["B"] == pytest.approx(np.exp(1j * (1 + value)))
            assert abs(p["C"] - p["B"]) == pytest.approx(3)
            assert abs(p["C"] - p["D"]) == pytest.approx(3.5)
        sides = [
            np.sign(((p["D"] - p["B"]).conj() * (p["C"] - p["B"])).imag)
            for p in map(Closure.of(linkage).points_at, found.x)
        ]
        assert sorted(sides) == [-1, 1]


def test_a_slider_gives_its_displacement():
    found = assemblies(slider_crank(), "block", 0.1)
    assert len(found.x) == 2
    places = Closure.of(slider_crank()).points_at(found.x)
    assert np.allclose(places["C"], 3.6)


def test_the_class_iv_groups_of_the_robomech_manipulator():
    """Two groups of four links, six assemblies each; the real ones by the paper's conditional coordinate as
    well.

    With the rotation of link 1 as conditional coordinate, f = |ML| − l_ML is a function of one variable for
    each of the two dyads B–G–H; its zeros are the assemblies of the group.
    """
    linkage = robomech()
    assert len(generic_assemblies(linkage, linkage.inputs["7"]).points) == 36
    closure = Closure.of(linkage)
    for degrees in (90.0, 100.0):
        found = assemblies(linkage, "7", np.radians(degrees - 90))
        p = linkage.points
        h = p["K"] + np.exp(1j * np.radians(degrees - 90)) * (p["H"] - p["K"])
        left = _group(p, "A", "B", "G", "L", "M", h)
        right = _group(p, "D", "E", "I", "Q", "N", h)
        assert len(found.x) == len(left) * len(right)
        spots = closure.points_at(found.x)
        for i in range(len(found.x)):
            assert min(abs(spots["B"][i] - b) + abs(spots["G"][i] - g) for b, g in left) < 1e-6
            assert min(abs(spots["E"][i] - b) + abs(spots["I"][i] - g) for b, g in right) < 1e-6


def _group(p, base, elbow, hand, brace, far, h):
    """Zeros (elbow, hand) of the brace's length error over all turns of the first link and both dyads."""
    found = []
    reach, upper, lower = p[elbow] - p[base], abs(p[hand] - p[elbow]), abs(p["H"] - p[hand])
    length = abs(p[far] - p[brace])
    for side in (1, -1):

        def place(turn, side=side):
            b = p[base] + reach * np.exp(1j * turn)
            d = np.abs(h - b)
            x = (d * d + upper**2 - lower**2) / (2 * d)
            g = b + (h - b) / d * (x + 1j * side * np.sqrt((upper**2 - x**2).astype(complex)).real)
            m = g + (p[far] - p[hand]) * (h - g) / (p["H"] - p[hand])
            tip = p[base] + (p[brace] - p[base]) * np.exp(1j * turn)
            return b, g, np.where(np.abs(x) <= upper, np.abs(m - tip) - length, np.nan)

        turns = np.linspace(-np.pi, np.pi, 20_000) + 1e-5
        error = place(turns)[2]
        for i in np.flatnonzero(error[:-1] * error[1:] <= 0):
            low, high = turns[i], turns[i + 1]
            for _ in range(60):
                middle = np.array(0.5 * (low + high))
                if place(middle)[2] * place(np.array(low))[2] > 0:
                    low = float(middle)
                else:
                    high = float(middle)
            found.append(place(np.array(low))[:2])
    return found


@pytest.mark.parametrize("name", LINKAGES)
def test_traced_circuits_agree_with_complete_solves(name):
    linkage = LINKAGES[name]()
    for driven in linkage.inputs.values():
        motion = all_circuits(linkage, driven)
        assert motion.complete, motion.doubts


def six_bars_are_complete(count, seed, inputs):
    rng = np.random.default_rng(seed)
    for kind in SIX_BARS:
        for _ in range(count):
            linkage = six_bar(kind, rng)
            numbers = set()
            for driven in list(linkage.inputs.values())[:inputs]:
                motion = all_circuits(linkage, driven)
                assert motion.complete, (kind, motion.doubts)
                numbers.add(motion.circuits)
            assert len(numbers) == 1  # circuits do not know which link is driven


def test_circuits_of_random_six_bars_are_complete():
    six_bars_are_complete(2, seed=21, inputs=1)


@pytest.mark.slow
def test_circuits_of_many_random_six_bars_are_complete():
    six_bars_are_complete(20, seed=22, inputs=3)


def test_dead_centres_of_a_four_bar_are_where_the_other_two_links_are_in_line():
    found = dead_centres(four_bar(4, 3, 1.2, 3.5), "crank")
    assert len(found.x) == 4
    places = Closure.of(four_bar(4, 3, 1.2, 3.5)).points_at(found.x)
    reach = np.abs(places["D"] - places["B"])
    assert np.allclose(np.sort(reach), [2.3, 2.3, 4.7, 4.7])
    assert np.all(np.diff(found.value) >= 0)
    assert not found.double.any()


def test_a_parallelogram_has_its_two_double_points():
    found = dead_centres(four_bar(4, 1, 4, 1, side=-1), "crank")
    assert found.double.sum() == 2
    places = Closure.of(four_bar(4, 1, 4, 1, side=-1)).points_at(found.x[found.double])
    assert np.allclose(places["B"].imag, 0, atol=1e-5)  # all links along one line


def test_every_circuit_of_the_robomech_manipulator():
    motion = all_circuits(robomech(), "7")
    assert motion.complete, motion.doubts
    assert (motion.circuits, motion.branches) == (6, 29)
    assert len(motion.dead_centres.x) == 28


def test_what_stands_is_completed_in_every_way():
    linkage = robomech()
    closure = Closure.of(linkage)
    found = assemblies(linkage, "7", 0.1)
    turned = closure.link_rotations(found.x[0])
    standing = {link: float(turned[link]) for link in ("7", "1", "2", "5", "8")}
    rest = completions(linkage, standing)
    alike = [
        x for x in found.x if np.abs(np.exp(1j * x[[0, 1, 4, 7]]) - np.exp(1j * found.x[0][[0, 1, 4, 7]])).max() < 1e-6
    ]
    assert len(rest) == len(alike) == 2


@pytest.mark.parametrize(
    ("lengths", "circuits", "doubles"),
    [
        ((4, 1, 4, 1), 1, 2),
        ((2, 2, 3, 3), 1, None),
        ((2, 2, 2, 2), 1, None),
        ((3, 1, 4, 2), 1, 1),
        ((3, 1, 4, 2.1), 2, 0),
    ],
)
def test_change_points_join_pieces_to_one_circuit(lengths, circuits, doubles):
    """Parallelogram, kite, rhombus, a single change point, and none.

    The crank of kite and rhombus stands still on a whole piece, so that their dead centres are not isolated.
    """
    motion = all_circuits(four_bar(*lengths), "crank")
    assert motion.complete, motion.doubts
    assert motion.circuits == circuits
    assert doubles is None or motion.dead_centres.double.sum() == doubles


def test_circuits_that_go_to_infinity_and_groups_that_are_never_dead():
    """A pin on a straight guide in the slot of an arm; the two crossed sliders of an ellipsograph."""
    arm = Linkage(
        {"O": 0, "P": 1j},
        {"ground": "O", "arm": "O", "block": "P"},
        sliders=[Slider("ground", "block", 1)],
        slots=[PinSlot("arm", "P", 1j)],
        inputs={"arm": Input("arm")},
    )
    motion = all_circuits(arm, "arm")
    assert motion.complete, motion.doubts
    assert [piece.circuit.ends for piece in motion.pieces] == [("goes to infinity",) * 2] * 2
    assert np.allclose([piece.range(0)[1] - piece.range(0)[0] for piece in motion.pieces], np.pi, atol=3e-3)
    ellipsograph = Linkage(
        {"X": 2, "Y": 1j},
        {"ground": (), "a": "X", "b": "Y", "rod": "XY"},
        sliders=[Slider("ground", "a", 1), Slider("ground", "b", 1j)],
        inputs={"a": Input("a", translation=True), "rod": Input("rod")},
    )
    assert repr(all_circuits(ellipsograph, "rod")) == "Motion(1 circuit, 1 branch, complete)"
    assert repr(all_circuits(ellipsograph, "a")) == "Motion(1 circuit, 2 branches, complete)"
