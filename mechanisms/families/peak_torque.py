"""Two-link coupled serial chains with the least peak torque between two positions, with and without springs.

Equations: V. Krovi, G. K. Ananthasuresh, V. Kumar, Kinematic and kinetostatic synthesis of planar coupled serial
chain mechanisms, (12)–(15).  The tip is carried from P_1 to P_2 under a constant load, and the input torque is
prescribed (zero, as a rule) in both positions:

- *Case I*: no springs; free R, φ_2; (12) is linear in Z1, Z2.
- *Case II*: springs relaxed in the first position; free R, φ_2, κ1, κ2; (14) is linear in Z1, Z2.  Its last row is
  T_I2 **+** T_S2 + R M_z: the paper prints −T_S2, which stands for springs of negative stiffness and is the only
  source of its order-of-magnitude gain in this case.
- *Case III*: springs relaxed anywhere; free R, φ_2, θ_k, ψ_k; (15) is linear in L_k and κ_k, with the spring
  columns D_11, (R−1)D_12, D_21, (R−1)D_22.

All functions take arrays of free choices at once, so that a search looks at thousands of chains in one call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.approximate import Fit, best_fit, minimax_fit, sobol_points
from mechanisms.families.chain import SerialChain, link_matrix
from mechanisms.families.kinetostatics import Load, Springs, energy_bound, input_torque, torque_rows
from mechanisms.task import TaskError

__all__ = ["PeakTask", "PeakTorque", "least_peak_torque"]

#: Input angles at which the peak is looked for: the grid of the published test vectors.
GRID = 181
#: Free choices by case, in this order.
CHOICES = {
    1: ("R", "phi2"),
    2: ("R", "phi2", "kappa1", "kappa2"),
    3: ("R", "phi2", "theta1", "theta2", "psi1", "psi2"),
}
#: Sobol points looked at before the best are followed.
SAMPLES = {1: 2**13, 2: 2**14, 3: 2**16}
#: How many of the best samples are followed down.
FOLLOWED = {1: 5, 2: 5, 3: 8}
#: Linear programs for each of them; the peak of Case III creeps towards zero without an end.
PROGRAMS = {1: 100, 2: 100, 3: 60}


@dataclass(frozen=True)
class PeakTask:
    """From where to where, under what load, and what a chain may be.

    Parameters
    ----------
    start, end : complex
        The tip in the first and in the last position.
    load : Load
    torques : (float, float)
        Input torque prescribed in the first and in the last position.
    ratio : (float, float)
        Bounds of R.
    rotation : (float, float)
        Bounds of φ_2, radians.
    longest : float
        Bound of both link lengths.
    stiffest : float
        Bound of both spring constants.
    windup : float
        Bound of |ψ_k − θ_k| in Case III, radians: how far a spring may be wound up in the first position.
    """

    start: complex
    end: complex
    load: Load
    torques: tuple[float, float] = (0.0, 0.0)
    ratio: tuple[float, float] = (-5.0, 5.0)
    rotation: tuple[float, float] = (np.radians(10.0), np.radians(180.0))
    longest: float = 100.0
    stiffest: float = 50.0
    windup: float = 3.0 * np.pi

    def __post_init__(self) -> None:
        if not (self.longest > 0 and np.isfinite(self.longest)):
            raise TaskError(f"the longest link is bounded by {self.longest:g}; give a positive length")
        if not (self.stiffest > 0 and np.isfinite(self.stiffest)):
            raise TaskError(
                f"the stiffness of the springs is bounded by {self.stiffest:g}; give a positive finite bound: without "
                "one the peak torque falls towards zero and no spring could be built"
            )
        if not (self.windup > 0 and np.isfinite(self.windup)):
            raise TaskError(f"the wind-up of the springs is bounded by {self.windup:g}; give a positive finite bound")
        if self.start == self.end:
            raise TaskError("the two positions are the same; a torque between them needs a way")
        for name, (low, high) in (("ratio", self.ratio), ("rotation", self.rotation)):
            if not low < high:
                raise TaskError(f"the range [{low:g}, {high:g}] of the {name} is empty; the lower end comes first")

    def box(self, case: int) -> NDArray[np.float64]:
        """Bounds of the free choices of a case."""
        turn, wind = (-np.pi, np.pi), (-self.windup, self.windup)
        spring = (0.0, self.stiffest)
        rows = {1: (), 2: (spring, spring), 3: (turn, turn, wind, wind)}[case]
        return np.array([self.ratio, self.rotation, *rows])

    @property
    def work(self) -> float:
        """What the input must do against the load between the positions, without a moment and without springs."""
        move = self.end - self.start
        return -(move.real * self.load.force.real + move.imag * self.load.force.imag)


@dataclass(frozen=True)
class PeakTorque:
    """A chain, its springs and its peak torque.

    Attributes
    ----------
    case : int
    chain : SerialChain
    springs : Springs or None
    rotation : float
        φ_2, radians.
    peak : float
        max |T| over the grid of [0, φ_2].
    bound : float
        The energy bound for this chain and these springs.
    choices : mapping
        The free choices by name.
    """

    case: int
    chain: SerialChain
    springs: Springs | None
    rotation: float
    peak: float
    bound: float
    choices: dict[str, float] = field(default_factory=dict)


def solve_links(
    task: PeakTask, case: int, choices: ArrayLike
) -> tuple[NDArray[np.complex128], NDArray[np.float64], NDArray[np.float64]]:
    """Links, stiffnesses and wind-ups that meet both positions and both torques, for n free choices at once.

    Parameters
    ----------
    case : {1, 2, 3}
    choices : (n, k) array
        As named in `CHOICES`; the last two of Case III are the wind-ups ψ_k − θ_k.

    Returns
    -------
    links : (n, 2) complex array
        Not finite where the equations are singular.
    stiffness : (n, 2) array
        May be negative in Case III: such a choice is not feasible.
    windup : (n, 2) array
        β_k in the first position.
    """
    x = np.atleast_2d(np.asarray(choices, dtype=float))
    ratio, phi = x[:, 0], x[:, 1]
    ratios = np.stack([np.ones_like(ratio), ratio], axis=1)
    ends = np.stack([np.zeros_like(phi), phi], axis=1)
    move = task.end - task.start
    moment = ratio * task.load.moment
    closing = link_matrix(ratios, phi[:, None])[:, 0, :]
    load_rows = torque_rows(ratios, ends, task.load)
    torques = np.stack([task.torques[0] + moment, task.torques[1] + moment], axis=1)
    step = ratio - 1.0
    with np.errstate(all="ignore"):
        if case in (1, 2):
            stiffness = x[:, 2:4] if case == 2 else np.zeros((len(x), 2))
            # T = a·Z − R Mz + springs, and the springs push with κ1 φ + κ2 (R−1)² φ in the last position.
            torques[:, 1] -= (stiffness[:, 0] + stiffness[:, 1] * step**2) * phi
            top = np.empty((len(x), 2, 4))
            top[:, 0, 0::2], top[:, 0, 1::2] = closing.real, -closing.imag
            top[:, 1, 0::2], top[:, 1, 1::2] = closing.imag, closing.real
            matrix = np.concatenate([top, load_rows], axis=1)
            right = np.concatenate([np.tile([move.real, move.imag], (len(x), 1)), torques], axis=1)
            z = _solve(matrix, right)
            return z[:, 0::2] + 1j * z[:, 1::2], stiffness, np.zeros((len(x), 2))
        unit: NDArray[np.complex128] = np.exp(1j * x[:, 2:4])
        moved = closing * unit
        lengths = _solve(np.stack([moved.real, moved.imag], axis=1), np.tile([move.real, move.imag], (len(x), 1)))
        links = (lengths * unit).astype(np.complex128)
        z = np.stack([links.real, links.imag], axis=2).reshape(len(x), 4)
        load_torque = np.einsum("nij,nj->ni", load_rows, z)
        beta1 = -x[:, 4]  # θ1 − ψ1
        beta2 = x[:, 4] - x[:, 5]  # (θ2 − ψ2) − (θ1 − ψ1)
        columns = np.stack(
            [
                np.stack([beta1, step * beta2], axis=1),
                np.stack([beta1 + phi, step * (beta2 + step * phi)], axis=1),
            ],
            axis=1,
        )
        stiffness = _solve(columns, torques - load_torque)
        bad = (lengths < 0).any(axis=1)
        links[bad] = np.nan
        return links, stiffness, np.stack([beta1, beta2], axis=1)


def torque_profiles(
    task: PeakTask, case: int, choices: ArrayLike, grid: int = GRID
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """T over a grid of [0, φ_2], (n, grid), and how far each choice breaks its bounds, (n,): 0 if it does not."""
    x = np.atleast_2d(np.asarray(choices, dtype=float))
    links, stiffness, windup = solve_links(task, case, x)
    ratio, phi = x[:, 0], x[:, 1]
    angle = phi[:, None] * np.linspace(0.0, 1.0, grid)
    fx, fy = task.load.force.real, task.load.force.imag
    with np.errstate(all="ignore"):
        first = 1j * links[:, :1] * np.exp(1j * angle)
        speed = first + 1j * (ratio * links[:, 1])[:, None] * np.exp(1j * ratio[:, None] * angle)
        torque = -(fx * speed.real + fy * speed.imag) - (ratio * task.load.moment)[:, None]
        torque += stiffness[:, :1] * (windup[:, :1] + angle)
        step = (ratio - 1.0)[:, None]
        torque += stiffness[:, 1:] * step * (windup[:, 1:] + step * angle)
        broken = np.abs(links).max(axis=1) / task.longest - 1.0
        broken = np.maximum(broken, (stiffness / task.stiffest - 1.0).max(axis=1))
        broken = np.maximum(broken, (-stiffness / task.stiffest).max(axis=1))
    return torque, np.where(np.isfinite(broken), np.maximum(broken, 0.0), np.inf)


def least_peak_torque(
    task: PeakTask, case: int, seed: int = 0, samples: int | None = None, starts: Sequence[ArrayLike] = ()
) -> PeakTorque:
    """The best chain found: Sobol points over the free choices, the best of them followed to their Chebyshev
    optimum.

    Parameters
    ----------
    case : {1, 2, 3}
    samples : int, optional
        Sobol points; `SAMPLES` of the case otherwise.
    starts : sequence of arrays
        Further choices to follow, for example the optimum of another case.

    Returns
    -------
    PeakTorque
        Best found, not certified; its `bound` says how much a better one could gain.

    Raises
    ------
    TaskError
        When no choice within the bounds meets the two positions.

    Examples
    --------
    >>> feeder = PeakTask(-18.29 + 4.41j, 25.19 + 25.19j, Load(-1j), longest=50, rotation=np.radians([10, 60]))
    >>> best = least_peak_torque(feeder, 1)
    >>> round(best.peak, 4), round(best.bound, 4)
    (30.4713, 19.8434)
    """
    if case not in CHOICES:
        raise ValueError(f"there is no case {case}; choose 1, 2 or 3")
    box = task.box(case)
    tried = sobol_points(box, samples or SAMPLES[case], seed)
    if len(starts):
        tried = np.vstack([np.atleast_2d(np.asarray(starts, dtype=float)), tried])
    scores = np.concatenate([_scores(task, case, part) for part in np.array_split(tried, max(1, len(tried) // 4096))])
    order = np.argsort(scores, kind="stable")[: FOLLOWED[case]]
    if not np.isfinite(scores[order[0]]):
        raise TaskError("no chain within these bounds meets both positions and torques; allow longer links")
    found: list[Fit] = []
    for k in dict.fromkeys([*range(len(starts)), *order.tolist()]):
        if np.isfinite(scores[k]):
            found.append(_follow(task, case, tried[k], box))
    good = [fit for fit in found if _feasible(task, case, fit.x)]
    if not good:
        raise TaskError("no chain within these bounds meets both positions and torques; allow longer links")
    return _result(task, case, best_fit(good, 1)[0].x)


def _scores(task: PeakTask, case: int, choices: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coarse peak, with a penalty for what is out of bounds."""
    torque, broken = torque_profiles(task, case, choices, 19)
    peak = np.abs(torque).max(axis=1)
    score = peak * (1.0 + broken) + abs(task.work) * broken
    return np.where(np.isfinite(score), score, np.inf)


