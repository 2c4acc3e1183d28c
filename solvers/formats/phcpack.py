"""PHCpack's text format: the number of equations, then the polynomials, each ended by a semicolon.

The first line may hold a second number, the number of unknowns; a polynomial begins on that line only if it cannot be
taken for a count. Unknowns are all names that occur, in order of appearance; `i` and `I` are the imaginary unit. What
follows the last polynomial (title, solutions) is not read.
"""

from __future__ import annotations

import re
from typing import Any

from solvers.degrees import degree_bounds
from solvers.formats.expressions import BYTE_ORDER_MARK, LARGEST_EXPONENT, FormatError, Reader, Value
from solvers.formats.numbers import coefficient
from solvers.from_sympy import InvalidSystem
from solvers.graph import Builder
from solvers.supports import terms
from solvers.system import System
from solvers.tape import exact

#: More equations than this in the first line are taken for a mistake.
LARGEST_COUNT = 100_000
_UNITS = ("i", "I")
#: Names that PHCpack itself misreads: its scanner takes a lone e or E for the exponent of a number.
_MISREAD = ("e", "E")


def read_phcpack(text: str) -> System:
    """Read a system in PHCpack's format.

    Parameters
    ----------
    text : str
        The contents of the file.

    Returns
    -------
    System
        Its unknowns are the names, as strings, in order of appearance.

    Raises
    ------
    FormatError
        The text is not in the format; the message begins with line and column.

    Examples
    --------
    >>> system = read_phcpack("2\\n x1**2 + 3*i*x10 - 1;\\n x1*x10 - 1/2;\\n")
    >>> system.unknowns, system.degrees
    (('x1', 'x10'), (2, 2))
    """
    text = text.removeprefix(BYTE_ORDER_MARK)
    reader = Reader(text)
    equations, unknowns = _first_line(reader)
    names = _names(reader, equations)
    if unknowns is not None and unknowns != len(names):
        raise FormatError(
            text,
            0,
            f"the first line promises {unknowns} unknowns, but {len(names)} occur: {', '.join(names[:20])}",
        )
    builder = reader.builder = Builder(len(names), 0)
    known: dict[str, Value] = {unit: exact(1j) for unit in _UNITS}
    known.update({name: builder.unknown(k) for k, name in enumerate(names)})
    reader.names = known
    nodes = []
    for number in range(equations):
        if reader.kind == "end":
            raise reader.error(f"the first line promises {equations} polynomials, the text ends after {number}")
        place = reader.at
        nodes.append(reader.node(reader.sum(), place))
        reader.expect(";", f"at the end of polynomial {number + 1}")
    return finish(reader, nodes, names)


def finish(reader: Reader, nodes: list[int], names: list[str], groups: Any = None) -> System:
    """Freeze the equations as a System, unless their degree is absurd."""
    assert reader.builder is not None
    program = reader.builder.finish({"F": nodes})
    degree = max(degree_bounds(program, set(range(program.unknowns))), default=0)
    if degree > LARGEST_EXPONENT:
        raise FormatError(
            reader.text, 0, f"an equation may have the degree {degree}, more than {LARGEST_EXPONENT}"
        )
    if not names:
        raise FormatError(reader.text, 0, "the system has no unknowns")
    return System.from_program(program, unknowns=names, groups=groups)


def _first_line(reader: Reader) -> tuple[int, int | None]:
    """The numbers of equations and, where it is given, of unknowns."""
    equations = _count(reader, "the first line must be the number of equations")
    line_end = re.compile(r"[\r\n]|\Z").search(reader.text, reader.offsets[0])
    assert line_end is not None
    unknowns = None
    if reader.kind == "number" and reader.offsets[reader.at] < line_end.start():
        unknowns = _count(reader, "behind the number of equations, only the number of unknowns may stand on its line")
    on_line = reader.kind != "end" and reader.offsets[reader.at] < line_end.start()
    # PHCpack would take 3 in "2 3*x" for the number of unknowns, and "1 - x;" may be a polynomial without a count.
    if on_line and reader.kind != "name" and reader.word != "(":
        raise reader.error(f"a polynomial that begins with a number or a sign needs a new line, {reader.found()}")
    return equations, unknowns


def _count(reader: Reader, message: str) -> int:
    word = reader.word
    if not reader.is_whole() or len(word) > 9 or not 0 < int(word) <= LARGEST_COUNT:
        raise reader.error(f"{message}, {reader.found()}")
    reader.at += 1
    return int(word)


def _names(reader: Reader, equations: int) -> list[str]:
    """Names in order of appearance, up to the last semicolon that counts."""
    names: dict[str, None] = {}
    left = equations
    for k in range(reader.at, len(reader.words)):
        word = reader.words[k]
        if word == ";":
            left -= 1
            if left == 0:
                break
        elif reader.kinds[k] == "name" and word not in _UNITS:
            names[word] = None
    return list(names)


def write_phcpack(system: System, parameters: Any = None) -> str:
    """A system at given parameters as text in PHCpack's format, multiplied out.

    Raises
    ------
    InvalidSystem
        An unknown has a name that PHCpack takes for a number (i, I, e, E) or cannot read; or a number is beyond
        the range of double precision.
    TooManyTerms
        The equations are too large to be multiplied out.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> print(write_phcpack(System([x**2 - 2*y, x + y - 1], [x, y])))
    2
     1*x^2 - 2*y;
     1*x + 1*y - 1;
    <BLANKLINE>
    """
    names = [str(name) for name in system.unknowns]
    for name in names:
        if name in _UNITS or name in _MISREAD:
            raise InvalidSystem(f"the unknown {name} cannot be written: PHCpack takes it for a number; rename it")
        if not (name.isidentifier() and name.isascii()):
            raise InvalidSystem(f"the unknown {name!r} cannot be written: PHCpack reads letters and digits only")
    expanded = terms(system, parameters)
    rows, columns = system.size
    lines = [f"{rows}" if rows == columns else f"{rows} {columns}"]
    # PHCpack numbers unknowns by appearance: a sum that cancels fixes their order where it would differ.
    prefix = "" if _appearance(expanded.supports, columns) == list(range(columns)) else _order(names)
    for k, (support, row) in enumerate(zip(expanded.supports, expanded.exact)):
        try:
            numbers = [coefficient(value, "i") for value in row]
        except InvalidSystem as error:
            raise InvalidSystem(f"equation {k}, multiplied out: {error}") from None
        parts = []
        for exponents, number in zip(support.tolist(), numbers):
            factors = [n if e == 1 else f"{n}^{e}" for n, e in zip(names, exponents) if e]
            parts.append("*".join([number.lstrip("-"), *factors]))
            parts[-1] = ("- " if number.startswith("-") else "+ ") + parts[-1]
        body = prefix + (" ".join(parts) or "+ 0")
        prefix = ""
        # No program likes a sign with a space behind it at the beginning.
        body = body.removeprefix("+ ")
        lines.append(" " + ("-" + body[2:] if body.startswith("- ") else body) + ";")
    return "\n".join(lines) + "\n"


def _appearance(supports: Any, count: int) -> list[int]:
    seen: dict[int, None] = {}
    for support in supports:
        for exponents in support.tolist():
            seen.update({k: None for k, e in enumerate(exponents) if e})
    return list(seen) if len(seen) == count else []


def _order(names: list[str]) -> str:
    return "".join(f"{'+ ' if k else ''}{name} - {name} " for k, name in enumerate(names))
