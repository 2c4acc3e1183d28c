"""A moving drawing for web pages: its data as JSON, and the script and style that play it.

A page that holds them needs nothing else, neither a server nor a network.  Everything that comes from a task is
escaped: a title is text, whatever it contains.
"""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms import drawing
from mechanisms.linkage import GROUND
from mechanisms.rails import design_rails
from mechanisms.travel import Travel, travel

if TYPE_CHECKING:
    from mechanisms.designs import Design
    from mechanisms.linkage import Linkage
    from mechanisms.rails import Rail
    from mechanisms.task import Task

__all__ = ["SCRIPT", "STYLE", "embedded", "player_data"]

#: Frames from the first pose to the last.
FRAMES = 91


def player_data(design: Design, task: Task | None = None, driven: str = "") -> dict[str, Any]:
    """What the script needs to draw one design moving.

    Returns
    -------
    dict
        ``box``, ``links``, ``points`` (by name: x and y of every frame), ``guides``, ``ground``, ``pins``,
        ``bodies``, ``poses`` (frame of each pose), ``input`` (its value in every frame, in degrees or in the
        length unit), ``path`` (whether the frames are a motion, not poses alone).
    """
    linkage = design.linkage
    if linkage is None:
        raise ValueError(f"{design.id} is no linkage, so that it cannot be drawn")
    motion = travel(design, FRAMES, driven)
    configurations = [linkage.positions(pose) for pose in design.poses]
    shown = [complex(z) for place in configurations for z in place.values()]
    box = drawing.fit([shown, *motion.points.values()] if motion.working else [shown])
    size = max(box[1] - box[0], box[3] - box[2])
    digits = max(0, 4 - math.floor(math.log10(size)))
    colours = drawing.link_colours(linkage)
    bodies = []
    for body, (link, point) in linkage.bodies.items():
        wanted = task.poses.get(body, ()) if task is not None else ()
        first = wanted[0].angle if wanted else 0.0
        places = [complex(place[point]) for place in configurations]
        bodies.append(
            {
                "name": body,
                "colour": colours.get(link, drawing.INK),
                "point": point,
                "angles": _rounded(motion.rotations[link] + first, 4) if link in motion.rotations else [],
                "poses": [
                    [*_pair(z, digits), round(first + pose.get(link, 0.0), 4)]
                    for z, pose in zip(places, design.poses)
                ],
                "marks": [_pair(z, digits) for z in (task.points.get(body, ()) if task is not None else ())],
            }
        )
    joints = {p for _, _, p in linkage.revolute_joints()}
    turning = bool(motion.driven) and not linkage.inputs[motion.driven].translation
    unit = ("°" if turning else f" {linkage.length_unit}".rstrip()) if motion.driven else ""
    return {
        "id": design.id,
        "box": [round(edge, digits) for edge in box],
        "links": [
            {
                "name": link,
                "colour": colours[link],
                "points": _ring(linkage.links[link], linkage.points),
            }
            for link in linkage.moving_links
        ],
        "points": {
            name: [_rounded(path.real, digits), _rounded(path.imag, digits)]
            for name, path in motion.points.items()
        },
        "guides": [
            _guide(rail, linkage, motion, digits)
            for rail in design_rails(design, drawing.BODY * size, motion)
        ],
        "ground": [name for name in linkage.links[GROUND] if name in joints],
        "pins": sorted(joints - set(linkage.links[GROUND])),
        "bodies": bodies,
        "poses": motion.poses,
        "input": _rounded(motion.input * (180 / math.pi if turning else 1.0), 2),
        "unit": unit,
        "driven": motion.driven or "pose",
        "path": bool(motion.driven),
        "working": motion.working,
    }


def _guide(rail: Rail, linkage: Linkage, motion: Travel, digits: int) -> list[list[float]]:
    """x and y of one end, x and y of the other, in every frame."""
    ends = [np.broadcast_to(end, len(motion)) for end in rail.ends(linkage, motion.points, motion.rotations)]
    return [_rounded(part, digits) for end in ends for part in (end.real, end.imag)]


def embedded(data: Any) -> str:
    """JSON that can stand inside a script element of a page.

    >>> embedded({"title": "</script><b>"})
    '{"title":"\\\\u003c/script\\\\u003e\\\\u003cb\\\\u003e"}'
    """
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    for letter, code in (("<", "\\u003c"), (">", "\\u003e"), ("&", "\\u0026")):
        text = text.replace(letter, code)
    return text


def _ring(names: Any, points: Any) -> list[str]:
    """The points of a link in the order in which they lie round it."""
    if len(names) < 3:
        return list(names)
    by_place = {complex(points[name]): name for name in names}
    ring = [by_place[z] for z in drawing.round_order([complex(points[name]) for name in names])]
    return ring if len(set(ring)) == len(names) else list(names)


def _pair(z: complex, digits: int) -> list[float]:
    return [round(z.real, digits), round(z.imag, digits)]


