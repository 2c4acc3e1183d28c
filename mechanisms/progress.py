"""Progress on standard error: a bar on a terminal, plain lines elsewhere, nothing in the way of the results."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

__all__ = ["motion_needs_compiling", "showing_progress"]

#: Seconds after which a stage that says nothing is explained.
PATIENCE = 2.0


def motion_needs_compiling() -> bool:
    """Whether the first motion will wait for machine code that is not in the cache yet.

    Only for a message: where Numba keeps its cache is its own affair, and not knowing means saying nothing.
    """
    from pathlib import Path

    from mechanisms import tube

    try:
        cache: Any = getattr(tube.trace, "_cache")  # noqa: B009
        return not Path(cache._cache_file._index_path).exists()
    except AttributeError:
        return False


@contextmanager
def showing_progress() -> Iterator[Callable[[str, int, int], None]]:
    """A function ``progress(what, done, total)`` whose calls are shown on standard error.

    On a terminal there is one bar that goes away at the end.  Elsewhere every new stage is one line, and so is the
    state of a long one every few seconds.
    """
    if sys.stderr.isatty():
        with _bar() as progress:
            yield progress
    else:
        yield _lines()


@contextmanager
def _bar() -> Iterator[Callable[[str, int, int], None]]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        line = bar.add_task("starting", total=None)

        def progress(what: str, done: int, total: int) -> None:
            bar.update(line, description=what, completed=done, total=total if total > 1 else None)

        yield progress


def _lines() -> Callable[[str, int, int], None]:
    last, spoken = "", 0.0

    def progress(what: str, done: int, total: int) -> None:
        nonlocal last, spoken
        now = time.monotonic()
        if what != last:
            print(what, file=sys.stderr, flush=True)
        elif now - spoken > PATIENCE and total > 1:
            print(f"{what}: {done} of {total}", file=sys.stderr, flush=True)
        else:
            return
        last, spoken = what, now

    return progress
