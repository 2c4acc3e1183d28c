"""Coupled serial chains: linear precision points, torques and peak torques.

Authorities: the recomputed example of the published chain with R1 = −1.2; difference quotients of the potential
energy; for the peak torques, chains found by differential evolution and by Nelder and Mead's method.
"""

import numpy as np
import pytest

from mechanisms.families.chain import (
    SerialChain,
    chain_for_points,
    chain_for_poses,
    free_choices,
    link_matrix,
    whole_exponents,
)
from mechanisms.families.kinetostatics import Load, Springs, energy, energy_bound, input_torque, torque_rows
from mechanisms.families.peak_torque import PeakTask, least_peak_torque, solve_links, torque_profiles
from mechanisms.families.torque_profile import best_ratio, match_profile
from mechanisms.motion import judge
from mechanisms.task import TaskError

FEEDER = {"start": -18.29 + 4.41j, "end": 25.19 + 25.19j, "load": Load(-1j)}


def feeder(degrees: float, longest: float, **bounds: float) -> PeakTask:
    return PeakTask(**FEEDER, rotation=(np.radians(10), np.radians(degrees)), longest=longest, **bounds)


def random_chain(rng: np.random.Generator, links: int) -> SerialChain:
    z = rng.normal(size=(links + 1, 2)) @ [1, 1j]
    return SerialChain(z[0], tuple(z[1:]), (1.0, *rng.uniform(-3, 3, links - 1)))


def test_published_guidance_example() -> None:
    points = [-18.29 + 4.41j, 2 + 18j, 25.19 + 25.19j]
    chain = chain_for_poses(points, np.radians([10, 35, 60]), (1, -1.2))
    np.testing.assert_allclose(
        [chain.base, *chain.links],
        [25.34001839 - 32.95644062j, -44.09853697 + 42.71328548j, 0.46851858 - 5.34684487j],
        atol=5e-9,
    )
    phi = np.radians([0, -125 / 6, -125 / 3])
    np.testing.assert_allclose(chain.tip(phi), points, atol=1e-12)
    np.testing.assert_allclose(np.degrees(chain.turning(phi)), [0, 25, 50], atol=1e-12)


def test_published_chain_moves_without_defect() -> None:
    chain = chain_for_poses([-18.29 + 4.41j, 2 + 18j, 25.19 + 25.19j], np.radians([10, 35, 60]), (1, -1.2))
    linkage, phi = chain.linkage(), np.radians([0, -125 / 6, -125 / 3])
    verdict = judge(linkage, "link1", chain.poses(phi))
    assert verdict.reasons == () and verdict.full_rotation
    places = linkage.positions(
        {name: np.array([p[name] for p in chain.poses(phi)]) for name in chain.poses([0])[0]}
    )
    np.testing.assert_allclose(places["P"], chain.tip(phi), atol=1e-12)


@pytest.mark.parametrize("links", [1, 2, 3, 4, 5])
def test_linear_points_give_a_known_chain_back(links: int) -> None:
    rng = np.random.default_rng(links)
    for _ in range(5):
        chain = random_chain(rng, links)
        phi = np.r_[0.0, rng.uniform(-2, 2, links)]
        again = chain_for_points(list(chain.tip(phi)), chain.ratios, phi[1:])
        np.testing.assert_allclose(again.links, chain.links, rtol=1e-6, atol=1e-6)
        if links > 1:
            poses = chain_for_poses(list(chain.tip(phi)), chain.turning(phi), chain.ratios)
            np.testing.assert_allclose(poses.links, chain.links, rtol=1e-6, atol=1e-6)


def test_fewer_points_get_the_shortest_links() -> None:
    phi = np.radians([0, 40])
    chain = chain_for_points([0, 1 + 1j], (1, -2, 0.5), phi[1:])
    np.testing.assert_allclose(chain.tip(phi), [0, 1 + 1j], atol=1e-12)
    row = link_matrix((1, -2, 0.5), phi[1:])[0]
    others = np.array(chain.links) + np.linalg.svd(row[None, :])[2][1:].conj() * 0.1
    for other in others:
        assert abs(row @ other - (1 + 1j)) < 1e-12
        assert np.linalg.norm(other) > np.linalg.norm(chain.links)


def test_free_choices_are_those_of_table_1() -> None:
    printed = {2: (7, 3, 6, 6), 3: (10, 5, 9, 9), 4: (13, 6, 12, 12), 5: (16, 8, 15, 15)}
    for links, (guided, most, path, most_path) in printed.items():
        assert free_choices(links, 0, True) == guided and free_choices(links, 0, False) == path
        assert [m for m in range(30) if free_choices(links, m, True) >= 0][-1] == most
        assert [m for m in range(30) if free_choices(links, m, False) >= 0][-1] == most_path


