"""The motion of a design through its poses, as frames for pictures.

The frames follow the circuit that `mechanisms.motion` has traced and judged, so that a picture cannot show a
motion that the linkage does not have.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from mechanisms.designs import Design

__all__ = ["Travel", "travel"]

#: Places on the circuit from which the frames are interpolated.
FINE = 721


@dataclass(frozen=True)
class Travel:
    """Frames of a motion.

    Attributes
    ----------
    points : dict of str to (n,) complex array
        Position of every point in every frame.
    rotations : dict of str to (n,) float array
        Rotation of every moving link from pose 0, radians.
    input : (n,) float array
        Value of the input: radians or length, evenly spaced on a working travel.
    poses : list of int or None
        The frame nearest to each pose; None for a pose that is not on the way.
    working : bool
        Whether the motion passes all poses in order; if not, it is the whole circuit of pose 0.
    driven : str
        The input; "" when the linkage has none, so that there is nothing between its poses.
    """

    points: Mapping[str, NDArray[np.complex128]]
    rotations: Mapping[str, NDArray[np.float64]]
    input: NDArray[np.float64]
    poses: list[int | None]
    working: bool
    driven: str

    def __len__(self) -> int:
        return len(self.input)


def travel(design: Design, frames: int = 91, driven: str = "") -> Travel:
    """Move a design through its poses.

    Parameters
    ----------
    design : Design
        With a linkage.
    frames : int
        How many.
    driven : str
        The input; by default the one that decided, or any that works.

    Returns
    -------
    Travel
        From the first pose to the last when the input passes them in order, else once round pose 0's circuit.  A
        linkage without an input, which one motor does not drive, is shown in its poses, a frame for each.
    """
    from mechanisms.branches import Branches
    from mechanisms.motion import Placed

    linkage = design.linkage
    if linkage is None:
        raise ValueError(f"{design.id} is no linkage, so that it cannot be moved")
    if not linkage.inputs:
        return _poses_alone(design)
    name = driven or design.input or next(iter(linkage.inputs))
    placed = Placed.of(linkage, design.poses)
    circuit = placed.circuits[0]
    branches = Branches.of(circuit, linkage.inputs[name])
    home = branches.index(placed.places[0])
    on_circuit = [number == 0 for number in placed.circuit_of]
    on_branch = all(on_circuit) and all(branches.holds(home, place) for place in placed.places)
    way = branches.order(placed.places, home) if on_branch else None
    if way is not None and way[0] != way[1]:
        places = np.linspace(way[0], way[1], FINE)
        values = np.array([branches.value(place) for place in places])
        wanted = np.linspace(values[0], values[-1], frames)
        rising = values if values[-1] > values[0] else -values
        places = np.interp(wanted if rising is values else -wanted, rising, places)
        values = wanted
    else:
        start = placed.places[0] if circuit.closed else 0.0
        places = start + np.linspace(0.0, float(circuit.arcs), frames)
        places = places if circuit.closed else np.minimum(places, float(circuit.arcs))
        values = np.array([branches.value(place) for place in places])
    wrapped = places % circuit.arcs if circuit.closed else places
    x, _ = circuit.at(wrapped)
    nearest: list[int | None] = []
    for place, there in zip(placed.places, on_circuit):
        nearest.append(_nearest(wrapped, place, circuit.arcs if circuit.closed else None) if there else None)
    return Travel(
        points=circuit.closure.points_at(x),
        rotations={link: np.asarray(angles) for link, angles in circuit.closure.link_rotations(x).items()},
        input=values,
        poses=nearest,
        working=way is not None,
        driven=name,
    )


def _poses_alone(design: Design) -> Travel:
    assert design.linkage is not None
    count = len(design.poses)
    rotations = {
        link: np.array([pose.get(link, 0.0) for pose in design.poses], dtype=float)
        for link in design.linkage.moving_links
    }
    return Travel(
        points={name: np.broadcast_to(z, count) for name, z in design.linkage.positions(rotations).items()},
        rotations=rotations,
        input=np.arange(count, dtype=float),
        poses=list(range(count)),
        working=True,
        driven="",
    )


def _nearest(places: NDArray[Any], place: float, period: int | None) -> int:
    gaps = np.abs(places - place)
    if period is not None:
        gaps = np.minimum(gaps, np.abs(period - gaps))
    return int(np.argmin(gaps)) if math.isfinite(place) else 0
