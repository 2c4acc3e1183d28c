"""Bertini's text format: declarations and assignments, each ended by a semicolon.

Read are variable_group, variable, function, constant, subfunctions, the CONFIG block (skipped), and comments
from % to the end of the line. `I` is the imaginary unit. Several variable groups become the groups of the system.
Refused, with a sentence: homogeneous groups, user-defined homotopies, random numbers and functions such as sin.
"""

from __future__ import annotations

import re
from typing import Any

from solvers.formats.expressions import BYTE_ORDER_MARK, FormatError, Reader, Value
from solvers.formats.numbers import coefficient
from solvers.formats.phcpack import finish
from solvers.from_sympy import InvalidSystem
from solvers.graph import Builder
from solvers.system import System
from solvers.tape import ADD, FMA, FMS, FNMA, INV, MUL, NEG, SQR, SUB, exact

_REFUSED = {
    "hom_variable_group": "homogeneous coordinates are not read: set one of them to 1 and use variable_group",
    "pathvariable": "user-defined homotopies are not read: give the system at its target",
    "parameter": "user-defined homotopies are not read: give the parameters as constants",
    "random": "random numbers are not read: give them as constants",
    "random_real": "random numbers are not read: give them as constants",
    "definedSubfunction": "defined subfunctions are not read",
}
_FUNCTIONS = ("sin", "cos", "tan", "exp", "log", "sqrt", "pow", "arcsin", "arccos", "arctan")
_UNIT = "I"
_RESERVED = {_UNIT, "Pi", "pi", "i", "END", "INPUT", "CONFIG", *_FUNCTIONS, *_REFUSED}
_RESERVED |= {"variable", "variable_group", "function", "constant"}


def read_bertini(text: str) -> System:
    """Read a system in Bertini's format.

    Parameters
    ----------
    text : str
        The contents of the file.

    Returns
    -------
    System
        Its unknowns are the names, as strings, in the order of their declaration.

    Raises
    ------
    FormatError
        The text is not in the format; the message begins with line and column.

    Examples
    --------
    >>> system = read_bertini("variable_group x, y; function f, g; f = x^2 - I; s = x*y; g = s - 1;")
    >>> system.unknowns, system.degrees
    (('x', 'y'), (2, 2))
    """
    text = text.removeprefix(BYTE_ORDER_MARK)
    reader = _BertiniReader(text, _input_starts(text), comment="%")
    groups, functions = _declarations(reader)
    names = [name for group in groups for name in group]
    builder = reader.builder = Builder(len(names), 0)
    known: dict[str, Value] = {_UNIT: exact(1j)}
    known.update({name: builder.unknown(k) for k, name in enumerate(names)})
    reader.names = known
    _assignments(reader, known, names)
    nodes = []
    for name, place in functions.items():
        if name not in known:
            raise reader.error(f"the function {name} is declared but never defined", place)
        nodes.append(reader.node(known[name], place))
    return finish(reader, nodes, names, groups if len(groups) > 1 else None)


class _BertiniReader(Reader):
    def unknown_name(self, word: str) -> FormatError:
        if word in _FUNCTIONS:
            return self.error(f"{word} is not polynomial; replace it by a new unknown")
        if word == "i":
            return self.error("the name 'i' has not been declared; the imaginary unit is I")
        return super().unknown_name(word)


def _input_starts(text: str) -> int:
    """Behind the word INPUT, if there is a line with it; a CONFIG block before it is for Bertini alone."""
    found = re.search(r"^[ \t]*INPUT\b[ \t]*;?", text, re.MULTILINE)
    return found.end() if found else 0


def _statements(reader: Reader) -> Any:
    """Go through the statements; yields at the first token of each."""
    while reader.kind != "end" and reader.word != "END":
        if reader.word == ";":
            reader.at += 1
            continue
        yield reader.word


def _declarations(reader: Reader) -> tuple[list[list[str]], dict[str, int]]:
    """First pass: what is declared where. Assignments are skipped."""
    groups: list[list[str]] = []
    functions: dict[str, int] = {}
    declared: set[str] = set()
    begin = reader.at
    for word in _statements(reader):
        if word in _REFUSED:
            raise reader.error(_REFUSED[word])
        if word in ("variable_group", "variable", "function", "constant"):
            reader.at += 1
            names = {}
            while True:
                if reader.kind != "name":
                    raise reader.error(f"a name is missing in the declaration of {word}, {reader.found()}")
                name = reader.word
                if name in declared or name in names:
                    raise reader.error(f"the name {name!r} is declared twice")
                if name in _RESERVED - {"i"}:
                    raise reader.error(f"the name {name!r} has a meaning of its own and cannot be declared")
                names[name] = reader.at
                reader.at += 1
                if reader.word != ",":
                    break
                reader.at += 1
            reader.expect(";", f"behind the declaration of {word}")
            declared |= set(names)
            if word == "function":
                functions.update(names)
            elif word != "constant":
                groups.append(list(names))
            continue
        while reader.kind != "end" and reader.word != ";":
            reader.at += 1
    if not groups:
        raise reader.error("no variable_group is declared")
    if not functions:
        raise reader.error("no function is declared")
    reader.at = begin
    return groups, functions


