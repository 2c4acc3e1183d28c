"""The command ``everylinkage``: each sub-command is one call that Python offers too.

Results go to standard output, everything else to standard error.  Exit codes: 0 done, also when the answer is that
there is no design; 2 the input or the options are wrong; 3 stopped by the user, what was found is kept; 1 anything
else.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import click

from mechanisms import __version__
from mechanisms.catalogue_command import catalogue
from mechanisms.checks import suggest
from mechanisms.console import console, print_json, say
from mechanisms.interrupts import remembering_interrupts
from mechanisms.map_command import map_command
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from mechanisms.result import Result

OK, FAILED, WRONG, STOPPED = 0, 1, 2, 3
#: Designs that a table shows unless asked for more.
TOP = 20
#: Remarks on a whole task that are printed below it.
REMARKS = 3
BACKENDS = ("threads", "processes", "dask", "ray")
#: What some of them import, which is not installed by default.
NEEDED = {"dask": "distributed", "ray": "ray"}


class _Group(click.Group):
    """A group of commands that says which one was probably meant."""

    def resolve_command(self, context: click.Context, args: list[str]) -> Any:
        name = args[0] if args else ""
        if self.get_command(context, name) is None and not name.startswith("-"):
            raise click.UsageError(f"there is no command '{name}'; {suggest(name, self.list_commands(context))}")
        return super().resolve_command(context, args)


@click.group(cls=_Group, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="everylinkage")
def cli() -> None:
    """Every linkage that performs a task.

    Write the task into a TOML file, solve it, look at the designs:

    \b
        everylinkage solve task.toml --run run.db
        everylinkage show run.db D005
        everylinkage plot run.db D005 -o D005.gif
    """


@cli.command("families")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def families_command(as_json: bool) -> None:
    """List what can be synthesised."""
    from mechanisms import tables

    if as_json:
        print_json(tables.family_rows())
    else:
        console().print(tables.families_table())


@cli.command()
@click.argument("task", metavar="TASK.toml")
@click.option("--run", "run", metavar="RUN.db", help="Keep the run in this file, as paths finish.")
@click.option("--jobs", type=int, default=None, metavar="N", help="Workers (default: one for each core).")
@click.option("--seed", type=int, default=None, metavar="S", help="Seed of every random choice.")
@click.option("--backend", default="threads", metavar="|".join(BACKENDS), help="What the workers are.")
@click.option("--resume", is_flag=True, help="Go on with a run that was stopped or killed.")
@click.option("--no-catalogue", is_flag=True, help="Solve from scratch, without the shipped generic solutions.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def solve(
    task: str,
    run: str | None,
    jobs: int | None,
    seed: int | None,
    backend: str,
    resume: bool,
    no_catalogue: bool,
    as_json: bool,
) -> int:
    """Find every root and every design of a task (- reads the task from standard input)."""
    from mechanisms.progress import showing_progress
    from mechanisms.synthesize import synthesize

    if jobs is not None and jobs < 1:
        raise TaskError(f"--jobs: {jobs} workers cannot work; give 1 or more")
    if seed is not None and not 0 <= seed < 2**63:
        raise TaskError(f"--seed: {seed} is no seed; give a whole number from 0 on")
    if backend not in BACKENDS:
        raise TaskError(f"--backend: there is no '{backend}'; {suggest(backend, BACKENDS)}")
    if backend in NEEDED and find_spec(NEEDED[backend]) is None:
        raise TaskError(f"--backend: {backend} needs more packages; pip install 'everylinkage[cluster]'")
    if resume and run is None:
        raise TaskError("--resume: name the run to go on with by --run RUN.db")
    asked = Task.from_file(task)
    with showing_progress() as progress:
        result = synthesize(
            asked,
            jobs=jobs or _cores(),
            seed=seed,
            backend=backend,
            run=run,
            resume=resume,
            catalogue=not no_catalogue,
            progress=progress,
        )
    if as_json:
        print_json(result.as_dict())
    else:
        _print_result(result, result.designs, TOP, everything=False)
        _print_hint(result, task, run)
    if result.state != "done":
        kept = f"; it is kept in {run}, add --resume to go on" if run else "; with --run RUN.db it would be kept"
        say(f"stopped: this is what was found so far{kept}")
        return STOPPED
    return OK


@cli.command()
@click.argument("run", metavar="RUN.db")
@click.argument("design", required=False)
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--sort", "key", metavar="KEY", help="Best first by this field; -KEY turns it round.")
@click.option("--where", "where", multiple=True, metavar="'FIELD > VALUE [and …]'", help="Only these designs.")
@click.option("--top", type=int, default=None, metavar="N", help=f"At most N designs (default {TOP}).")
@click.option(
    "--all", "everything", is_flag=True, help="Also the roots that are no real linkage, without a limit."
)
def show(
    run: str,
    design: str | None,
    as_json: bool,
    key: str | None,
    where: Sequence[str],
    top: int | None,
    everything: bool,
) -> int:
    """Show a run: its funnel and designs, or one DESIGN in full."""
    from mechanisms import query, tables

    result = _load(run)
    if top is not None and top < 1:
        raise TaskError(f"--top: {top} designs cannot be shown; give 1 or more")
    if design is not None:
        chosen = _design(result, design, run)
        if as_json:
            print_json(chosen.as_dict())
        else:
            console().print(tables.design_sheet(chosen, result))
        return OK
    designs = list(result.designs)
    for text in where:
        designs = query.select(designs, text)
    if key is not None:
        designs = query.sort(designs, key)
    if as_json:
        document = result.as_dict()
        kept = designs if top is None else designs[:top]
        document["designs"] = [d.as_dict() for d in kept]
        print_json(document)
    else:
        _print_result(result, designs, top or (None if everything else TOP), everything or bool(where))
    return OK


@cli.command()
@click.argument("run", metavar="RUN.db")
@click.argument("design")
@click.option("-o", "--output", metavar="FILE", help="svg, png, pdf, gif or html (default DESIGN.svg).")
@click.option("--input", "driven", metavar="LINK", default="", help="The driven link of an animation.")
def plot(run: str, design: str, output: str | None, driven: str) -> int:
    """Draw a DESIGN at its poses; animated for gif and html."""
    from mechanisms.plots import FORMATS, save_design

    chosen = _design(_load(run), design, run)
    path = _output(output or f"{chosen.id}.svg", FORMATS)
    _with_linkage(chosen)
    if driven and driven not in chosen.verdicts:
        raise TaskError(f"--input: {chosen.id} has no input '{driven}'; {suggest(driven, chosen.verdicts)}")
    save_design(chosen, path, task=_load(run).task, driven=driven)
    say(f"wrote {path}")
    return OK


@cli.command()
@click.argument("run", metavar="RUN.db")
@click.option("-o", "--output", default="report.html", metavar="FILE.html", help="Default report.html.")
@click.option("--top", type=int, default=TOP, metavar="N", help=f"At most N designs (default {TOP}).")
def report(run: str, output: str, top: int) -> int:
    """Write one self-contained page with every design of a run."""
    from mechanisms.report import write_report

    if top < 1:
        raise TaskError(f"--top: {top} designs cannot be shown; give 1 or more")
    result = _load(run)
    path = _output(output, ("html",))
    write_report(result, path, top)
    say(f"wrote {path}")
    return OK


@cli.command()
@click.argument("run", metavar="RUN.db")
@click.argument("design")
@click.option("-o", "--output", required=True, metavar="FILE", help="dxf, svg, csv or json.")
def export(run: str, design: str, output: str) -> int:
    """Write a DESIGN for CAD or another program."""
    from mechanisms.export import FORMATS, export_design

    result = _load(run)
    chosen = _design(result, design, run)
    path = _output(output, FORMATS)
    _with_linkage(chosen)
    export_design(chosen, path, result.task)
    say(f"wrote {path}")
    return OK


@cli.command()
@click.argument("paper")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def reproduce(paper: str, as_json: bool) -> int:
    """Compare every number printed in a PAPER with ours (all: every paper)."""
    from mechanisms import reproduce as papers

    known = (*papers.PAPERS, "all")
    if paper not in known:
        raise TaskError(f"there is no paper '{paper}'; {suggest(paper, known)}")
    names = list(papers.PAPERS) if paper == "all" else [paper]
    found = {name: papers.reproduce(name) for name in names}
    if as_json:
        print_json({name: [item.as_dict() for item in items] for name, items in found.items()})
    else:
        for name in names:
            out = console()
            out.print(papers.comparison_table(name, found[name], out.width))
    return OK


cli.add_command(catalogue)
cli.add_command(map_command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; returns the exit code.

    Errors of the user become one line on standard error and the exit code 2.
    """
    interrupted: list[int] = []
    try:
        with remembering_interrupts(interrupted):
            code = cli.main(
                args=None if arguments is None else list(arguments), prog_name="everylinkage", standalone_mode=False
            )
        return code if isinstance(code, int) else OK
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else "")
        return OK
    except click.ClickException as error:
        return _refuse(error.format_message())
    except (click.Abort, KeyboardInterrupt):
        say("stopped")
        return STOPPED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # so that closing it says nothing more
        return FAILED
    except Exception as error:
        if interrupted:  # Ctrl-C was lost in a callback of the compiler, which then stumbled over it
            say("stopped")
            return STOPPED
        if _users_fault(error):
            return _refuse(str(error))
        if isinstance(error, OSError) and isinstance(error.filename, str):  # a file that was named, in most cases
            return _refuse(f"cannot use {error.filename}: {error.strerror}")
        raise


