"""Results as text: the funnel, the table of designs, one design in full, the families."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from mechanisms import families

if TYPE_CHECKING:
    from rich.console import RenderableType

    from mechanisms.designs import Design
    from mechanisms.result import Result

__all__ = [
    "design_sheet",
    "error_cell",
    "families_table",
    "funnel_table",
    "headline",
    "moved_rows",
    "number",
    "result_table",
]

#: What the reason codes mean to a reader who sees them for the first time.
REASONS = {
    "degenerate": "no linkage at all",
    "complex": "not real",
    "inexact": "does not reach a pose",
    "circuit": "would have to be taken apart between poses",
    "branch": "a dead centre lies between poses",
    "order": "passes the poses in another order",
}
#: What is left after each stage, where the stage's own name does not say it.
STAGES = {
    "roots": "complex roots",
    "linkages": "possible linkages",
    "real": "real linkages",
    "designs": "designs with their free choices",
    "one circuit": "on one circuit",
    "one branch": "on one branch",
    "in order": "in order",
    "exact": "reach every pose",
    "accepted": "accepted designs",
}


def number(value: float | None, digits: int = 4) -> str:
    """A number for a table: `digits` significant ones, no exponent where none is needed.

    >>> number(37.302274), number(0.0001234567), number(None), number(1.5e7)
    ('37.30', '0.0001235', '–', '1.500e+07')
    """
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞"
    if value == 0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if not -5 < size < 6:
        return f"{value:.{digits - 1}e}"
    return f"{value:.{max(0, digits - 1 - size)}f}"


def headline(result: Result) -> list[str]:
    """What was asked and how completely it was answered, in a few lines."""
    task, roots, ledger = result.task, result.roots, result.ledger
    positions = [f"{len(poses)} poses of {body}" for body, poses in task.poses.items()]
    positions += [f"{len(points)} points of {body}" for body, points in task.points.items()]
    lines = [task.title] if task.title else []
    lines.append(f"{task.mechanism}: {', '.join(positions)}".replace(" of body", ""))
    if ledger.get("tracked"):
        parts = ["finite", "singular", "at_infinity", "failed"]
        account = " + ".join(f"{ledger.get(part, 0)} {part.replace('_', ' ')}" for part in parts)
        lines.append(f"paths: {ledger['tracked']} tracked = {account}")
    if ledger.get("tracked"):
        proved = f"{roots['certified']} of {roots['count']} certified, {roots['certified_real']} certified real"
        lines.append(f"roots: {proved}; {_completeness(roots)}")
    else:
        lines.append(str(roots.get("evidence", "")))
    return lines


def funnel_table(result: Result) -> RenderableType:
    """The funnel: how many were left after each test, and why the others went."""
    from rich.table import Table

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), show_header=False)
    table.add_column(justify="right", style="bold")
    table.add_column(no_wrap=True)
    table.add_column(style="dim")
    for stage in result.funnel:
        name = str(stage["stage"])
        words = STAGES.get(name) or f"meet {name.removeprefix('constraint:')}"
        gone = [_removed(code, count) for code, count in stage["removed"].items()]
        table.add_row(str(stage["left"]), words, ", ".join(gone))
    return table


def result_table(designs: Sequence[Design], unit: str = "", width: int = 160) -> RenderableType:
    """Designs as a table, one line each; on a narrow terminal the least telling columns are left out.

    Parameters
    ----------
    designs : sequence of Design
    unit : str
        The task's length unit.
    width : int
        Columns of the terminal.
    """
    from rich.box import SIMPLE_HEAD
    from rich.markup import escape
    from rich.table import Table

    columns = _columns(designs, unit)
    for name in _DROPPED_FIRST:
        if sum(_needed(head, cells) for head, cells in columns.items()) > width:
            columns.pop(next((head for head in columns if head.startswith(name)), ""), None)
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1), header_style="bold")
    for head, cells in columns.items():
        wraps = head in _WRAPPING
        table.add_column(
            escape(head),
            justify="left" if head in (*_WRAPPING, "id", "full\nturn") else "right",
            no_wrap=not wraps,
            overflow="fold",
            min_width=min(_WRAPPING.get(head, 99), max(map(len, [*head.split("\n"), *cells]))),
        )
    for number_of_row, design in enumerate(designs):
        row = [escape(cells[number_of_row]) for cells in columns.values()]
        row[1] = f"[{'green' if design.accepted else 'red'}]{row[1]}[/]"
        table.add_row(*row)
    return table


#: Columns that may wrap, and how narrow they may become.
_WRAPPING = {"verdict": 20, "note": 17}
#: Columns that are left out where there is no room, the first first.
_DROPPED_FIRST = ("angle", "full", "extent", "choices", "pose")
#: Errors above this are no rounding but the design's, and shown like other numbers.
_MEANT = 1e-4
#: Larger angle errors (radians) are worth a column.
_TELLING_ANGLE = 1e-9


def _columns(designs: Sequence[Design], unit: str) -> dict[str, list[str]]:
    """Heads and cells of the table of designs."""
    columns: dict[str, list[str]] = {
        head: [] for head in ("id", "verdict", "transm.\n°", "full\nturn", "link\nratio")
    }
    extent = f"extent\n[{unit}]" if unit else "extent"
    columns |= {head: [] for head in (extent, "pose\nerror")}
    if any((design.worst_angle_error or 0.0) > _TELLING_ANGLE for design in designs):
        columns["angle\nerror °"] = []
    if any("defect_free_share" in design.extra for design in designs):
        columns["choices free\nof defects"] = []
    if any(design.note for design in designs):
        columns["note"] = []
    for design in designs:
        built = design.linkage is not None
        share = design.extra.get("defect_free_share")
        reasons = ", ".join(reason.removeprefix("constraint:") for reason in design.reasons)
        cells = {
            "id": design.id,
            "verdict": reasons or "accepted",
            "transm.\n°": f"{design.min_transmission_deg:.1f}" if design.min_transmission_deg else "–",
            "full\nturn": ("yes" if design.full_rotation else "no") if design.verdicts else "–",
            "link\nratio": number(design.link_ratio, 3) if built else "–",
            extent: number(design.extent, 4) if built else "–",
            "pose\nerror": error_cell(design.worst_pose_error),
            "angle\nerror °": error_cell(design.worst_angle_error, 180 / math.pi),
            "choices free\nof defects": "–" if share is None else _percent(share),
            "note": design.note,
        }
        for head, column in columns.items():
            column.append(cells[head])
    return columns


def _needed(head: str, cells: Sequence[str]) -> int:
    """Columns of the terminal that a column of the table needs at least."""
    natural = max(map(len, [*head.split("\n"), *cells]))
    return 2 + min(natural, _WRAPPING.get(head, natural))


def design_sheet(design: Design, result: Result) -> RenderableType:
    """Everything about one design, as a workshop needs it: parameters, pivots, lengths, motion."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Group
    from rich.markup import escape
    from rich.table import Table

    unit = escape(result.task.length_unit)
    state = "accepted" if design.accepted else "; ".join(_explained(code) for code in design.reasons)
    parts: list[Any] = [
        f"[bold]{design.id}[/bold]  {state}" + (f"  ({escape(design.note)})" if design.note else "")
    ]

    def block(title: str, rows: Sequence[tuple[str, ...]], heads: tuple[str, ...]) -> None:
        if not rows:
            return
        table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
        for n, head in enumerate(heads):
            table.add_column(head, justify="left" if n == 0 else "right")
        for row in rows:
            table.add_row(*row)
        parts.append(table)

    def scalar(value: Any) -> tuple[str, ...]:
        return (_long(value.real), _long(value.imag)) if isinstance(value, complex) else (_long(value), "")

    block("Parameters", [(k, *scalar(v)) for k, v in design.parameters.items()], ("name", "x or value", "y"))
    if design.linkage is not None:
        points = [(k, _long(z.real), _long(z.imag)) for k, z in design.linkage.points.items()]
        block(f"Points in pose 0{f' ({unit})' if unit else ''}", points, ("point", "x", "y"))
        lengths = [
            (link, f"{a}-{b}", _long(abs(design.linkage.points[a] - design.linkage.points[b])))
            for link, names in design.linkage.links.items()
            for k, a in enumerate(names)
            for b in names[k + 1 :]
        ]
        block(f"Lengths{f' ({unit})' if unit else ''}", lengths, ("link", "from-to", "length"))
    verdicts = [
        (
            name + (" (decides)" if name == design.input else ""),
            *("yes" if v[key] else "no" for key in ("same_circuit", "same_branch", "in_order", "full_rotation")),
            f"{v['min_transmission_deg']:.2f}",
        )
        for name, v in design.verdicts.items()
    ]
    heads = ("driven link", "one circuit", "one branch", "in order", "full turn", "transm. °")
    block("Motion", verdicts, heads)
    block(f"Moved{f' ({unit})' if unit else ''}", moved_rows(design), ("position", "x", "y", "angle °"))
    for name, value in design.extra.items():
        if name == "moved":
            continue
        parts.append(f"{name.replace('_', ' ')}: {value:.4g}" if isinstance(value, float) else f"{name}: {value}")
    return Group(*parts)


