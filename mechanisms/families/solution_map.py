"""The map of four-bars through four poses: every pair of points of the curve, shaded by what becomes of it.

Across: the dyad that is driven.  Up: the dyad that follows.  Both are places on the circle-point curve, numbered
from 0 to 100 once round a circuit.  White are the pairs that cannot be used, in greys by their defect; colour
is the least transmission angle of the others.  The picture of the curves beside the map bears the same numbers, so
that a place in the map is a linkage in the plane, and `SolutionMap.pick` makes a design of it.

The idea of the map is that of LINCAGES (A. G. Erdman and J. E. Gustafson, LINCAGES: Linkage INteractive Computer
Analysis and Graphically Enhanced Synthesis package, ASME 77-DTC-5, 1977).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate
from mechanisms.families.circle_points import CircleCurve
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.dyad_pools import DyadPool
from mechanisms.families.motion_dyads import MotionDyad, Poses
from mechanisms.families.pair_search import judge_pairs
from mechanisms.task import Task, TaskError

__all__ = ["CLASSES", "SolutionMap"]

#: What becomes of a pair, the worst first: the codes in `SolutionMap.verdict`.
CLASSES = ("circuit defect", "branch defect", "order defect", "links too unequal", "usable")
CIRCUIT, BRANCH, ORDER, UNEQUAL, USABLE = range(5)
#: Points of each map axis, and the link ratio beyond which a pair is not usable.
STATIONS, LINK_RATIO = 240, 10.0
#: Pivots further than this many sizes from the middle of the poses are left out of the picture of the curves.
WINDOW = 2.0
#: Steps between numbers on the curves.
LABELS = 10


@dataclass(frozen=True, eq=False)
class SolutionMap:
    """Verdicts on all pairs of points of the four-pose curve.

    Attributes
    ----------
    poses : Poses
    curve : CircleCurve
    stations : (n,) float array
        Place of each dyad: 100·(circuit) + percentage of the way round it.
    fixed, moving : (n,) complex arrays
        Its pivots in pose 0.
    verdict : (n, n) int array
        Index into `CLASSES`; entry (i, j) is driven at dyad j and followed by dyad i, as drawn.
    transmission : (n, n) float array
        Least transmission angle, degrees; zero where the pair has a defect.
    turns : (n, n) bool array
        Whether the driven link can turn fully.
    link_ratio : (n, n) float array

    Examples
    --------
    >>> poses = Poses.of([(0, 0, 0), (30, 40, 20), (80, 55, 55), (125, 35, 90)])
    >>> found = SolutionMap.of(poses, 60)
    >>> found.share() > 0.1
    True
    """

    poses: Poses
    curve: CircleCurve
    stations: NDArray[np.float64]
    fixed: NDArray[np.complex128]
    moving: NDArray[np.complex128]
    verdict: NDArray[np.int64]
    transmission: NDArray[np.float64]
    turns: NDArray[np.bool_]
    link_ratio: NDArray[np.float64]

    @classmethod
    def of(cls, poses: Poses | Task, count: int = STATIONS, max_link_ratio: float = LINK_RATIO) -> SolutionMap:
        """Judge all pairs of `count` points of the curve.

        Raises
        ------
        TaskError
            Unless there are four poses with real circle points.
        """
        if isinstance(poses, Task):
            max_link_ratio = poses.constraints.get("max_link_ratio", max_link_ratio)
            poses = Poses.of(poses.poses[BODY])
        if len(poses) != 4:
            raise TaskError(f"{len(poses)} poses given; the map belongs to four, which leave a curve of dyads")
        try:
            curve = CircleCurve(poses)
        except ValueError as error:
            raise TaskError(f"the four poses have no map: {error}; everylinkage solve says what there is") from None
        parts = []
        for number, circuit in enumerate(curve.circuits):
            share = count // len(curve.circuits)
            fixed, moving = curve.dyads(circuit, circuit.stations(share))
            parts.append((fixed, moving, 100 * (number + np.arange(share) / share)))
        if not parts:
            raise TaskError("the four poses have no real circle points, so that no dyad carries the body")
        fixed, moving, stations = (np.concatenate(column) for column in zip(*parts))
        far = poses.points[0] + 1e6 * poses.size
        fixed, moving = (np.where(np.isfinite(z), z, far) for z in (fixed, moving))
        pool = DyadPool.of(fixed, moving)
        table = judge_pairs(poses, pool, pool)
        driven = table.driven_second  # entry (i, j): dyad j is driven
        steps = sum(np.asarray(driven[key], int) for key in ("same_circuit", "same_branch", "in_order"))
        verdict = np.where(steps == 3, np.where(table.link_ratio > max_link_ratio, UNEQUAL, USABLE), steps)
        return cls(
            poses, curve, stations, fixed, moving, verdict,
            np.where(steps == 3, driven["min_transmission_deg"], 0.0), driven["full_rotation"], table.link_ratio,
        )  # fmt: skip

    def share(self) -> float:
        """The share of the pairs that can be used."""
        return float(np.mean(self.verdict == USABLE))

    def best(self, reach: float = WINDOW) -> tuple[float, float]:
        """Driven and following station of the usable pair with the largest transmission angle.

        Pairs with a pivot further than `reach` sizes from the middle of the poses only count for want of others.
        """
        far = np.zeros(len(self.stations), dtype=bool)
        for places in (self.fixed, self.moving):
            way = places - self.poses.points.mean()
            far |= np.maximum(np.abs(way.real), np.abs(way.imag)) > reach * self.poses.size
        angle = np.where(self.verdict == USABLE, self.transmission, -1000.0)
        angle = angle - 100.0 * (far[:, None] | far)
        row, column = np.unravel_index(int(angle.argmax()), angle.shape)
        return float(self.stations[column]), float(self.stations[row])

    def dyad(self, station: float) -> MotionDyad:
        """The dyad at a station, which may lie between those judged.

        Raises
        ------
        TaskError
            When there is no such station.
        """
        try:
            return MotionDyad("RR", *self.curve.at_station(station))
        except ValueError as error:
            raise TaskError(str(error)) from None

    def station_of(self, moving: complex) -> float:
        """The station of the circle point nearest to a place, for instance of Ball's point."""
        circuit, phi, _ = self.curve.nearest(moving)
        return self.curve.station_of(circuit, phi)

    def pick(self, driven: float, following: float) -> Candidate:
        """The linkage of two stations, to be judged like any other."""
        return pair_candidate(self.poses, self.dyad(driven), self.dyad(following))

    def plot(self, path: str | Path | None = None, pick: tuple[float, float] | None = None, figure: Any = None) -> Any:
        """Draw the curves and the map side by side; see `mechanisms.families.solution_map_plot.draw_map`."""
        from mechanisms.families.solution_map_plot import draw_map

        return draw_map(self, path, pick, figure)