def test_whole_exponents() -> None:
    assert whole_exponents((1, 1.5, -0.5)) == (2, 3, -1)
    with pytest.raises(TaskError, match="simple fraction"):
        whole_exponents((1, np.sqrt(2)))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: chain_for_points([0, 1, 2, 3], (1, 2), [1, 2, 3]), "linear in 2 to 3 points"),
        (lambda: chain_for_points([0], (1, 2), []), "linear in 2 to 3"),
        (lambda: chain_for_points([0, 1, 2], (1, 2), [1]), "1 input angles for 3 points"),
        (lambda: chain_for_points([0, 1, 2], (1, 1), [1, 2]), "do not determine the links"),
        (lambda: chain_for_points([0, 1, 2], (1, 0), [1, 2]), "do not determine the links"),
        (lambda: chain_for_poses([0, 1, 2], [0, 1, 2], (1, 0)), "last ratio is 0"),
        (lambda: Springs((1.0, -2.0)), "spring 2 has the stiffness -2"),
        (lambda: PeakTask(**FEEDER, longest=-1), "positive length"),
        (lambda: PeakTask(**FEEDER, stiffest=np.inf), "positive finite bound"),
        (lambda: PeakTask(**FEEDER, windup=np.inf), "positive finite bound"),
        (lambda: PeakTask(1j, 1j, Load(-1j)), "the same"),
        (lambda: least_peak_torque(feeder(60, 1.0), 1, samples=64), "allow longer links"),
        (lambda: match_profile(lambda s: s, 1.0), "choose one other"),
        (lambda: best_ratio(lambda s: s, np.inf), "finite bound"),
    ],
)
def test_refusals(call, words: str) -> None:
    with pytest.raises(TaskError, match=words):
        call()


@pytest.mark.parametrize("links", [1, 2, 3])
def test_torque_is_the_slope_of_the_energy(links: int) -> None:
    rng = np.random.default_rng(10 + links)
    chain, load = random_chain(rng, links), Load(complex(*rng.normal(size=2)), rng.normal())
    springs = Springs(tuple(rng.uniform(0, 3, links)), tuple(rng.normal(size=links)))
    phi, h = rng.uniform(-3, 3, 20), 1e-5
    slope = (energy(chain, phi + h, load, springs) - energy(chain, phi - h, load, springs)) / (2 * h)
    np.testing.assert_allclose(input_torque(chain, phi, load, springs), slope, rtol=1e-7, atol=1e-7)
    rows = torque_rows(chain.ratios, phi, load) @ np.array(chain.links).view(float)
    np.testing.assert_allclose(rows, input_torque(chain, phi, load) + chain.ratios[-1] * load.moment, atol=1e-12)


def test_springs_assembled_at_angles_follow_equation_11() -> None:
    chain, psi = random_chain(np.random.default_rng(1), 2), (0.3, -0.8)
    springs, (t1, t2), r, phi = Springs.assembled(chain, (2, 3), psi), np.angle(chain.links), chain.ratios[1], 0.7
    printed = 2 * (t1 + phi - psi[0]) + 3 * (r - 1) * ((t2 - t1) + (r - 1) * phi - (psi[1] - psi[0]))
    assert input_torque(chain, phi, Load(), springs) == pytest.approx(printed)


@pytest.mark.parametrize(
    ("ratio", "degrees", "links", "peak"),
    [
        (-1.5, 90, (-30.091439068 + 4.003439068j, -20.060959379 - 23.835437930j), 20.487147),
        (2, 60, (-79.472015781 - 54.529569113j, 39.736007891 - 18.618405148j), 30.783513),
        (-0.5, 120, (10.749341224 - 35.353864951j, 21.498682448 + 45.883189704j), 15.232341),
    ],
)
def test_case_1_vectors(ratio: float, degrees: float, links: tuple[complex, ...], peak: float) -> None:
    task, choice = feeder(180, 100), [ratio, np.radians(degrees)]
    np.testing.assert_allclose(solve_links(task, 1, choice)[0][0], links, atol=1e-8)
    torque = torque_profiles(task, 1, choice)[0][0]
    assert np.abs(torque).max() == pytest.approx(peak, abs=1e-6)
    assert abs(torque[0]) < 1e-11 and abs(torque[-1]) < 1e-11


