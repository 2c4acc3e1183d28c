"""The picture of a `SolutionMap`: the two curves with their numbers, and the map."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.dyad_pairs import pair_linkage
from mechanisms.families.motion_dyads import MotionDyad
from mechanisms.families.solution_map import BRANCH, CIRCUIT, LABELS, ORDER, UNEQUAL, USABLE, WINDOW, SolutionMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_curves", "draw_map"]

#: Greys of the classes that cannot be used, and their words.
GREYS = {
    CIRCUIT: ("#f7f7f7", "must be taken apart between poses"),
    BRANCH: ("#e2e2e2", "stops at a dead centre between poses"),
    ORDER: ("#c2c2c2", "visits the poses out of order"),
    UNEQUAL: ("#b9cde4", "works, but its links are very unequal"),
}
CIRCLE_COLOUR, CENTRE_COLOUR, POSE_COLOUR = "#0b6e4f", "#9c2f00", "#555555"


def draw_map(
    found: SolutionMap, path: str | Path | None = None, pick: tuple[float, float] | None = None, figure: Any = None
) -> Any:
    """Draw the curves and the map side by side.

    Parameters
    ----------
    found : SolutionMap
    path : str or Path, optional
        File to write; its ending chooses the format.
    pick : (driven, following), optional
        Two stations: their linkage is drawn, and marked on the map. By default the best one.
    figure : matplotlib Figure, optional
        Where to draw, about twice as wide as high.

    Returns
    -------
    matplotlib.figure.Figure
    """
    from matplotlib.figure import Figure

    if pick is None and found.share() > 0:
        pick = found.best()
    if figure is None:
        figure = Figure(figsize=(14.5, 7.2))
    figure.set_layout_engine("constrained")
    curves, table = figure.subplots(1, 2, width_ratios=[1.0, 1.12])
    draw_curves(found, curves, pick)
    _draw_table(found, table, figure, pick)
    figure.suptitle(
        f"All four-bars through four poses: {100 * found.share():.0f} % of the pairs of dyads can be used",
        fontsize=13,
    )
    if path is not None:
        figure.savefig(path, dpi=130)
    return figure


def draw_curves(found: SolutionMap, ax: Axes, pick: tuple[float, float] | None = None) -> None:
    """The circle-point and the centre-point curve in pose 0, with the numbers of the map's axes."""
    poses = found.poses
    middle, reach = complex(poses.points.mean()), WINDOW * poses.size
    for number, circuit in enumerate(found.curve.circuits):
        phi = np.append(circuit.stations(2000), 2 * np.pi)
        fixed, moving = found.curve.dyads(circuit, phi)
        for places, colour, words in (
            (moving, CIRCLE_COLOUR, "circle points: moving pivots, in the first pose"),
            (fixed, CENTRE_COLOUR, "centre points: fixed pivots"),
        ):
            shown = _within(places, middle, reach)
            ax.plot(shown.real, shown.imag, color=colour, lw=1.6, label=words if number == 0 else None)
        stations = 100 * number + np.arange(0, 100, LABELS)
        marks = circuit.stations(100 // LABELS)
        labelled = found.curve.dyads(circuit, marks)
        for places, colour in zip(labelled, (CENTRE_COLOUR, CIRCLE_COLOUR)):
            for station, place in zip(stations, _within(places, middle, 0.97 * reach)):
                if np.isfinite(place):
                    ax.plot(place.real, place.imag, "o", ms=3, color=colour)
                    ax.annotate(
                        f"{station:g}", (place.real, place.imag), xytext=(3, 3), textcoords="offset points",
                        fontsize=7, color=colour, annotation_clip=True,
                    )  # fmt: skip
    _draw_poses(found, ax)
    for slider in _single_sliders(found):
        place = slider.moving if slider.kind == "PR" else slider.fixed
        if abs(place - middle) < reach:
            words = "Ball's point: moves on a line here" if slider.kind == "PR" else "pivot of an inverted slider"
            colour = CIRCLE_COLOUR if slider.kind == "PR" else CENTRE_COLOUR
            ax.plot(place.real, place.imag, "D", ms=6, mfc="white", mec=colour, label=words)
    if pick is not None:
        _draw_pick(found, ax, pick)
    ax.set_xlim(middle.real - reach, middle.real + reach)
    ax.set_ylim(middle.imag - reach, middle.imag + reach)
    ax.set_aspect("equal")
    ax.set_xlabel("x")
    ax.set_ylabel("y")
    ax.set_title("Where the pivots can be: equal numbers belong together", fontsize=11)
    ax.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.07), ncol=2, frameon=False)


def _draw_poses(found: SolutionMap, ax: Axes) -> None:
    poses = found.poses
    size = 0.16 * poses.size
    shape = size * np.array([0, 1.6, 0.5j, 0])
    for k, (point, angle) in enumerate(zip(poses.points, poses.angles)):
        outline = point + shape * np.exp(1j * angle)
        ax.fill(outline.real, outline.imag, color=POSE_COLOUR, alpha=0.22 if k else 0.5, lw=0)
        ax.annotate(
            f"pose {k}", (point.real, point.imag), xytext=(-4, -10), textcoords="offset points", fontsize=8,
            color=POSE_COLOUR, weight="bold",
        )  # fmt: skip


