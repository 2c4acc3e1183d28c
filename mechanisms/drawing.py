"""The strokes of a picture: links, pivots, carried bodies, names, and the page they stand on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.linkage import GROUND

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechanisms.linkage import Linkage
    from mechanisms.rails import Rail
    from mechanisms.task import Task

__all__ = [
    "Box",
    "bodies",
    "fit",
    "ground",
    "link_colours",
    "links",
    "names",
    "page",
    "paths",
    "round_order",
    "slides",
    "spaced",
]

#: Colours that stay apart for colour-blind eyes (Okabe and Ito, 2008), black left for lines.
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#B8A800")
INK, PAPER, FAINT = "#222222", "#ffffff", "#666666"
#: The longer side of a picture in inches.
SIDE = 6.6
#: Sizes as parts of the picture: ground pivots, body frames, the distance of a name from its joint.
PIVOT, BODY, NAME = 0.020, 0.055, 0.034
#: Numbers of poses nearer to each other than this part of the picture would run into one another.
APART = 0.035
#: More frames and marks of poses than this hide each other: frames are left out, marks are smaller.
FEW = 50

#: left, right, bottom, top
Box = tuple[float, float, float, float]


def link_colours(linkage: Linkage) -> dict[str, str]:
    """A colour for every moving link."""
    return {link: COLOURS[n % len(COLOURS)] for n, link in enumerate(linkage.moving_links)}


def fit(points: Iterable[Any]) -> Box:
    """The box that holds numbers and arrays of the plane, with a margin, no thinner than a third of its length.

    >>> fit([0, 10 + 10j])
    (-0.8, 10.8, -0.8, 10.8)
    """
    every = np.concatenate([np.ravel(np.asarray(part, dtype=complex)) for part in points])
    left, right = float(every.real.min()), float(every.real.max())
    bottom, top = float(every.imag.min()), float(every.imag.max())
    size = max(right - left, top - bottom) or 1.0
    wide, high = (max(0.0, size / 3 - extent) / 2 + 0.08 * size for extent in (right - left, top - bottom))
    return left - wide, right + wide, bottom - high, top + high


def page(box: Box, unit: str = "") -> Axes:
    """Axes of equal scale on a figure of their own that has the proportions of the box."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    mpl.rcParams["svg.hashsalt"] = "everylinkage"  # ids in SVG files depend on nothing but the drawing
    wide, high = box[1] - box[0], box[3] - box[2]
    size = SIDE / max(wide, high)
    left, right, bottom, top = 0.55, 0.15, 0.55, 0.55  # inches for ticks, unit and caption
    total = (wide * size + left + right, high * size + bottom + top)
    figure = Figure(figsize=total, facecolor=PAPER)
    FigureCanvasAgg(figure)
    sides = (left / total[0], bottom / total[1], wide * size / total[0], high * size / total[1])
    ax: Axes = figure.add_axes(sides)
    prepare(ax, box, unit)
    return ax


def prepare(ax: Axes, box: Box, unit: str = "") -> None:
    """Set the limits and a quiet grid."""
    ax.set_aspect("equal")
    ax.set_xlim(box[0], box[1])
    ax.set_ylim(box[2], box[3])
    ax.grid(True, color="#eeeeee", linewidth=0.8)
    ax.set_axisbelow(True)
    ax.tick_params(labelsize=8, colors=FAINT, length=0)
    for spine in ax.spines.values():
        spine.set_color("#dddddd")
    if unit:
        ax.set_xlabel(unit, fontsize=8, color=FAINT, parse_math=False)


def paths(ax: Axes, linkage: Linkage, points: Mapping[str, Any], strength: float) -> None:
    """The paths of the carried bodies, dashed."""
    colours = link_colours(linkage)
    for link, point in linkage.bodies.values():
        style: Any = {"linewidth": 1.2, "linestyle": (0, (4, 2)), "alpha": strength, "zorder": 3}
        ax.plot(points[point].real, points[point].imag, color=colours.get(link, INK), **style)