def _rounded(values: Any, digits: int) -> list[float]:
    return [round(float(value), digits) for value in values]


STYLE = """
:root { color-scheme: light; --ink: #222; --faint: #666; --line: #ddd; --good: #00794f; --bad: #b3401f; }
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: #fafafa; margin: 0; }
main { max-width: 1180px; margin: 0 auto; padding: 1.5rem 1rem 4rem; }
h1 { font-size: 1.5rem; margin: 0 0 .25rem; } h2 { font-size: 1.1rem; margin: 2rem 0 .5rem; }
p { margin: .25rem 0; } .faint { color: var(--faint); }
table { border-collapse: collapse; margin: .4rem 0 .8rem; font-size: .86rem; font-variant-numeric: tabular-nums; }
th, td { text-align: right; padding: .18rem .6rem; border-bottom: 1px solid var(--line); white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; } td.text, th.text { text-align: left; }
.scroll { overflow-x: auto; }
.good { color: var(--good); font-weight: 600; } .bad { color: var(--bad); font-weight: 600; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 1rem; align-items:
start; } .card { background: #fff; border: 1px solid var(--line); border-radius: 8px; padding: .8rem; min-width:
0; } .card h3 { font-size: 1rem; margin: 0; } .card details { margin-top: .5rem; font-size: .86rem; } .single {
max-width: 860px; } .player svg { display: block; width: 100%; height: auto; max-height: 74vh; background: #fff;
} .player .bar { display: flex; gap: .5rem; align-items: center; flex-wrap: wrap; margin-top: .4rem; } .player
input[type=range] { flex: 1 1 7rem; min-width: 5rem; accent-color: #0072B2; } .player button { font: inherit;
font-size: .86rem; padding: .1rem .55rem; border: 1px solid #bbb; border-radius: 5px;
  background: #f5f5f5; cursor: pointer; } .player button:hover { background: #e8e8e8; }
.player output { font-size: .86rem; min-width: 5.5rem; text-align: right; font-variant-numeric: tabular-nums; }
@media print { .player .bar { display: none; } .card { break-inside: avoid; } }
"""

