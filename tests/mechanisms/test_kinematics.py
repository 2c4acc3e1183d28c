from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from motion_zoo import four_bar, robomech, wanzer
from test_closure import LINKAGES, slider_crank

from mechanisms.branches import Branches
from mechanisms.closure import Closure
from mechanisms.curve import trace
from mechanisms.kinematics import Force, LineSpring, Torque, TorsionSpring, input_load, move, rates, spring_energy
from mechanisms.linkage import Gear, Input, Linkage, LinkageError


def test_the_robomech_manipulator_at_90_degrees():
    """Values of an independent computation with the loop equations (73) of the RoboMech paper."""
    linkage = robomech()
    state = move(linkage, "7", Closure.of(linkage).reference())
    speeds = {"1": 1.59576513, "2": -0.34713514, "5": 1.33012466, "8": -0.15976874,
              "3": 1.37133348, "4": -0.22263761, "6": 1.09465265, "9": -0.06199240}  # fmt: skip
    for link, value in speeds.items():
        assert state.angular_velocity[link] == pytest.approx(value, abs=5e-9)
    seconds = {"1": -0.1967, "2": 0.130511, "5": 0.431303, "8": -0.096242,
               "3": -0.301234, "4": -0.030119, "6": -0.611614, "9": 0.065837}  # fmt: skip
    for link, value in seconds.items():
        assert state.angular_acceleration[link] == pytest.approx(value, abs=5e-7)
    assert state.position["C"] == pytest.approx(1.284558792 + 3.303914309j, abs=1e-9)
    assert state.position["F"] == pytest.approx(5.070779174 + 3.461158969j, abs=1e-9)
    assert state.velocity["C"] == pytest.approx(-2.37482654 - 2.08812576j, abs=1e-8)


def test_the_robomech_manipulator_over_its_range():
    """C and F at φ7 = 72°, 74° … 108°, of the same independent computation."""
    linkage = robomech()
    branches = Branches.of(trace(Closure.of(linkage)), linkage.inputs["7"])
    home = branches.index(branches.circuit.locate(np.zeros(9)))
    expected = {
        72: (2.0531 + 3.717858j, 5.66164 + 2.726717j),
        80: (1.717423 + 3.595896j, 5.42785 + 3.094447j),
        100: (0.911193 + 2.881334j, 4.678688 + 3.71303j),
        108: (0.689837 + 2.482591j, 4.366598 + 3.831599j),
    }
    for degrees, (c, f) in expected.items():
        place = branches.place_at(home, np.radians(degrees - 90))
        points = branches.circuit.sample([place])
        assert points["C"][0] == pytest.approx(c, abs=2e-6)
        assert points["F"][0] == pytest.approx(f, abs=2e-6)
    # The input turns on: no dead centre anywhere, and all bars keep their lengths on the whole turn.
    assert branches.endless
    points = branches.circuit.sample([branches.place_at(home, angle) for angle in np.radians(np.arange(0, 360, 5))])
    for link, members in linkage.links.items():
        for a, b in pairwise(members):
            assert np.allclose(np.abs(points[a] - points[b]), linkage.length(link, a, b), atol=1e-12)
    turned = np.angle((points["H"] - points["K"]) / (linkage.points["H"] - linkage.points["K"]))
    assert np.allclose(np.exp(1j * turned), np.exp(1j * np.radians(np.arange(0, 360, 5))), atol=1e-9)