def slides(
    ax: Axes,
    linkage: Linkage,
    rails: Sequence[Rail],
    places: Mapping[str, complex],
    rotations: Mapping[str, float],
) -> list[Any]:
    """Guides and slots over their whole length, with what joins them to the pivots of a moving link."""
    colours = link_colours(linkage)
    joints = {p for _, _, p in linkage.revolute_joints()}
    drawn: list[Any] = []
    for rail in rails:
        x, y = _xy([complex(end) for end in rail.ends(linkage, places, rotations)])
        drawn += ax.plot(x, y, color=INK, linewidth=6, alpha=0.25, solid_capstyle="round", zorder=4)
        if rail.link == GROUND:
            continue
        for name in joints.intersection(linkage.links[rail.link]):
            foot, _ = replace(rail, first=rail.foot(linkage.points[name])).ends(linkage, places, rotations)
            x, y = _xy([complex(places[name]), complex(foot)])
            drawn += ax.plot(x, y, color=colours[rail.link], linewidth=2.2, zorder=4)
    return drawn


def links(
    ax: Axes,
    linkage: Linkage,
    places: Mapping[str, complex],
    strength: float = 1.0,
) -> list[Any]:
    """The moving links with their pins; without these, behind the others, when drawn faintly."""
    from matplotlib.patches import Polygon

    colours = link_colours(linkage)
    order = 2 if strength < 1 else 4
    drawn: list[Any] = []
    for link in linkage.moving_links:
        corners = round_order([complex(places[name]) for name in linkage.links[link]])
        x, y = _xy(corners)
        if len(corners) > 2:
            fill: Any = {
                "facecolor": colours[link],
                "edgecolor": "none",
                "alpha": 0.16 * strength,
                "zorder": order,
            }
            drawn.append(ax.add_patch(Polygon(list(zip(x, y)), closed=True, **fill)))
            x, y = [*x, x[0]], [*y, y[0]]
        round_ends: Any = {"solid_capstyle": "round", "solid_joinstyle": "round"}
        width = 2.2 if len(corners) > 2 else 3.6
        drawn += ax.plot(x, y, color=colours[link], linewidth=width, alpha=strength, zorder=order, **round_ends)
    if strength < 1:
        return drawn
    pins = sorted({p for _, _, p in linkage.revolute_joints()} - set(linkage.links[GROUND]))
    if pins:
        x, y = _xy([complex(places[p]) for p in pins])
        drawn.append(ax.scatter(x, y, s=26, facecolor=PAPER, edgecolor=INK, linewidth=1.1, zorder=6))
    return drawn


def ground(ax: Axes, linkage: Linkage, size: float) -> None:
    """A triangle on hatching below every fixed pivot."""
    from matplotlib.patches import Polygon

    joints = {p for _, _, p in linkage.revolute_joints()}
    w = PIVOT * size
    for name in linkage.links[GROUND]:
        if name not in joints:
            continue
        z = linkage.points[name]
        y = z.imag - 1.5 * w
        corners = [(z.real, z.imag), (z.real - w, y), (z.real + w, y)]
        ax.add_patch(Polygon(corners, closed=True, facecolor="#f2f2f2", edgecolor=INK, linewidth=1.0, zorder=5))
        ax.plot([z.real - 1.5 * w, z.real + 1.5 * w], [y, y], color=INK, linewidth=1.2, zorder=5)
        for k in range(-2, 3):
            x = z.real + (0.6 * k + 0.3) * w
            ax.plot([x, x - 0.5 * w], [y, y - 0.5 * w], color=INK, linewidth=0.7, zorder=5)
        ax.scatter([z.real], [z.imag], s=30, facecolor=PAPER, edgecolor=INK, linewidth=1.2, zorder=7)


