"""The sub-command ``everylinkage map``: the map of all four-bars through four poses."""

from __future__ import annotations

from pathlib import Path

import click

from mechanisms.console import say
from mechanisms.task import Task, TaskError

__all__ = ["map_command"]

FORMATS = ("svg", "png", "pdf")


@click.command("map")
@click.argument("task", metavar="TASK.toml")
@click.option("-o", "--output", default="map.svg", metavar="FILE", help="svg, png or pdf (default map.svg).")
@click.option("--pick", nargs=2, type=float, metavar="DRIVEN FOLLOWING", help="Draw the four-bar of these two numbers.")
def map_command(task: str, output: str, pick: tuple[float, float] | None) -> int:
    """Draw the map of all four-bars through four poses.

    Each pair of dyads is a place in the map, shaded by what becomes of it. A design is made of two numbers read off
    the map by writing them into the task: dyad1 and dyad2 in its [free] table.
    """
    from mechanisms.families.base import BODY
    from mechanisms.families.solution_map import SolutionMap

    given = Task.from_file(task)
    if given.mechanism != "four-bar-motion" or len(given.poses.get(BODY, ())) != 4 or given.points:
        raise TaskError(f"{task}: the map belongs to a four-bar-motion task of four poses and no points")
    path = Path(output)
    if path.suffix.lower().removeprefix(".") not in FORMATS:
        raise TaskError(f"cannot draw {path.suffix or 'a file without ending'}; use one of {', '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise TaskError(f"there is no folder {path.parent}; make it, or choose another place for {path.name}")
    found = SolutionMap.of(given)
    found.plot(path, pick)
    say(f"{100 * found.share():.0f} % of the pairs of dyads can be used; wrote {path}")
    return 0
