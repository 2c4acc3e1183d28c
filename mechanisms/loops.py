"""From the graph of a linkage to its loop equations: spanning tree, loops, and which links turn together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mechanisms.closure import Closure
from mechanisms.linkage import GROUND, Linkage, LinkageError


def _classes(linkage: Linkage) -> tuple[dict[str, int], int]:
    """Links joined by sliders turn together; return link to class, the ground's class being the last."""
    leader = {link: link for link in linkage.links}

    def find(link: str) -> str:
        while leader[link] != link:
            link = leader[link]
        return link

    for slider in linkage.sliders:
        a, b = find(slider.link_a), find(slider.link_b)
        if a != b:
            leader[b if a == find(GROUND) else a] = a if a == find(GROUND) else b
    index: dict[str, int] = {}
    for link in linkage.links:
        if find(link) != find(GROUND):
            index.setdefault(find(link), len(index))
    index[find(GROUND)] = len(index)
    return {link: index[find(link)] for link in linkage.links}, len(index) - 1


@dataclass(frozen=True)
class _Edge:
    """A joint in the graph: from node a to node b, the place it has on both, its displacement, its weight."""

    a: str
    b: str
    place: complex
    slide: int | None = None
    weight: float = 1.0


def _edges(linkage: Linkage, home: Mapping[str, complex]) -> list[_Edge]:
    """Return the joints; a point of three or more links becomes a node of its own, named ``•point``."""
    edges = []
    for point, place in home.items():
        owners = linkage.links_of(point)
        if len(owners) == 2:
            edges.append(_Edge(owners[0], owners[1], place))
        elif len(owners) > 2:
            edges += [_Edge(owner, "•" + point, place, weight=0.5) for owner in owners]
    for j, slider in enumerate(linkage.sliders):
        edges.append(_Edge(slider.link_a, slider.link_b, 0j, j))
    for j, slot in enumerate(linkage.slots, start=len(linkage.sliders)):
        edges.append(_Edge(slot.link, linkage.links_of(slot.point)[0], home[slot.point], j))
    return edges


def derive(linkage: Linkage, stages: Mapping[str, int] | None = None) -> Closure:
    """Derive the closure equations of a linkage.

    Parameters
    ----------
    linkage : Linkage
    stages : mapping of str to int, optional
        Stage of every link. Links of a lower stage are joined first, so that their loops hold no later link.

    Returns
    -------
    Closure

    Raises
    ------
    LinkageError
        If a gear couples only links that do not turn apart.

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> derive(four_bar).matrix.shape
    (1, 3)
    """
    class_of, rotations = _classes(linkage)
    links = tuple(linkage.links)
    origin = sum(linkage.points.values()) / len(linkage.points)
    # Twice the mean distance from the centre: any length of the linkage's own size makes steps comparable.
    scale = 2 * float(np.mean([abs(z - origin) for z in linkage.points.values()])) or 1.0
    home = {name: (z - origin) / scale for name, z in linkage.points.items()}
    directions = [(class_of[s.link_a], s.direction) for s in linkage.sliders]
    directions += [(class_of[s.link], s.direction) for s in linkage.slots]
    edges = _edges(linkage, home)
    stage = dict(stages or dict.fromkeys(links, 0))
    for point in home:
        stage["•" + point] = min(stage[owner] for owner in linkage.links_of(point))
    slides = rotations + 1

    def gap(edge: _Edge, number: int) -> np.ndarray:
        """Translation of b minus that of a: coefficients of (e^{iq}, 1, s e^{iq}), then the edge's mark."""
        row = np.zeros(slides + len(directions) + len(edges), dtype=complex)
        row[class_of[edge.a]] += edge.place
        if edge.b in class_of:
            row[class_of[edge.b]] -= edge.place
        if edge.slide is not None:
            row[slides + edge.slide] += directions[edge.slide][1]
        row[slides + len(directions) + number] = edge.weight**0.5
        return row

    shift = {GROUND: np.zeros(slides + len(directions) + len(edges), dtype=complex)}
    loops, loop_stage = [], []
    left = list(enumerate(edges))
    for level in sorted(set(stage.values())):
        progress = True
        while progress:
            progress = False
            for number, edge in list(left):
                if max(stage[edge.a], stage[edge.b]) > level:
                    continue
                if edge.a in shift and edge.b in shift:
                    loops.append(shift[edge.a] + gap(edge, number) - shift[edge.b])
                    loop_stage.append(level)
                elif edge.a in shift:
                    shift[edge.b] = shift[edge.a] + gap(edge, number)
                elif edge.b in shift:
                    shift[edge.a] = shift[edge.b] - gap(edge, number)
                else:
                    continue
                left.remove((number, edge))
                progress = True
                break  # begin again: pins come first in the list, so that displacements stay out of the tree
    rows = np.array(loops, dtype=complex).reshape(len(loops), slides + len(directions) + len(edges))
    table = np.array([shift[link] for link in links])
    gears = np.zeros((len(linkage.gears), rotations + 1))
    for row, gear in zip(gears, linkage.gears):
        for link, coefficient in gear.whole_numbers().items():
            row[class_of[link]] += coefficient
        if not row[:-1].any():
            names = ", ".join(gear.coefficients)
            raise LinkageError(f"gear on {names} says nothing: these links do not turn apart")
    lines = slice(slides, slides + len(directions))
    return Closure(
        links=links,
        class_of=class_of,
        matrix=np.ascontiguousarray(rows[:, :rotations]),
        slides=np.ascontiguousarray(rows[:, lines]),
        slide_class=np.array([k for k, _ in directions], dtype=np.int64),
        constant=np.ascontiguousarray(rows[:, rotations]),
        gears=np.ascontiguousarray(gears[:, :-1]),
        place=np.ascontiguousarray(table[:, :rotations]),
        place_slides=np.ascontiguousarray(table[:, lines]),
        place_constant=table[:, rotations] + origin / scale,
        points={name: (links.index(linkage.links_of(name)[0]), z) for name, z in home.items()},
        scale=scale,
        slide_links=tuple((s.link_a, s.link_b) for s in linkage.sliders),
        cycles=rows[:, slides + len(directions) :].real,
        loop_stage=np.array(loop_stage, dtype=np.int64),
        joint_stage=np.array([max(stage[edge.a], stage[edge.b]) for edge in edges], dtype=np.int64),
    )