def _follow(task: PeakTask, case: int, start: NDArray[np.float64], box: NDArray[np.float64]) -> Fit:
    unit = abs(task.work) or 1.0

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return torque_profiles(task, case, x)[0][0] / unit

    def limits(x: NDArray[np.float64]) -> NDArray[np.float64]:
        links, stiffness, _ = solve_links(task, case, x)
        rows = [np.abs(links[0]) / task.longest - 1.0]
        if case == 3:
            rows += [stiffness[0] / task.stiffest - 1.0, -stiffness[0] / task.stiffest]
        return np.concatenate(rows)

    return minimax_fit(residuals, start, box, limits, programs=PROGRAMS[case])


def _feasible(task: PeakTask, case: int, x: NDArray[np.float64]) -> bool:
    return bool(torque_profiles(task, case, x)[1][0] <= 1e-9)


def _result(task: PeakTask, case: int, x: NDArray[np.float64]) -> PeakTorque:
    links, stiffness, windup = solve_links(task, case, x)
    chain = SerialChain(task.start - links[0].sum(), tuple(links[0]), (1.0, float(x[0])))
    springs = None if case == 1 else Springs(tuple(np.maximum(stiffness[0], 0.0)), tuple(windup[0]))
    phi = float(x[1])
    torque = input_torque(chain, np.linspace(0.0, phi, GRID), task.load, springs)
    return PeakTorque(
        case,
        chain,
        springs,
        phi,
        float(np.abs(torque).max()),
        energy_bound(chain, phi, task.load, springs),
        dict(zip(CHOICES[case], map(float, x))),
    )


def _solve(matrix: NDArray[np.float64], right: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve n small systems; NaN where one is singular."""
    size = np.abs(matrix).max(axis=(1, 2))
    sound = np.isfinite(size) & (np.abs(np.linalg.det(matrix / np.where(size > 0, size, 1)[:, None, None])) > 1e-13)
    out = np.full(right.shape, np.nan)
    if sound.any():
        out[sound] = np.linalg.solve(matrix[sound], right[sound][:, :, None])[:, :, 0]
    return out
