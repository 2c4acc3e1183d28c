"""Coupled serial chains for more positions than they can meet: structural error, best fits, auxiliary last links.

The links enter linearly, so that for given ratios and input angles the best ones follow by linear least
squares; only ratios (and, for a path, input angles) are searched (variable projection).  The two
correspondences between desired and generated curve are those of V. Krovi, G. K. Ananthasuresh, V. Kumar,
Kinematic and kinetostatic synthesis of planar coupled serial chain mechanisms, section 4.2: *orientation
matching* for poses (no weight between lengths and angles is needed) and *equal arc length* for paths.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.approximate import Fit, best_fit, least_squares_fit, minimax_fit, sobol_points, spread_subsets
from mechanisms.families.chain import SerialChain
from mechanisms.task import TaskError

__all__ = [
    "ChainFit", "arc_length_error", "auxiliary_extension", "auxiliary_rotation", "fit_path", "fit_poses",
    "orientation_error",
]  # fmt: skip

#: Samples of a curve from which its arc length is measured.
CURVE = 721
#: Links so long that the ratios are as good as degenerate, in sizes of the task.
LONGEST = 1e4
#: Sobol points over the ratios, for each ratio that is searched.
SAMPLES = 256
#: How many of the best are followed.
FOLLOWED = 12
#: How many least-squares fits are followed to a Chebyshev fit.
MINIMAX = 4


@dataclass(frozen=True)
class ChainFit:
    """A chain and how it misses the task.

    Attributes
    ----------
    chain : SerialChain
    phi : (M,) array
        Input angles at the positions, the first 0.
    errors : (M,) array
        Distances there.
    """

    chain: SerialChain
    phi: NDArray[np.float64]
    errors: NDArray[np.float64]

    @property
    def rms(self) -> float:
        """Root of the mean square distance."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def worst(self) -> float:
        """The largest distance."""
        return float(self.errors.max())


def orientation_error(
    chain: SerialChain, points: Sequence[complex], angles: Sequence[float]
) -> NDArray[np.float64]:
    """Distances from the points when the input is set so that the orientations agree (orientation matching)."""
    phi = (np.array(angles, dtype=float) - angles[0]) / chain.ratios[-1]
    return np.abs(chain.tip(phi) - np.array(points))


def arc_length_error(chain: SerialChain, end: float, points: Sequence[complex]) -> NDArray[np.float64]:
    """Distances between points at the same share of arc length on the path of the tip and on the desired path.

    Parameters
    ----------
    end : float
        Input angle at which the path of the tip ends.
    points : sequence of complex
        The desired path; its length is that of the polygon through them.

    Returns
    -------
    (M,) array

    Examples
    --------
    >>> bar = SerialChain(0, (2,), (1,))
    >>> bool(arc_length_error(bar, 1.0, bar.tip(np.linspace(0, 1, 200))).max() < 1e-4)
    True
    """
    wanted = np.array(points, dtype=complex)
    phi = np.linspace(0.0, end, CURVE)
    made = chain.tip(phi)
    return np.abs(np.interp(_share(wanted), _share(made), made) - wanted)


def fit_poses(
    points: Sequence[complex],
    angles: Sequence[float],
    links: int,
    ratio: tuple[float, float] = (-5.0, 5.0),
    exact: Sequence[int] = (),
    minimax: bool = False,
    seed: int = 0,
) -> list[ChainFit]:
    """Chains that carry their last link through the orientations exactly and near the positions, the best first.

    Parameters
    ----------
    points, angles : sequences of M numbers
    links : int
        N ≥ 2.
    ratio : (float, float)
        Bounds of all gear ratios.
    exact : sequence of int
        Positions that are met exactly (at most N + 1, precision points); none by default.
    minimax : bool
        Make the largest distance least instead of the mean square; without precision points.

    Raises
    ------
    TaskError
        For fewer than two links, or more precision points than are linear.
    """
    if links < 2:
        raise TaskError(f"{links} link cannot be geared to anything; give at least 2 links")
    if len(exact) > links + 1:
        raise TaskError(f"{len(exact)} precision points, but {links} links meet at most {links + 1} linearly")
    if len(exact) and minimax:
        raise TaskError("precision points are met exactly; the largest distance of the others is not made least")
    wanted, theta = np.array(points, dtype=complex), np.array(angles, dtype=float) - angles[0]
    size = float(np.abs(wanted - wanted[0]).max())
    if np.abs(theta).max() < 1e-9 or size == 0.0:
        raise TaskError("the body does not turn or does not move between the poses; a chain is not determined")
    box = np.array([ratio] * (links - 1))
    least = np.abs(theta).max() / (4 * np.pi)  # the input turns twice at most

    def chain_of(x: NDArray[np.float64]) -> tuple[SerialChain, NDArray[np.float64]]:
        last = np.sign(x[-1] or 1.0) * max(abs(x[-1]), least)
        ratios = (1.0, *x[:-1].tolist(), float(last))
        phi = theta / last
        return _links_for(wanted, ratios, phi, exact), phi

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        chain, phi = chain_of(x)
        off = (chain.tip(phi) - wanted) / size
        long = max(0.0, max(chain.lengths) / size - LONGEST)
        return np.concatenate([off.real, off.imag, [long]])

    samples = sobol_points(box, SAMPLES * (links - 1), seed)
    scores = [float(np.sum(residuals(x) ** 2)) for x in samples]
    fits = [least_squares_fit(residuals, samples[k], box) for k in np.argsort(scores)[:FOLLOWED]]
    found = [chain_of(fit.x) for fit in best_fit(fits)]
    if minimax:
        found = [_minimax(chain, theta, wanted, box) for chain, _ in found[:MINIMAX]]
    fitted = [ChainFit(chain, phi, np.abs(chain.tip(phi) - wanted)) for chain, phi in found]
    return sorted(fitted, key=lambda fit: fit.worst) if minimax else fitted


