"""The RoboMech manipulator: one input, two end-effectors, two fourth-class groups; its positions, speeds,
accelerations.

Links 1 = AB(L), 2 = BC(G), 3 = DE(Q), 4 = EF(I), 5 = GH(M), 6 = IH(N), 7 = KH (input), 8 = LM, 9 = NQ on the
ground pivots A, D, K; H joins links 5, 6 and 7.  Nine links, thirteen pins, one degree of freedom:

    IV(1, 2, 5, 8) ← I(0, 7) → IV(3, 4, 6, 9)                                            (1), the input being
    link 7

Equations: Structurally parametric synthesis and position analysis of a RoboMech class parallel manipulator with
two end-effectors, IAENG Int. J. Applied Mathematics 50(2), 2020, by its numbers.  Frames: (1) at A along AB,
(2) at B along BC, (3) at D along DE, (4) at E along EF, (5) at G along GH, (6) at I along IH, (7) at K.  The
directions of links 5 and 6 are those of (54), G→H and I→H, everywhere; (25), (26) have them reversed.

Each half is found by the method of the conditional generalised coordinate: link 8 is taken out, link 1 is
turned by a trial angle, everything else follows from two-link chains, and the angle is right where |LM| is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.linkage import Input, Linkage

__all__ = ["INPUTS", "Half", "RoboMech"]

INPUTS = ("link7",)
#: Trial angles of link 1 in a full turn; between two of them a half has one assembly at most, but near a dead
#: centre.
TRIALS = 1440
#: Bisections and secant steps that bring an angle to rounding.
REFINE = 60


@dataclass(frozen=True)
class Half:
    """One half of the manipulator; the other has D, E, F, I, Q, N for A, B, C, G, L, M.

    Parameters
    ----------
    pivot : complex
        A.
    crank, rod : float
        l_AB, l_BC.
    g : complex
        r_G in frame (2).
    gh : float
        l_HG.
    l, m : complex
        r_L in frame (1), r_M in frame (5).
    lm : float
        l_LM.
    side : float
        +1 or −1: φ_BG = φ_BH + side·acos(…), (63) and (64).
    """

    pivot: complex
    crank: float
    rod: float
    g: complex
    gh: float
    l: complex
    m: complex
    lm: float
    side: float = 1.0

    def assembled(self, h: ArrayLike, phi1: ArrayLike) -> dict[str, NDArray[Any]]:
        """Angles and points of the half without link 8, for H and a trial angle of link 1; NaN where BGH is too
        short.

        ``"gap"`` is |LM| − l_LM, (44).
        """
        place, first = np.asarray(h, dtype=complex), np.asarray(phi1, dtype=float)
        b = self.pivot + self.crank * np.exp(1j * first)
        line = place - b
        with np.errstate(invalid="ignore", divide="ignore"):
            reach = np.abs(line)
            cosine = (abs(self.g) ** 2 + reach**2 - self.gh**2) / (2 * abs(self.g) * reach)
            bent = self.side * np.arccos(np.where(np.abs(cosine) <= 1, cosine, np.nan))
            direction = line / reach * np.exp(1j * bent)
        g = b + abs(self.g) * direction
        second = direction * abs(self.g) / self.g  # (71): the angle of r_G is subtracted; the paper adds it
        fifth = (place - g) / self.gh
        m = g + self.m * fifth
        l = self.pivot + self.l * np.exp(1j * first)
        points = {"B": b, "C": b + self.rod * second, "G": g, "H": place, "L": l, "M": m}
        angles = {"phi1": first, "phi2": np.angle(second), "phi5": np.angle(fifth), "phi8": np.angle(m - l)}
        return points | angles | {"gap": np.abs(m - l) - self.lm}

    def assemblies(self, h: complex) -> NDArray[np.float64]:
        """All angles of link 1 at which the half closes for one place of H, ascending."""
        grid = np.linspace(-np.pi, np.pi, TRIALS + 1)
        gap = self.assembled(h, grid)["gap"]
        starts = np.flatnonzero((gap[:-1] * gap[1:] <= 0) & (gap[:-1] != 0))
        if not len(starts):
            return np.zeros(0)
        low, high = grid[starts].copy(), grid[starts + 1].copy()
        at_low = gap[starts].copy()
        for _ in range(REFINE):
            middle = (low + high) / 2
            value = self.assembled(h, middle)["gap"]
            left = at_low * value > 0
            low, at_low = np.where(left, middle, low), np.where(left, value, at_low)
            high = np.where(left, high, middle)
        return (low + high) / 2

    def follow(self, h: Sequence[complex], start: float) -> NDArray[np.float64]:
        """φ1 along places of H, each time the assembly nearest to the one before; NaN where there is none."""
        found, last = [], start
        for place in h:
            angles = self.assemblies(place)
            if not len(angles):
                found.append(np.nan)
                continue
            turn = np.abs(np.angle(np.exp(1j * (angles - last))))
            last = float(angles[np.argmin(turn)])
            found.append(last)
        return np.array(found)


@dataclass(frozen=True)
class RoboMech:
    """A RoboMech manipulator.

    Parameters
    ----------
    pivot : complex
        K.
    h : complex
        r_H in frame (7).
    c, f : Half
        The halves that carry the end-effectors C and F.
    """

    pivot: complex
    h: complex
    c: Half
    f: Half

    def joint(self, phi7: ArrayLike) -> NDArray[np.complex128]:
        """H for input angles; (60)."""
        return self.pivot + self.h * np.exp(1j * np.asarray(phi7, dtype=float))

    def positions(
        self, phi7: Sequence[float], start: tuple[float, float]
    ) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
        """Both halves along input angles, from assemblies with link 1 and link 3 near the given angles.

        Returns
        -------
        two dicts
            As `Half.assembled`; in the second, B … M stand for E … N and phi1, phi2, phi5, phi8 for
            phi3, phi4, phi6, phi9.
        """
        h = self.joint(phi7)
        return (
            self.c.assembled(h, self.c.follow(h.tolist(), start[0])),
            self.f.assembled(h, self.f.follow(h.tolist(), start[1])),
        )

    def speeds(
        self, phi7: float, phi1: float, phi3: float, omega7: float = 1.0, epsilon7: float = 0.0
    ) -> dict[str, Any]:
        """Angular velocities and accelerations of all links and those of C and F, in one position; (73)–(87).

        Returns
        -------
        dict
            omega1 … omega9, epsilon1 … epsilon9, v_C, a_C, v_F, a_F, and ``determinant`` of A in (77).
        """
        h = complex(self.joint(phi7))
        found: dict[str, Any] = {"omega7": omega7, "epsilon7": epsilon7, "determinant": 1.0}
        numbers = (("C", self.c, phi1, (1, 2, 5, 8)), ("F", self.f, phi3, (3, 4, 6, 9)))
        for tip, half, first, (i1, i2, i5, i8) in numbers:
            p = {name: complex(z) for name, z in half.assembled(h, first).items() if name.isupper()}
            # Loops KH+HG−BG−AB and KH+HM−LM−AL: rows of vectors for ω1, ω2, ω5, ω8.
            rows = np.array(
                [
                    [-(p["B"] - half.pivot), -(p["G"] - p["B"]), p["G"] - h, 0],
                    [-(p["L"] - half.pivot), 0, p["M"] - h, -(p["M"] - p["L"])],
                ]
            )
            matrix = np.concatenate([rows.real, rows.imag])
            drive = np.full(2, h - self.pivot)
            omega = np.linalg.solve(matrix, -np.concatenate([drive.real, drive.imag]) * omega7)
            # Twice differentiated: i ε V − ω² V summed over the loop is zero.
            pull = rows @ omega**2 + drive * omega7**2
            right = pull / 1j - drive * epsilon7
            epsilon = np.linalg.solve(matrix, np.concatenate([right.real, right.imag]))
            for number, w, e in zip((i1, i2, i5, i8), omega, epsilon):
                found[f"omega{number}"], found[f"epsilon{number}"] = float(w), float(e)
            crank, rod = p["B"] - half.pivot, p["C"] - p["B"]
            found[f"v_{tip}"] = 1j * (omega[0] * crank + omega[1] * rod)
            found[f"a_{tip}"] = (1j * epsilon[0] - omega[0] ** 2) * crank + (1j * epsilon[1] - omega[1] ** 2) * rod
            found["determinant"] *= float(np.linalg.det(matrix))
        return found

    def linkage(self, phi7: float, phi1: float, phi3: float, title: str = "", length_unit: str = "") -> Linkage:
        """As a linkage, standing at the given angles."""
        h = complex(self.joint(phi7))
        c, f = self.c.assembled(h, phi1), self.f.assembled(h, phi3)
        points = {"A": self.c.pivot, "D": self.f.pivot, "K": self.pivot, "H": h}
        points |= {name: complex(c[name]) for name in "BCGLM"}
        points |= {ours: complex(f[name]) for ours, name in zip("EFIQN", "BCGLM")}
        return Linkage(
            points=points,
            links={
                "ground": ("A", "K", "D"),
                "link1": ("A", "B", "L"),
                "link2": ("B", "C", "G"),
                "link3": ("D", "E", "Q"),
                "link4": ("E", "F", "I"),
                "link5": ("G", "H", "M"),
                "link6": ("I", "H", "N"),
                "link7": ("K", "H"),
                "link8": ("L", "M"),
                "link9": ("N", "Q"),
            },
            bodies={"C": ("link2", "C"), "F": ("link4", "F")},
            inputs={"link7": Input("link7")},
            title=title,
            length_unit=length_unit,
        )

    def poses(self, phi7: Sequence[float], start: tuple[float, float]) -> list[dict[str, float]]:
        """Rotations of the links from the first position."""
        c, f = self.positions(phi7, start)
        turned = {"link7": np.asarray(phi7, dtype=float)}
        for half, numbers in ((c, "1258"), (f, "3469")):
            for name, number in zip(("phi1", "phi2", "phi5", "phi8"), numbers):
                turned[f"link{number}"] = np.unwrap(half[name])
        return [{link: float(a[j] - a[0]) for link, a in turned.items()} for j in range(len(phi7))]

    def parameters(self) -> dict[str, Any]:
        """All dimensions by the paper's names."""
        c, f = self.c, self.f
        return {
            "A": c.pivot, "D": f.pivot, "K": self.pivot, "r_H": self.h, "l_AB": c.crank, "l_BC": c.rod,
            "l_DE": f.crank, "l_EF": f.rod, "r_G": c.g, "r_I": f.g, "l_HG": c.gh, "l_HI": f.gh,
            "r_L": c.l, "r_M": c.m, "r_Q": f.l, "r_N": f.m, "l_LM": c.lm, "l_NQ": f.lm,
        }  # fmt: skip
