"""The RoboMech manipulator: positions, speeds, accelerations.

Authorities: a manipulator drawn forward in round numbers; difference quotients of its motion; the assemblies that
`mechanisms.assemblies` finds on the whole linkage.
"""

from dataclasses import replace

import numpy as np
import pytest

from mechanisms.assemblies import assemblies
from mechanisms.families.robomech_model import Half, RoboMech
from mechanisms.linkage import Input, Linkage
from mechanisms.motion import judge


def drawn() -> RoboMech:
    """At φ7 = 90°: φ1 = 115°, φ2 = 35°, φ3 = 62°, φ4 = 140°, G = (1.4, 1.9), I = (4.7, 1.9), H = (3, 0.5) …"""
    d = np.radians
    g, i, h, l, m, q, n = 1.4 + 1.9j, 4.7 + 1.9j, 3 + 0.5j, -1 + 0.7j, 1.5 + 0.6j, 7 + 0.8j, 4.4 + 0.6j
    b, e = 2 * np.exp(1j * d(115)), 6 + 2.1 * np.exp(1j * d(62))
    u5, u6 = (h - g) / abs(h - g), (h - i) / abs(h - i)
    c_half = Half(0, 2.0, 2.6, (g - b) * np.exp(-1j * d(35)), abs(h - g), l * np.exp(-1j * d(115)), (m - g) / u5,
                  abs(m - l), 1.0)  # fmt: skip
    f_half = Half(6, 2.1, 2.5, (i - e) * np.exp(-1j * d(140)), abs(h - i), (q - 6) * np.exp(-1j * d(62)),
                  (n - i) / u6, abs(n - q), -1.0)  # fmt: skip
    return RoboMech(3 - 0.5j, 1.0 * np.exp(1j * 0), c_half, f_half)


START = (np.radians(115.0), np.radians(62.0))
PHI7 = np.radians(np.arange(72.0, 109.0, 2.0))


def along(phi7: np.ndarray) -> tuple[dict, dict]:
    """Positions by continuation from 90°, where the drawing stands."""
    up = sorted(set(phi7.tolist()) | {np.pi / 2})
    middle = up.index(np.pi / 2)
    mech = drawn()
    one = mech.positions(up[middle:], START)
    other = mech.positions(up[: middle + 1][::-1], START)
    keep = np.isin(up, phi7)
    return tuple(
        {key: np.concatenate([other[k][key][::-1][:-1], one[k][key]])[keep] for key in one[k]} for k in (0, 1)
    )  # type: ignore[return-value]


def test_dimensions_of_the_drawing() -> None:
    named = drawn().parameters()
    expected = {
        "r_G": 1.889312 - 1.216234j, "r_I": 1.780540 + 1.434249j, "r_L": 1.057034 + 0.610475j,
        "r_M": 0.931314 - 0.912499j, "r_Q": 1.175830 - 0.507370j, "r_N": 1.057998 + 0.812797j,
        "l_HG": 2.126029163, "l_HI": 2.202271555, "l_LM": 2.501999201, "l_NQ": 2.607680962,
    }  # fmt: skip
    for name, value in expected.items():
        assert abs(named[name] - value) < 1e-6, name


def test_positions_by_the_conditional_coordinate() -> None:
    c, f = along(np.array([np.pi / 2]))
    assert abs(c["C"][0] - (1.284558792 + 3.303914309j)) < 1e-8
    assert abs(f["C"][0] - (5.070779174 + 3.461158969j)) < 1e-8
    assert np.degrees(c["phi5"][0]) == pytest.approx(-41.185925, abs=1e-6)
    assert np.degrees(f["phi5"][0]) == pytest.approx(-140.527540, abs=1e-6)
    c, f = along(PHI7)
    np.testing.assert_allclose([c["C"][0], c["C"][-1]], [2.0531 + 3.717858j, 0.689837 + 2.482591j], atol=1e-6)
    np.testing.assert_allclose([f["C"][0], f["C"][-1]], [5.66164 + 2.726717j, 4.366598 + 3.831599j], atol=1e-6)
    assert max(np.abs(c["gap"]).max(), np.abs(f["gap"]).max()) < 1e-12


