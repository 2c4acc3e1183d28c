"""Reading and writing the polynomial systems of other programs.

A file is data: it is parsed by a grammar and never evaluated. Errors begin with line and column.
"""

from __future__ import annotations

from pathlib import Path

from solvers.formats.bertini import read_bertini, write_bertini
from solvers.formats.expressions import BYTE_ORDER_MARK, FormatError
from solvers.formats.phcpack import read_phcpack, write_phcpack
from solvers.system import System

#: Files larger than this are refused before they are read.
LARGEST_FILE = 200_000_000


def read_system(path: str | Path) -> System:
    """Read a system from a file in PHCpack's or Bertini's format, whichever it is.

    A file that begins with a number is PHCpack's.

    Raises
    ------
    FormatError
        The file is in neither format.
    OSError
        The file cannot be read.
    """
    path = Path(path)
    size = path.stat().st_size
    if size > LARGEST_FILE:
        raise FormatError("", 0, f"{path} has {size} bytes, more than {LARGEST_FILE}")
    try:
        text = path.read_bytes().decode("utf-8").removeprefix(BYTE_ORDER_MARK)
    except UnicodeDecodeError as error:
        raise FormatError("", 0, f"{path} is not text: byte {error.start} is not UTF-8") from None
    return read_phcpack(text) if text.lstrip()[:1].isdigit() else read_bertini(text)


__all__ = [
    "FormatError",
    "read_bertini",
    "read_phcpack",
    "read_system",
    "write_bertini",
    "write_phcpack",
]
