"""The Watt II six-bar that draws a path: its vectors, its motion, and its second loop, which the path leaves free.

The first four-bar carries the tracing point B on its coupler; the ternary rocker drives a second one.  Vectors as in
`mechanisms.families.watt2_path`: Z1 = O1A, Z3 = AB, Z7 = O2C, Z4 = CB, Z6 = DC, Z8 = O3E, Z9 = ED.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.approximate import sobol_points
from mechanisms.families.base import BODY
from mechanisms.linkage import Input, Linkage

__all__ = ["WattLinkage", "with_second_loop"]

#: Sobol points for the second loop, which is free.
SECOND_LOOPS = 4096


@dataclass(frozen=True)
class WattLinkage:
    """A Watt II six-bar in its home position, by the published vectors.

    Parameters
    ----------
    o1 : complex
        Pivot of the crank.
    z1, z3, z4, z7, z6, z8, z9 : complex
        As above; without Z8 there is no second loop.  Z2, Z5, Z10, Z11 follow by (4)–(7).
    """

    o1: complex
    z1: complex
    z3: complex
    z4: complex
    z7: complex
    z6: complex = 0j
    z8: complex = 0j
    z9: complex = 0j

    def derived(self) -> dict[str, complex]:
        """Z2, Z5, Z11 and Z10 by (4)–(7)."""
        z2, z5 = self.z4 - self.z3, self.z7 - self.z6
        return {"Z2": z2, "Z5": z5, "Z11": z5 - self.z8 - self.z9, "Z10": self.z1 - z2 - self.z7}

    def points(self) -> dict[str, complex]:
        """Pivots and joints in the home position."""
        a = self.o1 + self.z1
        b = a + self.z3
        c = b - self.z4
        o2, d = c - self.z7, c - self.z6
        e = d - self.z9
        return {"O1": self.o1, "O2": o2, "O3": e - self.z8, "A": a, "B": b, "C": c, "D": d, "E": e}

    def first_loop(self) -> NDArray[np.float64]:
        """Lengths of crank, coupler, rocker and ground between the joints O1, A, C and O2."""
        z2 = self.z4 - self.z3
        return np.abs([self.z1, z2, self.z7, self.z1 - z2 - self.z7])

    def rotations(self, theta: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """α, β, φ, γ for crank angles θ from home, on the branch of home; NaN where a loop does not close."""
        crank, p = np.asarray(theta, dtype=float), self.points()
        a = p["O1"] + self.z1 * np.exp(1j * crank)
        c = _meet(a, abs(p["C"] - p["A"]), p["O2"], abs(self.z7), _side(p["A"], p["O2"], p["C"]))
        alpha = np.angle((c - a) / (p["C"] - p["A"]))
        beta = np.angle((c - p["O2"]) / self.z7)
        found = {"alpha": alpha, "beta": beta}
        if self.z8 != 0:
            d = p["O2"] + (p["D"] - p["O2"]) * np.exp(1j * beta)
            e = _meet(d, abs(self.z9), p["O3"], abs(self.z8), _side(p["D"], p["O3"], p["E"]))
            found["phi"] = np.angle((d - e) / self.z9)
            found["gamma"] = np.angle((e - p["O3"]) / self.z8)
        return found

    def trace(self, theta: ArrayLike) -> NDArray[np.complex128]:
        """Where the tracing point really is at the crank angles θ: nothing but the closure of the loops enters."""
        crank = np.asarray(theta, dtype=float)
        p = self.points()
        a = p["O1"] + self.z1 * np.exp(1j * crank)
        return a + self.z3 * np.exp(1j * self.rotations(crank)["alpha"])

    def stretched(
        self, theta: ArrayLike, slack: float = 0.0
    ) -> tuple[NDArray[np.complex128], NDArray[np.float64]]:
        """The trace, continued to where the loop A-C-O2 does not close, and how much is missing there.

        Where the loop does not close, C lies on the line through A and O2: a search finds its way back from there.
        With a slack, that part of the lengths is missing already before they are stretched or folded.
        """
        crank, p = np.asarray(theta, dtype=float), self.points()
        a = p["O1"] + self.z1 * np.exp(1j * crank)
        line, first, second = p["O2"] - a, abs(p["C"] - p["A"]), abs(self.z7)
        far = np.abs(line)
        along = (far**2 + first**2 - second**2) / (2 * far * first)
        across = _side(p["A"], p["O2"], p["C"]) * np.sqrt(np.maximum(1 - along**2, 0.0))
        turned = (np.clip(along, -1, 1) + 1j * across) * (line / far) * first / (p["C"] - p["A"])
        missing = np.maximum(far - (1 - slack) * (first + second), abs(first - second) + slack * (first + second) - far)
        return a + self.z3 * turned, np.maximum(missing, 0.0)

    def linkage(self, title: str = "", length_unit: str = "") -> Linkage:
        """As a linkage; B carries the task's path."""
        p = self.points()
        links = {"ground": ("O1", "O2"), "crank": ("O1", "A"), "coupler": ("A", "C", "B"), "rocker": ("O2", "C")}
        if self.z8 != 0:
            links |= {
                "ground": ("O1", "O2", "O3"),
                "rocker": ("O2", "C", "D"),
                "bar": ("D", "E"),
                "output": ("O3", "E"),
            }
        used = {name for members in links.values() for name in members}
        return Linkage(
            points={name: z for name, z in p.items() if name in used},
            links=links,
            bodies={BODY: ("coupler", "B")},
            inputs={"crank": Input("crank")},
            title=title,
            length_unit=length_unit,
        )

    def poses(self, theta: ArrayLike) -> list[dict[str, float]]:
        """Rotations of the links from home."""
        turned = {"crank": np.asarray(theta, dtype=float)}
        names = {"alpha": "coupler", "beta": "rocker", "phi": "bar", "gamma": "output"}
        turned |= {names[key]: values for key, values in self.rotations(theta).items()}
        return [{link: float(values[j]) for link, values in turned.items()} for j in range(np.size(theta))]


