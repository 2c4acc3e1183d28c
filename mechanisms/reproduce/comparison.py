"""One published number, formula or claim beside ours."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

__all__ = ["Comparison", "claim", "formula", "same_digits"]

Kind = Literal["number", "formula", "claim", "inferred"]

_NUMBER = r"[+−-]?\s*\d+(?:\.\d+)?"
#: A formula is the same when it gives the same values at random data, up to rounding.
SAME_FORMULA = 1e-9


@dataclass(frozen=True)
class Comparison:
    """A published item.

    Attributes
    ----------
    where : str
        Section, equation or table.
    what : str
        The item.
    printed : str
        As printed.
    ours : number, complex number, tuple of numbers, or bool
        Recomputed; for a formula or a claim, whether it holds.
    why : str
        The correction and how it is known, where they differ.
    kind : str
        ``"number"``, ``"formula"``, ``"claim"``, or ``"inferred"`` for what is not printed but follows.
    corrected : bool
        For a formula: whether the correction in `why` was checked to hold.
    """

    where: str
    what: str
    printed: str
    ours: Any
    why: str = ""
    kind: Kind = "number"
    corrected: bool = False

    @property
    def verdict(self) -> str:
        """``agrees``, ``misprint``, ``inferred``, ``not so`` (a claim that is not true), or ``differs``."""
        if self.kind == "inferred":
            return "inferred"
        if self.kind == "claim":
            return "agrees" if self.ours else "not so"
        if self.kind == "formula":
            return "agrees" if self.ours else "misprint" if self.corrected else "differs"
        if same_digits(self.printed, self.ours):
            return "agrees"
        return "misprint" if self.why else "differs"

    @property
    def shown(self) -> str:
        """Ours, with three digits more than printed."""
        if self.kind == "claim":
            return "holds" if self.ours else "does not hold"
        if self.kind == "formula":
            return "same" if self.ours else "another value"
        digits = max((len(part.partition(".")[2]) for part in re.findall(_NUMBER, self.printed)), default=3)
        return _written(self.ours, digits + 3 if digits else 0)

    def as_dict(self) -> dict[str, Any]:
        """As JSON."""
        ours: Any = self.ours
        if isinstance(ours, (complex, np.complexfloating)):
            ours = [float(ours.real), float(ours.imag)]
        elif isinstance(ours, tuple):
            ours = [float(part) for part in ours]
        elif not isinstance(ours, (bool, int, str)):
            ours = float(ours)
        return {
            "where": self.where,
            "what": self.what,
            "printed": self.printed,
            "ours": ours,
            "verdict": self.verdict,
            "why": self.why,
        }


def claim(where: str, what: str, holds: bool, why: str) -> Comparison:
    """A statement of the paper, and whether it is so."""
    return Comparison(where, what, "", bool(holds), why, kind="claim")


def formula(
    where: str,
    what: str,
    printed: Callable[[], Any],
    true: Callable[[], Any],
    why: str = "",
    corrected: Callable[[], Any] | None = None,
) -> Comparison:
    """A printed formula: the same as ours, or else whether its correction is.

    The three are called with no arguments; each must give the same data to its formula.
    """

    def agree(a: Any, b: Any) -> bool:
        a, b = np.asarray(a, dtype=complex), np.asarray(b, dtype=complex)
        return bool(np.all(np.abs(a - b) <= SAME_FORMULA * (1 + np.abs(b))))

    truth = true()
    good = corrected is not None and agree(corrected(), truth)
    return Comparison(where, what, "formula", agree(printed(), truth), why, kind="formula", corrected=good)


def same_digits(printed: str, ours: Any) -> bool:
    """Whether a value agrees with a printed one to all its digits.

    Parameters
    ----------
    printed : str
        Such as ``"12.902"``, ``"-3.170 + 12.268i"`` or ``"(29, -14.170)"``.
    ours : number, complex or tuple
        The value.

    Examples
    --------
    >>> same_digits("12.902", 12.901924), same_digits("-3.170 + 12.268i", -3.1712 + 12.268j)
    (True, False)
    """
    values: list[float]
    words = [word.replace("−", "-").replace(" ", "") for word in re.findall(_NUMBER, printed)]
    if isinstance(ours, (complex, np.complexfloating)):
        values = [float(ours.real), float(ours.imag)]
    else:
        values = list(ours) if isinstance(ours, tuple) else [ours]
    if len(words) != len(values):
        return False
    for word, value in zip(words, values):
        half_unit = 0.5 * 10.0 ** -len(word.partition(".")[2])
        if abs(float(word) - value) > half_unit * (1 + 1e-6):
            return False
    return True


def _written(value: Any, digits: int) -> str:
    if isinstance(value, (bool, str)):
        return str(value)
    if isinstance(value, tuple):
        return f"({', '.join(_written(part, digits) for part in value)})"
    if isinstance(value, (complex, np.complexfloating)):
        sign = "+" if value.imag >= 0 else "−"
        return f"{_written(value.real, digits)} {sign} {_written(abs(value.imag), digits)}i"
    if isinstance(value, int) or digits == 0:
        return f"{value:g}"
    return f"{value:.{digits}f}"