def bodies(
    ax: Axes,
    linkage: Linkage,
    poses: Sequence[Mapping[str, float]],
    task: Task | None,
    size: float,
    strength: float = 1.0,
    named: bool = True,
) -> list[Any]:
    """The carried bodies as small frames: an arrow along the body's x axis, a stroke along its y axis."""
    colours = link_colours(linkage)
    drawn: list[Any] = []
    for body, (link, point) in linkage.bodies.items():
        wanted = task.poses.get(body, ()) if task is not None else ()
        first = wanted[0].angle if wanted else 0.0
        places = [complex(linkage.positions(pose)[point]) for pose in poses]
        gaps = [abs(a - b) for k, a in enumerate(places) for b in places[:k]]
        length = min([BODY * size, *(max(0.6 * gap, 0.4 * BODY * size) for gap in gaps)])
        angles = [first + pose.get(link, 0.0) for pose in poses]
        backs = [z - 0.5 * BODY * size * complex(math.cos(a + 0.7), math.sin(a + 0.7)) for z, a in zip(places, angles)]
        every = math.ceil(len(places) / FEW)
        labels = {every * k: back for k, back in spaced(backs[::every], APART * size).items()}
        for number, (z, angle) in list(enumerate(zip(places, angles)))[::every]:
            along, across = (z + length * complex(math.cos(a), math.sin(a)) for a in (angle, angle + math.pi / 2))
            colour: Any = {"color": colours.get(link, INK), "alpha": strength, "zorder": 8}
            head = {"arrowstyle": "-|>", "linewidth": 1.6, "mutation_scale": 9, "shrinkA": 0, "shrinkB": 0}
            tips: Any = {"xy": (along.real, along.imag), "xytext": (z.real, z.imag)}
            drawn.append(ax.annotate("", **tips, arrowprops={**head, **colour}, annotation_clip=False))
            x, y = _xy([z, z + 0.6 * (across - z)])
            drawn += ax.plot(x, y, linewidth=1.6, solid_capstyle="round", **colour)
            drawn.append(ax.scatter([z.real], [z.imag], s=14, linewidth=0, **colour))
            if named and number in labels:
                back = labels[number]
                word = f"{body}{number}" if len(body) < 4 else str(number)
                drawn.append(ax.text(back.real, back.imag, word, fontsize=8, ha="center", va="center", **colour))
        marks = list(task.points.get(body, ())) if task is not None else []
        if marks:
            x, y = _xy(marks)
            area = 28 if len(marks) <= FEW else 6
            drawn.append(ax.scatter(x, y, marker="x", s=area, color=INK, linewidth=1.2, zorder=8))
    return drawn


def spaced(places: Sequence[complex], gap: float) -> dict[int, complex]:
    """Those places, by their number, that keep a gap to each other: the first, the last, then as many as there is room.

    >>> spaced([0, 1, 2, 3, 4, 4.5], 2.0)
    {0: 0, 5: 4.5, 2: 2}
    """
    kept: dict[int, complex] = {}
    for number in sorted(range(len(places)), key=lambda k: (0 < k < len(places) - 1, k)):
        if all(abs(places[number] - other) >= gap for other in kept.values()):
            kept[number] = places[number]
    return kept


def names(ax: Axes, linkage: Linkage, places: Mapping[str, complex], size: float) -> None:
    """The names of the joints, each on the side of its joint where there is most room."""
    carried = {point for _, point in linkage.bodies.values()}
    fixed = set(linkage.links[GROUND])
    taken = [complex(z) for z in places.values()]
    for name, place in places.items():
        if name in carried:
            continue
        z = complex(place)
        # below a fixed pivot stands its triangle
        turns = [k / 8 for k in range(16) if not (name in fixed and 9 <= k <= 15)]
        spots = [z + NAME * size * complex(math.cos(math.pi * t), math.sin(math.pi * t)) for t in turns]
        best = max(spots, key=lambda spot: min((abs(spot - other) for other in taken if other != z), default=0.0))
        taken.append(best)
        ax.text(best.real, best.imag, name, fontsize=8, color=INK, ha="center", va="center", zorder=9)


def round_order(corners: Sequence[complex]) -> list[complex]:
    """The corners in the order in which they lie round their centre, so that a link is no hourglass."""
    if len(corners) < 3:
        return list(corners)
    middle = sum(corners) / len(corners)
    return sorted(corners, key=lambda z: math.atan2((z - middle).imag, (z - middle).real))


def _xy(points: Sequence[complex]) -> tuple[list[float], list[float]]:
    return [z.real for z in points], [z.imag for z in points]
