"""A run as one self-contained web page: the task, the funnel, a table, and every design moving."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanisms.animation import page, player
from mechanisms.tables import REASONS, STAGES, error_cell, headline, moved_rows, number

if TYPE_CHECKING:
    from mechanisms.designs import Design
    from mechanisms.result import Result

__all__ = ["report_page", "write_report"]


def write_report(result: Result, path: str | Path, top: int = 20) -> None:
    """Write the report of a run.

    Parameters
    ----------
    result : Result
    path : path
        An HTML file.
    top : int
        At most that many designs are drawn; the table names them all.
    """
    Path(path).write_text(report_page(result, top), encoding="utf-8")


def report_page(result: Result, top: int = 20) -> str:
    """The page as text."""
    task = result.task
    built = [design for design in result.designs if design.linkage is not None]
    lines = headline(result)
    title = task.title or task.mechanism
    summary = lines[1:] if task.title else lines
    parts = [f"<h1>{escape(title)}</h1>"]
    parts += [f'<p class="faint">{escape(line)}</p>' for line in summary]
    parts += [f"<h2>{_count(len(result.accepted), 'design')} accepted</h2>", _funnel(result)]
    parts.append(_designs_table(built, task.length_unit))
    if built:
        parts.append("<h2>Designs</h2>")
        parts.append('<div class="cards">' + "".join(_card(design, result) for design in built[:top]) + "</div>")
    if len(built) > top:
        parts.append(f'<p class="faint">… and {len(built) - top} more, not drawn here.</p>')
    parts += ["<h2>Task</h2>", _task(result)]
    parts.append(f'<p class="faint">everylinkage {escape(result.version)}, seed {result.seed}</p>')
    return page(title, "\n".join(parts))


def _funnel(result: Result) -> str:
    rows = []
    for stage in result.funnel:
        name = str(stage["stage"])
        words = STAGES.get(name) or f"meet {name.removeprefix('constraint:')}"
        gone = [f"−{n} {c.removeprefix('constraint:')}" + (f": {REASONS[c]}" if c in REASONS else "")
                for c, n in stage["removed"].items()]  # fmt: skip
        rows.append([str(stage["left"]), words, ", ".join(gone)])
    return _table([], rows, text={1, 2})


def _designs_table(designs: Sequence[Design], unit: str) -> str:
    if not designs:
        return "<p>No design.</p>"
    heads = [
        "id",
        "verdict",
        "transmission °",
        "full turn",
        "link ratio",
        f"extent {unit}".strip(),
        "pose error",
        "",
    ]
    rows: list[list[Any]] = []
    for design in designs:
        rows.append(
            [
                _Html(f'<a href="#{escape(design.id)}">{escape(design.id)}</a>'),
                _verdict(design),
                number(design.min_transmission_deg or None, 3),
                ("yes" if design.full_rotation else "no") if design.verdicts else "–",
                number(design.link_ratio, 3),
                number(design.extent),
                error_cell(design.worst_pose_error),
                design.note,
            ]
        )
    return _table(heads, rows, text={1, 7})


def _card(design: Design, result: Result) -> str:
    unit = result.task.length_unit
    linkage = design.linkage
    assert linkage is not None
    facts = []
    if design.min_transmission_deg:
        facts.append(f"transmission ≥ {design.min_transmission_deg:.1f}°")
    facts.append(f"link ratio {number(design.link_ratio, 3)}")
    facts.append(f"extent {number(design.extent)} {unit}".strip())
    points = [[name, f"{z.real:.6g}", f"{z.imag:.6g}"] for name, z in linkage.points.items()]
    lengths = [[pair, f"{length:.6g}"] for pair, length in design.links.items()]
    parameters = [[name, _value(value)] for name, value in design.parameters.items()]
    moved = moved_rows(design)
    sheet = (
        (_table([f"position moved {unit}".strip(), "x", "y", "angle °"], moved) if moved else "")
        + _table([f"point {unit}".strip(), "x", "y"], points)
        + _table([f"length {unit}".strip(), ""], lengths)
        + _table(["parameter", ""], parameters)
    )
    return (
        f'<section class="card" id="{escape(design.id)}"><h3>{escape(design.id)} {_verdict(design).html}</h3>'
        f'<p class="faint">{escape(" · ".join(facts))}</p>{_note(design)}{player(design, result.task)}'
        f"<details><summary>dimensions</summary>{sheet}</details></section>"
    )


def _task(result: Result) -> str:
    rows: list[list[Any]] = []
    for body, poses in result.task.poses.items():
        for k, pose in enumerate(poses):
            rows.append(
                [f"{body} {k}", f"{pose.point.real:g}", f"{pose.point.imag:g}", f"{math.degrees(pose.angle):g}"]
            )
    for body, points in result.task.points.items():
        for k, point in enumerate(points):
            rows.append([f"{body} {k}", f"{point.real:g}", f"{point.imag:g}", ""])
    unit = result.task.length_unit
    mapping = result.task.to_dict()
    choices = [[f"{table}.{key}", str(value)] for table in ("free", "constraints", "solve")
               for key, value in mapping.get(table, {}).items()]  # fmt: skip
    heads = ["position", f"x {unit}".strip(), f"y {unit}".strip(), "angle °"]
    return _table(heads, rows) + (_table(["choice", ""], choices) if choices else "")


class _Html:
    """Text that is HTML already."""

    def __init__(self, html: str) -> None:
        self.html = html


def _verdict(design: Design) -> _Html:
    if design.accepted:
        return _Html('<span class="good">accepted</span>')
    short = ", ".join(code.removeprefix("constraint:") for code in design.reasons)
    words = "; ".join(REASONS.get(code, code) for code in design.reasons)
    return _Html(f'<span class="bad" title="{escape(words)}">{escape(short)}</span>')


def _note(design: Design) -> str:
    return f'<p class="faint">{escape(design.note)}</p>' if design.note else ""


def _value(value: Any) -> str:
    if isinstance(value, complex):
        return f"{value.real:.6g} {'+' if value.imag >= 0 else '−'} {abs(value.imag):.6g}i"
    return f"{value:.6g}"


def _table(heads: Sequence[str], rows: Iterable[Sequence[Any]], text: set[int] | None = None) -> str:
    text = text or set()

    def cell(tag: str, k: int, value: Any) -> str:
        kind = ' class="text"' if k in text else ""
        return f"<{tag}{kind}>{value.html if isinstance(value, _Html) else escape(str(value))}</{tag}>"

    head = "".join(cell("th", k, value) for k, value in enumerate(heads))
    body = "".join("<tr>" + "".join(cell("td", k, v) for k, v in enumerate(row)) + "</tr>" for row in rows)
    top = f"<thead><tr>{head}</tr></thead>" if heads else ""
    return f'<div class="scroll"><table>{top}<tbody>{body}</tbody></table></div>'


def _count(count: int, word: str) -> str:
    return f"{count} {word}{'' if count == 1 else 's'}"
