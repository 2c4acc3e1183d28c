"""Watt II path generation with prescribed timing, for many more points than a linkage can meet.

The first four-bar of a Watt II carries the tracing point B on its coupler; the ternary rocker drives a second one:

    (1)  Z1 (E(θ_j) − 1) + Z3 (E(α_j) − 1) = δ_j
    (2)  Z7 (E(β_j) − 1) + Z4 (E(α_j) − 1) = δ_j
    (3)  Z8 (E(γ_j) − 1) + Z9 (E(φ_j) − 1) + Z6 (E(β_j) − 1) + Z4 (E(α_j) − 1) = δ_j
    (4)–(7)  Z2 = Z4 − Z3,  Z5 = Z7 − Z6,  Z11 = Z5 − Z8 − Z9,  Z10 = Z1 − Z2 − Z7

Equations: the published Watt-II path generation through twenty-four precision points by dyad and triad
equations, where Z1 = O1A, Z3 = AB, Z7 = O2C, Z4 = CB, Z6 = DC, Z8 = O3E, Z9 = ED.  The published recipe chooses
all rotations freely and solves (1)–(3) by linear least squares.  Here only the crank's timing θ_j is prescribed:

- α_j is eliminated from (1): B keeps its distance from A, which is a dyad fit with the crank as body, and all its
  critical points are known (`mechanisms.dyad_fit`), timed cognates among them;
- (2) then is another dyad fit with the coupler as body, in which the first dyad is a trivial solution;
- the linkage is simulated, and all its dimensions move until the error of the *real motion* is least.

Eq. (3) cannot fix its own unknowns: where the second loop closes, Z8(E(γ)−1) + Z9(E(φ)−1) − Z5(E(β)−1) = 0
whatever the scale, so that the least-squares matrix of Z8, Z9, Z6 is singular.  The path does not depend on
them; they are chosen for transmission.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.approximate import Fit, best_fit, least_squares_fit, minimax_fit, sobol_points
from mechanisms.dyad_fit import DyadFits, fit_dyads
from mechanisms.families.base import BODY, Candidate, Family, Free, Problem
from mechanisms.families.watt2_tracing import WattLinkage, with_second_loop
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = [
    "Watt2Path",
    "WattLinkage",
    "fit_watt",
    "rank_of_equation_3",
    "recipe_with_given_angles",
    "with_second_loop",
]

Progress = Callable[[str, float], None]

#: A dyad this near to (O1, A), relative to the task's size, is the trivial solution of (2).
TRIVIAL = 1e-3
#: First dyads, and designs, worse than this many times the best are dropped.
WORSE = 50.0
#: Linear programs of a Chebyshev fit at most.
PROGRAMS = 60
#: A fit from two dyads that misses by more than this part of the task's size is not trusted: their residuals say
#: little about the motion then.  The published path is missed by 0.0014.
POOR = 0.01
#: Sobol points of a search without dyads, steps of each descent, and how many ends are finished.
SOBOL, SOBOL_STEPS, FINISHED = 64, 60, 4
#: That search keeps this part of the lengths away from where the loop ceases to close.
SLACK = 1e-3
#: It keeps the longest link of the first loop below so many times the shortest, if nothing else is said, by a
#: penalty with some margin: links of hardly any length are where descents end otherwise.
LINK_RATIO, MARGIN = 10.0, 0.98
SEARCHED = "from Sobol points, since fits of two dyads lead to nothing near: best found, not proved"


class Room(NamedTuple):
    """What a search may do on its way.

    Attributes
    ----------
    slack : float
        The part of the lengths that a loop keeps away from where it ceases to close.
    ratio : float
        The longest length of the first loop in units of the shortest.
    """

    slack: float
    ratio: float


@dataclass(frozen=True)
class WattFit:
    """A linkage and how its real motion misses the points.

    Attributes
    ----------
    design : WattLinkage
    theta : (M,) array
        Crank angles at the points, from home.
    errors : (M,) array
        Distances |B_j − P_j| there.
    crank_fits : DyadFits
        The proof for the first dyad.
    searched : bool
        Whether the descent began at a Sobol point, not at two dyads.
    """

    design: WattLinkage
    theta: NDArray[np.float64]
    errors: NDArray[np.float64]
    crank_fits: DyadFits
    searched: bool = False

    @property
    def rms(self) -> float:
        """Root of the mean square distance."""
        return float(np.sqrt(np.mean(self.errors**2)))

    @property
    def worst(self) -> float:
        """The largest distance."""
        return float(self.errors.max())


def fit_watt(
    points: ArrayLike,
    theta: ArrayLike | None = None,
    exact_first: bool = False,
    free_timing: bool = False,
    minimax: bool = False,
    seed: int = 0,
    progress: Progress = lambda what, share: None,
    max_link_ratio: float = LINK_RATIO,
) -> list[WattFit]:
    """Four-bars whose coupler point is at given points at given crank angles, all cognates, the best first.

    Parameters
    ----------
    points : sequence of M ≥ 8 complex
    theta : sequence of M float, optional
        Crank angles, the first 0, monotonic; equal steps of one anticlockwise turn otherwise.
    exact_first : bool
        Meet the first point exactly, as (1) and (2) do.
    free_timing : bool
        Let the crank angles move in the end: the path alone counts.
    minimax : bool
        Make the largest distance least, from the least-squares fits.
    seed : int
        Of the homotopies.
    progress : callable
        ``progress(what, share)``.
    max_link_ratio : float
        A search from Sobol points keeps the longest link of the first loop below so many times the shortest; two
        dyads leave no choice.

    Returns
    -------
    list of WattFit
        The second loop is not chosen yet: see `with_second_loop`.

    Raises
    ------
    TaskError
        For too few points, or timing that is not increasing or decreasing.
    """
    wanted = np.array(points, dtype=complex)
    count = len(wanted)
    if count < 8:
        raise TaskError(f"{count} points, but a timed four-bar passes up to 5 exactly; give 8 or more to approach")
    crank = 2 * np.pi * np.arange(count) / count if theta is None else np.array(theta, dtype=float)
    _check_timing(crank, count)
    size = float(np.abs(wanted - wanted.mean()).max())
    first = fit_dyads(wanted, crank, seed)
    found: list[tuple[Fit, WattLinkage]] = []
    for dyad in first.minima:
        if dyad.rms > WORSE * first.best.rms + 1e-12 * size**2:
            continue
        o1, z1 = dyad.fixed, -dyad.moving
        a = o1 + z1 * np.exp(1j * crank)
        alpha = np.unwrap(np.angle((wanted - a) / (wanted[0] - a[0])))
        for other in fit_dyads(wanted, alpha, seed).minima:
            c = wanted[0] + other.moving
            if abs(c - a[0]) < TRIVIAL * size or not np.isfinite(other.length):
                continue
            start = WattLinkage(o1, z1, wanted[0] - a[0], wanted[0] - c, c - other.fixed)
            polished = _polish(start, wanted, crank, exact_first, free_timing, minimax, size)
            if polished is not None:
                found.append(polished)
    from_dyads = len(found)
    if not found or min(fit.value for fit, _ in found) > POOR:
        room = Room(SLACK, MARGIN * max_link_ratio)
        for start in _sobol_starts(wanted, crank, size, seed, progress, room):
            progress("finishing the best of them", 0.0)
            polished = _polish(start, wanted, crank, exact_first, free_timing, minimax, size, room)
            if polished is not None:
                found.append(polished)
    searched = {id(fit) for fit, _ in found[from_dyads:]}
    kept = best_fit([fit for fit, _ in found])
    kept = [fit for fit in kept if fit.value <= WORSE * kept[0].value + 1e-12]
    by_fit = {id(fit): design for fit, design in found}
    fits = []
    for fit in kept:
        design = by_fit[id(fit)]
        angles = crank + np.r_[0.0, fit.x[-(count - 1) :]] if free_timing else crank
        fits.append(WattFit(design, angles, np.abs(design.trace(angles) - wanted), first, id(fit) in searched))
    return fits


def recipe_with_given_angles(points: ArrayLike, first: ArrayLike, second: ArrayLike) -> tuple[complex, complex, float]:
    """The published recipe for (1) or (2): both rotations given, the two vectors by linear least squares.

    Returns
    -------
    vectors and the root of the mean square residual of the vector equation, which is *not* the error of a motion
    """
    wanted = np.array(points, dtype=complex)
    matrix = np.exp(1j * np.stack([first, second], axis=1)) - 1
    moves = wanted - wanted[0]
    found = np.linalg.lstsq(matrix, moves, rcond=None)[0]
    rms = float(np.sqrt(np.mean(np.abs(matrix @ found - moves) ** 2)))
    return complex(found[0]), complex(found[1]), rms


def rank_of_equation_3(design: WattLinkage, theta: ArrayLike) -> tuple[int, NDArray[np.float64]]:
    """Rank of the least-squares matrix of Z8, Z9, Z6 in (3) for a real motion, and its singular values.

    The rank is 2 of 3 where the second loop closes: one complex vector remains free.
    """
    turned = design.rotations(theta)
    matrix = np.stack([np.exp(1j * turned[name]) - 1 for name in ("gamma", "phi", "beta")], axis=1)
    values = np.linalg.svd(matrix, compute_uv=False)
    return int((values > 1e-9 * values[0]).sum()), values


class Watt2Path(Family):
    """A point along a path with a timed crank, by a Watt II six-bar."""

    name = "watt2-path"
    summary = "Watt II six-bar that draws a timed path"
    source = "Watt-II path generation through twenty-four precision points by dyad and triad equations"
    point_counts = tuple(range(8, 2001))
    unknowns = "O1, Z1 of the crank; O2, C of the rocker"
    roots = "25 critical points of each dyad"
    free = (
        Free("theta", "angle", "crank angles at the points, the first 0", many=True),
        Free("timing", "text", "whether the crank angles count", choices=("prescribed", "free")),
        Free("norm", "text", "what is made least", choices=("least-squares", "minimax")),
        Free("first_point", "text", "whether it is met exactly", choices=("exact", "near")),
    )
    inputs = ("crank",)
    exact = False

    def check(self, task: Task) -> None:
        """Refuse timing that does not fit the points."""
        theta = task.free.get("theta")
        if theta is not None:
            try:
                _check_timing(np.array(theta), len(task.points[BODY]))
            except TaskError as error:
                raise TaskError(f"{task.where}: free.theta_deg: {error}") from None

    def system(self, task: Task) -> Problem | None:
        """None: the two dyads are solved one after the other, the second with the angles of the first."""
        return None

    def freedom(self, task: Task) -> str:
        """What was done instead of a solve."""
        return "more points than a linkage can meet: fits from all critical points of two dyads"

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """One design for each cognate, the best first."""
        progress = progress or (lambda what, share: None)
        progress("fitting dyads to all points", 0.0)
        ratio = task.constraints.get("max_link_ratio", LINK_RATIO)
        fits = fit_watt(
            task.points[BODY],
            task.free.get("theta"),
            exact_first=task.free.get("first_point") == "exact",
            free_timing=task.free.get("timing") == "free",
            minimax=task.free.get("norm") == "minimax",
            seed=task.seed,
            progress=progress,
            max_link_ratio=ratio,
        )
        for fit in fits:
            design = with_second_loop(fit.design, fit.theta, task.seed, ratio)
            named: dict[str, Any] = {f"Z{k}": getattr(design, f"z{k}") for k in (1, 3, 4, 6, 7, 8, 9)}
            yield Candidate(
                None,
                named | design.derived(),
                design.linkage(task.title, task.length_unit),
                design.poses(fit.theta),
                note=SEARCHED if fit.searched else f"crank: {fit.crank_fits.summary}",
                pose_error=fit.worst,
                extra={"rms_error": fit.rms, "critical_points": fit.crank_fits.critical},
            )


def _polish(
    start: WattLinkage,
    wanted: NDArray[np.complex128],
    crank: NDArray[np.float64],
    exact_first: bool,
    free_timing: bool,
    minimax: bool,
    size: float,
    room: Room | None = None,
    steps: int = 400,
) -> tuple[Fit, WattLinkage] | None:
    """All dimensions together, by the error of the simulated motion; None when it does not close at the points.

    With room the descent may pass through linkages that do not close, and links stay in proportion.
    """
    count = len(wanted)

    def angles_of(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return crank + np.r_[0.0, x[-(count - 1) :]] if free_timing else crank

    def design_of(x: NDArray[np.float64]) -> WattLinkage:
        z = x[:8].view(complex) * size
        o1 = wanted[0] - z[0] - z[1] if exact_first else complex(x[8], x[9]) * size
        return WattLinkage(complex(o1), *(complex(v) for v in z))

    def misses(x: NDArray[np.float64]) -> NDArray[np.complex128]:
        if room is not None:
            design = design_of(x)
            traced, missing = design.stretched(angles_of(x), room.slack)
            lengths = design.first_loop()
            uneven = max(0.0, math.log(max(lengths.max() / max(lengths.min(), 1e-300) / room.ratio, 1e-300)))
            return np.concatenate([(traced - wanted) / size, missing / size + 0j, [uneven + 0j]])
        off = (design_of(x).trace(angles_of(x)) - wanted) / size
        return np.where(np.isfinite(off), off, 1.0 + 0j)

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        off = misses(x)
        return np.concatenate([off.real, off.imag])

    vectors = np.array([start.z1, start.z3, start.z4, start.z7]) / size
    x = np.concatenate([vectors.view(float), [] if exact_first else [start.o1.real / size, start.o1.imag / size]])
    if free_timing:
        x = np.concatenate([x, np.zeros(count - 1)])
    fit = least_squares_fit(residuals, x, steps=steps)
    if minimax:
        fit = minimax_fit(lambda y: np.abs(misses(y)), fit.x, programs=PROGRAMS)
    design = design_of(fit.x)
    off = (design.trace(angles_of(fit.x)) - wanted) / size
    if not np.all(np.isfinite(off)):
        return None
    if room is not None:  # what was missing on the way is no error of the motion
        plain = np.abs(off) if minimax else np.concatenate([off.real, off.imag])
        value = plain.max() if minimax else np.sqrt(np.mean(plain**2))
        fit = replace(fit, residuals=plain, value=float(value))
    return fit, design


def _sobol_starts(
    wanted: NDArray[np.complex128],
    crank: NDArray[np.float64],
    size: float,
    seed: int,
    progress: Progress,
    room: Room,
) -> list[WattLinkage]:
    """Where descents from Sobol points end that keep the timing: the best few."""
    middle, turn = complex(wanted.mean()), 2 * np.pi
    box = [(-1.5, 1.5), (-1.5, 1.5), (0.1, 1.0), (0.0, turn), (0.3, 2.0), (0.0, turn), (0.3, 2.0), (0.0, turn)]
    ends: list[tuple[Fit, WattLinkage]] = []
    for number, u in enumerate(sobol_points(box, SOBOL, seed)):
        progress("searching from Sobol points", number / SOBOL)
        o1 = middle + size * complex(u[0], u[1])
        z1, ac, o2c = (size * u[k] * np.exp(1j * u[k + 1]) for k in (2, 4, 6))
        start = WattLinkage(o1, z1, wanted[0] - o1 - z1, wanted[0] - o1 - z1 - ac, o2c)
        end = _polish(start, wanted, crank, False, False, False, size, room, SOBOL_STEPS)
        if end is not None:
            ends.append(end)
    ends.sort(key=lambda end: end[0].value)
    return [design for _, design in ends[:FINISHED]]


def _check_timing(theta: NDArray[np.float64], count: int) -> None:
    if len(theta) != count:
        raise TaskError(f"{len(theta)} crank angles for {count} points; give one for each, the first 0")
    if abs(theta[0]) > 1e-12:
        raise TaskError(f"the first crank angle is {math.degrees(theta[0]):g}°; angles count from the first point")
    steps = np.diff(theta)
    if not (np.all(steps > 0) or np.all(steps < 0)):
        bad = int(np.flatnonzero(np.sign(steps) != np.sign(steps[0]))[0]) + 1 if steps[0] != 0 else 1
        raise TaskError(f"the crank angles must go one way; angle {bad} does not follow angle {bad - 1}")
    if abs(theta[-1]) >= 2 * np.pi:
        raise TaskError("the crank angles span a whole turn or more; the last point would be past the first")
