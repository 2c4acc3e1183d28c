"""Watt II through 24 timed points.

Authorities: the published linkage, simulated; its vectors (4)–(7); Roberts' cognates, which share the timing; the
difference quotients and bounds of a second, independent assembly by `mechanisms.linkage`.
"""

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.families.watt2_path import (
    WattLinkage,
    fit_watt,
    rank_of_equation_3,
    recipe_with_given_angles,
    with_second_loop,
)
from mechanisms.task import TaskError

POINTS = np.array(Task.from_file("examples/watt2_24_points.toml").points["body"])
THETA = np.radians(15.0 * np.arange(24))


def polar(length: float, degrees: float) -> complex:
    return length * np.exp(1j * np.radians(degrees))


def printed() -> WattLinkage:
    z = {
        "z1": polar(0.223, 88.35), "z3": polar(0.313, 40.57), "z4": polar(0.283, 200.19),
        "z7": polar(0.525, 87.83),
        "z6": polar(0.249, 96.37), "z8": polar(0.173, 56.15), "z9": polar(0.286, 152.12),
    }  # fmt: skip
    return WattLinkage(POINTS[0] - z["z1"] - z["z3"], **z)


def test_printed_linkage_really_moves_near_the_points() -> None:
    errors = np.abs(printed().trace(THETA) - POINTS)
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(0.000596, abs=1e-6)
    assert errors.max() == pytest.approx(0.00105, abs=1e-5)
    assert np.sqrt(np.mean(np.abs(printed().trace(-THETA) - POINTS) ** 2)) > 0.2  # clockwise
    ends = np.linspace(0, 2 * np.pi, 24)
    assert np.sqrt(np.mean(np.abs(printed().trace(ends) - POINTS) ** 2)) == pytest.approx(0.0315, abs=5e-4)


def test_printed_derived_vectors() -> None:
    expected = {"Z2": (0.587, 210.88), "Z5": (0.281, 80.33), "Z10": (0.490, 0.01), "Z11": (0.203, 0.05)}
    for name, value in printed().derived().items():
        assert abs(value - polar(*expected[name])) < 1.5e-3, name


def test_true_angles_of_the_printed_linkage_lie_in_the_printed_ranges_and_are_not_linear() -> None:
    angles = {name: np.degrees(v) for name, v in printed().rotations(THETA).items()}
    ranges = {"alpha": (0, 60), "beta": (-15, 60), "gamma": (-22.5, 75), "phi": (-7.5, 11.25)}
    for name, (low, high) in ranges.items():
        assert low - 1e-9 <= angles[name].min() and angles[name].max() <= high
    np.testing.assert_allclose(angles["alpha"][:4], [0, 0.538, 1.937, 4.114], atol=1e-3)
    np.testing.assert_allclose(angles["gamma"][-3:], [-21.881, -17.384, -9.515], atol=1e-3)


def test_simulation_agrees_with_the_linkage_model() -> None:
    design = printed()
    linkage, poses = design.linkage(), design.poses(THETA)
    places = linkage.positions({name: np.array([pose[name] for pose in poses]) for name in poses[0]})
    np.testing.assert_allclose(places["B"], design.trace(THETA), atol=1e-12)
    for bar in (("A", "C"), ("D", "E"), ("E", "O3"), ("C", "D")):
        lengths = np.abs(np.asarray(places[bar[0]]) - places[bar[1]])
        np.testing.assert_allclose(lengths, lengths[0], atol=1e-12)


def test_linear_angle_profiles_cannot_give_the_result() -> None:
    share = np.arange(24) / 24
    _, _, rms = recipe_with_given_angles(POINTS, THETA, np.pi / 3 * share)
    assert rms > 0.05
    _, _, rms = recipe_with_given_angles(POINTS, -np.pi / 12 + 5 * np.pi / 12 * share, np.pi / 3 * share)
    assert rms > 0.05
    true = printed().rotations(THETA)
    z1, z3, rms = recipe_with_given_angles(POINTS, THETA, true["alpha"])
    assert rms < 5e-4 and abs(z1 - polar(0.2231, 88.37)) < 2e-4 and abs(z3 - polar(0.3134, 40.70)) < 3e-4
    z7, z4, rms = recipe_with_given_angles(POINTS, true["beta"], true["alpha"])
    assert rms < 5e-4 and abs(z7 - polar(0.5252, 87.85)) < 2e-4 and abs(z4 - polar(0.2830, 200.07)) < 3e-4


def test_equation_3_is_rank_deficient() -> None:
    rank, values = rank_of_equation_3(printed(), THETA)
    assert rank == 2 and values[2] < 1e-13 * values[0]


def test_optimum_and_its_timed_cognate() -> None:
    exact, other = fit_watt(POINTS, THETA, exact_first=True)[:2]
    assert exact.rms == pytest.approx(3.98e-4, abs=1e-6) and exact.worst == pytest.approx(7.3e-4, abs=1e-5)
    assert other.rms == pytest.approx(exact.rms, rel=1e-6)
    assert exact.crank_fits.complete and len(exact.crank_fits.minima) == 3
    lengths = sorted(abs(fit.design.z1) for fit in (exact, other))
    np.testing.assert_allclose(lengths, [0.1076, 0.2223], atol=1e-4)
    turns = np.linspace(0, 2 * np.pi, 100)  # cognates draw one curve, with one timing
    np.testing.assert_allclose(exact.design.trace(turns), other.design.trace(turns), atol=1e-7)
    np.testing.assert_allclose(exact.design.trace(0.0), POINTS[0], atol=1e-15)
    assert fit_watt(POINTS, THETA)[0].rms < exact.rms


