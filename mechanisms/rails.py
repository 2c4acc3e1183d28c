"""Guides and slots as straight pieces of their links, as long as the motion needs them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.linkage import GROUND, Linkage

if TYPE_CHECKING:
    from mechanisms.designs import Design
    from mechanisms.travel import Travel

__all__ = ["Rail", "design_rails", "rails"]


@dataclass(frozen=True)
class Rail:
    """The piece of a link along which something slides.

    Attributes
    ----------
    link : str
        The link that it is a part of.
    first, last : complex
        Its ends in pose 0.
    anchor : str
        A point that moves with the link; "" for a link that stands still.
    """

    link: str
    first: complex
    last: complex
    anchor: str

    def ends(
        self, linkage: Linkage, places: Mapping[str, Any], rotations: Mapping[str, Any] | None = None
    ) -> tuple[Any, Any]:
        """Both ends, complex or complex arrays, where the points are at `places` and the links have turned."""
        move = _Move.of(linkage, self.link, self.anchor, places, rotations or {})
        return move.to_world(self.first), move.to_world(self.last)

    def foot(self, place: complex) -> complex:
        """The point of the rail nearest to a place, both in pose 0."""
        along = self.last - self.first
        share = ((place - self.first) * along.conjugate()).real / abs(along) ** 2
        return self.first + along * min(1.0, max(0.0, share))


def rails(
    linkage: Linkage, places: Mapping[str, Any], rotations: Mapping[str, Any], margin: float
) -> list[Rail]:
    """The rails of a linkage, sliders first.

    Parameters
    ----------
    linkage : Linkage
    places : mapping of str to (n,) complex array
        Every point in the configurations that the rails have to serve.
    rotations : mapping of str to (n,) float array
        Rotations of the moving links there, radians.
    margin : float
        How far a rail goes on beyond what slides on it.

    Returns
    -------
    list of Rail
        One for each slider and slot.

    Examples
    --------
    The slide of a slider-crank whose pin C goes from 3 to 5:

    >>> from mechanisms.linkage import Slider
    >>> crank = Linkage({"A": 0, "B": 1, "C": 5}, {"ground": "A", "crank": "AB", "rod": "BC", "block": "C"},
    ...                 sliders=[Slider("ground", "block", 1, "C")])
    >>> rail, = rails(crank, {"A": [0, 0], "B": [1, -1], "C": [5, 3]}, {}, 0.5)
    >>> rail.first, rail.last
    ((2.5+0j), (5.5+0j))
    """
    guides: list[tuple[str | complex, str, complex]] = [(s.at, s.link_a, s.direction) for s in linkage.sliders]
    guides += [(slot.point, slot.link, slot.direction) for slot in linkage.slots]
    found = []
    for point, link, direction in guides:
        home = linkage.points[point] if isinstance(point, str) else complex(point)
        members = linkage.links[link]
        # a link without a point of its own can only be drawn where something slides on it
        anchor = "" if link == GROUND else members[0] if members else point if isinstance(point, str) else ""
        travel = np.zeros(1)
        if isinstance(point, str):
            move = _Move.of(linkage, link, anchor, places, rotations)
            travel = ((move.to_link(places[point]) - home) * np.conj(direction)).real
        travel = np.append(travel[np.isfinite(travel)], 0.0)
        first, last = (home + direction * (end + way * margin) for end, way in ((travel.min(), -1), (travel.max(), 1)))
        found.append(Rail(link, complex(first), complex(last), anchor))
    return found


def design_rails(design: Design, margin: float, motion: Travel | None = None) -> list[Rail]:
    """The rails that serve a design at its poses, and through a motion if there is one."""
    linkage = design.linkage
    if linkage is None or not (linkage.sliders or linkage.slots):
        return []
    turned = {k: np.array([pose.get(k, 0.0) for pose in design.poses], dtype=float) for k in linkage.moving_links}
    places = {name: np.broadcast_to(z, len(design.poses)) for name, z in linkage.positions(turned).items()}
    if motion is not None:
        turned = {link: np.append(angles, motion.rotations[link]) for link, angles in turned.items()}
        places = {name: np.append(z, motion.points[name]) for name, z in places.items()}
    return rails(linkage, places, turned, margin)


@dataclass(frozen=True)
class _Move:
    """What takes a link from pose 0 to other configurations: z becomes place + turn·(z − home)."""

    home: complex
    place: NDArray[np.complex128]
    turn: NDArray[np.complex128]

    @classmethod
    def of(
        cls, linkage: Linkage, link: str, anchor: str, places: Mapping[str, Any], rotations: Mapping[str, Any]
    ) -> _Move:
        if not anchor:
            return cls(0j, np.asarray(0j), np.asarray(1 + 0j))
        turn = np.exp(1j * np.asarray(rotations.get(link, 0.0), dtype=float))
        return cls(linkage.points[anchor], np.asarray(places[anchor], dtype=complex), turn)

    def to_world(self, z: complex) -> NDArray[np.complex128]:
        return self.place + self.turn * (z - self.home)

    def to_link(self, z: Any) -> NDArray[np.complex128]:
        return self.home + (np.asarray(z, dtype=complex) - self.place) / self.turn
