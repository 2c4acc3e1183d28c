"""What a task of poses gives and what it leaves open: regions of pivots, numbers on the map, pools of dyads."""

from __future__ import annotations

from typing import Any

import numpy as np

from mechanisms.families.circle_points import CircleCurve
from mechanisms.families.dyad_pools import DyadPool, curve_pool, sampled_pool
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.regions import Region
from mechanisms.families.translations import Regions
from mechanisms.task import Task, TaskError

__all__ = ["SAMPLES", "STATIONS", "check_number", "pools", "region_of", "regions_of"]

#: Points of the four-pose curve that are paired, and dyads sampled for each side with fewer poses. All their pairs
#: are judged in about a second.
STATIONS, SAMPLES = 240, 256


def region_of(task: Task, pivot: str) -> Region:
    """What a task asks of the pivot O1, A1, O2 or A2."""
    sides: list[Any] = []
    for axis in "xy":
        value = task.free.get(f"{pivot}_{axis}")
        sides.append(None if value is None else value if isinstance(value, tuple) else (value, value))
    return Region(*sides)


def regions_of(task: Task) -> Regions:
    """For either dyad what is asked of its fixed and of its moving pivot."""
    first, second = ((region_of(task, f"O{number}"), region_of(task, f"A{number}")) for number in (1, 2))
    return first, second


def check_number(task: Task, poses: Poses, number: int) -> None:
    """A dyad named by its number on the map needs four poses, that number on their curve, and nothing else.

    Raises
    ------
    TaskError
        One sentence: what is wrong, where, what to do.
    """
    place = f"{task.where}: free.dyad{number}"
    if len(poses) != 4:
        raise TaskError(f"{place}: {len(poses)} poses have no map; leave it out, or give four poses")
    if region_of(task, f"O{number}").given or region_of(task, f"A{number}").given:
        raise TaskError(f"{place}: a number determines both pivots of the dyad; leave out O{number} and A{number}")
    try:
        CircleCurve(poses).at_station(task.free[f"dyad{number}"])
    except ValueError as error:
        raise TaskError(f"{place}: {error}") from None


def pools(task: Task, poses: Poses, count: int) -> tuple[DyadPool, DyadPool]:
    """The dyads that two to four poses leave for either side; one pool twice, if nothing is given.

    Parameters
    ----------
    task : Task
        For what is given.
    poses : Poses
        Its poses, or poses near them.
    count : int
        Points of the curve of four poses, or samples for either side.

    Raises
    ------
    TaskError
        When four poses are so special that every point of the body is a circle point.
    """
    regions = regions_of(task)
    if len(poses) == 4:
        try:
            curve = CircleCurve(poses)
        except ValueError as error:
            raise TaskError(f"{task.where}: poses: {error}") from None
        numbers = [task.free.get(f"dyad{k}") for k in (1, 2)]
        found = [_of_curve(curve, count, number, *pair) for number, pair in zip(numbers, regions)]
        if any(number is not None for number in numbers):
            return found[0], found[1]
    else:
        found = [sampled_pool(poses, count, *pair, seed=task.seed + k) for k, pair in enumerate(regions)]
    if not any(region.given for pair in regions for region in pair):
        return found[0], found[0]
    return found[0], found[1]


def _of_curve(curve: CircleCurve, count: int, number: float | None, fixed: Region, moving: Region) -> DyadPool:
    if number is not None:
        return DyadPool.of(*curve.at_station(number), dyad=np.array([number]))
    for region, which in ((moving, "moving"), (fixed, "fixed")):
        if (place := region.point) is not None and curve.circuits:
            circuit, phi, distance = curve.nearest(place, which)
            g, z = curve.dyads(circuit, phi)
            return DyadPool.of(g, z, distance_from_pick=np.array([distance]))
    return curve_pool(curve, count, fixed, moving)
