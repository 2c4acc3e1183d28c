"""Coupled serial chains whose input torque follows a prescribed profile while they hold a load.

Where the path of the tip does not matter, the torque under a constant load is linear in the links for given ratios
(V. Krovi, G. K. Ananthasuresh, V. Kumar, Kinematic and kinetostatic synthesis of planar coupled serial chain
mechanisms, (7) and Example B).  So for each ratio the best links are found for certain: in the mean by linear
least squares, at the worst angle by one linear program.  Over the ratio the error of a two-link chain has no
interior minimum: it falls as R → 0 while |Z2| grows without limit, so that a bound on the lengths is needed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.approximate import Fit, best_fit, least_squares_fit, linear_minimax, minimax_fit
from mechanisms.families.chain import SerialChain
from mechanisms.families.kinetostatics import Load, input_torque, torque_rows
from mechanisms.task import TaskError

__all__ = ["ProfileFit", "best_ratio", "match_profile"]

#: Input angles at which the profile is compared.
GRID = 181
#: Ratios tried before the best are followed.
RATIOS = 41
#: How many are followed, by how many linear programs at most.
FOLLOWED, PROGRAMS = 2, 40


@dataclass(frozen=True)
class ProfileFit:
    """A chain and how its torque misses the profile.

    Attributes
    ----------
    chain : SerialChain
        With its base at the origin: the place does not matter.
    rms, worst : float
        Of the difference of the torques, on the grid.
    """

    chain: SerialChain
    rms: float
    worst: float


def match_profile(
    profile: Callable[[NDArray[np.float64]], ArrayLike],
    ratio: float,
    end: float = np.radians(60.0),
    load: Load = Load(-1j),  # noqa: B008 - immutable
    norm: Literal["least-squares", "minimax", "chebyshev-points"] = "least-squares",
) -> ProfileFit:
    """The two-link chain of a given ratio whose torque is nearest to a profile; certain, by linear algebra.

    Parameters
    ----------
    profile : callable
        Torque by φ/φ_end in [0, 1].
    ratio : float
        R; R and −R can follow the same profiles.
    end : float
        Range of the input, radians.
    norm : str
        In the mean, at the worst angle, or exactly at the four Chebyshev nodes of the range.

    Raises
    ------
    TaskError
        For a ratio of 0, 1 or −1, at which two columns of (7) coincide or vanish.

    Examples
    --------
    >>> fit = match_profile(lambda s: s**2 - 0.6 * s - 0.16, 2.0)
    >>> [round(z, 4) for z in (fit.chain.links[0].real, fit.chain.links[0].imag, fit.worst)]
    [0.0729, -0.6392, 0.0061]
    """
    if ratio in (0.0, 1.0, -1.0):
        raise TaskError(f"the ratio {ratio:g} leaves the links open: choose one other than 0, 1 and −1")
    share = np.linspace(0.0, 1.0, GRID)
    if norm == "chebyshev-points":
        share = 0.5 - 0.5 * np.cos(np.pi * (2 * np.arange(4) + 1) / 8)
    rows = torque_rows(np.array([1.0, ratio]), end * share, load)
    wanted = np.asarray(profile(share), dtype=float) + ratio * load.moment
    if norm == "minimax":
        z: Any = linear_minimax(rows, wanted)[0]
    else:
        z = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    return _measured(z, ratio, profile, end, load)


def best_ratio(
    profile: Callable[[NDArray[np.float64]], ArrayLike],
    longest: float,
    ratio: tuple[float, float] = (0.1, 5.0),
    end: float = np.radians(60.0),
    load: Load = Load(-1j),  # noqa: B008 - immutable
    minimax: bool = True,
) -> ProfileFit:
    """The two-link chain with links no longer than `longest` whose torque is nearest to a profile, over the
    ratio too.

    Raises
    ------
    TaskError
        Without a finite positive bound on the lengths: there would be no best chain.
    """
    if not (0 < longest < np.inf):
        raise TaskError("the links need a finite bound: the error falls for ever as R goes to 0 and |Z2| to infinity")
    share = np.linspace(0.0, 1.0, GRID)
    wanted = np.asarray(profile(share), dtype=float)

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        rows = torque_rows(np.array([1.0, x[0]]), end * share, load)
        return rows @ x[1:] - x[0] * load.moment - wanted

    def limits(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array([np.hypot(x[1], x[2]), np.hypot(x[3], x[4])]) / longest - 1.0

    box = np.array([ratio, *[(-longest, longest)] * 4])
    found: list[Fit] = []
    for value in np.linspace(*ratio, RATIOS):
        if min(abs(value), abs(abs(value) - 1.0)) < 1e-3:
            continue
        start = match_profile(profile, float(value), end, load).chain.links
        cut = [z * min(1.0, longest / abs(z)) for z in start]
        x = np.array([value, cut[0].real, cut[0].imag, cut[1].real, cut[1].imag])
        found.append(Fit(x, residuals(x), float(np.abs(residuals(x)).max())))
    best: list[Fit] = []
    for fit in best_fit(found, FOLLOWED):
        if minimax:
            best.append(minimax_fit(residuals, fit.x, box, limits, programs=PROGRAMS))
        else:
            best.append(least_squares_fit(lambda x: np.r_[residuals(x), 1e3 * np.maximum(limits(x), 0)], fit.x, box))
    x = best_fit(best, 1)[0].x
    return _measured(x[1:], float(x[0]), profile, end, load)


def _measured(z: NDArray[np.float64], ratio: float, profile: Any, end: float, load: Load) -> ProfileFit:
    chain = SerialChain(0, (complex(z[0], z[1]), complex(z[2], z[3])), (1.0, ratio))
    share = np.linspace(0.0, 1.0, GRID)
    error = input_torque(chain, end * share, load) - np.asarray(profile(share), dtype=float)
    return ProfileFit(chain, float(np.sqrt(np.mean(error**2))), float(np.abs(error).max()))
