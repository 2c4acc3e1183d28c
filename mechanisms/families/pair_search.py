"""The best pairs out of two pools of dyads, judged by closed formulas, all of them.

Pairs of two sliders are chosen apart (`mechanisms.families.two_sliders`): their links have no lengths to compare, so
that they would win every search for a compact design.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Candidate
from mechanisms.families.dyad_pairs import both_sides, driver_first, four_bar_verdicts, pair_candidate
from mechanisms.families.dyad_pools import FAR, DyadPool
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.two_sliders import slider_pairs

__all__ = ["PairTable", "judge_pairs", "search_candidates"]

#: Pairs judged at once: some tens of megabytes.
CHUNK = 50_000
#: Designs kept of each aim, by the kind of the dyad that is not RR; and of all when none is free of defects.
KEEP, KEEP_DEFECTIVE = {"RR": 3, "PR": 1, "RP": 1}, 3
#: Pivots this many sizes apart are only kept for want of others.
LARGE = 5.0
#: Designs whose pivots are all nearer than this, in sizes of the task, are one choice.
SAME_CHOICE = 0.15
#: Longest link over the shortest, beyond which a design is only kept for want of others.
LINK_RATIO = 10.0
#: Transmission angle, in degrees, that a compact design must have, or this share of the best one if that is less.
USEFUL, SHARE = 30.0, 0.8


@dataclass(frozen=True, eq=False)
class PairTable:
    """Verdicts on every pair of two pools: entry (i, j) is the first pool's dyad i with the second's j.

    Attributes
    ----------
    driven_first, driven_second : mapping of str to (n, m) array
        Verdicts when the first, or the second, dyad is driven: ``same_circuit``, ``same_branch``, ``in_order``,
        ``full_rotation``, ``min_transmission_deg``.
    link_ratio : (n, m) float array
        Longest link over the shortest, sliders apart; infinite where the two share a pivot.
    """

    driven_first: Mapping[str, NDArray[Any]]
    driven_second: Mapping[str, NDArray[Any]]
    link_ratio: NDArray[np.float64]


def judge_pairs(poses: Poses, first: DyadPool, second: DyadPool) -> PairTable:
    """Judge every pair of dyads for both driving sides."""
    shape = (len(first), len(second))
    index = np.indices(shape).reshape(2, -1)
    parts: list[tuple[dict[str, Any], ...]] = []
    ratios = []
    for begin in range(0, index.shape[1], CHUNK):
        i, j = index[:, begin : begin + CHUNK]
        fixed, moving = (first.fixed[i], second.fixed[j]), (first.moving[i], second.moving[j])
        ratio = _link_ratio(fixed, moving, (first.kinds[i], second.kinds[j]), poses.size)
        # a pair that shares a pivot is no four-bar: any other lengths keep the formulas quiet (of the task's
        # size, since 1 added to a large number may be lost to rounding)
        apart = np.isfinite(ratio)
        fixed, moving = ((a, np.where(apart, b, a + (1 + 1j) * poses.size)) for a, b in (fixed, moving))
        parts.append(four_bar_verdicts(poses, fixed, moving))
        ratios.append(ratio)
    sides: list[dict[str, NDArray[Any]]] = []
    for side in range(2):
        keys = parts[0][side] if parts else ()
        table = {key: np.concatenate([part[side][key] for part in parts]).reshape(shape) for key in keys}
        if keys:
            angle = table["min_transmission_deg"]
            table["min_transmission_deg"] = _in_blocks(poses, (first, second), side, angle)
        sides.append(table)
    ratio = np.concatenate(ratios).reshape(shape) if ratios else np.zeros(shape)
    return PairTable(sides[0], sides[1], ratio)


def _in_blocks(
    poses: Poses, pools: tuple[DyadPool, DyadPool], side: int, angle: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Transmission angles where a crank drives a body that slides in a block.

    The joints of the follower are the block's pivot O and a slide; its angle μ is that between the line A–O from
    the crank's pin and the normal of the slide, cos μ = h/|A − O| with h the constant distance of O from the line
    through A along the slide.  The far pivot of the pool gives the angle s/R instead, R its distance and
    s² = |A − O|² − h².
    """
    crank, block = pools[side], pools[1 - side]
    shift = crank.moving[:, None] - block.fixed
    with np.errstate(invalid="ignore"):
        h = np.abs((shift * np.conj(block.lines)).imag)
        far = angle if side == 0 else angle.T
        s = FAR * poses.size * np.sin(np.radians(far))
        better = np.degrees(np.arctan2(s, h))
        slides = (crank.kinds == "RR")[:, None] & (block.kinds == "RP")
        result = np.where(slides & (far > 0), better, far)
    return result if side == 0 else result.T