def fit_path(
    points: Sequence[complex],
    ratios: Sequence[float],
    free_ratios: bool = False,
    subsets: int = 1,
    seed: int = 0,
    keep: int = 8,
) -> list[ChainFit]:
    """Chains of rational ratios whose tip passes near many points, from all chains that pass some of them exactly.

    Every chain through 2N + 1 points that are spread over the path is computed
    (`mechanisms.families.chain_paths`), and each real one is fitted to all points by least squares over links
    and input angles.

    Parameters
    ----------
    points : sequence of M > 2N + 1 complex
    ratios : sequence of N float
    free_ratios : bool
        Let the ratios move too, after the complete solves.
    subsets : int
        How many choices of 2N + 1 points are solved.
    keep : int
        How many fits to return.

    Returns
    -------
    list of ChainFit
        Those that pass the points in their order, the best first; then the others.
    """
    wanted = np.array(points, dtype=complex)
    fits: list[Fit] = []
    for ratio_row, phi in _exact_starts(wanted, ratios, subsets, seed):
        fits.append(_fit_from(wanted, ratio_row, phi, free_ratios))
    found = []
    for fit in best_fit(fits):
        row, phi = _unpack(fit.x, ratios, len(wanted), free_ratios)
        chain = _links_for(wanted, row, phi, ())
        found.append(ChainFit(chain, phi, np.abs(chain.tip(phi) - wanted)))
    found.sort(key=lambda f: (not _in_order(f.phi), f.rms))
    return found[:keep]


def auxiliary_rotation(chain: SerialChain, phi: ArrayLike, angles: ArrayLike) -> NDArray[np.float64]:
    """Turns of a rotating last link that corrects the orientation, from its first position; radians.

    The tip is where the auxiliary link is pivoted, so that positions stay as they are.
    """
    wanted = np.asarray(angles, dtype=float)
    return (wanted - wanted[..., :1]) - (chain.turning(phi) - chain.turning(np.asarray(phi)[..., :1]))