def test_case_2_and_3_vectors() -> None:
    task, phi = feeder(180, 100), np.radians(90)
    links = solve_links(task, 2, [-1.5, phi, 5, 2])[0][0]
    np.testing.assert_allclose(links, [-60.889417028 + 45.796991315j, -40.592944685 - 57.853945035j], atol=1e-8)
    assert np.abs(torque_profiles(task, 2, [-1.5, phi, 5, 2])[0]).max() == pytest.approx(41.910640, abs=1e-6)
    theta, psi = np.radians([-30, 100]), np.radians([200, 50])
    choice = [-1.5, phi, *theta, *(psi - theta)]
    links, stiffness, _ = solve_links(task, 3, choice)
    np.testing.assert_allclose(np.abs(links[0]), [112.485294, 85.266374], atol=1e-6)
    np.testing.assert_allclose(stiffness[0], [-43.520594, 24.091034], atol=1e-6)
    torque, broken = torque_profiles(task, 3, choice)
    assert np.abs(torque).max() == pytest.approx(36.908603, abs=1e-6)
    assert abs(torque[0, 0]) < 1e-11 and abs(torque[0, -1]) < 1e-11
    assert broken[0] > 0.8  # stiffness −43.5 of at most 50: no spring


@pytest.mark.parametrize(
    ("degrees", "longest", "peak", "ratio"),
    [(60, 50, 30.47130, -2.00975), (60, 100, 30.24960, -1.62568), (180, 50, 10.39000, None)],
)
def test_case_1_optimum(degrees: float, longest: float, peak: float, ratio: float | None) -> None:
    best = least_peak_torque(feeder(degrees, longest), 1)
    assert best.peak == pytest.approx(peak, abs=1e-5)
    assert ratio is None or best.choices["R"] == pytest.approx(ratio, abs=1e-4)
    assert best.bound == pytest.approx(20.78 / best.rotation) and best.peak > best.bound


def test_springs_relaxed_in_the_lower_position_gain_nothing() -> None:
    best = least_peak_torque(feeder(60, 50), 2)
    assert best.peak == pytest.approx(30.47130, abs=1e-4)
    assert max(best.springs.stiffness) < 1e-6


def test_wound_up_springs_gain_an_order_of_magnitude() -> None:
    best = least_peak_torque(feeder(60, 100, stiffest=50.0), 3, samples=2**13)
    assert best.peak < 30.2496 / 10 and best.peak >= best.bound
    assert min(best.springs.stiffness) >= 0 and max(best.chain.lengths) <= 100 * (1 + 1e-6)
    phi = np.linspace(0, best.rotation, 2001)
    assert np.abs(input_torque(best.chain, phi, Load(-1j), best.springs)).max() < 1.02 * best.peak
    np.testing.assert_allclose(best.chain.tip([0, best.rotation]), [FEEDER["start"], FEEDER["end"]], atol=1e-9)


def test_energy_bound_holds_for_any_chain() -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        chain, load = random_chain(rng, 3), Load(complex(*rng.normal(size=2)), rng.normal())
        springs, end = Springs(tuple(rng.uniform(0, 3, 3)), tuple(rng.normal(size=3))), rng.uniform(-3, 3)
        torque = input_torque(chain, np.linspace(0, end, 500), load, springs)
        assert np.abs(torque).max() >= energy_bound(chain, end, load, springs) * (1 - 1e-4)


def quadratic(s: np.ndarray) -> np.ndarray:
    return s**2 - 0.6 * s - 0.16


def cubic(s: np.ndarray) -> np.ndarray:
    return s**3 - s**2 + 0.08 * s + 0.064


@pytest.mark.parametrize(
    ("profile", "ratio", "norm", "worst"),
    [
        (quadratic, 2, "least-squares", 6.19e-3),
        (quadratic, 0.5, "least-squares", 1.58e-3),
        (cubic, 2, "least-squares", 4.37e-3),
        (cubic, 0.5, "least-squares", 1.07e-3),
        (quadratic, 2, "chebyshev-points", 3.50e-3),
        (cubic, 0.5, "chebyshev-points", 7.15e-4),
    ],
)
def test_torque_profiles(profile, ratio: float, norm: str, worst: float) -> None:
    fit = match_profile(profile, ratio, norm=norm)
    assert fit.worst == pytest.approx(worst, rel=2e-2)  # it depends a little on the angles compared
    assert match_profile(profile, ratio, norm="minimax").worst <= fit.worst


def test_best_ratio_is_bounded_by_the_lengths() -> None:
    short, long = best_ratio(cubic, 5.0), best_ratio(cubic, 40.0)
    assert max(short.chain.lengths) <= 5.0 * (1 + 1e-6) and max(long.chain.lengths) <= 40.0 * (1 + 1e-6)
    assert long.worst < short.worst