def _link_ratio(fixed: Any, moving: Any, kinds: Any, size: float) -> NDArray[np.float64]:
    ground, coupler = np.abs(fixed[0] - fixed[1]), np.abs(moving[0] - moving[1])
    links = [np.abs(g - z) for g, z in zip(fixed, moving)]
    # a distance to a pivot at infinity is no length of a link
    ground = np.where((kinds[0] == "PR") | (kinds[1] == "PR"), np.nan, ground)
    coupler = np.where((kinds[0] == "RP") | (kinds[1] == "RP"), np.nan, coupler)
    links = [np.where(kind == "RR", length, np.nan) for kind, length in zip(kinds, links)]
    lengths = np.stack([ground, coupler, *links])
    missing = np.isnan(lengths)
    longest = np.where(missing, 0.0, lengths).max(axis=0)
    shortest = np.where(missing, np.inf, lengths).min(axis=0)
    # a pivot shared in vain by two links that are not a pair of lengths, as two sliders on one pin
    shared = (np.abs(moving[0] - moving[1]) < 1e-9 * size) | (np.abs(fixed[0] - fixed[1]) < 1e-9 * size)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = longest / shortest
    return np.where(shared | (shortest < 1e-9 * size), np.inf, ratio)


def search_candidates(
    poses: Poses,
    first: DyadPool,
    second: DyadPool,
    constraints: Mapping[str, Any],
    title: str = "",
    length_unit: str = "",
) -> Iterator[Candidate]:
    """The pairs worth a designer's look: by transmission angle and by compactness, each choice once.

    Parameters
    ----------
    poses : Poses
    first, second : DyadPool
        They may be one pool.
    constraints : mapping
        The task's; those on pivots, link ratio and transmission angle direct the search, all are tested later.
    """
    for number, pool in enumerate((first, second), start=1):
        if not len(pool):
            words = f"no dyad {number} has its pivots where they are asked to be"
            yield Candidate(None, reasons=("degenerate",), note=words)
            return
    table = judge_pairs(poses, first, second)
    best = _driven(table, first, second)
    possible = np.isfinite(table.link_ratio)
    possible &= (first.kinds == "RR")[:, None] | (second.kinds == "RR")  # two sliders: see the module
    if first is second:
        possible &= np.triu(np.ones_like(possible), 1).astype(bool)
    possible &= _pivots_inside(first, constraints)[:, None] & _pivots_inside(second, constraints)
    good = possible & best["in_order"]
    if constraints.get("full_rotation"):
        good &= best["full_rotation"]
    share = float(good.sum() / max(1, possible.sum()))
    angle, ratio = np.nan_to_num(best["min_transmission_deg"]), table.link_ratio
    extent = _extent(first, second)
    limited = good & (ratio <= constraints.get("max_link_ratio", LINK_RATIO))
    limited = limited if limited.any() else good
    near = limited & (extent <= LARGE * poses.size)
    chosen = near if near.any() else limited
    floor = min(USEFUL, SHARE * float(np.where(chosen, angle, 0.0).max(initial=0.0)))
    useful = chosen & (angle >= constraints.get("min_transmission_deg", floor))
    useful = useful if useful.any() else chosen
    orders: list[tuple[str, NDArray[Any], int]] = []
    for kind, count in KEEP.items():
        own = _with(first, second, kind)
        orders.append(("best in transmission angle", np.where(chosen & own, angle, -np.inf), count))
        orders.append(("most compact", np.where(useful & own, -extent, -np.inf), count))
    if not good.any():
        steps = sum(best[key].astype(float) for key in ("same_circuit", "same_branch", "in_order"))
        words = "no pair of these dyads is free of defects"
        orders = [(words, np.where(possible, 100 * steps - np.minimum(ratio, 99.0), -np.inf), KEEP_DEFECTIVE)]
    taken: list[NDArray[np.complex128]] = []
    for words, value, count in orders:
        for i, j in _picks(first, second, value, taken, len(taken) + count, SAME_CHOICE * poses.size):
            pair = (first, i), (second, j)
            dyads = [pool.dyad(k) for pool, k in pair]
            if driver_first(poses, *dyads)[0] is dyads[1]:  # so that the marks bear the numbers of the pivots
                pair, dyads = pair[::-1], dyads[::-1]
            marks = {
                f"{name}{number}": float(values[k])
                for number, (pool, k) in enumerate(pair, start=1)
                for name, values in pool.marks.items()
                if np.isfinite(values[k])
            }
            extra = {**marks, "defect_free_share": share, "pairs": int(possible.sum())}
            yield pair_candidate(poses, dyads[0], dyads[1], title, length_unit, extra, words)
    sliders = [[pool.dyad(int(k)) for k in np.flatnonzero(pool.kinds != "RR")] for pool in (first, second)]
    one, other = (sliders[0], sliders[0]) if first is second else sliders
    yield from slider_pairs(poses, one, other, constraints, title, length_unit)


