"""Checks of single values that came from a file or a command line, each with its one-sentence refusal."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NoReturn

from mechanisms.task import TaskError

__all__ = ["LARGEST", "Checker", "short", "suggest"]

#: Larger numbers overflow when they are squared a few times in the solver.
LARGEST = 1e60


def suggest(word: str, known: Iterable[str]) -> str:
    """Half a sentence that helps someone who wrote `word` where only `known` words are understood.

    >>> suggest("pose", ["poses", "title"])
    'did you mean poses?'
    >>> suggest("zzz", ["poses", "title"])
    'known are poses, title'
    """
    known = list(known)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return (
        f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}" if known else "none is known here"
    )


class Checker:
    """Checks that know the name of the file they speak of.

    Parameters
    ----------
    where : str
        The file, for messages.
    """

    def __init__(self, where: str) -> None:
        self.where = where

    def fail(self, key: str, message: str) -> NoReturn:
        """Refuse, naming the file and the key."""
        place = f"{_plain(self.where)}: {_plain(key)}" if key else _plain(self.where)
        raise TaskError(f"{place}: {message}")

    def number(self, value: Any, key: str) -> float:
        """A finite number of usable size; a text or a truth value is none."""
        if isinstance(value, str):
            self.fail(key, f"{short(value)} is text where a number is needed; write it without quotes")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.fail(key, f"{short(value)} is not a number")
        if not abs(value) <= LARGEST:
            self.fail(key, f"{short(value)} is not a finite number of usable size")
        return float(value)

    def integer(self, value: Any, key: str, low: int, high: int) -> int:
        """A whole number in a range."""
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            self.fail(key, f"{short(value)} is not a whole number from {low} to {high}")
        return value

    def text(self, value: Any, key: str) -> str:
        """A label: text without control characters."""
        if not isinstance(value, str):
            self.fail(key, f"{short(value)} is not a text; put it in quotes")
        if any(ord(letter) < 32 for letter in value):
            self.fail(key, "a label may not contain control characters")
        return value

    def table(self, value: Any, key: str) -> Mapping[str, Any]:
        """A table."""
        if not isinstance(value, Mapping):
            self.fail(key, f"{short(value)} is not a table; write [{key}] and its keys below it")
        return value

    def pair(self, value: Any, key: str) -> tuple[float, float]:
        """A range: two numbers, the lower first."""
        if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 2:
            self.fail(key, f"{short(value)} is not a range; write [lowest, highest]")
        low, high = (self.number(part, key) for part in value)
        if not low < high:
            self.fail(key, f"the range [{low:g}, {high:g}] is empty; the lower end comes first")
        return low, high

    def keys(self, table: Mapping[str, Any], known: Sequence[str], key: str, angles: Sequence[str] = ()) -> None:
        """Refuse unknown keys, and angles without their unit, of a table."""
        for name in table:
            if name in known:
                continue
            place = f"{key}.{name}" if key else str(name)
            plain = re.sub(r"_(rad|radians|degrees)$", "", str(name))
            if f"{plain}_deg" in angles:
                self.fail(place, f"an angle needs its unit; did you mean {plain}_deg (in degrees)?")
            self.fail(place, f"unknown key; {suggest(str(name), known)}")


def _plain(text: Any) -> str:
    """A name out of a file as it may stand in a message, on one line and not endless."""
    words = "".join(letter if letter.isprintable() else "?" for letter in str(text))
    return words if len(words) <= 120 else words[:119] + "…"


def short(value: Any) -> str:
    """A value as it may stand in a message: one line, not too long."""
    text = repr(value) if not isinstance(value, str) else f"'{value}'"
    text = " ".join("".join(letter if letter.isprintable() else "?" for letter in text).split())
    return text if len(text) <= 40 else text[:39] + "…"
