"""The sub-commands of ``everylinkage catalogue``: list, verify, build."""

from __future__ import annotations

from typing import Any

import click

from mechanisms.console import console, print_json, say

__all__ = ["catalogue"]


@click.group()
def catalogue() -> None:
    """Generic solutions that are shipped, so that a task is one parameter homotopy away."""


@catalogue.command("list")
@click.argument("family", default="")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def list_command(family: str, as_json: bool) -> int:
    """List the entries, of one FAMILY or of all."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    from mechanisms.catalogue import names
    from mechanisms.catalogue.entries import FOLDER, CatalogueError, _read

    entries: list[dict[str, Any]] = []
    for name in names(family):
        try:
            entries.append(_read(name, FOLDER)[0])
        except CatalogueError as error:
            entries.append({"name": name, "problem": str(error)})
    if as_json:
        print_json(entries)
        return 0
    table = Table(box=SIMPLE_HEAD, pad_edge=False, padding=(0, 1), header_style="bold")
    for column, side in (
        ("name", "left"),
        ("roots", "right"),
        ("certified", "right"),
        ("what", "left"),
        ("evidence", "left"),
    ):
        table.add_column(column, justify=side, no_wrap=column in ("name", "roots", "certified"))  # type: ignore[arg-type]
    for entry in entries:
        if "problem" in entry:
            table.add_row(entry["name"], "–", "–", "[red]missing or damaged[/red]", entry["problem"])
        else:
            counts = str(entry["count"]), str(entry["certified_distinct"])
            table.add_row(entry["name"], *counts, entry["title"], entry["evidence"])
    console().print(table)
    return 0


@catalogue.command()
@click.argument("family", default="")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def verify(family: str, as_json: bool) -> int:
    """Check that the entries are what their manifests say: files, roots, certificates, counts."""
    from mechanisms.catalogue import names
    from mechanisms.catalogue import verify as verified

    good, report = True, {}
    for name in names(family):
        checks = verified(name)
        report[name] = [{"check": check, "passed": passed, "detail": detail} for check, passed, detail in checks]
        good &= all(passed for _, passed, _ in checks)
        if not as_json:
            for check, passed, detail in checks:
                click.echo(f"{name:28} {check:12} {'ok' if passed else 'FAILED':7} {detail}")
    if as_json:
        print_json(report)
    return 0 if good else 1


@catalogue.command()
@click.argument("name", metavar="FAMILY")
@click.option("--seed", type=int, default=None, metavar="S", help="Seed of the monodromy loops.")
@click.option("--jobs", type=int, default=1, metavar="N", help="Workers.")
@click.option("--json", "as_json", is_flag=True, help="Print the manifests as JSON.")
def build(name: str, seed: int | None, jobs: int, as_json: bool) -> int:
    """Make the entries of a FAMILY (or one entry) again, by monodromy, with trace test and certificate."""
    from mechanisms.catalogue import build as built
    from mechanisms.catalogue import names
    from mechanisms.catalogue.entries import SEED
    from mechanisms.progress import showing_progress
    from mechanisms.task import TaskError

    if jobs < 1:
        raise TaskError(f"--jobs: {jobs} workers cannot work; give 1 or more")
    wanted = (name,) if ":" in name else names(name)
    manifests = []
    for entry in wanted:
        with showing_progress() as progress:
            manifests.append(built(entry, seed=SEED if seed is None else seed, jobs=jobs, progress=progress))
        say(f"{entry}: {manifests[-1]['count']} roots; {manifests[-1]['evidence']}")
    if as_json:
        print_json(manifests)
    return 0
