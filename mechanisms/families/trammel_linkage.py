"""From a trammel and its drive to a `Linkage`: slotted disk, two blocks, coupler, and what leads the coupler's point A.

Links as the paper numbers them: 0 ground, 1 the slotted disk, 2 and 3 the blocks that slide in it, 4 the coupler that
carries the body.  The original linkage guides A by a block on a vertical line (5), the modified one by a four-bar:
5 its coupler RSA, 6 the crank MR, 7 the rocker NS.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.families.trammel import Trammel
from mechanisms.linkage import Input, Linkage, Slider

__all__ = [
    "CurveFourBar",
    "guided_linkage",
    "guided_poses",
    "modified_linkage",
    "modified_poses",
    "trammel_linkage",
    "trammel_poses",
]

#: Links that turn with the disk.
_WITH_DISK = ("disk", "block-B", "block-C")


@dataclass(frozen=True)
class CurveFourBar:
    """A four-bar that leads A through its places, by the paper's parameters.

    Parameters
    ----------
    M, N : complex
        Fixed pivots, in the frame in which the places of A are given.
    e, f, g : float
        Coupler RSA: in its own frame A is the origin, R = (−e, −g), S = (f, −g).
    turns : (places,) array
        Absolute rotation η of that frame in each place, radians.
    places : (places,) complex array
        A.
    """

    M: complex
    N: complex
    e: float
    f: float
    g: float
    turns: NDArray[np.float64]
    places: NDArray[np.complex128]

    @property
    def R(self) -> NDArray[np.complex128]:
        """The crank's pin in each place."""
        return self.places + complex(-self.e, -self.g) * np.exp(1j * self.turns)

    @property
    def S(self) -> NDArray[np.complex128]:
        """The rocker's pin in each place."""
        return self.places + complex(self.f, -self.g) * np.exp(1j * self.turns)

    @property
    def L_MR(self) -> float:
        """Length of the crank."""
        return float(abs(self.R[0] - self.M))

    @property
    def L_NS(self) -> float:
        """Length of the rocker."""
        return float(abs(self.S[0] - self.N))

    def rotations(self) -> NDArray[np.float64]:
        """Rotations of crank, coupler and rocker from the first place, (places, 3), radians in (−π, π]."""
        crank = np.angle((self.R - self.M) / (self.R[0] - self.M))
        rocker = np.angle((self.S - self.N) / (self.S[0] - self.N))
        coupler = np.angle(np.exp(1j * (self.turns - self.turns[0])))
        return np.stack([crank, coupler, rocker], axis=1)

    def parameters(self) -> dict[str, float]:
        """By the paper's names."""
        return {
            "x_M": self.M.real,
            "y_M": self.M.imag,
            "x_N": self.N.real,
            "y_N": self.N.imag,
            "L_MR": self.L_MR,
            "L_NS": self.L_NS,
            "e": self.e,
            "f": self.f,
            "g": self.g,
        }


def trammel_linkage(trammel: Trammel, origin: complex = 0j, title: str = "", length_unit: str = "") -> Linkage:
    """The rotatory trammel alone, which has two degrees of freedom.

    Parameters
    ----------
    trammel : Trammel
        Measured from `origin`.
    origin : complex
        P in pose 0, in the world.

    Examples
    --------
    >>> trammel_linkage(Trammel(2 + 0j, -1j, 1 - 2j))
    Linkage(5 links, 4 points, 3 revolute joints, 2 sliders, 2 degrees of freedom)
    """
    points, links, sliders = _trammel_parts(trammel, origin)
    return Linkage(points, links, sliders, bodies={"body": ("coupler", "P")}, title=title, length_unit=length_unit)


def trammel_poses(disk: ArrayLike, turns: ArrayLike) -> list[dict[str, float]]:
    """Configurations of `trammel_linkage`: rotations of disk and coupler from pose 0."""
    return [
        {**dict.fromkeys(_WITH_DISK, float(theta)), "coupler": float(phi)}
        for theta, phi in zip(np.asarray(disk), np.asarray(turns))
    ]


def guided_linkage(
    trammel: Trammel, a_point: complex, origin: complex = 0j, title: str = "", length_unit: str = ""
) -> Linkage:
    """The original Wanzer linkage: the coupler's point A runs on a vertical line.

    Examples
    --------
    >>> guided_linkage(Trammel(2 + 0j, -1j, 1 - 2j), -1 - 1j)
    Linkage(6 links, 5 points, 4 revolute joints, 3 sliders, 1 degree of freedom)
    """
    points, links, sliders = _trammel_parts(trammel, origin)
    points["A"] = origin + a_point
    links["coupler"] = (*links["coupler"], "A")
    links["guide"] = ("A",)
    sliders.append(Slider("ground", "guide", 1j, "A"))
    return Linkage(
        points,
        links,
        sliders,
        bodies={"body": ("coupler", "P")},
        inputs={"disk": Input("disk"), "guide": Input("guide", translation=True)},
        title=title,
        length_unit=length_unit,
    )


def guided_poses(disk: ArrayLike, turns: ArrayLike) -> list[dict[str, float]]:
    """Configurations of `guided_linkage`."""
    return [{**pose, "guide": 0.0} for pose in trammel_poses(disk, turns)]


def modified_linkage(
    trammel: Trammel, four_bar: CurveFourBar, origin: complex = 0j, title: str = "", length_unit: str = ""
) -> Linkage:
    """The modified Wanzer linkage of eight links, driven by a crank of the four-bar.

    Parameters
    ----------
    trammel : Trammel
    four_bar : CurveFourBar
        Both measured from `origin`; the first of its places is A in pose 0.
    """
    points, links, sliders = _trammel_parts(trammel, origin)
    points |= {
        "A": origin + complex(four_bar.places[0]),
        "M": origin + four_bar.M,
        "N": origin + four_bar.N,
        "R": origin + complex(four_bar.R[0]),
        "S": origin + complex(four_bar.S[0]),
    }
    links["ground"] = ("Q", "M", "N")
    links["coupler"] = (*links["coupler"], "A")
    links |= {"carrier": ("R", "S", "A"), "crank": ("M", "R"), "rocker": ("N", "S")}
    return Linkage(
        points,
        links,
        sliders,
        bodies={"body": ("coupler", "P")},
        inputs={name: Input(name) for name in ("crank", "rocker", "disk")},
        title=title,
        length_unit=length_unit,
    )


def modified_poses(disk: ArrayLike, turns: ArrayLike, four_bar: CurveFourBar) -> list[dict[str, float]]:
    """Configurations of `modified_linkage`."""
    names = ("crank", "carrier", "rocker")
    return [
        {**pose, **dict(zip(names, map(float, angles)))}
        for pose, angles in zip(trammel_poses(disk, turns), four_bar.rotations())
    ]


def _trammel_parts(
    trammel: Trammel, origin: complex
) -> tuple[dict[str, complex], dict[str, tuple[str, ...]], list[Slider]]:
    points = {
        "Q": origin + trammel.Q,
        "B": origin + trammel.B,
        "C": origin + trammel.C,
        "P": origin,
    }
    links: dict[str, tuple[str, ...]] = {
        "ground": ("Q",),
        "disk": ("Q",),
        "block-B": ("B",),
        "block-C": ("C",),
        "coupler": ("B", "C", "P"),
    }
    sliders = [Slider("disk", "block-B", trammel.u, "B"), Slider("disk", "block-C", 1j * trammel.u, "C")]
    return points, links, sliders
