"""Assur groups of a driven linkage, and the transmission angle they give.

With its input locked a linkage falls apart into Assur groups: smallest sets of links that are rigid on the
links before them. In a two-link group (dyad) the transmission angle is the angle between the two links. In
general it is the smallest angle, over the links of the group, between the motion of the loops that one
link's turning (or sliding) makes and all those that the other links of the group can make together; at a
dead centre it is zero. For a dyad this is the textbook angle. Lengths of gaps are measured in the space of
joint gaps modulo shifting the links, so that the angle depends neither on the choice of loops nor on names.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations

import numpy as np

from mechanisms.closure import Closure
from mechanisms.linkage import GROUND, Input, Linkage, LinkageError


def assur_groups(linkage: Linkage, driven: Input) -> tuple[tuple[str, ...], ...]:
    """Return the groups of links in the order in which they follow from the input.

    Parameters
    ----------
    linkage : Linkage
        With one degree of freedom.
    driven : Input
        What is locked.

    Returns
    -------
    tuple of tuple of str
        Each moving link once; the first group is the driven link itself when it is joined to the ground.

    Raises
    ------
    LinkageError
        If the count of joints leaves some links loose or holds some too often.

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> assur_groups(four_bar, Input("crank"))
    (('crank',), ('coupler', 'follower'))
    >>> assur_groups(four_bar, Input("coupler"))
    (('crank', 'coupler', 'follower'),)
    """
    owners = tuple(tuple(linkage.links_of(point)) for point in linkage.points)
    pairs = tuple((s.link_a, s.link_b) for s in linkage.sliders)
    slots = tuple((s.link, tuple(linkage.links_of(s.point))) for s in linkage.slots)
    gears = tuple(tuple(g.coefficients) for g in linkage.gears)
    return _groups(linkage.moving_links, owners, pairs, slots, gears, (driven.link, driven.relative_to))


@lru_cache(maxsize=1024)
def _groups(
    moving: tuple[str, ...],
    owners: tuple[tuple[str, ...], ...],
    sliders: tuple[tuple[str, str], ...],
    slots: tuple[tuple[str, tuple[str, ...]], ...],
    gears: tuple[tuple[str, ...], ...],
    driven: tuple[str, str],
) -> tuple[tuple[str, ...], ...]:
    def held(links: set[str]) -> int:
        """Number of constraints among these links."""
        total = sum(2 * max(0, sum(o in links for o in names) - 1) for names in owners)
        total += sum(2 for a, b in sliders if a in links and b in links)
        total += sum(1 for a, names in slots if a in links and any(o in links for o in names))
        total += sum(1 for names in gears if all(o in links for o in names))
        return total + (driven[0] in links and driven[1] in links)

    known, groups = {GROUND}, []
    while len(known) <= len(moving):
        before = held(known)
        free = [link for link in moving if link not in known]
        group = None
        for chosen in (part for size in range(1, len(free) + 1) for part in combinations(free, size)):
            surplus = held(known | set(chosen)) - before - 3 * len(chosen)
            if surplus > 0:
                names = ", ".join(map(repr, chosen))
                raise LinkageError(
                    f"with the input locked, {names} {'is' if len(chosen) == 1 else 'are'} held too often"
                )
            if surplus == 0:
                group = chosen
                break
        if group is None:
            names = ", ".join(map(repr, free))
            raise LinkageError(f"with the input locked, {names} can still move")
        groups.append(group)
        known |= set(group)
    return tuple(groups)


@dataclass(frozen=True)
class _Block:
    """One group's share of the staged equations: loops, unknowns, ties, and the measure of gaps."""

    loops: np.ndarray
    unknowns: np.ndarray
    free: np.ndarray | None  # (unknowns, k): directions that gears and a locked input leave; None for all
    metric: np.ndarray  # (loops, loops): W with |W·gap| the length of a gap


