"""What a solve returns: the roots, the singular ends, and an account of every path."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

#: A root counts as real when its imaginary part is below this, relative to the root. A certificate decides
#: exactly; this is the answer for systems that were not certified.
REAL_TOLERANCE = 1e-8


@dataclass
class Ledger:
    """Every path ends in exactly one class: tracked = finite + singular + at infinity + failed.

    Attributes
    ----------
    tracked, finite, singular, at_infinity, failed : int
    excess : int
        Paths whose end is no root of the system given (a vanishing denominator, or an equation added to make an
        overdetermined system square).
    rungs : dict of str to int
        How many paths each rung of the retry ladder was asked to track again.
    failures : list of (int, str)
        Number of the path and what happened to it.
    """

    tracked: int = 0
    finite: int = 0
    singular: int = 0
    at_infinity: int = 0
    failed: int = 0
    excess: int = 0
    rungs: dict[str, int] = field(default_factory=dict)
    failures: list[tuple[int, str]] = field(default_factory=list)

    @property
    def balanced(self) -> bool:
        """Whether every path is accounted for."""
        return self.tracked == self.finite + self.singular + self.at_infinity + self.failed + self.excess

    def as_dict(self) -> dict[str, int]:
        """The five numbers of the JSON output."""
        names = ("tracked", "finite", "singular", "at_infinity", "failed")
        return {name: int(getattr(self, name)) for name in names}

    def __repr__(self) -> str:
        text = (
            f"{self.tracked} paths: {self.finite} finite, {self.singular} singular, "
            f"{self.at_infinity} at infinity, {self.failed} failed"
        )
        if self.excess:
            text += f", {self.excess} excess"
        if self.rungs:
            text += " (" + ", ".join(f"{count} again {rung}" for rung, count in self.rungs.items()) + ")"
        return text


@dataclass
class Singular:
    """Singular endpoints.

    Attributes
    ----------
    points : ndarray, shape (m, unknowns)
    multiplicity : ndarray of int, shape (m,)
        Number of paths that end there.
    winding : ndarray of int, shape (m,)
        Largest winding number among them.
    dimension : ndarray of int, shape (m,)
        Dimension of the kernel of the Jacobian: an upper bound for the dimension of the solution set there.
    """

    points: np.ndarray
    multiplicity: np.ndarray
    winding: np.ndarray
    dimension: np.ndarray

    def __len__(self) -> int:
        return len(self.points)

    def __array__(self, dtype: Any = None, copy: Any = None) -> np.ndarray:
        return np.asarray(self.points, dtype=dtype)

    def __getitem__(self, key: Any) -> Any:
        return self.points[key]

    @property
    def shape(self) -> tuple[int, ...]:
        return self.points.shape

    def __repr__(self) -> str:
        return f"Singular({len(self)} points, multiplicities {self.multiplicity.tolist()})"


@dataclass
class Solutions:
    """All roots of a system at one choice of its parameters.

    Attributes
    ----------
    points : ndarray, shape (n, unknowns), complex
        The finite nonsingular roots, in an order that depends on the seed only.
    singular : Singular
        Singular endpoints with their multiplicities.
    parameters : ndarray, shape (parameters,), complex
    ledger : Ledger
    unknowns : tuple
        The symbols, in the order of the columns of `points`.
    paths : ndarray of int, shape (n,)
        Which path found each root.
    evidence : str
        Why the set is believed to be complete.
    complete : bool or None
        True with evidence for completeness, False when something is known to be missing, None when open.
    certificate : Certificates or None
    start : str
        The homotopy or method.
    notes : list of str
        What else there is to know.
    orbit : ndarray of int, shape (n,), or None
        Orbit of each root under the symmetry group that was given.
    group : solvers.points.Group or None
        That group.
    """

    points: np.ndarray
    singular: Singular
    parameters: np.ndarray
    ledger: Ledger
    unknowns: tuple[Any, ...] = ()
    paths: np.ndarray = field(default_factory=lambda: np.zeros(0, np.int64))
    evidence: str = ""
    complete: bool | None = None
    certificate: Any = None
    start: str = ""
    seed: int = 0
    notes: list[str] = field(default_factory=list)
    orbit: np.ndarray | None = None
    group: Any = None

    def __len__(self) -> int:
        return len(self.points)

    @property
    def real(self) -> np.ndarray:
        """Which roots are real, shape (n,): certified where certificates exist, else by tolerance."""
        size = np.maximum(np.abs(self.points).max(axis=1, initial=0), 1e-300)
        near = np.abs(self.points.imag).max(axis=1, initial=0) <= REAL_TOLERANCE * size
        if self.certificate is None or np.any(np.iscomplex(self.parameters)):
            return near
        certified = np.asarray(self.certificate.certified)
        return np.where(certified, np.asarray(self.certificate.real), near)

    @property
    def real_points(self) -> np.ndarray:
        """The real roots, shape (k, unknowns), as floats."""
        return self.points[self.real].real

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON: numbers are [re, im] pairs."""
        return {
            "unknowns": [str(s) for s in self.unknowns],
            "points": [[[z.real, z.imag] for z in row] for row in self.points.tolist()],
            "singular": [[[z.real, z.imag] for z in row] for row in np.asarray(self.singular.points).tolist()],
            "multiplicity": [int(m) for m in self.singular.multiplicity],
            "parameters": [[z.real, z.imag] for z in np.asarray(self.parameters, complex).tolist()],
            "ledger": self.ledger.as_dict(),
            "complete": self.complete,
            "evidence": self.evidence,
        }

    def table(self, limit: int = 20) -> str:
        """The roots as text, real ones marked."""
        head = "  ".join(f"{s!s:>24}" for s in self.unknowns)
        lines = [f"{'':6}{head}"]
        for k, (row, real) in enumerate(zip(self.points[:limit], self.real)):
            numbers = "  ".join(f"{z.real:>11.6g}{z.imag:>+11.6g}i " for z in row)
            lines.append(f"{k:4d}{'*' if real else ' '} {numbers}")
        if len(self) > limit:
            lines.append(f"… and {len(self) - limit} more")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return (
            f"Solutions({len(self)} roots, {int(self.real.sum())} real, {len(self.singular)} singular, "
            f"{self.ledger.failed} failed of {self.ledger.tracked} paths)"
        )