def _assignments(reader: Reader, known: dict[str, Value], unknowns: list[str]) -> None:
    """Second pass: name = expression, in order."""
    for word in _statements(reader):
        if word in ("variable_group", "variable", "function", "constant"):
            while reader.word != ";":
                reader.at += 1
            continue
        if reader.kind != "name":
            raise reader.error(f"a declaration or an assignment must begin with a name, {reader.found()}")
        if word in known:
            what = "is an unknown" if word in unknowns else "already has a value"
            raise reader.error(f"{word!r} {what} and cannot be assigned")
        reader.at += 1
        reader.expect("=", f"behind {word!r}")
        value = reader.sum()
        reader.expect(";", f"at the end of the definition of {word!r}")
        known[word] = value


def write_bertini(system: System, parameters: Any = None) -> str:
    """A system at given parameters as text in Bertini's format; shared subexpressions become subfunctions.

    Raises
    ------
    InvalidSystem
        An unknown has a name that Bertini reserves, or cannot read; or a number is beyond the range of double
        precision.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> print(write_bertini(System([x**2 - 2*y, x + y - 1], [x, y])))
    INPUT
    variable_group x, y;
    function f1, f2;
    s1 = y*(-2);
    f1 = x^2 + s1;
    s2 = x + (-1);
    f2 = y + s2;
    END;
    <BLANKLINE>
    """
    names = [str(name) for name in system.unknowns]
    taken = set(names)
    for name in names:
        if name in _RESERVED:
            raise InvalidSystem(f"the unknown {name} cannot be written: Bertini gives it a meaning of its own")
        if not (name.isidentifier() and name.isascii()):
            raise InvalidSystem(f"the unknown {name!r} cannot be written: Bertini reads letters and digits only")
    rows = system.size[0]
    functions = [_free(f"f{k + 1}", taken) for k in range(rows)]
    lines = ["INPUT"]
    groups = system.groups or (tuple(range(len(names))),)
    lines += [f"variable_group {', '.join(names[k] for k in group)};" for group in groups]
    lines.append(f"function {', '.join(functions)};")
    if system.groups is not None:
        _check_group_order(system.groups)
    lines += _body(system, system.values_of(parameters).tolist(), names, functions, taken)
    return "\n".join([*lines, "END;"]) + "\n"


def _check_group_order(groups: Any) -> None:
    """Reading back gives the unknowns in the order of the groups; nothing to do, but say so if it differs."""
    flat = [k for group in groups for k in group]
    if flat != sorted(flat):
        raise InvalidSystem("Bertini orders unknowns by group; list the unknowns of the system in that order")


def _free(name: str, taken: set[str]) -> str:
    while name in taken or name in _RESERVED:
        name += "_"
    taken.add(name)
    return name


def _body(
    system: System, values: list[complex], names: list[str], functions: list[str], taken: set[str]
) -> list[str]:
    program = system.program
    slots = [*names, *[coefficient(exact(v), _UNIT) for v in values], *["0"] * len(values)]
    slots += [coefficient(value, _UNIT) for value in program.constants]
    slots = [f"({s})" if s.startswith("-") or "/" in s else s for s in slots]
    outputs = program.outputs["F"].tolist()
    lines = []
    named: dict[int, str] = {}
    for function, slot in zip(functions, outputs):
        named.setdefault(slot, function)
    count = 0
    for k, (op, a, b, c) in enumerate(program.code.tolist()):
        slot = program.inputs + k
        x, y, z = slots[a], slots[b], slots[c]
        body = {
            ADD: f"{x} + {y}",
            SUB: f"{x} - {y}",
            MUL: f"{x}*{y}",
            SQR: f"{x}^2",
            NEG: f"-{x}",
            FMA: f"{x}*{y} + {z}" if a != b else f"{x}^2 + {z}",
            FMS: f"{x}*{y} - {z}" if a != b else f"{x}^2 - {z}",
            FNMA: f"{z} - {x}*{y}" if a != b else f"{z} - {x}^2",
            INV: f"1/{x}",  # of a parameter: unknowns have been cleared from denominators
        }[op]
        if slot in named:
            name = named[slot]
        else:
            count += 1
            name = _free(f"s{count}", taken)
        slots.append(name)
        lines.append(f"{name} = {body};")
    done = {named[slot] for slot in named if slot >= program.inputs}
    for function, slot in zip(functions, outputs):
        if function not in done:
            lines.append(f"{function} = {slots[slot]};")
    return lines