def _with(first: DyadPool, second: DyadPool, kind: str) -> NDArray[np.bool_]:
    """The pairs of an RR dyad with one of a kind, (n, m)."""
    one, other = first.kinds[:, None], second.kinds
    return ((one == "RR") & (other == kind)) | ((one == kind) & (other == "RR"))


def _extent(first: DyadPool, second: DyadPool) -> NDArray[np.float64]:
    """Largest distance between two pivots in pose 0, infinite ones apart: (n, m)."""
    places = []
    for pool, shape in ((first, (-1, 1)), (second, (1, -1))):
        places.append(np.where(pool.kinds == "PR", pool.moving, pool.fixed).reshape(shape))
        places.append(np.where(pool.kinds == "RP", pool.fixed, pool.moving).reshape(shape))
    extent = np.zeros((len(first), len(second)))
    for a, b in itertools.combinations(places, 2):
        extent = np.maximum(extent, np.abs(a - b))
    return extent


def _driven(table: PairTable, first: DyadPool, second: DyadPool) -> dict[str, NDArray[Any]]:
    """The verdicts that count: for the better side of a four-bar, for the crank of a slider-crank."""
    sides = (table.driven_first, table.driven_second)
    best = both_sides(sides)
    slider_first, slider_second = (first.kinds != "RR")[:, None], second.kinds != "RR"
    for key in sides[0]:
        only_second = np.where(slider_first & ~slider_second, sides[1][key], best[key])
        best[key] = np.where(slider_second & ~slider_first, sides[0][key], only_second)
    return best


def _picks(
    first: DyadPool,
    second: DyadPool,
    value: NDArray[np.float64],
    taken: list[NDArray[np.complex128]],
    until: int,
    near: float,
) -> Iterator[tuple[int, int]]:
    """Pairs by falling value that are not near one taken before; `taken` grows up to `until`."""
    for flat in np.argsort(-value, axis=None, kind="stable"):
        i, j = (int(k) for k in np.unravel_index(flat, value.shape))
        if len(taken) >= until or not np.isfinite(value[i, j]):
            return
        pivots = np.array([first.fixed[i], first.moving[i], second.fixed[j], second.moving[j]])
        if any(np.abs(pivots - other).max() < near for other in taken):
            continue
        if any(np.abs(pivots[[2, 3, 0, 1]] - other).max() < near for other in taken):
            continue
        taken.append(pivots)
        yield i, j


def _pivots_inside(pool: DyadPool, constraints: Mapping[str, Any]) -> NDArray[np.bool_]:
    box = constraints.get("pivots_in")
    keep = np.ones(len(pool), dtype=bool)
    if box:
        for axis, values in (("x", pool.fixed.real), ("y", pool.fixed.imag)):
            if axis in box:
                keep &= ((values >= box[axis][0]) & (values <= box[axis][1])) | (pool.kinds == "PR")
    return keep
