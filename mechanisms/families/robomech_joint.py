"""All dimensions of a RoboMech manipulator together, from nothing but the paths of its end-effectors.

What is free in the passive chains is sampled (Sobol points, after Sobol and Statnikov's LPτ sequences); for
each sample every active chain that is exact at five positions is computed, and the negative chains follow from all
critical points of their dyads (`mechanisms.families.robomech_fit`).  The best of these linkages then move in
all 28 dimensions at once.  Residuals are the amounts by which the links HG, HI, LM and NQ would have to stretch
while C and F are exactly on their paths; in the end the manipulator is driven by its input alone and its real
errors are measured.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.approximate import Fit, geodesic_fit, minimax_fit, sobol_points
from mechanisms.dyad_fit import DyadFits
from mechanisms.families.robomech_fit import (
    ActiveChain,
    Norm,
    PassiveChain,
    exact_active,
    finish,
    negative_chain,
    passive_chain,
)
from mechanisms.families.robomech_model import Half, RoboMech
from mechanisms.task import TaskError

__all__ = ["ManipulatorFit", "complete_manipulators", "fit_manipulator", "stretches"]

#: Dimensions of one half, in the order of the vector of unknowns.
OWN = 12
#: Pivots of the passive chains are looked for this many path sizes around the path, link lengths up to this many.
REACH = 3.0
#: Pairs of passive chains that are completed, at most.
PAIRS = 40
#: Links longer than this many path sizes are as good as sliders and are not wanted.
LONGEST = 60.0
#: A negative link whose pins are nearer than CLEAR path sizes to those of link 2 (4) is that link, more or
#: less: the descent is kept from there by a wall of this height.
CLEAR, WALL = 0.3, 1e-2
#: The search ends when a manipulator misses its paths by less than this part of their size.
GOOD = 1e-7
#: Steps of every descent at first; starts between two choices; how many of those waiting are followed, by how many
#: steps at a time, how often, and only while a round still takes this factor off.
SCREENING, BATCH, PROMISING, FINISHING, ROUNDS, SLOW = 150, 12, 2, 1000, 3, 0.97
#: A cosine beyond this means that a passive chain does not reach its point.
OUT_OF_REACH = 1.0 - 1e-9


@dataclass(frozen=True)
class ManipulatorFit:
    """A manipulator and how it misses the paths when only its input is driven.

    Attributes
    ----------
    mechanism : RoboMech
    start : (float, float)
        φ1 and φ3 in the first position.
    errors : (2, N) array
        Distances of C and F from their points; NaN where the motion does not go on.
    stretch : float
        Largest stretch of a link that would make all errors zero.
    proofs : tuple of DyadFits
        Critical points of the two negative dyads, where they were fitted.
    """

    mechanism: RoboMech
    start: tuple[float, float]
    errors: NDArray[np.float64]
    stretch: float
    proofs: tuple[DyadFits, ...] = ()

    @property
    def worst(self) -> float:
        """The largest distance; infinite when the motion does not go on."""
        return float(np.nanmax(np.where(np.isfinite(self.errors), self.errors, np.inf)))

    @property
    def rms(self) -> float:
        """Root of the mean square distance."""
        return float(np.sqrt(np.mean(self.errors**2))) if np.all(np.isfinite(self.errors)) else float("inf")


def stretches(
    x: NDArray[np.float64],
    paths: tuple[NDArray[np.complex128], NDArray[np.complex128]],
    phi7: NDArray[np.float64],
    elbows: tuple[float, float],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """|HG| − l, |LM| − l, |HI| − l, |NQ| − l while C and F are on their paths, and their derivatives: (4N,),
    (4N, 28).

    Derivatives are carried along exactly; the valleys are too narrow for difference quotients.  Where a passive
    chain does not reach a point, the residual grows with the miss.
    """
    unknown = np.eye(len(x))

    def vector(k: int) -> _Dual:
        slope = (unknown[k] + 1j * unknown[k + 1])[:, None]
        return _Dual(np.array([complex(x[k], x[k + 1])]), slope)

    def length(k: int) -> _Dual:
        return _Dual(np.array([x[k]]), unknown[k][:, None])

    place = vector(0) + vector(2) * _Dual(np.exp(1j * phi7))
    parts = []
    for k, (path, elbow) in enumerate(zip(paths, elbows)):
        at = 4 + OWN * k
        base, crank, rod, g, gh = vector(at), length(at + 2), length(at + 3), vector(at + 4), length(at + 6)
        l, m, lm = vector(at + 7), vector(at + 9), length(at + 11)
        line = _Dual(path) - base
        square = line.squared()
        # e^{±i acos} from its cosine and sine; the sine is kept real where the point is out of reach
        cosine = (square + crank * crank - rod * rod) / (_Dual(2.0) * line.size() * crank)
        over = np.abs(cosine.value) > OUT_OF_REACH
        inner = _Dual(np.where(over, 0.0, 1.0)) * cosine
        turn = inner + _Dual(1j * elbow) * (_Dual(1.0) - inner * inner).root()
        first = line / line.size() * turn
        b = base + crank * first
        rest = _Dual(path) - b
        second = rest / rest.size()
        joint = b + g * second
        bar = place - joint
        reach = bar.size()
        miss = _Dual(np.where(over, 1.0, 0.0)) * crank * cosine * cosine
        parts += [reach - gh + miss, (joint + m * bar / reach - base - l * first).size() - lm + miss]
    values = np.concatenate([part.value.real for part in parts])
    return values, np.concatenate([part.slope.real for part in parts], axis=1).T


class _Dual:
    """Numbers at N positions, and their derivatives by the 28 unknowns, (28, N)."""

    __slots__ = ("slope", "value")

    def __init__(self, value: Any, slope: Any = 0.0) -> None:
        self.value, self.slope = np.asarray(value), slope

    def __add__(self, other: _Dual) -> _Dual:
        return _Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: _Dual) -> _Dual:
        return _Dual(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: _Dual) -> _Dual:
        return _Dual(self.value * other.value, self.slope * other.value + self.value * other.slope)

    def __truediv__(self, other: _Dual) -> _Dual:
        value = self.value / other.value
        return _Dual(value, (self.slope - value * other.slope) / other.value)

    def squared(self) -> _Dual:
        """|z|²."""
        return _Dual(np.abs(self.value) ** 2, 2 * np.real(np.conj(self.value) * self.slope))

    def root(self) -> _Dual:
        """√z of a positive number."""
        value = np.sqrt(np.maximum(self.value.real, 1e-12))
        return _Dual(value, self.slope / (2 * value))

    def size(self) -> _Dual:
        """|z|."""
        value = np.abs(self.value)
        return _Dual(value, np.real(np.conj(self.value) * self.slope) / value)


def fit_manipulator(
    c: Sequence[complex],
    f: Sequence[complex],
    phi7: Sequence[float],
    norm: Norm = "least-squares",
    seed: int = 0,
    good: float = GOOD,
    pairs: int = PAIRS,
    progress: Callable[[str, float], None] | None = None,
) -> list[ManipulatorFit]:
    """RoboMech manipulators whose end-effectors follow two paths, the best first.

    Parameters
    ----------
    c, f : sequences of N ≥ 8 complex
    phi7 : sequence of N float
        Input angles at the points.
    norm : str
        The mean square, or the largest, stretch is made least.
    good : float
        The search ends when the real error of a manipulator is below this part of the paths' size.
    pairs : int
        How many pairs of passive chains are completed at most.

    Raises
    ------
    TaskError
        For paths of different or too small numbers of points, or an input that does not go one way.
    """
    paths, crank = _checked(c, f, phi7)
    size = _size(paths)
    found: list[ManipulatorFit] = []
    waiting: list[tuple[float, int, tuple[Any, ...]]] = []
    tried = 0
    for begun in _starts(paths, crank, size, seed, pairs):
        chains, active, halves, proofs = begun
        elbows = (chains[0].elbow, chains[1].elbow)
        fit = _descend(_vector(active, halves), paths, crank, elbows, size, "least-squares", SCREENING)
        moves = _measured(fit, paths, crank, elbows, halves, proofs)
        if moves is not None and np.isfinite(moves.worst):
            waiting.append((fit.value, tried, (fit, elbows, halves, proofs)))
        tried += 1
        if progress is not None:
            progress("fitting manipulators", min(1.0, tried / (2 * pairs)))
        if tried % BATCH == 0 and _follow(waiting, found, paths, crank, size, norm, good):
            return sorted(found, key=lambda item: item.worst)
    while waiting and not _follow(waiting, found, paths, crank, size, norm, good):
        pass
    return sorted(found, key=lambda item: item.worst)


def complete_manipulators(
    chains: Sequence[PassiveChain],
    c: Sequence[complex],
    f: Sequence[complex],
    phi7: Sequence[float],
    norm: Norm = "least-squares",
    seed: int = 0,
) -> list[ManipulatorFit]:
    """Manipulators with given passive chains, the best first: every exact active chain, the best negative chains.

    Parameters
    ----------
    chains : sequence of two PassiveChain
        Along the paths of C and F.
    norm : str
        In which the active chain is fitted to all positions.

    Returns
    -------
    list of ManipulatorFit
        Their negative dyads are global optima where the proofs say so; passive chains stay as they are.
    """
    paths, crank = _checked(c, f, phi7)
    fits = []
    for active, halves, proofs in _completed(chains, crank, LONGEST * _size(paths), seed, norm, None):
        elbows = (chains[0].elbow, chains[1].elbow)
        x = _vector(active, halves)
        values, _ = stretches(x, paths, crank, elbows)
        fit = Fit(x, values / _size(paths), float(np.abs(values).max()))
        measured = _measured(fit, paths, crank, elbows, halves, proofs)
        if measured is not None:
            fits.append(measured)
    return sorted(fits, key=lambda item: (item.worst, item.stretch))


def _size(paths: Sequence[NDArray[Any]]) -> float:
    return max(float(np.abs(p - p.mean()).max()) for p in paths)


def _completed(
    chains: Sequence[PassiveChain],
    crank: NDArray[np.float64],
    longest: float,
    seed: int,
    norm: Norm,
    most: int | None,
) -> Iterator[tuple[ActiveChain, list[Half], tuple[DyadFits, ...]]]:
    """Every active chain that is exact at five positions, fitted to all, with its best negative chains."""
    count = len(crank)
    chosen = tuple(round(k * (count - 1) / 4) for k in range(5))
    ranked = []
    for one in exact_active(chains, crank.tolist(), chosen, seed):
        if np.all(np.isfinite(one.lengths)) and max(one.lengths) <= longest:
            fit = finish(one, chains, crank.tolist(), norm)
            ranked.append((fit.value, ActiveChain.from_vector(fit.x)))
    for _, active in sorted(ranked, key=lambda item: item[0])[:most]:
        try:
            made = [negative_chain(chain, active, k, crank.tolist(), seed) for k, chain in enumerate(chains)]
        except (TaskError, np.linalg.LinAlgError):
            continue
        yield active, [half for _, half, _ in made], tuple(proof for _, _, proof in made)


def _follow(
    waiting: list[tuple[float, int, tuple[Any, ...]]],
    found: list[ManipulatorFit],
    paths: tuple[NDArray[Any], NDArray[Any]],
    crank: NDArray[np.float64],
    size: float,
    norm: Norm,
    good: float,
) -> bool:
    """Follow the best that wait to their ends; whether one of them is good enough."""
    waiting.sort(key=lambda item: item[:2])
    best, waiting[:] = waiting[:PROMISING], waiting[PROMISING:]
    for _, _, (fit, elbows, halves, proofs) in best:
        for _ in range(ROUNDS):
            before = fit.value
            fit = _descend(fit.x, paths, crank, elbows, size, norm, FINISHING)
            measured = _measured(fit, paths, crank, elbows, halves, proofs)
            if measured is not None and measured.worst <= good * size:
                found.append(measured)
                return True
            if fit.converged or fit.value > SLOW * before:
                break
        if measured is not None:
            found.append(measured)
    return False


def _starts(
    paths: tuple[NDArray[Any], NDArray[Any]], crank: NDArray[np.float64], size: float, seed: int, pairs: int
) -> Iterator[tuple[list[PassiveChain], ActiveChain, list[Half], tuple[DyadFits, ...]]]:
    """Complete linkages near the task: sampled passive chains, exact active chains, best negative chains."""
    box = [(-REACH, REACH)] * 2 + [(0.3, REACH)] * 2
    samples = [sobol_points(box, 64 * pairs, seed + 10_007 * k) for k in range(2)]
    rng = np.random.default_rng(seed)
    usable = [_passive_chains(path, rows, size, rng) for path, rows in zip(paths, samples)]
    for number in range(pairs):
        chains = [chain for chain in (next(side, None) for side in usable) if chain is not None]
        if len(chains) < 2:
            return
        for active, halves, proofs in _completed(chains, crank, LONGEST * size, seed + number, "least-squares", 2):
            yield chains, active, halves, proofs


def _passive_chains(
    path: NDArray[np.complex128], rows: NDArray[np.float64], size: float, rng: np.random.Generator
) -> Iterator[PassiveChain]:
    middle = path.mean()
    for row in rows:
        try:
            yield passive_chain(
                list(path),
                middle + size * complex(row[0], row[1]),
                size * float(row[2]),
                size * float(row[3]),
                float(rng.choice([-1.0, 1.0])),
            )
        except TaskError:
            continue


def _descend(
    x: NDArray[np.float64],
    paths: tuple[NDArray[Any], NDArray[Any]],
    crank: NDArray[np.float64],
    elbows: tuple[float, float],
    size: float,
    norm: Norm,
    steps: int,
) -> Fit:
    last: list[Any] = [None, None]

    def evaluated(y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if last[0] is None or not np.array_equal(last[0], y):  # residuals and slopes are asked for one after the other
            values, slopes = stretches(y, paths, crank, elbows)
            walls, wall_slopes = _walls(y, size)
            both = np.concatenate([values / size, walls]), np.concatenate([slopes / size, wall_slopes])
            last[:] = [y.copy(), both]
        return last[1]

    def residuals(y: NDArray[np.float64]) -> NDArray[np.float64]:
        return evaluated(y)[0]

    def jacobian(y: NDArray[np.float64]) -> NDArray[np.float64]:
        return evaluated(y)[1]

    fit = geodesic_fit(residuals, x, jacobian, steps)
    return fit if norm == "least-squares" else minimax_fit(residuals, fit.x, jacobian=jacobian, programs=100)


def _walls(x: NDArray[np.float64], size: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What keeps a descent from linkages that are none: WALL·(1 − d²/δ²) where a distance d is less than δ.

    LM must not become link 2 (nor NQ link 4), and r_H, r_G, r_I must not vanish: with H = K = A and G = B
    everything is satisfied, whatever the path, by link 5 lying on link 1.
    """
    gaps: list[tuple[list[int], int | None]] = [([2, 3], None)]
    for at in (4, 4 + OWN):
        gaps += [([at + 7, at + 8, at + 9, at + 10], at + 2), ([at + 4, at + 5], None)]
    values, slopes = np.zeros(len(gaps)), np.zeros((len(gaps), len(x)))
    for row, (places, less) in enumerate(gaps):
        gap = x[places] / (CLEAR * size)
        if less is not None:
            gap[0] -= x[less] / (CLEAR * size)
        inside = 1.0 - float(gap @ gap)
        if inside > 0:
            values[row] = WALL * inside
            slope = -2 * WALL * gap / (CLEAR * size)
            slopes[row, places] = slope
            if less is not None:
                slopes[row, less] = -slope[0]
    return values, slopes