SCRIPT = r"""
"use strict";
const SVG = "http://www.w3.org/2000/svg";
function make(parent, tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const key in attributes) element.setAttribute(key, attributes[key]);
  parent.appendChild(element);
  return element;
}
function text(parent, x, y, words, size, colour) {
  const element = make(parent, "text", {x: x, y: y, "font-size": size, fill: colour, "text-anchor": "middle",
    "dominant-baseline": "middle"});
  element.textContent = words;
}
function play(root, data, auto) {
  const [left, right, bottom, top] = data.box, size = Math.max(right - left, top - bottom), u = size / (auto ?
  150 : 100); const svg = make(root, "svg", {viewBox: [left, -top, right - left, top - bottom].join(" "), role:
  "img"}); svg.setAttribute("aria-label", "linkage " + data.id + " moving through its poses"); const step =
  Math.pow(10, Math.floor(Math.log10(size / 2))); for (let x = Math.ceil(left / step) * step; x < right; x +=
  step)
    make(svg, "line", {x1: x, x2: x, y1: -top, y2: -bottom, stroke: "#eee", "stroke-width": 0.25 * u});
  for (let y = Math.ceil(bottom / step) * step; y < top; y += step)
    make(svg, "line", {x1: left, x2: right, y1: -y, y2: -y, stroke: "#eee", "stroke-width": 0.25 * u});
  const line = (x, y) => x.map((value, k) => value + "," + -y[k]).join(" ");
  function frame(parent, x, y, angle, colour, strength) {
    const long = 5.5 * u, c = Math.cos(angle), s = Math.sin(angle), g = make(parent, "g", {opacity: strength});
    const pen = {stroke: colour, "stroke-width": 0.7 * u, "stroke-linecap": "round"};
    make(g, "line", Object.assign({x1: x, y1: -y, x2: x + long * c, y2: -(y + long * s)}, pen));
    make(g, "line", Object.assign({x1: x, y1: -y, x2: x - 0.6 * long * s, y2: -(y + 0.6 * long * c)}, pen));
    const tip = [[1.25, 0], [0.9, 0.16], [0.9, -0.16]].map(([a, b]) =>
      (x + long * (a * c - b * s)) + "," + -(y + long * (a * s + b * c))).join(" ");
    make(g, "polygon", {points: tip, fill: colour});
    make(g, "circle", {cx: x, cy: -y, r: 0.7 * u, fill: colour});
  }
  for (const body of data.bodies) {
    const path = data.points[body.point];
    if (data.path)
      make(svg, "polyline", {points: line(path[0], path[1]), fill: "none", stroke: body.colour, opacity: 0.8,
        "stroke-width": 0.4 * u, "stroke-dasharray": [1.6 * u, u].join(" ")});
    const taken = [];
    body.poses.forEach(([x, y, angle], k) => {
      frame(svg, x, y, angle, body.colour, 0.4);
      const at = [x - 2.6 * u * Math.cos(angle + 0.7), -(y - 2.6 * u * Math.sin(angle + 0.7))];
      if (taken.some(other => Math.hypot(at[0] - other[0], at[1] - other[1]) < 3.5 * u)) return;
      taken.push(at);
      text(svg, at[0], at[1], (body.name.length < 4 ? body.name : "") + k, 2.6 * u, body.colour);
    });
    for (const [x, y] of body.marks)
      make(svg, "path", {d: `M${x - u} ${-y - u}l${2 * u} ${2 * u}m0 ${-2 * u}l${-2 * u} ${2 * u}`, stroke: "#222",
        "stroke-width": 0.35 * u});
  }
  for (const name of data.ground) {
    const x = data.points[name][0][0], y = -data.points[name][1][0], w = 2 * u;
    make(svg, "polygon", {points: `${x},${y} ${x - w},${y + 1.5 * w} ${x + w},${y + 1.5 * w}`, fill: "#f2f2f2",
      stroke: "#222", "stroke-width": 0.3 * u});
    make(svg, "line", {x1: x - 1.5 * w, x2: x + 1.5 * w, y1: y + 1.5 * w, y2: y + 1.5 * w, stroke: "#222",
      "stroke-width": 0.4 * u});
    text(svg, x + 3.4 * u, y, name, 2.6 * u, "#222");
  }
  const moving = make(svg, "g", {});
  function draw(k) {
    moving.textContent = "";
    for (const guide of data.guides) {
      const [x1, y1, x2, y2] = guide.map(path => path[k]);
      make(moving, "line", {x1: x1, y1: -y1, x2: x2, y2: -y2, stroke: "#222",
        opacity: 0.25, "stroke-width": 2.4 * u, "stroke-linecap": "round"});
    }
    for (const link of data.links) {
      const x = link.points.map(name => data.points[name][0][k]), y = link.points.map(name =>
      data.points[name][1][k]); const solid = link.points.length > 2; const shape = make(moving, solid ?
      "polygon" : "polyline", {points: line(x, y), stroke: link.colour,
        fill: solid ? link.colour : "none", "fill-opacity": 0.15, "stroke-width": (solid ? 0.7 : 1.2) * u,
        "stroke-linejoin": "round", "stroke-linecap": "round"});
      const title = document.createElementNS(SVG, "title");
      title.textContent = link.name;
      shape.appendChild(title);
    }
    for (const name of data.ground.concat(data.pins))
      make(moving, "circle", {cx: data.points[name][0][k], cy: -data.points[name][1][k], r: 0.9 * u, fill: "#fff",
        stroke: "#222", "stroke-width": 0.35 * u});
    for (const body of data.bodies)
      if (body.angles.length)
        frame(moving, data.points[body.point][0][k], data.points[body.point][1][k], body.angles[k], body.colour,
        1);
  }
  const bar = root.appendChild(document.createElement("div"));
  bar.className = "bar";
  const button = bar.appendChild(document.createElement("button"));
  button.type = "button";
  const slider = bar.appendChild(document.createElement("input"));
  slider.type = "range"; slider.min = 0; slider.max = data.input.length - 1; slider.value = 0;
  slider.setAttribute("aria-label", data.driven);
  const output = bar.appendChild(document.createElement("output"));
  const every = Math.ceil(data.poses.length / 24);
  data.poses.forEach((where, number) => {
    if (where === null || number % every) return;
    const jump = bar.appendChild(document.createElement("button"));
    jump.type = "button"; jump.textContent = "pose " + number;
    jump.onclick = () => { stop(); show(where); };
  });
  let at = 0, way = 1, timer = null, rest = 0;
  function show(k) {
    at = k; slider.value = k; draw(k);
    output.textContent = data.driven + " " + data.input[k].toFixed(1) + data.unit;
  }
  function stop() { clearInterval(timer); timer = null; button.textContent = "▶ play"; }
  function start() {
    button.textContent = "❚❚ pause";
    timer = setInterval(() => {
      if (rest > 0) { rest -= 1; return; }
      const last = data.input.length - 1;
      if (data.working) { if (at + way < 0 || at + way > last) way = -way; show(at + way); }
      else show((at + 1) % (last + 1));
      if (data.working && data.poses.includes(at)) rest = 14;
    }, 33);
  }
  button.onclick = () => timer === null ? start() : stop();
  slider.oninput = () => { stop(); show(Number(slider.value)); };
  stop(); show(data.poses[0] || 0);
  if (auto && !matchMedia("(prefers-reduced-motion: reduce)").matches) start();
}
for (const root of document.querySelectorAll(".player"))
  play(root, JSON.parse(root.querySelector("script").textContent), root.dataset.auto === "yes");
"""
