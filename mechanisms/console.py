"""Where the command writes: results to standard output, everything else to standard error."""

from __future__ import annotations

import json
import os
import sys
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["console", "print_json", "say"]

#: Columns of a table that goes into a file or a pipe.
PIPED_WIDTH = 160


def say(message: str) -> None:
    """A line on standard error."""
    click.echo(message, err=True)


def print_json(document: Any) -> None:
    """JSON on standard output."""
    click.echo(json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False))


def console() -> Console:
    """A console on standard output, as wide as the terminal, or wide enough for tables elsewhere."""
    from rich.console import Console

    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else PIPED_WIDTH
    return Console(highlight=False, width=width, soft_wrap=False)