def test_all_pins_hold_in_the_linkage_model() -> None:
    mech = drawn()
    linkage = mech.linkage(np.pi / 2, *START)
    assert linkage.degrees_of_freedom == 1
    phi7 = np.radians(np.arange(90.0, 109.0, 2.0))
    poses = mech.poses(phi7, START)
    places = linkage.positions({name: np.array([pose[name] for pose in poses]) for name in poses[0]})
    c, f = mech.positions(phi7, START)
    np.testing.assert_allclose(places["C"], c["C"], atol=1e-9)
    np.testing.assert_allclose(places["F"], f["C"], atol=1e-9)
    assert judge(linkage, "link7", poses).reasons == ()


def test_speeds_and_accelerations() -> None:
    found = drawn().speeds(np.pi / 2, *START)
    omega = (1.59576513, -0.34713514, 1.33012466, -0.15976874, 1.37133348, -0.22263761, 1.09465265, -0.06199240)
    epsilon = (-0.1967, 0.130511, 0.431303, -0.096242, -0.301234, -0.030119, -0.611614, 0.065837)
    order = (1, 2, 5, 8, 3, 4, 6, 9)
    np.testing.assert_allclose([found[f"omega{k}"] for k in order], omega, atol=1e-8)
    np.testing.assert_allclose([found[f"epsilon{k}"] for k in order], epsilon, atol=1e-5)
    assert abs(found["v_C"] - (-2.37482654 - 2.08812576j)) < 1e-8
    assert abs(found["determinant"]) == pytest.approx(31.260409, abs=1e-5)


def test_speeds_and_accelerations_are_those_of_the_motion() -> None:
    mech, h = drawn(), 1e-4
    phi7 = np.pi / 2 + h * np.array([0, -1, 1])
    (c0, cm, cp), (f0, fm, fp) = (np.array(x["C"]) for x in mech.positions(phi7, START))
    found = mech.speeds(np.pi / 2, *START, omega7=2.0, epsilon7=0.7)
    for tip, (at, low, high) in {"C": (c0, cm, cp), "F": (f0, fm, fp)}.items():
        slope, curve = (high - low) / (2 * h), (high - 2 * at + low) / h**2
        assert abs(found[f"v_{tip}"] - 2.0 * slope) < 1e-6
        assert abs(found[f"a_{tip}"] - (4.0 * curve + 0.7 * slope)) < 1e-4


def test_assemblies_of_a_half_are_zeros_of_its_gap() -> None:
    half, h = drawn().c, complex(drawn().joint(np.pi / 2))
    angles = half.assemblies(h)
    assert np.abs(angles - START[0]).min() < 1e-9
    np.testing.assert_allclose(half.assembled(h, angles)["gap"], 0, atol=1e-12)
    fine = np.linspace(-np.pi, np.pi, 200001)
    gap = half.assembled(h, fine)["gap"]
    assert len(angles) == np.sum(gap[:-1] * gap[1:] < 0)


def test_assemblies_are_those_of_the_polynomials() -> None:
    half, h = drawn().c, complex(drawn().joint(np.pi / 2))
    at = {name: complex(z) for name, z in half.assembled(h, START[0]).items() if name.isupper()}
    linkage = Linkage(
        {"A": 0, "K": 3 - 0.5j, **at},
        {"ground": "AK", "1": "ABL", "2": "BCG", "5": "GHM", "7": "KH", "8": "LM"},
        inputs={"7": Input("7")},
    )
    found = assemblies(linkage, "7", 0.0)
    ours = np.concatenate([replace(half, side=side).assemblies(h) for side in (1.0, -1.0)])
    assert len(found.x) == len(ours)
    first = list(linkage.moving_links).index("1")
    theirs = np.angle(np.exp(1j * (found.x[:, first] + START[0])))
    np.testing.assert_allclose(np.sort(ours), np.sort(theirs), atol=1e-8)
