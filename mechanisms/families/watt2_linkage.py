"""From the dyads of a two-effector Watt II to a `Linkage`, and its configurations in the poses of a task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from mechanisms.families.dyads import Dyads
from mechanisms.linkage import Input, Linkage

__all__ = ["ANGLES", "INPUTS", "Watt2"]

#: The links that may be driven: the ternary crank of both loops, or one of the two rockers.
INPUTS = ("crank", "P-rocker", "Q-rocker")
#: Rotations in the paper's names.
ANGLES = frozenset(f"{name}{pose}" for name in ("beta", "eta", "phi") for pose in (2, 3))


@dataclass(frozen=True)
class Watt2:
    """A Watt II six-bar with two effectors, by its four dyads.

    Parameters
    ----------
    p, q : complex
        The effectors' reference points in pose 0.
    dyads : sequence of four Dyads
        (W1, Z1) and (W3, Z3) carry P, (W2, Z2) and (W4, Z4) carry Q; W1 and W2 are sides of one ternary
        crank.
    beta, eta, phi : sequence of float
        Rotations of the crank, of W3 and of W4 to the later poses, radians.
    alpha, gamma : sequence of float
        Rotations of P and of Q, radians.
    """

    p: complex
    q: complex
    dyads: Sequence[Dyads]
    beta: Sequence[float]
    eta: Sequence[float]
    phi: Sequence[float]
    alpha: Sequence[float]
    gamma: Sequence[float]

    def points(self) -> dict[str, complex]:
        """The pivots and the effectors in pose 0.

        The fixed pivot O1 is taken from P's side; Eq. (1) says that Q's side gives the same.
        """
        (w1, z1), (_, z2), (w3, z3), (w4, z4) = self.dyads
        named: dict[str, Any] = {
            "O1": self.p - z1 - w1,
            "O3": self.p - z3 - w3,
            "O4": self.q - z4 - w4,
            "A1": self.p - z1,
            "A2": self.q - z2,
            "A3": self.p - z3,
            "A4": self.q - z4,
            "P": self.p,
            "Q": self.q,
        }
        return {name: complex(point) for name, point in named.items()}

    def linkage(self, title: str = "", length_unit: str = "") -> Linkage:
        """The linkage in pose 0."""
        return Linkage(
            points=self.points(),
            links={
                "ground": ("O1", "O3", "O4"),
                "crank": ("O1", "A1", "A2"),
                "P-coupler": ("A1", "A3", "P"),
                "Q-coupler": ("A2", "A4", "Q"),
                "P-rocker": ("O3", "A3"),
                "Q-rocker": ("O4", "A4"),
            },
            bodies={"P": ("P-coupler", "P"), "Q": ("Q-coupler", "Q")},
            inputs={name: Input(name) for name in INPUTS},
            title=title,
            length_unit=length_unit,
        )

    def poses(self) -> list[dict[str, float]]:
        """Rotations of the links from pose 0, pose by pose."""
        names = ("crank", "P-coupler", "Q-coupler", "P-rocker", "Q-rocker")
        later = zip(self.beta, self.alpha, self.gamma, self.eta, self.phi)
        return [dict.fromkeys(names, 0.0)] + [dict(zip(names, map(float, angles))) for angles in later]

    def parameters(self) -> Mapping[str, complex]:
        """W1 … Z4 and the rotations, by the paper's names."""
        named: dict[str, complex] = {}
        for angles, symbol in ((self.beta, "beta"), (self.eta, "eta"), (self.phi, "phi")):
            named.update({f"{symbol}{pose}": float(angle) for pose, angle in enumerate(angles, start=2)})
        for number, (w, z) in enumerate(self.dyads, start=1):
            named[f"W{number}"], named[f"Z{number}"] = complex(w), complex(z)
        return named