class Transmission:
    """The transmission angle of a linkage for one input, at any configurations.

    Parameters
    ----------
    linkage : Linkage
    driven : Input

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 1j, "D": 3},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> transmission = Transmission(four_bar, Input("crank"))
    >>> round(float(np.degrees(transmission.angle(np.zeros(3)))), 9)
    90.0
    """

    def __init__(self, linkage: Linkage, driven: Input) -> None:
        groups = assur_groups(linkage, driven)
        stages = {GROUND: 0} | {link: i for i, group in enumerate(groups, start=1) for link in group}
        self.groups = groups
        self.closure = Closure.in_stages(linkage, stages)
        self._blocks = _blocks(linkage, driven, self.closure, stages, len(groups))

    def angle(self, x: np.ndarray) -> np.ndarray:
        """Return the transmission angle in [0, π/2] at configurations (…, n), the least over the groups."""
        x = np.asarray(x, dtype=float)
        least = np.full(x.shape[:-1], 1.0)
        jacobian = self.closure.jacobian(x)
        for block in self._blocks:
            rows = np.stack([2 * block.loops, 2 * block.loops + 1], axis=1)
            part = jacobian[..., rows[:, :, None], block.unknowns]  # (…, loops, 2, unknowns)
            if block.free is not None:
                part = part @ block.free
            if len(block.loops) > 1:
                part = np.einsum("ml,...lcf->...mcf", block.metric, part)
            part = part.reshape(*x.shape[:-1], 2 * len(block.loops), part.shape[-1])
            least = np.minimum(least, _least_sine(part))
        return np.arcsin(np.clip(least, 0.0, 1.0))


def _blocks(linkage: Linkage, driven: Input, closure: Closure, stages: Mapping[str, int], count: int) -> list[_Block]:
    """Return the blocks of the groups that have loops (a driven crank alone has none)."""
    turn_stage = [
        min(stages[link] for link in closure.links if closure.class_of[link] == k) for k in range(closure.rotations)
    ]
    slide_stage = [max(stages[a], stages[b]) for a, b in closure.slide_links]
    slide_stage += [max(stages[s.link], stages[linkage.links_of(s.point)[0]]) for s in linkage.slots]
    unknown_stage = np.array(turn_stage + slide_stage, dtype=int)
    gear_stage = [max(stages[link] for link in gear.coefficients) for gear in linkage.gears]
    gradient, _ = closure.gradient(driven)
    input_stage = max(stages[driven.link], stages[driven.relative_to])
    blocks = []
    for level in range(1, count + 1):
        loops = np.flatnonzero(closure.loop_stage == level)
        unknowns = np.flatnonzero(unknown_stage == level)
        if not len(loops):
            continue
        ties = [row for row, stage in zip(closure.gears, gear_stage) if stage == level]
        ties = [np.concatenate([row, np.zeros(closure.size - len(row))])[unknowns] for row in ties]
        ties += [gradient[unknowns]] if input_stage == level else []
        inside = [j for j in range(closure.cycles.shape[1]) if closure.cycles[loops, j].any()]
        cycles = closure.cycles[loops][:, _new(closure, inside, level)]
        metric = np.linalg.inv(np.linalg.cholesky(cycles @ cycles.T))
        blocks.append(_Block(loops, unknowns, _free(ties, len(unknowns)), metric))
    return blocks


def _new(closure: Closure, joints: Sequence[int], level: int) -> list[int]:
    """Joints of a group's loops; those between links of earlier groups are rigid and drop out."""
    return [j for j in joints if closure.joint_stage[j] == level]


def _free(ties: Sequence[np.ndarray], size: int) -> np.ndarray | None:
    """Return a basis of the directions that satisfy the ties, by elimination (so that names do not matter)."""
    if not ties:
        return None
    rows = np.array(ties, dtype=float)
    pivots: list[int] = []
    for i in range(len(rows)):
        p = int(np.argmax(np.abs(rows[i])))
        rows[i] /= rows[i, p]
        for k in range(len(rows)):
            if k != i:
                rows[k] -= rows[k, p] * rows[i]
        pivots.append(p)
    basis = np.delete(np.eye(size), pivots, axis=1)
    others = [u for u in range(size) if u not in pivots]
    for row, p in zip(rows, pivots):
        basis[p] = -row[others]
    return basis


def _least_sine(columns: np.ndarray) -> np.ndarray:
    """Return the least sine of the angle between one column of (…, k, k) and the span of the others."""
    size = np.linalg.norm(columns, axis=-2)
    if columns.shape[-1] == 2:
        cross = columns[..., 0, 0] * columns[..., 1, 1] - columns[..., 1, 0] * columns[..., 0, 1]
        return np.abs(cross) / np.maximum(size[..., 0] * size[..., 1], 1e-300)
    # The sine for column k is 1 / (|column k| · |row k of the inverse|); near singular the inverse
    # overflows to 0.
    _, s, vh = np.linalg.svd(columns / np.maximum(size, 1e-300)[..., None, :])
    rows = np.swapaxes(vh, -1, -2) / np.maximum(s, 1e-300)[..., None, :]
    return 1.0 / np.linalg.norm(rows, axis=-1).max(axis=-1)
