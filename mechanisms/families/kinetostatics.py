"""Input torque of coupled serial chains under loads, with torsional springs at the joints.

Equations: V. Krovi, G. K. Ananthasuresh, V. Kumar, Kinematic and kinetostatic synthesis of planar coupled serial
chain mechanisms, (5)–(15), with the signs of (14) and the spring terms of (15) corrected.  By virtual work the
torque on the input that holds the force F and the moment M_z at the tip is

    T(φ) = −F·dZ/dφ − R_N M_z + Σ_k K_k β_k dβ_k/dφ                                                      (7), (11)

where spring k acts between link k−1 and link k and is wound up by β_k = β_k(0) + (R_k − R_{k−1}) φ, with R_0 = 0.

**Energy bound.**  Without a moment and with one constant force F the work of the input between two positions is
the gain of −F·Z plus the gain of spring energy, whatever the links.  So the mean of T over the range is fixed, and

    max |T| ≥ |−F·(P_2 − P_1) + ΔE| / |φ_2|.

Springs that are relaxed in the first position can only gain energy.  Where the load gains energy too, as when
it is lifted, they raise the bound: **springs assembled relaxed in the lower position never help** (Case II of
the paper, with the sign of virtual work).  The reduction by an order of magnitude belongs to springs that are
wound up in the lower position (Case III).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.families.chain import SerialChain
from mechanisms.task import TaskError

__all__ = ["Load", "Springs", "energy", "energy_bound", "input_torque", "torque_rows"]


@dataclass(frozen=True)
class Load:
    """What acts on the tip.

    Parameters
    ----------
    force : complex
        F_x + i F_y, constant.
    moment : float
        M_z, anticlockwise, constant.
    """

    force: complex = 0j
    moment: float = 0.0


@dataclass(frozen=True)
class Springs:
    """Torsional springs at the joints, from the ground to the tip.

    Parameters
    ----------
    stiffness : tuple of float
        K_k ≥ 0, torque per radian.
    windup : tuple of float
        β_k in the reference position, radians: how far each spring is wound up there.

    Raises
    ------
    TaskError
        For a negative stiffness, which no spring has.
    """

    stiffness: tuple[float, ...]
    windup: tuple[float, ...] = field(default=())

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", tuple(float(k) for k in self.stiffness))
        windup = self.windup or (0.0,) * len(self.stiffness)
        object.__setattr__(self, "windup", tuple(float(b) for b in windup))
        if len(self.windup) != len(self.stiffness):
            raise TaskError(f"{len(self.stiffness)} springs, but {len(self.windup)} wind-ups; give one for each")
        for number, stiffness in enumerate(self.stiffness, start=1):
            if not stiffness >= 0.0:
                raise TaskError(f"spring {number} has the stiffness {stiffness:g}; a spring's is not negative")

    @classmethod
    def assembled(cls, chain: SerialChain, stiffness: Sequence[float], at: Sequence[float]) -> Springs:
        """Springs that are relaxed when the links stand at the absolute angles `at` (ψ_k, radians); Eq. (10)."""
        angles = np.angle(chain.links)
        beta = np.diff(angles - np.array(at), prepend=0.0)
        return cls(tuple(stiffness), tuple(beta))


def _steps(ratios: ArrayLike) -> NDArray[np.float64]:
    """R_k − R_{k−1}: how fast each joint turns."""
    return np.diff(np.asarray(ratios, dtype=float), prepend=0.0, axis=-1)


def input_torque(
    chain: SerialChain, phi: ArrayLike, load: Load, springs: Springs | None = None
) -> NDArray[np.float64]:
    """Torque on the input that balances the load and the springs; Eqs. (7) and (11).

    Parameters
    ----------
    phi : array
        Input angles, radians.

    Returns
    -------
    array of the shape of `phi`
        In units of force times length.

    Examples
    --------
    A bar of length 2 held level, a unit weight at its tip:

    >>> float(input_torque(SerialChain(0, (2,), (1,)), 0.0, Load(-1j)))
    2.0
    """
    angle = np.asarray(phi, dtype=float)
    speed = chain.velocity(angle)
    torque = -(speed.real * load.force.real + speed.imag * load.force.imag) - chain.ratios[-1] * load.moment
    if springs is not None:
        steps = _steps(chain.ratios)
        beta = np.array(springs.windup) + angle[..., None] * steps
        torque = torque + beta @ (np.array(springs.stiffness) * steps)
    return torque


def energy(chain: SerialChain, phi: ArrayLike, load: Load, springs: Springs | None = None) -> NDArray[np.float64]:
    """Potential energy of load and springs, up to a constant; its derivative by φ is the input torque."""
    angle = np.asarray(phi, dtype=float)
    place = chain.tip(angle)
    total = -(place.real * load.force.real + place.imag * load.force.imag) - chain.turning(angle) * load.moment
    if springs is not None:
        beta = np.array(springs.windup) + angle[..., None] * _steps(chain.ratios)
        total = total + 0.5 * beta**2 @ np.array(springs.stiffness)
    return total


def energy_bound(chain: SerialChain, end: float, load: Load, springs: Springs | None = None) -> float:
    """What max |T| over [0, end] cannot fall below: the mean torque that the energy asks for.

    Examples
    --------
    Lifting a unit weight by 20.78 within 60° takes at least 19.84 on average, whatever the chain:

    >>> chain = SerialChain(0, (-20.78j,), (1,))
    >>> round(energy_bound(chain, np.pi / 2, Load(-1j)) * np.pi / 2, 2)
    20.78
    """
    start, stop = energy(chain, np.array([0.0, end]), load, springs)
    return float(abs(stop - start) / abs(end))


def torque_rows(ratios: ArrayLike, phi: ArrayLike, load: Load) -> NDArray[np.float64]:
    """Rows a with a·(Z1x, Z1y, Z2x, Z2y, …) = T(φ) + R_N M_z of a chain without springs; −A of Eq. (7).

    Parameters
    ----------
    ratios : (…, N) array
    phi : (…, n) array

    Returns
    -------
    (…, n, 2N) array
    """
    ratio, angle = np.asarray(ratios, dtype=float), np.asarray(phi, dtype=float)
    turn = angle[..., :, None] * ratio[..., None, :]
    sine, cosine = np.sin(turn), np.cos(turn)
    fx, fy = load.force.real, load.force.imag
    r = ratio[..., None, :]
    columns = np.stack([r * (fx * sine - fy * cosine), r * (fx * cosine + fy * sine)], axis=-1)
    return columns.reshape(*turn.shape[:-1], -1)