def run() -> None:
    """The console script."""
    sys.exit(main())


def _users_fault(error: Exception) -> bool:
    if isinstance(error, TaskError):
        return True
    from mechanisms.catalogue.entries import CatalogueError
    from solvers.from_sympy import InvalidSystem
    from solvers.store import StoreError

    return isinstance(error, (StoreError, CatalogueError, InvalidSystem))


def _refuse(message: str) -> int:
    say(f"error: {' '.join(message.split())}")
    return WRONG


def _print_result(result: Result, designs: Sequence[Any], top: int | None, everything: bool) -> None:
    from mechanisms import tables

    out = console()
    for line in tables.headline(result):
        out.print(line, markup=False, soft_wrap=True)
    out.print()
    out.print(tables.funnel_table(result))
    shown = [d for d in designs if everything or d.linkage is not None]
    listed = shown if top is None else shown[:top]
    out.print()
    if listed:
        out.print(tables.result_table(listed, result.task.length_unit, out.width))
    elif not designs:
        out.print("no design" if result.state == "done" else "no design yet: the run was stopped")
    if len(listed) < len(shown):
        out.print(f"… and {len(shown) - len(listed)} more; --top N shows more", markup=False)
    # what is no root and no linkage says something of the whole task
    remarks = dict.fromkeys(d.note for d in designs if d.linkage is None and d.root is None and d.note)
    for remark in list(remarks)[:REMARKS] if not everything else ():
        out.print(remark, markup=False, soft_wrap=True)


