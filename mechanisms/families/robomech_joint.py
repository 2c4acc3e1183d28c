"""Whole RoboMech manipulators: measured by driving the input alone, and completed where the passive chains are given.

A manipulator is judged by the real errors of C and F, not by residuals of an equation: the input is turned, both
halves are assembled, and the distances from the points are taken.  With the passive chains given, every active chain
that is exact at five positions is computed and fitted to all, and the negative chains follow from all critical points
of their dyads (`mechanisms.families.robomech_fit`).  From the paths alone: `mechanisms.families.robomech_search`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

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

__all__ = ["CLEAR", "ManipulatorFit", "complete_manipulators", "measured", "path_size", "proved", "stretches"]

#: Links longer than this many path sizes are as good as sliders and are not wanted.
LONGEST = 60.0
#: A negative link whose pins are nearer than CLEAR path sizes to those of link 2 (4) is that link, more or less; nor
#: may r_H, r_G, r_I vanish: with H = K = A and G = B every path is followed by link 5 lying on link 1.
CLEAR = 0.3

Paths = tuple[NDArray[np.complex128], NDArray[np.complex128]]


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
    elbows : (float, float)
        Signs of the passive chains in (8), (9).
    proofs : tuple of DyadFits
        Critical points of the two negative dyads, where they were fitted.
    """

    mechanism: RoboMech
    start: tuple[float, float]
    errors: NDArray[np.float64]
    stretch: float
    elbows: tuple[float, float]
    proofs: tuple[DyadFits, ...] = ()

    @property
    def worst(self) -> float:
        """The largest distance; infinite when the motion does not go on."""
        return float(np.nanmax(np.where(np.isfinite(self.errors), self.errors, np.inf)))

    @property
    def rms(self) -> float:
        """Root of the mean square distance."""
        return float(np.sqrt(np.mean(self.errors**2))) if np.all(np.isfinite(self.errors)) else float("inf")


def stretches(half: Half, chain: PassiveChain, h: NDArray[np.complex128]) -> NDArray[np.float64]:
    """|HG| − l_HG and |LM| − l_LM at all positions while C is on its path: (2, N)."""
    g = chain.joint + half.g * np.exp(1j * chain.phi2)
    bar = h - g
    m = g + half.m * bar / np.abs(bar)
    l = chain.pivot + half.l * np.exp(1j * chain.phi1)
    return np.stack([np.abs(bar) - half.gh, np.abs(m - l) - half.lm])


def measured(
    mechanism: RoboMech, paths: Paths, phi7: NDArray[np.float64], elbows: tuple[float, float]
) -> ManipulatorFit | None:
    """Drive the input and measure; None for a linkage that is trivial, has a negative length or does not reach.

    The sides of the halves are chosen here: on which the joint G (I) is where C (F) passes its points.
    """
    size = path_size(paths)
    h = mechanism.joint(phi7)
    parts, first, stretch = [], [], []
    for half, path, elbow in zip((mechanism.c, mechanism.f), paths, elbows):
        if min(half.crank, half.rod, half.gh, half.lm) <= 0:
            return None
        trivial = np.hypot(abs(half.l - half.crank), abs(half.m))
        if min(trivial, abs(half.g), abs(mechanism.h)) < 0.99 * CLEAR * size:
            return None
        try:
            chain = passive_chain(list(path), half.pivot, half.crank, half.rod, elbow)
        except TaskError:
            return None
        g = half.g * np.exp(1j * chain.phi2)
        side = float(np.sign(np.median((np.conj(h - chain.joint) * g).imag))) or 1.0
        parts.append(replace(half, side=side))
        first.append(float(chain.phi1[0]))
        stretch.append(float(np.abs(stretches(half, chain, h)).max()))
    whole = RoboMech(mechanism.pivot, mechanism.h, parts[0], parts[1])
    moved = whole.positions(phi7.tolist(), (first[0], first[1]))
    errors = np.array([np.abs(half["C"] - path) for half, path in zip(moved, paths)])
    start = (float(moved[0]["phi1"][0]), float(moved[1]["phi1"][0]))
    return ManipulatorFit(whole, start, errors, max(stretch), elbows)


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
    paths, crank = checked(c, f, phi7)
    count, longest = len(crank), LONGEST * path_size(paths)
    chosen = tuple(round(k * (count - 1) / 4) for k in range(5))
    elbows = (chains[0].elbow, chains[1].elbow)
    fits = []
    for one in exact_active(chains, crank.tolist(), chosen, seed):
        if not (np.all(np.isfinite(one.lengths)) and max(one.lengths) <= longest):
            continue
        active = ActiveChain.from_vector(finish(one, chains, crank.tolist(), norm).x)
        try:
            made = [negative_chain(chain, active, k, crank.tolist(), seed) for k, chain in enumerate(chains)]
        except (TaskError, np.linalg.LinAlgError):
            continue
        mechanism = RoboMech(active.pivot, active.h, made[0][1], made[1][1])
        fit = measured(mechanism, paths, crank, elbows)
        if fit is not None:
            fits.append(replace(fit, proofs=tuple(proof for _, _, proof in made)))
    return sorted(fits, key=lambda item: (item.worst, item.stretch))


def proved(fit: ManipulatorFit, paths: Paths, phi7: NDArray[np.float64], seed: int = 0) -> ManipulatorFit:
    """The same with all critical points of both negative dyads, for its own active and passive chains.

    Where the paths are followed exactly, the dyads of the manipulator are among them; elsewhere they are near one, as
    the manipulator has the least real error and not the least residual.
    """
    mechanism = fit.mechanism
    halves = (mechanism.c, mechanism.f)
    active = ActiveChain(mechanism.pivot, mechanism.h, (halves[0].g, halves[1].g), (halves[0].gh, halves[1].gh))
    proofs = []
    for number, (half, path, elbow) in enumerate(zip(halves, paths, fit.elbows)):
        chain = passive_chain(list(path), half.pivot, half.crank, half.rod, elbow)
        try:
            proofs.append(negative_chain(chain, active, number, phi7.tolist(), seed)[2])
        except (TaskError, np.linalg.LinAlgError):
            return fit
    return replace(fit, proofs=tuple(proofs))


def path_size(paths: Sequence[NDArray[Any]]) -> float:
    """The farthest that a point of a path lies from the middle of its path."""
    return max(float(np.abs(p - p.mean()).max()) for p in paths)


def checked(c: Sequence[complex], f: Sequence[complex], phi7: Sequence[float]) -> tuple[Paths, NDArray[np.float64]]:
    """Both paths and the input angles as arrays; `TaskError` says what is wrong with them."""
    if len(c) != len(f) or len(c) != len(phi7):
        raise TaskError(f"{len(c)} points of C, {len(f)} of F and {len(phi7)} input angles; the numbers must agree")
    if len(c) < 8:
        raise TaskError(f"{len(c)} points of each end-effector; give 8 or more, fewer leave dimensions open")
    crank = np.array(phi7, dtype=float)
    steps = np.diff(crank)
    if not (np.all(steps > 0) or np.all(steps < 0)):
        raise TaskError("the input angles must go one way, up or down")
    return (np.array(c, dtype=complex), np.array(f, dtype=complex)), crank