def moved_rows(design: Design) -> list[tuple[str, ...]]:
    """How far a design misses each position on purpose, within tolerances: number, x, y, degrees; else no rows."""
    moved = design.extra.get("moved", ())
    return [(str(k), *(f"{value:+.4g}" if value else "0" for value in row)) for k, row in enumerate(moved)]


def families_table() -> RenderableType:
    """What can be synthesised."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1), header_style="bold")
    for column in ("name", "what", "task", "unknowns", "roots", "source"):
        table.add_column(column, no_wrap=column == "name", overflow="fold")
    for row in family_rows():
        table.add_row(*(row[key] for key in ("name", "summary", "task", "unknowns", "roots", "source")))
    return table


def family_rows() -> list[dict[str, Any]]:
    """The families as plain data."""
    rows = []
    for name in families.names():
        family = families.family(name)
        rows.append(
            {
                "name": name,
                "summary": family.summary,
                "task": family.needs,
                "unknowns": family.unknowns,
                "roots": family.roots,
                "source": family.source,
                "pose_counts": list(family.pose_counts),
                "point_counts": list(family.point_counts),
                "effectors": list(family.effectors),
                "free": [{"key": item.key, "meaning": item.meaning} for item in family.free],
                "inputs": list(family.inputs),
                "exact": family.exact,
                "catalogue": family.catalogue,
            }
        )
    return rows


def _completeness(roots: Mapping[str, Any]) -> str:
    words = {True: "complete", False: "NOT complete", None: "completeness not proved"}
    return f"{words[roots.get('complete')]}: {roots.get('evidence', '')}"


def _removed(code: str, count: int) -> str:
    return f"−{count} {code.removeprefix('constraint:')}" + (f" ({REASONS[code]})" if code in REASONS else "")


def _explained(code: str) -> str:
    return f"{code}: {REASONS[code]}" if code in REASONS else code


def error_cell(value: float | None, unit: float = 1.0) -> str:
    """An error for a table: the power of ten of rounding, the digits of what a design misses on purpose.

    >>> error_cell(3.2e-14), error_cell(3.5365), error_cell(0.0), error_cell(None)
    ('3e-14', '3.54', '0', '–')
    """
    if value is None:
        return "–"
    return f"{unit * value:.0e}" if 0 < value < _MEANT else number(unit * value, 3)


def _percent(share: float) -> str:
    if not share:
        return "0"
    percent = 100 * share
    return f"{percent:.0f} %" if percent >= 10 else f"{percent:.2g} %" if percent >= 1e-3 else f"{percent:.0e} %"


def _long(value: float) -> str:
    return f"{value:.9g}"
