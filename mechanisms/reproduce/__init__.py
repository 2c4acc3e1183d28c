"""Published numbers beside ours.

A new paper is one module with a function ``comparisons() -> list[Comparison]`` and one line in the table.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from mechanisms.reproduce.comparison import Comparison

if TYPE_CHECKING:
    from rich.console import RenderableType

#: name on the command line -> (module, author and title)
PAPERS: dict[str, tuple[str, str]] = {
    "kiper": (
        "mechanisms.reproduce.kiper",
        "G. Kiper, Motion synthesis of a planar Watt II type six-bar mechanism with two end-effectors",
    ),
    "suarez": (
        "mechanisms.reproduce.suarez",
        "H. A. Suárez-Velásquez, J. J. Cervantes-Sánchez, J. M. Rico-Martínez, "
        "Synthesis of a novel planar linkage to visit up to eight poses",
    ),
    "watt2-24": (
        "mechanisms.reproduce.watt24",
        "Watt-II path generation through twenty-four precision points",
    ),
    "robomech": (
        "mechanisms.reproduce.robomech",
        "Structurally parametric synthesis and position analysis of a RoboMech class parallel manipulator with two "
        "end-effectors, IAENG Int. J. Applied Mathematics 50(2), 2020",
    ),
    "krovi": (
        "mechanisms.reproduce.krovi",
        "V. Krovi, G. K. Ananthasuresh, V. Kumar, "
        "Kinematic and kinetostatic synthesis of planar coupled serial chain mechanisms",
    ),
}

__all__ = ["PAPERS", "Comparison", "comparison_table", "reproduce"]


def reproduce(paper: str) -> list[Comparison]:
    """Compute every number of a paper again.

    Parameters
    ----------
    paper : str
        A key of `PAPERS`.

    Returns
    -------
    list of Comparison
        In the order of the paper.

    Examples
    --------
    >>> items = reproduce("kiper")
    >>> sorted({item.verdict for item in items})
    ['agrees', 'inferred', 'misprint', 'not so']
    """
    return import_module(PAPERS[paper][0]).comparisons()


#: Terminals narrower than this get the reasons below the table instead of beside it.
WIDE = 140


def comparison_table(paper: str, items: list[Comparison], width: int = 160) -> RenderableType:
    """The comparison as a table, with a count of the verdicts below it.

    Parameters
    ----------
    paper : str
        A key of `PAPERS`.
    items : list of Comparison
    width : int
        Columns of the terminal.
    """
    from collections import Counter

    from rich.box import SIMPLE_HEAD
    from rich.console import Group
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1), header_style="bold")
    table.add_column("where", no_wrap=True)
    table.add_column("what")
    table.add_column("printed", justify="right", overflow="fold")
    table.add_column("ours", justify="right", overflow="fold")
    table.add_column("verdict", no_wrap=True)
    if width >= WIDE:
        table.add_column("why", ratio=1, overflow="fold")
    colours = {"agrees": "green", "differs": "bold red"}
    last = ""
    for item in items:
        colour = colours.get(item.verdict, "yellow")
        where, last = ("" if item.where == last else item.where), item.where
        verdict = f"[{colour}]{item.verdict}[/{colour}]"
        row = [where, item.what, item.printed, item.shown, verdict]
        table.add_row(*row, *([item.why] if width >= WIDE else []))
    counts = Counter(item.verdict for item in items)
    summary = ", ".join(f"{count} {verdict}" for verdict, count in counts.most_common())
    reasons = [f"[bold]{i.where}, {i.what}:[/bold] {i.why}" for i in items if i.why and width < WIDE]
    return Group(PAPERS[paper][1], table, *reasons, f"{len(items)} items: {summary}")
