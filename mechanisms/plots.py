"""Pictures of a design: at its poses as SVG, PNG or PDF, moving as GIF or HTML.

Fixed pivots are triangles on hatching, links are coloured bodies, moving joints are circles.  Pose 0 is drawn in
full, the later poses faintly; the bodies to be carried are small frames, and the dashed lines are the paths of
their reference points.
"""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms import drawing
from mechanisms.rails import design_rails
from mechanisms.tables import REASONS
from mechanisms.travel import Travel, travel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from mechanisms.designs import Design
    from mechanisms.linkage import Linkage
    from mechanisms.task import Task

__all__ = ["FORMATS", "caption", "draw_design", "save_design"]

FORMATS = ("svg", "png", "pdf", "gif", "html")
#: Frames of an animation from the first pose to the last, how long each is shown and how long a pose, in ms.
FRAMES, FRAME_MS, HOLD_MS = 48, 50, 600
#: Letters of a caption in an inch.
LETTERS = 12
#: Dots per inch.
PNG_DPI, GIF_DPI = 150, 84
#: Colours of a GIF: flat drawings with smooth edges need no more.
GIF_COLOURS = 96
#: How strongly the later poses are drawn, from the second to the last.
GHOSTS = (0.30, 0.45)
#: As many of them are drawn at most; of more, every second, every third, …
MOST_GHOSTS = 24


def draw_design(design: Design, ax: Axes | None = None, task: Task | None = None, driven: str = "") -> Axes:
    """Draw a design at its poses.

    Parameters
    ----------
    design : Design
        With a linkage.
    ax : matplotlib Axes, optional
        Where; by default on a figure of its own.
    task : Task, optional
        For the orientation of the body frames and the wanted path points.
    driven : str
        The input whose motion gives the paths of the bodies; by default the one that decided.

    Returns
    -------
    matplotlib Axes
    """
    linkage = _linkage(design)
    motion = travel(design, driven=driven)
    places = [{name: complex(z) for name, z in linkage.positions(pose).items()} for pose in design.poses]
    shown = [z for place in places for z in place.values()]
    box = drawing.fit([shown, *(_paths(linkage, motion) if motion.working else [])])
    size = max(box[1] - box[0], box[3] - box[2])
    rails = design_rails(design, drawing.BODY * size, motion)
    if ax is None:
        ax = drawing.page(box, linkage.length_unit)
    else:
        drawing.prepare(ax, box, linkage.length_unit)
    if motion.driven:
        drawing.paths(ax, linkage, motion.points, 0.9 if motion.working else 0.35)
    later = places[1 :: math.ceil(len(places) / MOST_GHOSTS)]
    for number, place in reversed(list(enumerate(later))):
        drawing.links(ax, linkage, place, GHOSTS[0] + (GHOSTS[1] - GHOSTS[0]) * number / max(1, len(later) - 1))
    drawing.bodies(ax, linkage, design.poses, task, size)
    drawing.slides(ax, linkage, rails, places[0], design.poses[0])
    drawing.links(ax, linkage, places[0])
    drawing.ground(ax, linkage, size)
    drawing.names(ax, linkage, places[0], size)
    _head(ax, caption(design))
    return ax


def save_design(design: Design, path: str | Path, task: Task | None = None, driven: str = "") -> None:
    """Write a picture of a design; the ending of `path` says of which kind.

    Raises
    ------
    ValueError
        When the ending is none of `FORMATS`, or the design has no linkage.
    """
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise ValueError(f"cannot draw {path.suffix or 'a file without ending'}; use one of {', '.join(FORMATS)}")
    if kind == "gif":
        _save_gif(design, path, task, driven)
    elif kind == "html":
        from mechanisms.animation import animation_page

        path.write_text(animation_page(design, task, driven), encoding="utf-8")
    else:
        figure: Any = draw_design(design, task=task, driven=driven).figure
        # no creation date: the same design gives the same file
        metadata: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind, {})
        figure.savefig(path, dpi=PNG_DPI, metadata=metadata)


