"""A design for other programs: DXF and SVG in true size, CSV of its dimensions, JSON of everything."""

from __future__ import annotations

import cmath
import csv
import io
import json
import math
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanisms import drawing
from mechanisms.linkage import GROUND
from mechanisms.rails import design_rails

if TYPE_CHECKING:
    from mechanisms.designs import Design
    from mechanisms.linkage import Linkage
    from mechanisms.task import Task

__all__ = ["FORMATS", "export_design"]

FORMATS = ("dxf", "svg", "csv", "json")
#: DXF's $INSUNITS, by the labels that people write; 0 is "no unit".
DXF_UNITS = {"in": 1, "inch": 1, "ft": 2, "mm": 4, "cm": 5, "m": 6, "km": 7, "um": 13, "µm": 13, "dm": 14}
#: Millimetres in a unit, for the size of an SVG page.
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "inch": 25.4, "dm": 100.0, "um": 1e-3, "µm": 1e-3}
#: Pins and frames are drawn in this part of the linkage's size.
PIN = 0.008
#: How far a guide goes on beyond what slides on it, as a part of the linkage's size.
RAIL = 0.03


def export_design(design: Design, path: str | Path, task: Task | None = None) -> None:
    """Write a design to a file; the ending of `path` says in which format.

    Raises
    ------
    TaskError
        When a package that the format needs is not installed.
    ValueError
        When the ending is none of `FORMATS`, or the design has no linkage.
    """
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    if design.linkage is None:
        raise ValueError(f"{design.id} is no linkage, so that it cannot be exported")
    if kind == "dxf":
        _dxf(design, design.linkage, path)
    elif kind == "svg":
        path.write_text(_svg(design, design.linkage), encoding="utf-8")
    elif kind == "csv":
        path.write_text(_csv(design, design.linkage), encoding="utf-8", newline="")
    elif kind == "json":
        units = {"length": design.linkage.length_unit or None, "angle": "rad, where no key ends in _deg"}
        document = {**design.to_document(), "units": units, "task": None if task is None else task.to_dict()}
        path.write_text(
            json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n", encoding="utf-8"
        )
    else:
        raise ValueError(
            f"cannot export {path.suffix or 'a file without ending'}; use one of {', '.join(FORMATS)}"
        )


def _dxf(design: Design, linkage: Linkage, path: Path) -> None:
    """One layer for each link (its outline and its pins), one for names, one for each pose of the bodies."""
    try:
        import ezdxf
        from ezdxf.enums import TextEntityAlignment
    except ImportError:
        from mechanisms.task import TaskError

        raise TaskError("DXF needs the package ezdxf; pip install ezdxf") from None
    document = ezdxf.new("R2010")
    document.header["$INSUNITS"] = DXF_UNITS.get(linkage.length_unit.strip().lower(), 0)
    space = document.modelspace()
    size = _size(linkage)
    joints = {p for _, _, p in linkage.revolute_joints()}
    for number, (link, names) in enumerate(linkage.links.items()):
        layer = _layer(link)
        document.layers.add(layer, color=8 if link == GROUND else 1 + number % 6)
        corners = drawing.round_order([linkage.points[name] for name in names])
        xy = [(z.real, z.imag) for z in corners]
        if len(xy) > 1 and link != GROUND:
            space.add_lwpolyline(xy, close=len(xy) > 2, dxfattribs={"layer": layer})
        for name in names:
            if name in joints:
                z = linkage.points[name]
                radius = PIN * size * (1.6 if link == GROUND else 1.0)
                space.add_circle((z.real, z.imag), radius, dxfattribs={"layer": layer})
    for rail in design_rails(design, RAIL * size):
        first, last = rail.first, rail.last
        space.add_line((first.real, first.imag), (last.real, last.imag), dxfattribs={"layer": _layer(rail.link)})
    document.layers.add("names", color=7)
    for name, z in linkage.points.items():
        words = space.add_text(name, height=2 * PIN * size, dxfattribs={"layer": "names"})
        words.set_placement((z.real + 2 * PIN * size, z.imag), align=TextEntityAlignment.MIDDLE_LEFT)
    for number, pose in enumerate(design.poses):
        layer = f"pose {number}"
        document.layers.add(layer, color=9)
        places = linkage.positions(pose)
        for link, point in linkage.bodies.values():
            z, angle = complex(places[point]), pose.get(link, 0.0)
            along = z + 6 * PIN * size * complex(math.cos(angle), math.sin(angle))
            space.add_line((z.real, z.imag), (along.real, along.imag), dxfattribs={"layer": layer})
            space.add_circle((z.real, z.imag), 0.5 * PIN * size, dxfattribs={"layer": layer})
    document.saveas(path)