def _vector(active: ActiveChain, halves: Sequence[Half]) -> NDArray[np.float64]:
    x = [active.pivot.real, active.pivot.imag, active.h.real, active.h.imag]
    for half in halves:
        x += [half.pivot.real, half.pivot.imag, half.crank, half.rod, half.g.real, half.g.imag, half.gh]
        x += [half.l.real, half.l.imag, half.m.real, half.m.imag, half.lm]
    return np.array(x)


def _mechanism(x: NDArray[np.float64], sides: Sequence[float]) -> RoboMech:
    halves = []
    for k, side in enumerate(sides):
        p = x[4 + OWN * k : 4 + OWN * (k + 1)]
        pivot, g, l, m = (complex(p[i], p[i + 1]) for i in (0, 4, 7, 9))
        halves.append(Half(pivot, p[2], p[3], g, p[6], l, m, p[11], side))
    return RoboMech(complex(x[0], x[1]), complex(x[2], x[3]), halves[0], halves[1])


def _measured(
    fit: Fit,
    paths: tuple[NDArray[Any], NDArray[Any]],
    crank: NDArray[np.float64],
    elbows: tuple[float, float],
    halves: Sequence[Half],
    proofs: tuple[DyadFits, ...],
) -> ManipulatorFit | None:
    """Drive the input and measure; None for a linkage that is trivial, has a negative length or does not move."""
    blank = _mechanism(fit.x, [half.side for half in halves])
    size = _size(paths)
    first = []
    parts = []
    h = blank.joint(crank)
    for half, path, elbow in zip((blank.c, blank.f), paths, elbows):
        if min(half.crank, half.rod, half.gh, half.lm) <= 0:
            return None
        if min(np.hypot(abs(half.l - half.crank), abs(half.m)), abs(half.g), abs(blank.h)) < 0.99 * CLEAR * size:
            return None
        try:
            chain = passive_chain(list(path), half.pivot, half.crank, half.rod, elbow)
        except TaskError:
            return None
        joint = chain.joint + half.g * np.exp(1j * chain.phi2)
        side = float(np.sign(np.median((np.conj(h - chain.joint) * (joint - chain.joint)).imag))) or 1.0
        parts.append(replace(half, side=side))
        first.append(float(chain.phi1[0]))
    mechanism = RoboMech(blank.pivot, blank.h, parts[0], parts[1])
    moved = mechanism.positions(crank.tolist(), (first[0], first[1]))
    errors = np.array([np.abs(half["C"] - path) for half, path in zip(moved, paths)])
    start = (float(moved[0]["phi1"][0]), float(moved[1]["phi1"][0]))
    return ManipulatorFit(mechanism, start, errors, float(np.abs(fit.residuals).max()) * size, proofs)


def _checked(
    c: Sequence[complex], f: Sequence[complex], phi7: Sequence[float]
) -> tuple[tuple[NDArray[np.complex128], NDArray[np.complex128]], NDArray[np.float64]]:
    if len(c) != len(f) or len(c) != len(phi7):
        raise TaskError(f"{len(c)} points of C, {len(f)} of F and {len(phi7)} input angles; the numbers must agree")
    if len(c) < 8:
        raise TaskError(f"{len(c)} points of each end-effector; give 8 or more, fewer leave dimensions open")
    crank = np.array(phi7, dtype=float)
    steps = np.diff(crank)
    if not (np.all(steps > 0) or np.all(steps < 0)):
        raise TaskError("the input angles must go one way, up or down")
    return (np.array(c, dtype=complex), np.array(f, dtype=complex)), crank