def caption(design: Design) -> str:
    """One or two lines that say what the picture shows."""
    title = design.linkage.title if design.linkage else ""
    if not design.accepted:
        words = "; ".join(f"{code}: {REASONS.get(code, 'not met')}" for code in design.reasons)
        return f"{design.id}  ·  rejected, {words}"
    parts = [design.id]
    if design.input:
        parts.append(f"driven at the {design.input}")
    if design.min_transmission_deg is not None:
        parts.append(f"transmission ≥ {design.min_transmission_deg:.1f}°")
    return "  ·  ".join(parts) + (f"\n{title}" if title else "")


def _head(ax: Axes, words: str) -> None:
    """Write the caption above the picture, in more and smaller lines where it would not fit."""
    figure: Any = ax.figure
    inches = ax.get_position().width * figure.get_figwidth()
    lines, size = words.splitlines(), 10
    if max(map(len, lines)) > LETTERS * inches:
        size = 8
        lines = [part for line in lines for part in textwrap.wrap(line, max(16, int(LETTERS * inches * 10 / size)))]
    ax.set_title("\n".join(lines), fontsize=size, color=drawing.INK, loc="left", parse_math=False)


def _linkage(design: Design) -> Linkage:
    if design.linkage is None:
        raise ValueError(f"{design.id} is no linkage ({', '.join(design.reasons)}), so that it cannot be drawn")
    return design.linkage


def _paths(linkage: Linkage, motion: Travel) -> list[Any]:
    return [motion.points[point] for _, point in linkage.bodies.values()]


def _save_gif(design: Design, path: Path, task: Task | None, driven: str) -> None:
    """There and back through the poses, resting at each of them."""
    from PIL import Image

    linkage, motion = _linkage(design), travel(design, FRAMES, driven)
    box = drawing.fit(motion.points.values())
    size = max(box[1] - box[0], box[3] - box[2])
    rails = design_rails(design, drawing.BODY * size, motion)
    ax = drawing.page(box, linkage.length_unit)
    if motion.driven:
        drawing.paths(ax, linkage, motion.points, 0.9)
    drawing.bodies(ax, linkage, design.poses, task, size, strength=0.45)
    drawing.ground(ax, linkage, size)
    _head(ax, caption(design))
    figure: Any = ax.figure
    figure.set_dpi(GIF_DPI)
    canvas = figure.canvas
    canvas.draw()
    scenery = canvas.copy_from_bbox(figure.bbox)
    images, durations = [], []
    rests = {frame for frame in motion.poses if frame is not None}
    for frame in range(len(motion)):
        canvas.restore_region(scenery)
        here = {name: complex(points[frame]) for name, points in motion.points.items()}
        turned = {link: float(angles[frame]) for link, angles in motion.rotations.items()}
        moving = drawing.slides(ax, linkage, rails, here, turned) + drawing.links(ax, linkage, here)
        moving += drawing.bodies(ax, linkage, [turned], _poses_only(task), size, named=False)
        for artist in sorted(moving, key=lambda item: item.get_zorder()):
            ax.draw_artist(artist)
            artist.remove()
        pixels = np.asarray(canvas.buffer_rgba())[..., :3]
        images.append(Image.fromarray(pixels.copy()).quantize(GIF_COLOURS, dither=Image.Dither.NONE))
        durations.append(HOLD_MS if frame in rests else FRAME_MS)
    if motion.working:  # else it went round the circuit and is where it began
        images, durations = images + images[-2:0:-1], durations + durations[-2:0:-1]
    images[0].save(path, save_all=True, append_images=images[1:], duration=durations, loop=0, optimize=True)


def _poses_only(task: Task | None) -> Task | None:
    """The task without its path points, which stand still."""
    from dataclasses import replace

    return None if task is None else replace(task, points={})
