"""The family of coupled serial chains, from tasks to designs.

Authorities: the conic through five points (the path of a chain with R = −1 is an ellipse), exchange of the links,
and chains that are known.
"""

from dataclasses import replace

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.families import chain_paths as paths
from mechanisms.families.chain import SerialChain, whole_exponents
from mechanisms.families.chain_fit import (
    arc_length_error,
    auxiliary_extension,
    auxiliary_rotation,
    fit_path,
    fit_poses,
    orientation_error,
)
from mechanisms.task import TaskError
from solvers import solve


def path_of(ratios: tuple[float, ...], seed: int = 0) -> tuple[SerialChain, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    z = rng.normal(size=(len(ratios) + 1, 2)) @ [1, 1j]
    chain = SerialChain(z[0], tuple(z[1:]), ratios)
    phi = np.r_[0.0, np.sort(rng.uniform(0.2, 2.8, 2 * len(ratios)))]
    return chain, phi, chain.tip(phi)


def solved(points: np.ndarray, ratios: tuple[float, ...]):
    exponents = whole_exponents(ratios)
    solutions = solve(paths.path_system(exponents), paths.path_parameters(points)[0], start="multihomogeneous")
    return solutions, list(paths.real_chains(solutions, exponents, points))


@pytest.mark.parametrize("ratio", [2.0, -1.0, 0.5, -2.0, 1.5, 3.0])
def test_known_chain_is_among_all_chains_through_five_points(ratio: float) -> None:
    known, _, points = path_of((1.0, ratio), seed=int(10 * abs(ratio)))
    solutions, found = solved(points, (1.0, ratio))
    assert solutions.ledger.failed == 0 and solutions.ledger.balanced
    turning = paths.is_rotation(solutions.points, 2)
    count = paths.root_count(whole_exponents((1.0, ratio)))
    assert count is None or turning.sum() == count
    for _, chain, angles in found:
        np.testing.assert_allclose(chain.tip(angles), points, atol=1e-7 * max(1.0, *chain.lengths))
    assert min(np.abs(np.subtract(chain.links, known.links)).max() for _, chain, _ in found) < 1e-7


def test_ratio_minus_one_draws_the_ellipse_through_five_points() -> None:
    _, _, points = path_of((1.0, -1.0), seed=7)
    x, y = points.real, points.imag
    rows = np.stack([x * x, x * y, y * y, x, y, np.ones(5)], axis=1)
    a, b, c, d, e, f = np.linalg.svd(rows)[2][-1]
    centre = np.linalg.solve([[2 * a, b], [b, 2 * c]], [-d, -e])
    level = -(f + 0.5 * (d * centre[0] + e * centre[1]))
    semi = np.sqrt(level / np.linalg.eigvalsh([[a, b / 2], [b / 2, c]]))
    _, found = solved(points, (1.0, -1.0))
    assert len(found) == 2  # round the ellipse one way or the other
    for _, chain, _ in found:
        assert abs(chain.base - complex(*centre)) < 1e-8
        long, short = sum(chain.lengths), abs(np.subtract(*chain.lengths))
        np.testing.assert_allclose(sorted(semi), [short, long], rtol=1e-7)


def test_exchanging_links_and_ratio_gives_the_same_curves() -> None:
    _, _, points = path_of((1.0, 2.0), seed=3)
    one = sorted(chain.lengths[0] for _, chain, _ in solved(points, (1.0, 2.0))[1])
    other = sorted(chain.lengths[1] for _, chain, _ in solved(points, (1.0, 0.5))[1])
    np.testing.assert_allclose(one, other, rtol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_monodromy_finds_what_the_homotopy_found(seed: int) -> None:
    """370 roots by the multihomogeneous homotopy; loops between two fixed places stop at 358 … 369."""
    assert len(paths.generic_chains((1, -3), seed)) == paths.ROOT_COUNTS[(-1, 3)] == 370


def test_paths_that_jump_to_a_zero_rotation_are_let_go() -> None:
    """The cleared equations have 528 roots with a zero rotation besides: one jump, and a search counts 4656."""
    assert len(paths.generic_chains((-1, 2, 3), 4)) == paths.ROOT_COUNTS[(-1, 2, 3)] == 4128


def test_two_incomplete_searches_are_united() -> None:
    """Five roots are missing here, seven others there: 48 of 60 are in both."""
    full = paths.generic_chains((1, -2), 0, 60)
    one = replace(full, points=full.points[5:], paths=full.paths[5:], orbit=None)
    other = replace(full, points=full.points[:-7], paths=full.paths[:-7], orbit=None)
    whole, estimate = paths.united(one, other, paths.path_system((1, -2)))
    assert len(whole) == 60 and estimate == 55 * 53 / 48
    residual = paths.path_system((1, -2)).evaluate(whole.points, whole.parameters)[0]
    assert np.abs(residual).max() < 1e-8 * np.abs(whole.points).max() ** 3


def test_counts_belong_to_kinds_of_exponents_and_keep_their_bounds() -> None:
    assert {paths.kind_of(e) for e in [(4, -2), (-1, 2), (2, -1), (-6, 3)]} == {(-1, 2)}
    assert all(paths.kind_of(kind) == kind for kind in paths.ROOT_COUNTS)
    for kind, count in paths.ROOT_COUNTS.items():
        if len(kind) == 2:
            assert count <= paths.root_bound(kind) <= paths.paths_to_track(kind)


def test_seven_points_of_three_links() -> None:
    """Exponents (1, 2, −1): every root has its mirror image among the roots, the known chain is one of the real."""
    known, _, points = path_of((1.0, 2.0, -1.0), seed=2)
    exponents = whole_exponents(known.ratios)
    values, _ = paths.path_parameters(points)
    found = solve(paths.path_system(exponents), values, start=paths.generic_chains(exponents))
    assert len(found) == paths.root_count(exponents) == 158 and found.ledger.failed == 0
    images = paths.path_mirror(3).image(found.points)
    distance = np.abs(images[:, None] - found.points[None]).max(axis=2)
    assert (distance.min(axis=1) < 1e-6 * np.abs(images).max(axis=1)).all()
    real = [chain for _, chain, _ in paths.real_chains(found, exponents, points)]
    assert len(real) % 2 == 0
    assert min(np.abs(np.subtract(chain.links, known.links)).max() for chain in real) < 1e-7


def task_of(**entries: object) -> Task:
    return Task.from_dict({"mechanism": "coupled-serial-chain", **entries})


def as_points(points: np.ndarray) -> list[dict[str, float]]:
    return [{"x": p.real, "y": p.imag} for p in points]


def as_poses(points: np.ndarray, angles: np.ndarray) -> list[dict[str, float]]:
    return [{"x": p.real, "y": p.imag, "angle_deg": np.degrees(a)} for p, a in zip(points, angles)]


def test_five_points_through_the_front_door() -> None:
    known, _, points = path_of((1.0, 2.0), seed=5)
    result = synthesize(task_of(points=as_points(points), free={"ratios": [2.0]}))
    assert result.roots["count"] == 20 and result.roots["complete"] and result.ledger["failed"] == 0
    assert result.roots["certified"] == 20 and result.roots["certified_real"] == result.roots["real"]
    near = [d for d in result.accepted if abs(d.parameters["Z1"] - known.links[0]) < 1e-6]
    assert len(near) == 1 and near[0].worst_pose_error < 1e-9
    assert all("order" in d.reasons for d in result.designs if d.linkage is not None and not d.accepted)


def test_published_poses_through_the_front_door() -> None:
    result = synthesize(Task.from_file("examples/feeder_three_poses.toml"))
    (design,) = result.accepted
    assert abs(design.parameters["Z1"] - (-44.09853697 + 42.71328548j)) < 1e-7
    assert design.worst_pose_error < 1e-9 and design.worst_angle_error < 1e-9


def test_five_poses_of_three_links_through_the_front_door() -> None:
    chain = SerialChain(1j, (2, 1 + 1j, 0.5), (1, -1.3, 0.7))
    phi = np.radians([0, 30, 70, 100, 140])
    result = synthesize(task_of(poses=as_poses(chain.tip(phi), chain.turning(phi)), free={"links": 3}))
    assert any(abs(d.parameters["R1"] + 1.3) < 1e-8 and d.accepted for d in result.designs)
    assert all("proved" in d.note and d.worst_pose_error < 1e-5 for d in result.designs)


def test_ratios_that_are_no_fractions_get_gears_that_nearly_have_them() -> None:
    chain = SerialChain(1j, (2, 1 + 1j, 0.5), (1, -np.sqrt(2), 1 / np.sqrt(3)))
    phi = np.radians([0, 30, 70, 100, 140])
    result = synthesize(task_of(poses=as_poses(chain.tip(phi), chain.turning(phi)), free={"links": 3}))
    (known,) = [d for d in result.designs if abs(d.parameters["R1"] + np.sqrt(2)) < 1e-8]
    assert known.accepted and 1e-10 < known.worst_pose_error < 1e-5


def test_more_poses_are_fitted_and_a_known_chain_is_found() -> None:
    chain = SerialChain(1j, (2, 1 + 1j), (1, -1.3))
    phi = np.linspace(0, 2.0, 9)
    result = synthesize(task_of(poses=as_poses(chain.tip(phi), chain.turning(phi)), free={"links": 2}))
    assert result.designs[0].worst_pose_error < 1e-7 or min(d.worst_pose_error for d in result.designs) < 1e-7


def test_fit_of_poses_with_precision_points_and_minimax() -> None:
    phi = np.linspace(0, 1.5, 12)
    points = np.exp(1j * phi) * (2 + 0.3 * np.sin(2 * phi))
    fits = fit_poses(points, 0.7 * phi, 2)
    best = fits[0]
    np.testing.assert_allclose(best.errors, orientation_error(best.chain, points, 0.7 * phi), atol=1e-9)
    assert fit_poses(points, 0.7 * phi, 2, minimax=True)[0].worst <= best.worst * (1 + 1e-9)
    exact = fit_poses(points, 0.7 * phi, 2, exact=(0, 5, 11))[0]
    assert exact.errors[[0, 5, 11]].max() < 1e-9 and exact.rms >= best.rms * (1 - 1e-9)
    assert fit_poses(points, 0.7 * phi, 3)[0].rms <= best.rms * (1 + 1e-6)


def test_fit_of_a_path_finds_a_known_chain_and_beats_a_wrong_one() -> None:
    known, _, _ = path_of((1.0, 2.0), seed=11)
    points = known.tip(np.linspace(0.0, 2.5, 10))
    best = fit_path(points, (1.0, 2.0))[0]
    assert best.worst < 1e-8
    assert fit_path(points, (1.0, 3.0))[0].worst > 1e-4
    assert arc_length_error(best.chain, best.phi[-1], points).max() < 2e-2


def test_auxiliary_links_close_what_is_left() -> None:
    phi = np.linspace(0, 1.2, 10)
    points = 3 * np.exp(0.8j * phi) + 0.02 * np.cos(5 * phi)
    chain = fit_poses(points, 0.5 * phi, 2)[0].chain
    angle, extension = auxiliary_extension(chain, 0.5 * phi / chain.ratios[-1], points)
    axis = chain.links[-1] / abs(chain.links[-1]) * np.exp(1j * chain.ratios[-1] * angle)
    np.testing.assert_allclose(chain.tip(angle) + extension * axis, points, atol=1e-9)
    turn = auxiliary_rotation(chain, angle, 0.5 * phi)
    np.testing.assert_allclose(turn + chain.turning(angle) - chain.turning(angle[0]), 0.5 * phi, atol=1e-12)


FIVE = as_points(np.array([0, 1, 2 + 1j, 2 + 2j, 1 + 3j]))


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"points": FIVE}, "free.ratios: missing"),
        ({"points": FIVE, "free": {"ratios": [1.0]}}, "without use"),
        ({"points": FIVE, "free": {"ratios": [0.0]}}, "without use"),
        ({"points": FIVE, "free": {"ratios": [2.0], "links": 3}}, "1 given for 3 links"),
        ({"points": FIVE, "free": {"ratios": [2.0], "phi_deg": [1, 2, 3, 4]}}, "determine the input angles"),
        ({"points": FIVE[:4], "free": {"ratios": [2.0]}}, "take up to 3 points"),
        ({"points": FIVE[:3], "free": {"ratios": [2.0]}}, "free.phi_deg: missing"),
        ({"points": FIVE[:3], "free": {"ratios": [2.0], "phi_deg": [20.0]}}, "1 given for 3 points"),
        ({"points": FIVE[:3], "free": {"ratios": [2.0], "phi_deg": [50, 20]}}, "go one way"),
        ({"points": FIVE, "free": {"ratios": [0.123456789]}}, "no simple fraction"),
        ({"points": FIVE * 1, "free": {"ratios": [31.0]}}, "mean .* paths"),
        ({"points": FIVE, "free": {"ratios": [2.0], "links": 1}}, "1 given for 1 links|at least 2 links"),
        ({"poses": as_poses(np.array([0, 1, 2j]), np.array([0, 1, 2]))}, "leave the 1 ratios free"),
    ],
)
def test_refusals(entries: dict[str, object], words: str) -> None:
    with pytest.raises(TaskError, match=words):
        task_of(**entries)
