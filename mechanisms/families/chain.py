"""Coupled serial chains: N links in a row, each geared to the first, and precision points that are linear.

A chain turns all its links with one input.  When the first link turns by φ, link k turns by R_k φ (R_1 = 1), so
that its tip is

    Z(φ) = Z0 + Σ_k Z_k e^{i R_k φ},      Θ(φ) = Θ(0) + R_N φ                                            (1), (2)

Equations: V. Krovi, G. K. Ananthasuresh, V. Kumar, Kinematic and kinetostatic synthesis of planar coupled
serial chain mechanisms.  For given ratios and input angles the links follow linearly from displacements of the
tip,

    Σ_k (e^{i R_k φ_j} − 1) Z_k = P_j − P_1                                                                    (3)

(the paper prints the exponents as iφ−1), for up to M = N + 1 points, Eq. (4).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.linkage import Gear, Input, Linkage
from mechanisms.task import TaskError

__all__ = [
    "SerialChain",
    "chain_for_points",
    "chain_for_poses",
    "free_choices",
    "gear_fraction",
    "input_angles",
    "link_matrix",
    "whole_exponents",
]

#: Reciprocal condition below which (3) does not determine the links: two of them turn alike.
SINGULAR = 1e-12
#: Gears have ratios with at most this denominator; a ratio is such a fraction when it agrees to this part.
LARGEST_DENOMINATOR, SAME_RATIO = 1000, 1e-12


@dataclass(frozen=True)
class SerialChain:
    """A planar serial chain whose links are geared to the first one.

    Parameters
    ----------
    base : complex
        Z0, the fixed pivot.
    links : tuple of complex
        Z1 … ZN in the reference position (φ = 0), each from its joint to the next.
    ratios : tuple of float
        R_1 = 1, R_2 …: rotation of each link for one turn of the first.

    Examples
    --------
    >>> chain = SerialChain(0, (1, 0.5), (1, -2))
    >>> complex(chain.tip(0.0))
    (1.5+0j)
    >>> chain.linkage().degrees_of_freedom
    1
    """

    base: complex
    links: tuple[complex, ...]
    ratios: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "base", complex(self.base))
        object.__setattr__(self, "links", tuple(complex(z) for z in self.links))
        object.__setattr__(self, "ratios", tuple(float(r) for r in self.ratios))
        if len(self.links) != len(self.ratios) or not self.links:
            raise ValueError(f"{len(self.links)} links need as many ratios, not {len(self.ratios)}")
        if self.ratios[0] != 1.0:
            raise ValueError(f"the first ratio is {self.ratios[0]:g}, but the first link is the input: it is 1")

    def tip(self, phi: ArrayLike) -> NDArray[np.complex128]:
        """Where the tip is when the input has turned by `phi` (radians, any shape); Eq. (1)."""
        angle = np.asarray(phi, dtype=float)
        turned = np.exp(1j * angle[..., None] * np.array(self.ratios))
        return self.base + turned @ np.array(self.links)

    def velocity(self, phi: ArrayLike) -> NDArray[np.complex128]:
        """dZ/dφ of the tip; Eq. (6)."""
        angle = np.asarray(phi, dtype=float)
        ratios = np.array(self.ratios)
        return np.exp(1j * angle[..., None] * ratios) @ (1j * ratios * np.array(self.links))

    def turning(self, phi: ArrayLike) -> NDArray[np.float64]:
        """By how much the last link has turned, radians; Eq. (2)."""
        return self.ratios[-1] * np.asarray(phi, dtype=float)

    @property
    def lengths(self) -> tuple[float, ...]:
        """L_k = |Z_k|."""
        return tuple(abs(z) for z in self.links)

    def linkage(self, title: str = "", length_unit: str = "") -> Linkage:
        """The chain as a linkage of pins and gears in its reference position."""
        places = [self.base]
        for link in self.links:
            places.append(places[-1] + link)
        names = ["O", *(f"J{k}" for k in range(1, len(self.links))), "P"]
        bars = {f"link{k}": (names[k - 1], names[k]) for k in range(1, len(self.links) + 1)}
        gears = [
            Gear({f"link{k}": Fraction(1), "link1": -gear_fraction(ratio)})
            for k, ratio in enumerate(self.ratios[1:], start=2)
            if ratio != 0.0
        ]
        gears += [Gear({f"link{k}": Fraction(1)}) for k, ratio in enumerate(self.ratios[1:], start=2) if ratio == 0.0]
        return Linkage(
            points=dict(zip(names, places)),
            links={"ground": ("O",), **bars},
            gears=gears,
            bodies={"body": (f"link{len(self.links)}", "P")},
            inputs={"link1": Input("link1")},
            title=title,
            length_unit=length_unit,
        )

    def poses(self, phi: Sequence[float] | NDArray[Any]) -> list[dict[str, float]]:
        """Rotations of the links for each input angle, by the ratios that the gears of `linkage` have.

        They differ from the chain's by 1e-6 at most, and by nothing for simple fractions.
        """
        made = [float(gear_fraction(ratio)) for ratio in self.ratios]
        return [{f"link{k}": ratio * float(p) for k, ratio in enumerate(made, start=1)} for p in phi]

    def parameters(self) -> dict[str, Any]:
        """Z0, Z1 …, R1 … by the paper's names (R1 is the ratio of the second link)."""
        named: dict[str, Any] = {f"Z{k}": z for k, z in enumerate((complex(self.base), *self.links))}
        return named | {f"R{k}": ratio for k, ratio in enumerate(self.ratios[1:], start=1)}