def _svg(design: Design, linkage: Linkage) -> str:
    """A drawing in true size: one user unit is one length unit, y upwards; one group for each link."""
    slides = design_rails(design, RAIL * _size(linkage))
    corners = [*linkage.points.values(), *(z for rail in slides for z in (rail.first, rail.last))]
    left, right, bottom, top = drawing.fit([corners])
    wide, high = right - left, top - bottom
    millimetres = MILLIMETRES.get(linkage.length_unit.strip().lower())
    page = f' width="{wide * millimetres:.6g}mm" height="{high * millimetres:.6g}mm"' if millimetres else ""
    pen, pin = 0.002 * max(wide, high), PIN * max(wide, high)
    colours = drawing.link_colours(linkage)
    joints = {p for _, _, p in linkage.revolute_joints()}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg"{page} viewBox="{left:.9g} {-top:.9g} {wide:.9g} {high:.9g}">',
        f"<title>{escape(design.id)} {escape(linkage.title)}</title>",
        f'<g transform="scale(1,-1)" fill="none" stroke-width="{pen:.6g}" stroke-linejoin="round">',
    ]
    for link, names in linkage.links.items():
        colour = colours.get(link, "#222222")
        lines.append(f'<g id="{escape(_layer(link))}" stroke="{colour}">')
        corners = drawing.round_order([linkage.points[name] for name in names])
        if len(corners) > 1 and link != GROUND:
            shape = "polygon" if len(corners) > 2 else "polyline"
            lines.append(f'<{shape} points="{" ".join(f"{z.real:.9g},{z.imag:.9g}" for z in corners)}"/>')
        for name in names:
            if name in joints:
                z = linkage.points[name]
                radius = pin * (1.6 if link == GROUND else 1.0)
                lines.append(f'<circle cx="{z.real:.9g}" cy="{z.imag:.9g}" r="{radius:.6g}"/>')
        for rail in slides:
            if rail.link == link:
                ends = " ".join(f"{z.real:.9g},{z.imag:.9g}" for z in (rail.first, rail.last))
                lines.append(f'<polyline points="{ends}"/>')
        lines.append("</g>")
    lines += ["</g>", f'<g font-family="sans-serif" font-size="{3 * pin:.6g}" fill="#222222">']
    for name, z in linkage.points.items():
        lines.append(f'<text x="{z.real + 2 * pin:.9g}" y="{-z.imag:.9g}">{escape(name)}</text>')
    return "\n".join([*lines, "</g>", "</svg>", ""])


def _csv(design: Design, linkage: Linkage) -> str:
    """Points of every pose, then lengths, slides (a place on the line, its direction), parameters."""
    out = io.StringIO()
    writer = csv.writer(out)
    unit = linkage.length_unit
    writer.writerow(["kind", "name", "pose", "x", "y", "value", "unit"])
    for number, pose in enumerate(design.poses):
        for name, z in linkage.positions(pose).items():
            writer.writerow(["point", _safe(name), number, _text(z.real), _text(z.imag), "", _safe(unit)])
    for number, pose in enumerate(design.poses):
        for link, angle in pose.items():
            writer.writerow(["rotation", _safe(link), number, "", "", _text(math.degrees(angle)), "deg"])
    for pair, length in design.links.items():
        writer.writerow(["length", _safe(pair), "", "", "", _text(length), _safe(unit)])
    for rail in design_rails(design, _size(linkage)):  # the margin gives a direction where nothing slides far
        middle, angle = (rail.first + rail.last) / 2, math.degrees(cmath.phase(rail.last - rail.first))
        writer.writerow(["slide", _safe(rail.link), 0, _text(middle.real), _text(middle.imag), _text(angle), "deg"])
    for name, value in design.parameters.items():
        if isinstance(value, complex):
            writer.writerow(["parameter", _safe(name), "", _text(value.real), _text(value.imag), "", ""])
        else:
            writer.writerow(
                ["parameter", _safe(name), "", "", "", _text(value), "deg" if name.endswith("_deg") else ""]
            )
    return out.getvalue()


def _size(linkage: Linkage) -> float:
    left, right, bottom, top = drawing.fit([list(linkage.points.values())])
    return max(right - left, top - bottom)


def _layer(link: str) -> str:
    """A link's name as the name of a layer."""
    return "".join(letter if letter.isalnum() or letter in "-_ " else "_" for letter in link)


def _safe(text: str) -> str:
    """Text that no spreadsheet takes for a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@") else text


def _text(value: Any) -> str:
    return repr(float(value))