@pytest.mark.parametrize("name", LINKAGES)
def test_rates_agree_with_finite_differences(name):
    linkage = LINKAGES[name]()
    driven = next(iter(linkage.inputs.values()))
    closure = Closure.of(linkage)
    g, unit = closure.gradient(driven)
    x = trace(closure).x[3]
    state = move(linkage, driven, x, rate=0.7, acceleration=-0.4)
    v, a = rates(linkage, driven, x, rate=0.7, acceleration=-0.4)

    def later(t):
        """The configuration at time t, with the input at its value exactly."""
        y = x + v * t + a * t * t / 2
        for _ in range(8):
            matrix = np.vstack([closure.jacobian(y), g])
            aim = g @ x + (0.7 * t - 0.2 * t * t) / unit
            y = y - np.linalg.solve(matrix, np.r_[closure.residual(y), g @ y - aim])
        return closure.points_at(y)

    h = 1e-4
    before, after = later(-h), later(h)
    for point, place in state.position.items():
        size = closure.scale
        assert abs((after[point] - before[point]) / (2 * h) - state.velocity[point]) < 1e-6 * size
        assert abs((after[point] - 2 * place + before[point]) / h**2 - state.acceleration[point]) < 1e-4 * size


def test_a_slider_is_driven_by_its_displacement():
    linkage = slider_crank()
    state = move(linkage, "block", Closure.of(linkage).reference(), rate=2.5)
    assert state.velocity["C"] == pytest.approx(2.5, abs=1e-12)


def test_the_input_does_the_work_that_loads_and_springs_take():
    linkage, _ = wanzer(5)
    closure = Closure.of(linkage)
    x = trace(closure, longest=0.02).x
    loads = [Force("P", 1 - 2j), Torque("disc", 0.3), TorsionSpring("body", "coupler", 0.8, 0.2),
             LineSpring("P", "N", 0.5, 1.0), TorsionSpring("follower", "ground", 0.4)]  # fmt: skip
    push = input_load(linkage, "crank", x, loads)
    angle = x[:, closure.class_of["crank"]]
    points, turned = closure.points_at(x), closure.link_rotations(x)
    stored = spring_energy(linkage, x, loads) - (np.conj(1 - 2j) * points["P"]).real - 0.3 * turned["disc"]
    # Simpson on the uneven nodes would need care; the trapezoid error falls with the square of the step.
    work = np.concatenate([[0], np.cumsum(0.5 * (push[1:] + push[:-1]) * np.diff(angle))])
    assert np.ptp(stored) > 1
    assert np.allclose(work, stored - stored[0], atol=2e-3)
    rates_of_work = np.gradient(stored, angle, edge_order=2)
    assert np.allclose(rates_of_work, push, atol=2e-2)


def test_the_feeder_arm_of_coupled_serial_chains():
    """Peak torque of the design with R = −1.5 and φ2 = 90° for the feeder task of Krovi, Ananthasuresh and Kumar.

    T(φ) = Re(Z1 e^{iφ}) + R Re(Z2 e^{iRφ}) for the force (0, −1); 20.487147 on a grid of half degrees.
    """
    z1, z2 = complex(-30.091439068, 4.003439068), complex(-20.060959379, -23.835437930)
    linkage = Linkage(
        points={"O": 0, "A": z1, "P": z1 + z2},
        links={"ground": "O", "1": "OA", "2": "AP"},
        gears=[Gear({"2": 1, "1": Fraction(3, 2)})],
        inputs={"1": Input("1")},
    )
    phi = np.radians(np.linspace(0, 90, 181))
    x = Closure.of(linkage).configuration({"1": phi, "2": -1.5 * phi})
    torque = input_load(linkage, "1", x, [Force("P", -1j)])
    expected = (z1 * np.exp(1j * phi)).real - 1.5 * (z2 * np.exp(-1.5j * phi)).real
    assert np.allclose(torque, expected, atol=1e-12)
    assert np.abs(torque).max() == pytest.approx(20.487147, abs=5e-7)


def test_a_dead_centre_is_refused():
    linkage = four_bar(4, 3, 1.2, 3.5)
    circuit = trace(Closure.of(linkage))
    cut = circuit.turning_places(circuit.closure.gradient(Input("crank"))[0])[0]
    with pytest.raises(LinkageError, match="dead centre"):
        move(linkage, "crank", circuit.at(cut)[0])


def test_a_load_on_nothing_is_refused():
    with pytest.raises(LinkageError, match="'X'"):
        input_load(four_bar(4, 1, 3, 3.5), "crank", np.zeros(3), [Force("X", 1)])
