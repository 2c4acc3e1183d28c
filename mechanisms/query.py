"""The little language of ``--where`` and ``--sort``: comparisons joined with ``and``.

    query      = comparison { "and" comparison }
    comparison = field ( "<" | "<=" | ">" | ">=" | "=" | "==" | "!=" ) value
    value      = number | "true" | "false" | word

It is read by this module and never by Python.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from mechanisms.checks import suggest
from mechanisms.task import TaskError

if TYPE_CHECKING:
    from mechanisms.designs import Design

__all__ = ["parse", "select", "sort"]

_OPERATORS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "=": operator.eq,
    "==": operator.eq,
    "!=": operator.ne,
}
_COMPARISON = re.compile(r"\s*([^\s<>=!]+)\s*(<=|>=|==|!=|<|>|=)\s*([^\s<>=!]+)\s*")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
#: Keys by which larger is better, so that the best come first without having to ask.
LARGER_IS_BETTER = frozenset({"min_transmission_deg", "accepted", "defect_free_share", "full_rotation"})

Comparison = tuple[str, str, "float | bool | str"]


def parse(text: str) -> list[Comparison]:
    """Read a query.

    Raises
    ------
    TaskError
        When it is none.

    Examples
    --------
    >>> parse("min_transmission_deg > 30 and accepted = true")
    [('min_transmission_deg', '>', 30.0), ('accepted', '=', True)]
    """
    comparisons: list[Comparison] = []
    for part in re.split(r"\s+and\s+", text.strip()):
        match = _COMPARISON.fullmatch(part)
        if match is None:
            raise TaskError(
                f"--where: cannot read '{part}'; write comparisons such as link_ratio < 5, joined with and"
            )
        field, sign, word = match.groups()
        comparisons.append((field, sign, _value(word, sign)))
    return comparisons


def select(designs: Iterable[Design], text: str) -> list[Design]:
    """The designs that meet a query; one that has no such field does not.

    Raises
    ------
    TaskError
        When the query cannot be read, or no design at all has a field of that name.
    """
    designs, comparisons = list(designs), parse(text)
    rows = [design.fields() for design in designs]
    known = _known(rows)
    for field, sign, value in comparisons:
        if rows and field not in known:
            raise TaskError(f"--where: no design has '{field}'; {suggest(field, known)}")
        kinds = {isinstance(row[field], str) for row in rows if field in row}
        if kinds and isinstance(value, str) not in kinds:
            what = "a word" if True in kinds else "a number or true or false"
            raise TaskError(f"--where: {field} is {what}, which '{value}' is not")
        if sign not in ("=", "==", "!=") and isinstance(value, bool):
            raise TaskError(
                f"--where: true and false cannot be compared by '{sign}'; write {field} = {str(value).lower()}"
            )
    return [
        design
        for design, row in zip(designs, rows)
        if all(field in row and _OPERATORS[sign](row[field], value) for field, sign, value in comparisons)
    ]


def sort(designs: Iterable[Design], key: str) -> list[Design]:
    """The designs by one field, the best first; ``-field`` turns the order round; those without it come last.

    Raises
    ------
    TaskError
        When no design has such a field.
    """
    designs = list(designs)
    name, turned = (key[1:], True) if key.startswith("-") else (key, False)
    rows = [design.fields() for design in designs]
    known = _known(rows)
    if rows and name not in known:
        raise TaskError(f"--sort: no design has '{name}'; {suggest(name, known)}")
    downwards = (name in LARGER_IS_BETTER) != turned
    having = [(row[name], n) for n, row in enumerate(rows) if name in row]
    order = [n for _, n in sorted(having, key=lambda pair: pair[0], reverse=downwards)]
    order += [n for n, row in enumerate(rows) if name not in row]
    return [designs[n] for n in order]


def _known(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def _value(word: str, sign: str) -> float | bool | str:
    if _NUMBER.fullmatch(word):
        return float(word)
    if word in ("true", "false"):
        return word == "true"
    if sign not in ("=", "==", "!="):
        raise TaskError(f"--where: '{word}' is not a number")
    return word.strip("'\"")
