"""Choices of trammel parameters: against the paper's formulas for B, C, Q, a, b on random trammels."""

import itertools

import numpy as np
import pytest

from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_choices import choices

NAMES = ("x_B", "y_B", "x_C", "y_C", "x_Q", "y_Q", "a", "b")


def parameters(trammel):
    pins = {"B": trammel.B, "C": trammel.C, "Q": trammel.Q}
    found = {f"x_{name}": z.real for name, z in pins.items()} | {f"y_{name}": z.imag for name, z in pins.items()}
    return found | {"a": trammel.a, "b": trammel.b}


def random_trammel(seed, theta0):
    rng = np.random.default_rng(seed)
    return Trammel(*(rng.normal(size=3) + 1j * rng.normal(size=3)), theta0)


def value(rows, trammel):
    m, d, R = trammel.essential()
    essential = np.array([m, np.conj(m), d, np.conj(d), R, np.conj(R)])
    return rows[:, 1:7] @ essential + rows[:, 7] + rows[:, 0] * (abs(m) ** 2 - abs(R) ** 2)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("theta0", [0.0, 0.6, -1.2])
def test_each_parameter_with_theta0_is_a_linear_condition(name, theta0):
    trammel = random_trammel(1, theta0)
    right = {"theta0": theta0, name: parameters(trammel)[name]}
    rows = choices(right, 6).rows
    assert abs(value(rows, trammel)).max() < 1e-12
    wrong = choices({**right, name: right[name] + 0.1}, 6).rows
    assert abs(abs(value(wrong, trammel)[0]) - 0.1) < 1e-12


@pytest.mark.parametrize("pair", list(itertools.combinations(NAMES[:4], 2)))
def test_two_pin_coordinates_in_place_of_theta0(pair):
    """The condition holds for the trammel they were taken from in every gauge; the gauge gives them back."""
    trammel = random_trammel(2, 0.3)
    given = {name: parameters(trammel)[name] for name in pair}
    chosen = choices(given, 6)
    m, d, R = trammel.essential()
    assert abs(value(chosen.rows, trammel)).max() < 1e-12
    assert abs(value(chosen.rows, Trammel.from_essential(m, d, R, 1.1))).max() < 1e-12
    found = [parameters(Trammel.from_essential(m, d, R, theta0)) for theta0 in chosen.gauges(m, d, R)]
    assert found
    for again in found:
        assert all(abs(again[name] - given[name]) < 1e-12 for name in pair)


@pytest.mark.parametrize("name", NAMES[:4])
def test_one_pin_coordinate_is_a_gauge_for_seven_poses(name):
    trammel = random_trammel(3, 0.2)
    chosen = choices({name: parameters(trammel)[name]}, 7)
    assert len(chosen.rows) == 0
    m, d, R = trammel.essential()
    gauges = chosen.gauges(m, d, R)
    assert 1 <= len(gauges) <= 2 and min(abs(np.sin(g - 0.2)) for g in gauges) < 1e-9
    for theta0 in gauges:
        assert parameters(Trammel.from_essential(m, d, R, theta0))[name] == pytest.approx(
            parameters(trammel)[name], abs=1e-12
        )


def test_coordinate_out_of_reach_has_no_gauge():
    assert choices({"x_C": 9.0}, 7).gauges(1 + 0j, 0j, 2 + 0j) == []


def test_pivot_and_three_pin_coordinates_for_five_poses():
    trammel = random_trammel(4, 0.0)
    values = parameters(trammel)
    for names in (("x_Q", "x_B", "y_C"), ("x_B", "y_B", "x_C"), ("theta0", "a", "y_Q")):
        given = {name: values.get(name, 0.0) for name in names}
        chosen = choices(given, 5)
        assert len(chosen.rows) == 2 and abs(value(chosen.rows, trammel)).max() < 1e-12


def test_defaults_are_those_of_table_2():
    assert choices({}, 6).words == "x_C, theta0"
    assert choices({"x_C": 0.5}, 6).words == "x_C, theta0"
    assert choices({}, 7).words == "theta0"


@pytest.mark.parametrize(
    "free, poses, message",
    [
        ({"theta0": 0.0}, 6, "too few"),
        ({"theta0": 0.0, "x_C": 0.0}, 7, "too many"),
        ({"theta0": 0.0, "x_C": 0.0, "y_B": 1.0}, 6, "too many"),
        ({"a": 1.0, "x_B": 0.0}, 6, "theta0_deg"),
        ({"x_B": 1.0, "y_B": 0.0, "x_C": 0.3, "y_C": 0.2, "x_Q": 0.0}, 3, "theta0"),
        ({"x_C": 1.0}, 5, "too few"),
        ({"theta0": 0.0, "x_C": 0.0, "x_Q": 0.0, "b": 1.0}, 4, "not independent"),
    ],
)
def test_wrong_choices_are_refused_with_the_reason(free, poses, message):
    if "independent" in message:
        with pytest.raises(ValueError, match=message):  # with θ₀ = 0, b = x_Q − x_C
            choices(free, poses)
        return
    try:
        chosen = choices(free, poses)
    except ValueError as error:
        assert message in str(error)
    else:
        assert chosen.quadratic  # four coordinates and one of Q: exactly what three poses leave open
        assert len(chosen.rows) == 4