def with_second_loop(
    design: WattLinkage, theta: ArrayLike, seed: int = 0, max_link_ratio: float = np.inf
) -> WattLinkage:
    """The same path with a second four-bar O2-D-E-O3 that transmits best over the rocker's swing, of Sobol points.

    The path says nothing about it; see `mechanisms.families.watt2_path.rank_of_equation_3`.  Where some of the
    points keep the ratio of the longest to the shortest link, it is one of these.
    """
    beta = np.unwrap(design.rotations(np.linspace(0, 2 * np.pi, 181))["beta"])
    if not np.all(np.isfinite(beta)):
        beta = np.unwrap(design.rotations(theta)["beta"])
    reach, o2 = abs(design.z7), design.points()["O2"]
    u = sobol_points([(0.3, 0.8), (-np.pi, np.pi), (0.3, 1.5), (-np.pi, np.pi), (0.3, 1.5), (-np.pi, np.pi)],
                     SECOND_LOOPS, seed)  # fmt: skip
    z5, z9, z8 = (reach * u[:, k] * np.exp(1j * u[:, k + 1]) for k in (0, 2, 4))
    d0 = o2 + z5
    e0 = d0 - z9
    o3 = e0 - z8
    d = o2 + z5[:, None] * np.exp(1j * beta)[None, :]
    side = np.sign(np.imag(np.conj(o3 - d0) * (e0 - d0)))
    e = _meet(d, np.abs(z9)[:, None], o3[:, None], np.abs(z8)[:, None], side[:, None])
    least = np.abs(np.sin(np.angle((d - e) * np.conj(e - o3[:, None])))).min(axis=1)
    least = np.where(np.isfinite(least), least, -1.0)
    p = design.points()
    lengths = np.abs([z5, design.z7 - z5, z9, z8, o2 - o3, p["O1"] - o3])
    shortest, longest = (f(lengths, axis=0) for f in (np.min, np.max))
    first = design.first_loop()
    ratio = np.maximum(longest, first.max()) / np.minimum(shortest, first.min())
    best = int(np.argmax(np.where(ratio <= max_link_ratio, least, least - 2)))
    z6 = design.z7 - z5[best]
    return WattLinkage(design.o1, design.z1, design.z3, design.z4, design.z7, z6, complex(z8[best]), complex(z9[best]))


def _side(first: complex, second: complex, meeting: complex) -> float:
    """On which side of the line from first to second their common point lies."""
    return float(np.sign((np.conj(second - first) * (meeting - first)).imag))


def _meet(a: Any, reach_a: Any, b: Any, reach_b: Any, side: Any) -> NDArray[np.complex128]:
    """Where circles about a and b meet, on the given side of the line from a to b; NaN where they do not."""
    line = b - a
    with np.errstate(divide="ignore", invalid="ignore"):
        square = np.abs(line) ** 2
        along = (square + reach_a**2 - reach_b**2) / (2 * square)
        height = np.sqrt(reach_a**2 / square - along**2)
        return np.asarray(a + line * (along + 1j * side * height))