@pytest.mark.slow
def test_twenty_seeds_out_of_twenty() -> None:
    """About a minute."""
    for seed in range(20):
        first, second = fit_watt(POINTS, seed=seed)[:2]
        assert first.rms <= 4.0e-4 and second.rms <= 4.0e-4, seed
        assert abs(abs(first.design.z1) - abs(second.design.z1)) > 0.1


def test_minimax_and_free_timing_are_better_at_what_they_ask_for() -> None:
    timed = fit_watt(POINTS)[0]
    assert fit_watt(POINTS, minimax=True)[0].worst < timed.worst
    free = fit_watt(POINTS, free_timing=True)[0]
    assert free.rms < 0.7 * timed.rms
    assert np.all(np.diff(free.theta) > 0)
    np.testing.assert_allclose(np.abs(free.design.trace(free.theta) - POINTS), free.errors, atol=1e-12)


def test_a_known_linkage_is_found_exactly() -> None:
    known = WattLinkage(0.1 + 0.2j, 0.8j, 2 + 1.5j, -1.4 + 0.8j, 0.5 + 2.6j)
    theta = np.radians(np.arange(0, 300, 20.0))
    points = known.trace(theta)
    fits = fit_watt(points, theta)
    assert fits[0].worst < 1e-8
    assert min(abs(fit.design.z1 - known.z1) for fit in fits) < 1e-6


def test_a_drawn_curve_gets_a_linkage_though_no_two_dyads_close() -> None:
    """A bean of which nothing is known; the least-squares fits of (1) and (2) make no linkage that moves round it."""
    t = 2 * np.pi * np.arange(24) / 24
    bean = 60 * np.cos(t) + 15 * np.cos(2 * t) + 1j * (35 * np.sin(t) + 8 * np.sin(2 * t + 0.3))
    best = fit_watt(bean, free_timing=True)[0]
    assert best.searched and best.rms < 0.02 * 75 and np.all(np.diff(best.theta) > 0)
    np.testing.assert_allclose(np.abs(best.design.trace(best.theta) - bean), best.errors, atol=1e-9)
    timed = fit_watt(bean)
    assert best.rms < timed[0].rms < 0.2 * 75
    assert [fit.rms for fit in timed] == sorted(fit.rms for fit in timed)
    assert not fit_watt(POINTS)[0].searched


@pytest.mark.parametrize("ratio", [3.0, 10.0])
def test_a_search_keeps_its_links_in_proportion(ratio: float) -> None:
    t = 2 * np.pi * np.arange(24) / 24
    curve = np.exp(1j * t) + 0.35 * np.exp(2j * t) + 0.15 * np.exp(-1j * t) + 0.1 * np.exp(-3j * t)
    best = next(fit for fit in fit_watt(curve, max_link_ratio=ratio) if fit.searched)
    assert best.rms < 0.15
    whole = with_second_loop(best.design, best.theta, max_link_ratio=ratio)
    points = whole.points()
    bars = ["O1-A", "A-C", "C-O2", "O1-O2", "O1-O3", "O2-O3", "O2-D", "D-C", "D-E", "E-O3"]
    lengths = [abs(points[a] - points[b]) for a, b in (bar.split("-") for bar in bars)]
    np.testing.assert_allclose(np.sort(lengths[:4]), np.sort(best.design.first_loop()), rtol=1e-9)
    assert max(lengths) <= ratio * min(lengths) * (1 + 1e-9)


def test_a_stretched_trace_is_the_trace_where_the_loop_closes() -> None:
    design = WattLinkage(0j, 1 + 0j, 1 + 1j, 0.6 + 0.5j, -0.8 + 0.6j)
    theta = np.linspace(0, 2 * np.pi, 60)
    true, (continued, missing) = design.trace(theta), design.stretched(theta)
    closes = np.isfinite(true)
    assert 5 < closes.sum() < 55
    np.testing.assert_allclose(continued[closes], true[closes], atol=1e-12)
    assert np.all(missing[closes] == 0) and np.all(missing[~closes] > 0) and np.all(np.isfinite(continued))


def test_second_loop_does_not_touch_the_path() -> None:
    design = fit_watt(POINTS)[0].design
    whole = with_second_loop(design, THETA)
    np.testing.assert_array_equal(whole.trace(THETA), design.trace(THETA))
    assert np.all(np.isfinite(whole.rotations(np.linspace(0, 2 * np.pi, 200))["gamma"]))


def test_through_the_front_door() -> None:
    result = synthesize(Task.from_file("examples/watt2_24_points.toml"))
    assert len(result.accepted) == 2
    for design in result.accepted:
        assert design.full_rotation and design.extra["rms_error"] <= 4.0e-4
        assert design.worst_pose_error <= 7.4e-4


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"points": [{"x": k, "y": k * k} for k in range(7)]}, "takes 8 to"),
        ({"free": {"theta_deg": [0, 10]}}, "2 crank angles for 24 points"),
        ({"free": {"theta_deg": [15 * k + 1 for k in range(24)]}}, "count from the first point"),
        ({"free": {"theta_deg": [0, 30, 20, *range(40, 61)]}}, "must go one way"),
        ({"free": {"theta_deg": [20 * k for k in range(24)]}}, "whole turn"),
        ({"free": {"timing": "loose"}}, "prescribed"),
    ],
)
def test_refusals(entries: dict[str, object], words: str) -> None:
    points = [{"x": p.real, "y": p.imag} for p in POINTS]
    with pytest.raises(TaskError, match=words):
        Task.from_dict({"mechanism": "watt2-path", "points": points, **entries})