def _draw_pick(found: SolutionMap, ax: Axes, pick: tuple[float, float]) -> None:
    driven, following = (found.dyad(station) for station in pick)
    linkage, _ = pair_linkage(found.poses, driven, following)
    o1, a1, o2, a2, p = (linkage.points[name] for name in ("O1", "A1", "O2", "A2", "P"))
    body = np.array([a1, a2, p, a1])
    ax.fill(body.real, body.imag, color="#3366cc", alpha=0.15)
    for ends, width in (((o1, a1), 3.2), ((o2, a2), 2.2), ((a1, a2), 2.2)):
        line = np.array(ends)
        ax.plot(line.real, line.imag, color="#3366cc", lw=width, solid_capstyle="round", zorder=4)
    for place, face in ((o1, "black"), (o2, "black"), (a1, "white"), (a2, "white")):
        ax.plot(place.real, place.imag, "o", ms=6, mfc=face, mec="black", zorder=5)
    ax.plot([], [], color="#3366cc", lw=3, label=f"the marked pair {pick[0]:.1f}, {pick[1]:.1f} (thick: driven)")


def _draw_table(found: SolutionMap, ax: Axes, figure: Any, pick: tuple[float, float] | None) -> None:
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    count = len(found.stations)
    circuits = len(found.curve.circuits)
    extent = (0, 100 * circuits, 0, 100 * circuits)
    greys = np.ma.masked_equal(found.verdict, USABLE)
    colours = ListedColormap([GREYS[code][0] for code in sorted(GREYS)])
    ax.imshow(greys, origin="lower", extent=extent, cmap=colours, vmin=-0.5, vmax=3.5, interpolation="nearest")
    angle = np.ma.masked_where(found.verdict != USABLE, found.transmission)
    picture = ax.imshow(angle, origin="lower", extent=extent, cmap="viridis", vmin=0, vmax=90, interpolation="nearest")
    bar = figure.colorbar(picture, ax=ax, shrink=0.85, pad=0.02)
    bar.set_label("usable: least transmission angle between the poses, degrees")
    usable_turn = (found.verdict == USABLE) & found.turns
    if usable_turn.any() and not usable_turn.all():
        step = 100 * circuits / count
        axis = (np.arange(count) + 0.5) * step
        ax.contour(axis, axis, usable_turn.astype(float), levels=[0.5], colors="#d62728", linewidths=1.0)
    for k in range(1, circuits):
        ax.axvline(100 * k, color="black", lw=0.8)
        ax.axhline(100 * k, color="black", lw=0.8)
    ax.plot([0, 100 * circuits], [0, 100 * circuits], color="white", lw=2.0)
    ax.annotate(
        "one dyad twice", (50 * circuits, 50 * circuits), rotation=45, rotation_mode="anchor", fontsize=7,
        ha="center", va="bottom", color="#666666", xytext=(-2, 2), textcoords="offset points",
    )  # fmt: skip
    _mark_sliders(found, ax)
    ticks = np.arange(0, 100 * circuits + 1, 2 * LABELS if circuits > 1 else LABELS)
    ax.set_xticks(ticks)
    ax.set_yticks(ticks)
    parts = "" if circuits == 1 else " (from 100 on: the second branch of the curve)"
    ax.set_xlabel("number of the dyad that is driven" + parts)
    ax.set_ylabel("number of the dyad that follows" + parts)
    ax.set_title("What becomes of each pair", fontsize=11)
    handles = [Patch(fc=colour, ec="#777777", lw=0.5, label=words) for colour, words in GREYS.values()]
    handles.append(Patch(fc="none", ec="#d62728", label="inside: the driven link turns fully"))
    if pick is not None:
        ax.plot(*pick, marker="o", ms=9, mfc="none", mec="white", mew=2.5)
        ax.plot(*pick, marker="o", ms=9, mfc="none", mec="black", mew=1.0)
    ax.legend(handles=handles, fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.09), ncol=2, frameon=False)


def _mark_sliders(found: SolutionMap, ax: Axes) -> None:
    """Where a dyad of the axes is a slider: Ball's point, whose link is infinitely long."""
    for slider in _single_sliders(found):
        if slider.kind != "PR":
            continue
        station = found.station_of(slider.moving)
        ax.axvline(station, color=CIRCLE_COLOUR, lw=0.8, ls=":")
        ax.axhline(station, color=CIRCLE_COLOUR, lw=0.8, ls=":")
        ax.annotate(
            "slider", (station, 1.0), xycoords=("data", "axes fraction"), xytext=(0, -2),
            textcoords="offset points", rotation=90, fontsize=7, ha="right", va="top", color=CIRCLE_COLOUR,
        )  # fmt: skip


def _single_sliders(found: SolutionMap) -> list[MotionDyad]:
    """Sliders that are one of their kind: two of a kind are no marks to steer by."""
    sliders = found.curve.sliders()
    return [s for s in sliders if sum(other.kind == s.kind for other in sliders) == 1]


def _within(places: NDArray[np.complex128], middle: complex, reach: float) -> NDArray[np.complex128]:
    """Places inside the window; those outside become gaps of the line."""
    inside = (np.abs(places.real - middle.real) < 1.5 * reach) & (np.abs(places.imag - middle.imag) < 1.5 * reach)
    return np.where(inside, places, complex(np.nan, np.nan))