def _print_hint(result: Result, task: str, run: str | None) -> None:
    if not result.designs:
        return
    if run is None:
        say(f"to draw and export designs: everylinkage solve {task} --run RUN.db")
    elif result.accepted:
        best = result.accepted[0].id
        say(f"next: everylinkage plot {run} {best} -o {best}.gif   or   everylinkage show {run} {best}")


def _load(run: str) -> Result:
    from mechanisms.result import Result

    return Result.load(run)


def _design(result: Result, name: str, run: str) -> Any:
    try:
        return result.design(name)
    except KeyError:
        ids = sorted(design.id for design in result.designs)
        some = f"there are {ids[0]} to {ids[-1]}" if ids else "it has none"
        raise TaskError(f"{run} has no design '{name}'; {some}") from None


def _with_linkage(design: Any) -> None:
    if design.linkage is None:
        raise TaskError(f"{design.id} is no linkage ({', '.join(design.reasons)}); choose another design")


def _output(name: str, formats: Sequence[str]) -> Any:
    from pathlib import Path

    path = Path(name)
    ending = path.suffix.lower().removeprefix(".")
    if ending not in formats:
        known = ", ".join(f".{item}" for item in formats)
        raise TaskError(f"-o: cannot tell the format of {path} from its ending; use {known}")
    if not path.parent.is_dir():
        raise TaskError(f"-o: the folder {path.parent} does not exist")
    return path


def _cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not every system has it
        return os.cpu_count() or 1


if __name__ == "__main__":
    run()
