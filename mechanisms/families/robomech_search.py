"""A RoboMech manipulator from nothing but the paths of its end-effectors.

The structure does most of the work.  Only four of the 28 dimensions, K and r_H, are shared: given them, H moves along
a known circle and each half is a problem of its own in twelve dimensions, with so few minima that a dozen starts find
its best ones again and again.  With K and r_H, one path alone determines a half: 2N equations for 16 dimensions.  So

- K and r_H are drawn (Sobol points, after Sobol and Statnikov's LPτ sequences);
- one half is descended from some passive chains, r_G following linearly from the chain, r_M from a drawn r_L; then K
  and r_H are released too.  A half that follows its path exactly has found the circle of H, or that of a cognate, and
  the other half is looked for from there;
- without such luck, the best are completed by the best other halves for the same circle, both move in all 28
  dimensions, and the most promising go on.

What is made least decides about success.  The stretches of the bars while C and F are on their paths are easy to
make small, down to 1e-7 of the path, by linkages near a dead centre, which magnify a stretch a thousand times.  They
only begin a descent; from then on it is the real error of the driven linkage (`mechanisms.families.robomech_kernel`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mechanisms.approximate import minimax_fit, sobol_points
from mechanisms.families.robomech_fit import Norm, passive_chain
from mechanisms.families.robomech_joint import ManipulatorFit, Paths, checked, measured, path_size, proved
from mechanisms.families.robomech_model import Half, RoboMech

__all__ = ["fit_manipulator"]

#: A search ends when a manipulator misses its paths by no more than this part of their size.
GOOD = 1e-6
#: Circles of H that are tried at most, for one half and for the other by turns.  Where a task can be met exactly, one
#: in some two hundred leads to the bottom.
SAMPLES = 4000
#: Pivots are looked for this many path sizes around the paths, links of the passive chains up to this length.
REACH = 4.0
#: Shortest and longest r_H, shortest link of a passive chain, largest cosine of the angle between its links at the
#: start: a chain that is nearly stretched cannot move away from there.
ARM, SHORTEST, FOLDED = (0.3, 3.0), 0.3, 0.97
#: Passive chains tried for a drawn circle of H, and for that of a half that is completed; points r_L tried for each of
#: them and their spread; passive chains made at once.
CHAINS, PARTNERS, SPOTS, SPREAD, SOBOL_BLOCK = 4, 12, 4, 1.5, 4096
#: Steps of a half in the stretched view and in the driven one.
HALF_STEPS = 30
#: A half stretched by more than this part of the path is not driven; values that differ by less than SAME are of one
#: half, circles of H that differ by less are one.
HOPELESS, SAME = 1e-2, 1e-2
#: How many minima of a half are released; their steps at first, how much the sum of squares must fall in a third of
#: them, the value below which they go on, by how many steps, and the value below which a half is exact.
RELEASED, RELEASE_STEPS, RELEASE_GAIN = 2, 150, 0.5
PROMISING, PROMISING_STEPS, PROMISING_GAIN, EXACT = 3e-6, 2000, 0.8, 1e-9
#: How many halves of a batch of circles are completed, and by how many partners each.
BATCH, COMPLETED, BEST_PARTNERS = 32, 2, 2
#: How often chains are tried for the partner of an exact half; one round in ten to thirty finds it.
ROUNDS = 100
#: Three stages of a descent in all dimensions: steps at most; how much the sum of squares must fall in LOOK steps; and
#: how many of those that wait go on to it after a batch.
STEPS, GAIN, SHARE, LOOK = (200, 600, 2000), (0.95, 0.97, 0.99), (0, 2, 1), 50
#: Sum of squares, in path sizes, below which nothing is left to gain: rounding.
ROUNDING = 1e-28
#: A motion that misses the path by this many times more than its descent said is another assembly's.
JUMP = 3.0
#: Manipulators that are returned, and linear programs for each of them in the Chebyshev norm.
RETURNED, PROGRAMS = 3, 60


@dataclass(frozen=True)
class _Place:
    """Where a descent stands: dimensions of one half or both, the shared ones last; angles of links 1, 2 (3, 4); signs
    of the passive chains."""

    value: float
    number: int
    x: NDArray[np.float64]
    angles: NDArray[np.float64]
    elbows: NDArray[np.float64]


def fit_manipulator(
    c: Sequence[complex],
    f: Sequence[complex],
    phi7: Sequence[float],
    norm: Norm = "least-squares",
    seed: int = 0,
    good: float = GOOD,
    samples: int = SAMPLES,
    progress: Callable[[str, float], None] | None = None,
) -> list[ManipulatorFit]:
    """RoboMech manipulators whose end-effectors follow two paths, the best first.

    Parameters
    ----------
    c, f : sequences of N ≥ 8 complex
    phi7 : sequence of N float
        Input angles at the points.
    norm : str
        The mean square, or the largest, error is made least.
    good : float
        The search ends when the largest error of a manipulator is below this part of the paths' size.
    samples : int
        How many circles of H are tried at most.

    Returns
    -------
    list of ManipulatorFit
        Measured with the input alone driven; with the critical points of their negative dyads.

    Raises
    ------
    TaskError
        For paths of different or too small numbers of points, or an input that does not go one way.
    """
    paths, crank = checked(c, f, phi7)
    search = _Search(paths, crank, norm, good, seed)
    released: list[tuple[float, int, _Place]] = []
    for number, shared in enumerate(_circles(search.paths, samples, seed)):
        k = number % 2
        for begun in search.halves(k, shared, CHAINS)[:RELEASED]:
            half = search.release(k, begun, number)
            if half.value < EXACT and any(search.descend(whole, 0) for whole in search.partners(k, half)):
                return search.results()
            released.append((half.value, k, half))
        if (number + 1) % BATCH == 0 or number + 1 == samples:
            released.sort(key=lambda item: (item[0], item[2].number))
            begun_pairs = (whole for _, k, half in released[:COMPLETED] for whole in search.completed(k, half))
            if any(search.descend(whole, 0) for whole in begun_pairs):
                return search.results()
            if any(search.descend(p, stage) for stage in range(1, len(STEPS)) for p in search.promising(stage)):
                return search.results()
            released.clear()
        if progress is not None:
            progress("searching manipulators", (number + 1) / samples)
    return search.results()


class _Search:
    """The task in path sizes around its middle, and all places reached so far."""

    def __init__(self, paths: Paths, phi7: NDArray[np.float64], norm: Norm, good: float, seed: int) -> None:
        self.original, self.phi7, self.norm, self.good, self.seed = paths, phi7, norm, good, seed
        self.size, self.middle = path_size(paths), complex(np.concatenate(paths).mean())
        self.paths, self.turns = (np.array(paths) - self.middle) / self.size, np.exp(1j * phi7)
        self.chains = [_passive_chains(path, seed + 1 + k) for k, path in enumerate(self.paths)]
        self.rng = np.random.default_rng(seed)
        self.stages: list[list[_Place]] = [[] for _ in STEPS]
        self.good_ones: list[ManipulatorFit] = []

    def halves(self, k: int, shared: NDArray[np.float64], tries: int) -> list[_Place]:
        """Different minima of one half for a circle of H, the best first."""
        from mechanisms.families.robomech_descent import descend

        path, found = self.paths[k : k + 1], []
        h = complex(shared[0], shared[1]) + complex(shared[2], shared[3]) * self.turns
        for _ in range(tries):
            chain, elbow = next(self.chains[k])
            x, elbows = np.r_[_half(path[0], h, chain, elbow, self.rng), shared], np.array([elbow])
            angles, value = np.zeros((1, 2, len(h))), np.inf
            for rigid in (False, True):
                x, angles, value = descend(
                    x, path, self.turns, elbows, angles, rigid, False, HALF_STEPS, HALF_STEPS, 1.0, ROUNDING
                )
                if not value < HOPELESS:
                    break
            else:
                found.append(_Place(float(value), 0, x, angles, elbows))
        found.sort(key=lambda place: place.value)
        return [p for i, p in enumerate(found) if i == 0 or p.value > (1 + SAME) * found[i - 1].value]

    def release(self, k: int, place: _Place, number: int) -> _Place:
        """Move one half together with K and r_H."""
        from mechanisms.families.robomech_descent import descend

        x, angles, value, path = place.x, place.angles, place.value, self.paths[k : k + 1]
        for steps, gain in ((RELEASE_STEPS, RELEASE_GAIN), (PROMISING_STEPS, PROMISING_GAIN)):
            x, angles, value = descend(
                x, path, self.turns, place.elbows, angles, True, True, steps, RELEASE_STEPS // 3, gain, ROUNDING
            )
            if not value < PROMISING:
                break
        return _Place(float(value), number, x, angles, place.elbows)

    def partners(self, k: int, half: _Place) -> Iterator[_Place]:
        """Whole manipulators from an exact half: exact other halves, released from its circle of H and back there."""
        shared = half.x[-4:]
        for _ in range(ROUNDS):
            for begun in self.halves(1 - k, shared, CHAINS)[:RELEASED]:
                other = self.release(1 - k, begun, half.number)
                if other.value < EXACT and np.abs(other.x[-4:] - shared).max() < SAME:
                    yield _joined(k, half, other)

    def completed(self, k: int, half: _Place) -> Iterator[_Place]:
        """Whole manipulators from a half: the best other halves for its circle of H."""
        for partner in self.halves(1 - k, half.x[-4:], PARTNERS)[:BEST_PARTNERS]:
            yield _joined(k, half, partner)

    def descend(self, place: _Place, stage: int) -> bool:
        """Move all dimensions; whether the manipulator is good enough."""
        from mechanisms.families.robomech_descent import descend

        x, angles, value = descend(
            place.x, self.paths, self.turns, place.elbows, place.angles, True, True, STEPS[stage], LOOK, GAIN[stage],
            ROUNDING,
        )  # fmt: skip
        if not np.isfinite(value):
            return False
        reached = replace(place, value=float(value), x=x, angles=angles)
        # The largest distance is at least √2 times the root of the mean square of the coordinates.
        if np.sqrt(2) * value <= self.good:
            fit = self.measure(reached)
            if fit is not None and fit.worst <= self.good * self.size:
                self.good_ones.append(fit)
                return True
        self.stages[stage].append(reached)
        return False

    def promising(self, stage: int) -> list[_Place]:
        """The best that wait for this stage; they wait no longer."""
        waiting = self.stages[stage - 1]
        waiting.sort(key=lambda place: (place.value, place.number))
        best, waiting[:] = waiting[: SHARE[stage]], waiting[SHARE[stage] :]
        return best

    def measure(self, place: _Place) -> ManipulatorFit | None:
        """The manipulator of a place, its largest error made least if that is the norm, driven and measured."""
        x = self.least_worst(place) if self.norm == "minimax" else place.x
        z, halves = x * self.size, []
        for p in (z[:12], z[12:24]):
            pivot, g, l, m = (complex(p[i], p[i + 1]) for i in (0, 4, 7, 9))
            halves.append(Half(pivot + self.middle, float(p[2]), float(p[3]), g, float(p[6]), l, m, float(p[11])))
        mechanism = RoboMech(complex(z[24], z[25]) + self.middle, complex(z[26], z[27]), halves[0], halves[1])
        # a passive chain may have stretched and bent to the other side on the way
        elbows = np.where(np.median(np.sin(place.angles[:, 0] - place.angles[:, 1]), axis=1) < 0, -1.0, 1.0)
        return measured(mechanism, self.original, self.phi7, (float(elbows[0]), float(elbows[1])))

    def least_worst(self, place: _Place) -> NDArray[np.float64]:
        """The Chebyshev fit near a place: the largest component of an error in eight directions is made least."""
        from mechanisms.families.robomech_kernel import OWN, SHARED, driven

        count = len(self.turns)
        views = np.array([1.0, 1.0j, np.sqrt(0.5) * (1 + 1j), np.sqrt(0.5) * (1 - 1j)])

        def seen(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
            values, slopes = np.empty((2, 4, count)), np.zeros((2, 4, count, len(x)))
            res, rows = np.zeros(2 * count), np.zeros((2 * count, OWN + SHARED))
            for k in range(2):
                own, angles = slice(OWN * k, OWN * (k + 1)), place.angles[k].copy()
                if not driven(x[own], x[-SHARED:], self.paths[k], self.turns, angles, res, rows, True):
                    return np.full(8 * count, np.inf), np.zeros((8 * count, len(x)))
                for i, view in enumerate(views):
                    values[k, i] = view.real * res[:count] + view.imag * res[count:]
                    slope = view.real * rows[:count] + view.imag * rows[count:]
                    slopes[k, i, :, own], slopes[k, i, :, -SHARED:] = slope[:, :OWN], slope[:, OWN:]
            return values.ravel(), slopes.reshape(-1, len(x))

        return minimax_fit(lambda x: seen(x)[0], place.x, jacobian=lambda x: seen(x)[1], programs=PROGRAMS).x

    def results(self) -> list[ManipulatorFit]:
        """The good ones and the best of the others, measured, with their dyads; the best first."""
        found = list(self.good_ones)
        for place in sorted((p for stage in self.stages for p in stage), key=lambda place: (place.value, place.number)):
            if len(found) >= RETURNED:
                break
            fit = self.measure(place)
            # driven from its first position, it may not come to all the others: it would have to jump
            if fit is None or not fit.rms <= JUMP * np.sqrt(2) * place.value * self.size:
                continue
            if all(abs(fit.rms - other.rms) > SAME * other.rms for other in found):
                found.append(fit)
        rank = (lambda fit: fit.worst) if self.norm == "minimax" else (lambda fit: fit.rms)
        return [proved(fit, self.original, self.phi7, self.seed) for fit in sorted(found, key=rank)]


def _joined(k: int, half: _Place, other: _Place) -> _Place:
    c, f = (half, other) if k == 0 else (other, half)
    x, angles = np.r_[c.x[:-4], f.x[:-4], half.x[-4:]], np.concatenate([c.angles, f.angles])
    return _Place(np.inf, half.number, x, angles, np.concatenate([c.elbows, f.elbows]))


def _circles(paths: NDArray[np.complex128], samples: int, seed: int) -> Iterator[NDArray[np.float64]]:
    """K and r_H: K around one of the paths, r_H in every direction."""
    box = [(-REACH, REACH)] * 2 + [ARM, (-np.pi, np.pi)]
    for number, (x, y, arm, angle) in enumerate(sobol_points(box, samples, seed)):
        pivot, h = paths[number % 2].mean() + complex(x, y), arm * np.exp(1j * angle)
        yield np.array([pivot.real, pivot.imag, h.real, h.imag])


def _passive_chains(path: NDArray[np.complex128], seed: int) -> Iterator[tuple[NDArray[np.float64], float]]:
    """Pivot, lengths and sign of two-link chains that reach all points with ease, without end."""
    box = [(-REACH, REACH)] * 2 + [(SHORTEST, REACH)] * 2
    for block in itertools.count():
        for number, (x, y, crank, rod) in enumerate(sobol_points(box, SOBOL_BLOCK, seed + 2 * block)):
            pivot = path.mean() + complex(x, y)
            reach = np.abs(path - pivot)
            if np.abs((reach**2 + crank**2 - rod**2) / (2 * reach * crank)).max() < FOLDED:
                yield np.array([pivot.real, pivot.imag, crank, rod]), 1.0 if number % 2 else -1.0


def _half(
    path: NDArray[np.complex128],
    h: NDArray[np.complex128],
    chain: NDArray[np.float64],
    elbow: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """The dimensions of a half around a passive chain: r_G, and r_M for the best of some r_L, as centres of circles."""
    moved = passive_chain(list(path), complex(chain[0], chain[1]), float(chain[2]), float(chain[3]), elbow)
    g = _centre((h - moved.joint) * np.exp(-1j * moved.phi2))
    joint = moved.joint + g * np.exp(1j * moved.phi2)
    bar = h - joint
    fifth = bar / np.abs(bar)
    best = (np.inf, 0j, 0j, 0.0)
    for real, imag in rng.normal(size=(SPOTS, 2)):
        l = SPREAD * complex(real, imag)
        spot = moved.pivot + l * np.exp(1j * moved.phi1)
        m = _centre((spot - joint) * np.conj(fifth))
        lengths = np.abs(joint + m * fifth - spot)
        best = min(best, (float(lengths.std()), l, m, float(lengths.mean())), key=lambda item: item[0])
    _, l, m, lm = best
    return np.array([*chain, g.real, g.imag, np.abs(bar).mean(), l.real, l.imag, m.real, m.imag, lm])


def _centre(points: NDArray[np.complex128]) -> complex:
    """Centre of the circle through points, by linear least squares."""
    rows = np.stack([points.real, points.imag, np.ones(len(points))], axis=1)
    x, y, _ = np.linalg.lstsq(rows, 0.5 * np.abs(points) ** 2, rcond=None)[0]
    return complex(x, y)