def auxiliary_extension(
    chain: SerialChain, phi: Sequence[float], points: Sequence[complex]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Input angles and extensions of a last link that slides along itself so that the tip meets every point
    exactly.

    Parameters
    ----------
    phi : sequence of M float
        Where to look for the angles: those of a fit.

    Returns
    -------
    phi, extension : (M,) arrays
        The line of the last link at each angle passes the point; Newton's method from the given angle.

    Raises
    ------
    TaskError
        When the line of the last link passes by a point, near the given angle.
    """
    wanted = np.array(points, dtype=complex)
    angle = np.array(phi, dtype=float)
    last, ratio = chain.links[-1], chain.ratios[-1]
    for _ in range(50):
        axis = last / abs(last) * np.exp(1j * ratio * angle)
        off = (wanted - chain.tip(angle)) * np.conj(axis)
        slope = np.imag(-chain.velocity(angle) * np.conj(axis) - 1j * ratio * off)
        step = np.imag(off) / np.where(slope == 0, np.inf, slope)
        angle = angle - np.clip(step, -0.2, 0.2)
    axis = last / abs(last) * np.exp(1j * ratio * angle)
    off = (wanted - chain.tip(angle)) * np.conj(axis)
    if np.abs(off.imag).max() > 1e-9 * max(1.0, float(np.abs(wanted).max())):
        bad = int(np.argmax(np.abs(off.imag)))
        raise TaskError(f"the line of the last link passes by point {bad}; an extension alone cannot reach it")
    return angle, off.real


def _minimax(
    chain: SerialChain, theta: NDArray[np.float64], wanted: NDArray[np.complex128], box: NDArray[np.float64]
) -> tuple[SerialChain, NDArray[np.float64]]:
    """The chain with the least largest distance near a given one: ratios and links move together."""
    size, own = float(np.abs(wanted - wanted[0]).max()), len(chain.ratios) - 1

    def chain_at(x: NDArray[np.float64]) -> SerialChain:
        z = size * (x[own::2] + 1j * x[own + 1 :: 2])
        return SerialChain(z[0], tuple(z[1:]), (1.0, *x[:own].tolist()))

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        made = chain_at(x)
        return np.abs(made.tip(theta / made.ratios[-1]) - wanted) / size

    start = np.concatenate([chain.ratios[1:], (np.array([chain.base, *chain.links]) / size).view(float)])
    lengths = np.array([(-LONGEST, LONGEST)] * (len(start) - own))
    best = chain_at(minimax_fit(residuals, start, np.vstack([box, lengths])).x)
    return best, theta / best.ratios[-1]


def _links_for(
    wanted: NDArray[np.complex128], ratios: Sequence[float], phi: NDArray[np.float64], exact: Sequence[int]
) -> SerialChain:
    """Z0 and the links nearest to all points in the mean, some of the points met exactly (null space method)."""
    matrix = np.column_stack([np.ones(len(phi)), np.exp(1j * phi[:, None] * np.array(ratios))])
    if not len(exact):
        z = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    else:
        rows, right = matrix[list(exact)], wanted[list(exact)]
        start = np.linalg.lstsq(rows, right, rcond=None)[0]
        free = np.linalg.svd(rows)[2][len(exact) :].conj().T
        rest = np.linalg.lstsq(matrix @ free, wanted - matrix @ start, rcond=None)[0] if free.size else np.zeros(0)
        z = start + free @ rest
    return SerialChain(complex(z[0]), tuple(z[1:]), tuple(ratios))


def _exact_starts(
    wanted: NDArray[np.complex128], ratios: Sequence[float], subsets: int, seed: int
) -> Iterator[tuple[Sequence[float], NDArray[np.float64]]]:
    """Input angles at all points for every real chain through some of them."""
    from mechanisms.families.chain import whole_exponents
    from mechanisms.families.chain_paths import path_parameters, path_system, real_chains
    from solvers import solve

    exponents = whole_exponents(ratios)
    needed = 2 * len(ratios) + 1
    if len(wanted) < needed:
        raise TaskError(
            f"{len(wanted)} points, but {len(ratios)} links pass {needed} exactly; use chain_for_points"
        )
    for chosen in spread_subsets(len(wanted), needed, subsets, seed):
        some = wanted[list(chosen)]
        values, _ = path_parameters(some)
        solutions = solve(path_system(exponents), values, seed=seed, certificates=False)
        for _, chain, phi in real_chains(solutions, exponents, some):
            yield ratios, _between(chain, phi, chosen, wanted, 2 * np.pi * exponents[0])


def _between(
    chain: SerialChain,
    phi: NDArray[np.float64],
    chosen: Sequence[int],
    wanted: NDArray[np.complex128],
    period: float,
) -> NDArray[np.float64]:
    """Input angles at all points: those at the chosen ones, and the nearest place on the path for the others."""
    grid = np.linspace(-period / 2, period / 2, CURVE)
    angles = grid[np.argmin(np.abs(chain.tip(grid)[None, :] - wanted[:, None]), axis=1)]
    angles[list(chosen)] = phi
    return angles


def _fit_from(
    wanted: NDArray[np.complex128], ratios: Sequence[float], phi: NDArray[np.float64], free: bool
) -> Fit:
    size = float(np.abs(wanted - wanted[0]).max())

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        row, angles = _unpack(x, ratios, len(wanted), free)
        off = (_links_for(wanted, row, angles, ()).tip(angles) - wanted) / size
        return np.concatenate([off.real, off.imag])

    start = np.concatenate([ratios[1:] if free else [], phi[1:]])
    return least_squares_fit(residuals, start, tolerance=1e-12, steps=60)


def _unpack(
    x: NDArray[np.float64], ratios: Sequence[float], positions: int, free: bool
) -> tuple[tuple[float, ...], NDArray[np.float64]]:
    own = len(x) - (positions - 1)
    row = (1.0, *x[:own].tolist()) if free else tuple(ratios)
    return row, np.r_[0.0, x[own:]]


def _in_order(phi: NDArray[np.float64]) -> bool:
    steps = np.diff(phi)
    return bool(np.all(steps > 0) or np.all(steps < 0))


def _share(curve: NDArray[np.complex128]) -> NDArray[np.float64]:
    length = np.r_[0.0, np.cumsum(np.abs(np.diff(curve)))]
    return length / (length[-1] or 1.0)
