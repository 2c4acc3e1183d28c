"""All critical points of the fit of a dyad to many poses.

Authorities: poses made by a known dyad; the gradient by difference quotients of the sum of squares; descent
from many random starts, which must end in no other minimum and in none that is better.
"""

import numpy as np
import pytest

from mechanisms.approximate import (
    Fit,
    best_fit,
    geodesic_fit,
    least_squares_fit,
    linear_minimax,
    minimax_fit,
    sobol_points,
    spread_subsets,
)  # fmt: skip
from mechanisms.dyad_fit import CRITICAL_POINTS, dyad_residuals, fit_dyads, minimax_dyad


def random_poses(seed: int, count: int = 9) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 2)) @ [1, 1j], rng.uniform(-1.5, 1.5, count)


def residuals_of(places: np.ndarray, turns: np.ndarray):
    def residuals(x: np.ndarray) -> np.ndarray:
        q = dyad_residuals(places, turns, complex(x[0], x[1]), complex(x[2], x[3]), 0.0)
        return q - q.mean()

    return residuals


@pytest.mark.parametrize("seed", range(4))
def test_critical_points_of_general_poses(seed: int) -> None:
    places, turns = random_poses(seed)
    fits = fit_dyads(places, turns)
    assert fits.critical == CRITICAL_POINTS == fits.certified and fits.complete
    assert fits.real % 2 == 1 and len(fits.minima) >= 1
    residuals = residuals_of(places, turns)
    for dyad in fits.dyads:
        x = np.array([dyad.fixed.real, dyad.fixed.imag, dyad.moving.real, dyad.moving.imag])
        np.testing.assert_allclose(residuals(x), dyad.residuals, atol=1e-9 * max(1, np.abs(x).max() ** 2))
        h, total = 1e-5 * max(1.0, np.abs(x).max()), lambda y: float(np.sum(residuals(y) ** 2))
        slope = [(total(x + h * e) - total(x - h * e)) / (2 * h) for e in np.eye(4)]
        assert np.abs(slope).max() < 1e-4 * max(1.0, np.abs(x).max() ** 4)


@pytest.mark.parametrize("seed", [1, 2])
def test_descent_finds_no_other_minimum(seed: int) -> None:
    places, turns = random_poses(seed)
    fits = fit_dyads(places, turns)
    residuals = residuals_of(places, turns)
    minima = np.array([[d.fixed.real, d.fixed.imag, d.moving.real, d.moving.imag] for d in fits.minima])
    starts = 4 * np.random.default_rng(seed).normal(size=(60, 4))
    ends = [least_squares_fit(residuals, start) for start in starts]
    best = min(end.value for end in ends)
    assert best == pytest.approx(fits.best.rms, rel=1e-6)
    for end in ends:
        if np.abs(end.x).max() < 50:
            assert np.abs(minima - end.x).max(axis=1).min() < 1e-3 * max(1.0, np.abs(end.x).max())


def test_a_known_dyad_is_found_exactly() -> None:
    rng = np.random.default_rng(5)
    turns, swing = rng.uniform(-1, 1, 12), np.sort(rng.uniform(0, 2, 12))
    places = 300 - 40j + 50 * np.exp(1j * swing) - np.exp(1j * turns) * (20 + 10j)
    best = fit_dyads(places, turns).best
    assert abs(best.fixed - (300 - 40j)) < 1e-8 and abs(best.moving - (20 + 10j)) < 1e-8
    assert best.length == pytest.approx(50, abs=1e-8) and best.rms < 1e-8 and best.stretch < 1e-9


def test_minimax_dyad_levels_its_errors() -> None:
    places, turns = random_poses(3)
    fits = fit_dyads(places, turns)
    dyad = minimax_dyad(places, turns, fits)
    assert dyad.worst < fits.best.worst
    errors = dyad_residuals(places, turns, dyad.fixed, dyad.moving, dyad.length)
    np.testing.assert_allclose(errors, dyad.residuals, atol=1e-9)
    # Five unknowns: the largest error is attained six times where none of them can be improved alone.
    assert np.sum(np.abs(np.abs(errors) - dyad.worst) < 1e-5 * dyad.worst) >= 5


def test_fewer_than_five_poses_are_refused() -> None:
    with pytest.raises(ValueError, match="five poses"):
        fit_dyads([0, 1, 2, 3], [0, 1, 2, 3])


def test_minimax_reaches_the_chebyshev_polynomial() -> None:
    grid = np.linspace(-1, 1, 401)
    fit = minimax_fit(lambda c: grid**4 - np.polyval(c, grid), np.zeros(4))
    assert fit.value == pytest.approx(1 / 8, abs=1e-5)  # monic degree 4: 2^(1−4), but for the grid
    matrix = np.stack([grid**3, grid**2, grid, np.ones_like(grid)], axis=1)
    assert linear_minimax(matrix, grid**4)[1] == pytest.approx(fit.value, abs=1e-9)


def test_minimax_keeps_bounds_and_constraints() -> None:
    def residuals(x: np.ndarray) -> np.ndarray:
        return np.array([x[0] - 3, x[1] + 2])

    assert minimax_fit(residuals, [0, 0], [(-1, 1), (-1, 1)]).value == pytest.approx(2)
    circle = minimax_fit(residuals, [0.1, 0.1], constraints=lambda x: np.array([x @ x - 1]))
    assert circle.x @ circle.x <= 1 + 1e-6
    angle = np.linspace(0, 2 * np.pi, 200001)
    best = np.maximum(np.abs(np.cos(angle) - 3), np.abs(np.sin(angle) + 2)).min()
    assert circle.value == pytest.approx(best, abs=1e-6)


def test_geodesic_descent_follows_a_narrow_valley() -> None:
    """Fit of exponentials, where the Jacobian is singular to 1e-8 at the solution."""
    grid = np.linspace(0, 1, 30)
    rates = np.array([1.0, 1.3, 1.7, 2.2])

    def residuals(x: np.ndarray) -> np.ndarray:
        return np.exp(-np.outer(grid, x)).sum(axis=1) - np.exp(-np.outer(grid, rates)).sum(axis=1)

    def slopes(x: np.ndarray) -> np.ndarray:
        return -grid[:, None] * np.exp(-np.outer(grid, x))

    fit = geodesic_fit(residuals, [0.2, 0.9, 2.5, 4.0], slopes, steps=500)
    assert fit.value < 1e-9
    np.testing.assert_allclose(np.sort(fit.x), rates, atol=1e-2)


def test_fits_that_end_in_one_place_are_one() -> None:
    fits = [Fit(np.array([1.0, 2.0]), np.array([v]), v) for v in (0.3, 0.1)] + [Fit(np.zeros(2), np.zeros(1), 0.2)]
    kept = best_fit(fits)
    assert [fit.value for fit in kept] == [0.1, 0.2]


def test_sobol_points_fill_the_box_and_depend_on_the_seed_only() -> None:
    box = [(-1, 1), (10, 20)]
    points = sobol_points(box, 100, seed=4)
    assert points.shape == (100, 2) and np.all(points >= [-1, 10]) and np.all(points <= [1, 20])
    np.testing.assert_array_equal(points, sobol_points(box, 100, seed=4))
    assert len(set(spread_subsets(24, 5, 10, 1))) > 5 and all(s[0] == 0 for s in spread_subsets(24, 5, 10))
    with pytest.raises(ValueError, match="cannot be chosen"):
        spread_subsets(3, 5, 1)