def gear_fraction(ratio: float) -> Fraction:
    """A ratio as a fraction that gears can have: exactly, if it is simple, else the nearest one.

    >>> gear_fraction(-1.5), gear_fraction(1 / 3), gear_fraction(2**0.5)
    (Fraction(-3, 2), Fraction(1, 3), Fraction(1393, 985))
    """
    return Fraction(ratio).limit_denominator(LARGEST_DENOMINATOR)


def is_simple(ratio: float) -> bool:
    """Whether a ratio is a fraction of whole numbers of teeth to rounding."""
    return abs(float(gear_fraction(ratio)) - ratio) <= SAME_RATIO * max(1.0, abs(ratio))


def link_matrix(ratios: ArrayLike, phi: ArrayLike) -> NDArray[np.complex128]:
    """The matrix of Eq. (3): e^{i R_k φ_j} − 1, shape (…, M−1, N) for `ratios` (…, N) and `phi` (…, M−1)."""
    ratio, angle = np.asarray(ratios, dtype=float), np.asarray(phi, dtype=float)
    half = 0.5 * angle[..., :, None] * ratio[..., None, :]
    return 2j * np.sin(half) * np.exp(1j * half)  # without the cancellation of e^{ix} − 1 for small x


def chain_for_points(
    points: Sequence[complex], ratios: Sequence[float], phi: Sequence[float] | NDArray[Any]
) -> SerialChain:
    """The chain whose tip passes the points at the given input angles; Eq. (3).

    Parameters
    ----------
    points : sequence of M complex
        Precision points, 2 ≤ M ≤ N + 1.
    ratios : sequence of N float
        Gear ratios, the first 1.
    phi : sequence of M − 1 float
        Input angles at the points after the first, radians.

    Returns
    -------
    SerialChain
        The only one for M = N + 1; the one with the least sum of squared lengths for fewer points.

    Raises
    ------
    TaskError
        When there are too many points, or the ratios and angles do not determine the links.

    Examples
    --------
    >>> chain = chain_for_points([0, 1, 1 + 1j], (1, -1.5), np.radians([40, 90]))
    >>> bool(abs(chain.tip(np.radians(90)) - (1 + 1j)) < 1e-12)
    True
    """
    links = len(ratios)
    if not 2 <= len(points) <= links + 1:
        raise TaskError(
            f"{len(points)} points, but a chain of {links} links is linear in 2 to {links + 1} points (Eq. 4)"
        )
    if len(phi) != len(points) - 1:
        raise TaskError(f"{len(phi)} input angles for {len(points)} points; give one for each point after the first")
    matrix = link_matrix(np.array(ratios, dtype=float), np.array(phi, dtype=float))
    moves = np.array(points[1:], dtype=complex) - points[0]
    singular = np.linalg.svd(matrix, compute_uv=False)
    if singular[-1] <= SINGULAR * singular[0]:
        raise TaskError(
            "these ratios and input angles do not determine the links: two links turn alike or one not at all; "
            "choose others (ratios 0 and 1 and equal ratios are of this kind)"
        )
    found = np.linalg.lstsq(matrix, moves, rcond=None)[0]
    return SerialChain(points[0] - found.sum(), tuple(found), tuple(ratios))


def chain_for_poses(points: Sequence[complex], angles: Sequence[float], ratios: Sequence[float]) -> SerialChain:
    """The chain whose last link passes the poses: φ_j = ΔΘ_j/R_N, then Eq. (3).

    Parameters
    ----------
    points, angles : sequences of M numbers
        Positions and orientations (radians, taken as they stand: whole turns count).
    ratios : sequence of N float

    Examples
    --------
    The published type of task, two links and three poses with R1 = −1.2:

    >>> chain = chain_for_poses([-18.29 + 4.41j, 2 + 18j, 25.19 + 25.19j], np.radians([10, 35, 60]), (1, -1.2))
    >>> np.round(chain.links, 5).tolist()
    [(-44.09854+42.71329j), (0.46852-5.34684j)]
    """
    if ratios[-1] == 0.0:
        raise TaskError("the last ratio is 0: the last link would not turn; choose another ratio")
    return chain_for_points(points, ratios, input_angles(angles, ratios[-1]))


def input_angles(angles: Sequence[float], last_ratio: float) -> list[float]:
    """φ_j = ΔΘ_j / R_N for the poses after the first."""
    return [(angle - angles[0]) / last_ratio for angle in angles[1:]]


def free_choices(links: int, positions: int, guidance: bool) -> int:
    """How many scalars N links leave free for M positions; Table 1.  Negative: too many positions.

    >>> [free_choices(n, 3, guidance=True) for n in (2, 3, 4, 5)]
    [1, 4, 7, 10]
    >>> max(m for m in range(1, 20) if free_choices(3, m, guidance=False) >= 0)
    9
    """
    return 3 * links + 1 - 2 * positions if guidance else 3 * links - positions


def whole_exponents(ratios: Sequence[float]) -> tuple[int, ...]:
    """The ratios as whole numbers without common divisor: exponents of e^{iφ/q}.

    Raises
    ------
    TaskError
        When a ratio is no simple fraction.

    >>> whole_exponents((1, -1.5))
    (2, -3)
    """
    fractions = [gear_fraction(ratio) for ratio in ratios]
    for ratio in ratios:
        if not is_simple(ratio):
            raise TaskError(f"the ratio {ratio!r} is no simple fraction; give a ratio of whole numbers of teeth")
    common = math.lcm(*(f.denominator for f in fractions))
    return tuple(int(f * common) for f in fractions)
