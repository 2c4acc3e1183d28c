"""Certificates: each root exists, is alone in its box, differs from the others, is real or is not.

All points are tested at once in double precision (`solvers.krawczyk`); what that leaves open, Arb decides one by
one (`solvers.krawczyk_arb`) with 128 bits, then 256, and so on. Nothing here is a tolerance: an answer is a proof
about the system with exactly the coefficients and parameter values given, or it is not given.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from solvers.arithmetic.discs import TINY_SIZE, UP
from solvers.arithmetic.values import exact_parameters
from solvers.distinct import overlapping_pairs, representatives
from solvers.from_sympy import InvalidSystem
from solvers.krawczyk import Boxes, Question, krawczyk_discs
from solvers.krawczyk_arb import ArbBox, NotNearRoot, krawczyk_arb
from solvers.reality import conjugation_order, is_real
from solvers.system import System
from solvers.tape import Exact

#: Points tested together; their intermediate results should stay in the processor's cache.
CHUNK = 1024
#: Bits of the fast pass, of the first Arb pass and of the last.
DOUBLE_BITS, FIRST_BITS, MAX_BITS = 53, 128, 1024
#: A square of half-side 0.7 r fits into a disc of radius r.
INSCRIBED = 0.7


@dataclass(frozen=True, eq=False, repr=False)
class Certificates:
    """What was proved about each of n points; index by index in the order of the points.

    Attributes
    ----------
    certified : ndarray of bool, shape (n,)
        A box round the point holds exactly one root, and that root is simple.
    real : ndarray of bool, shape (n,)
        That root is real, proved. Never True unless the system and its parameters are real.
    complex_ : ndarray of bool, shape (n,)
        That root is not real, proved.
    representative : ndarray of int, shape (n,)
        The first point that has the same root (or could not be told apart); -1 where nothing is certified.
    boxes : Boxes
        Midpoints, inclusion radii and uniqueness radii in double precision.
    precision : ndarray of int, shape (n,)
        Bits that decided: 53 is the fast pass, 0 means not certified.
    exact : dict of int to ArbBox
        The boxes of the points that Arb decided, in Arb's precision.
    real_system : bool
        Whether reality could be decided at all.
    """

    certified: np.ndarray
    real: np.ndarray
    complex_: np.ndarray
    representative: np.ndarray
    boxes: Boxes
    precision: np.ndarray
    exact: dict[int, ArbBox] = field(default_factory=dict)
    real_system: bool = False

    def __len__(self) -> int:
        return len(self.certified)

    @property
    def count(self) -> int:
        """Number of points that are certified."""
        return int(self.certified.sum())

    @property
    def distinct(self) -> int:
        """Number of roots proved to differ from each other: at most `count`."""
        return len(np.unique(self.representative[self.certified]))

    @property
    def points(self) -> np.ndarray:
        """The certified points, polished, shape (count, k): midpoints of the boxes."""
        return self.boxes.midpoints[self.certified]

    def __repr__(self) -> str:
        parts = [f"{self.count} of {len(self)} certified", f"{self.distinct} distinct"]
        if self.real_system:
            parts.append(f"{int(self.real.sum())} real")
            open_ = self.count - int(self.real.sum()) - int(self.complex_.sum())
            if open_:
                parts.append(f"{open_} neither proved real nor complex")
        if self.exact:
            bits = max(box.bits for box in self.exact.values())
            parts.append(f"{len(self.exact)} by Arb with up to {bits} bits")
        return f"Certificates({', '.join(parts)})"


def certify(
    system: System,
    solutions: Any,
    parameters: Any = None,
    *,
    conjugate_pairs: Sequence[tuple[Any, Any]] | None = None,
    max_bits: int = MAX_BITS,
) -> Certificates:
    """Prove that points are near true, simple roots, that the roots differ, and which are real.

    Parameters
    ----------
    system : System
        As many equations as unknowns.
    solutions : Solutions, or array of shape (n, k)
        Approximate roots: something with ``.points`` (and ``.parameters``), or the points themselves.
    parameters : mapping or sequence of numbers, optional
        Default: ``solutions.parameters``. Floats mean the binary number that they store, exactly; rational
        numbers (Fraction, SymPy) are taken as they are.
    conjugate_pairs : sequence of pairs of unknowns, optional
        For isotropic coordinates: a root is real when the unknowns of each pair are conjugates of each other and
        the others are real. Reality then rests on :func:`solvers.reality.is_real`.
    max_bits : int
        Precision at which Arb gives up; 0 leaves Arb out.

    Returns
    -------
    Certificates

    Raises
    ------
    InvalidSystem
        The system is not square, parameter values are missing, or the points have another number of unknowns.

    Notes
    -----
    Krawczyk's test, see :mod:`solvers.krawczyk`. A multiple root is never certified.  A point that Newton's method
    moves by more than a thousandth of its size is not near a root and is not certified either.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> system = System([x**2 + y**2 - 5, x * y - 2], [x, y])
    >>> certify(system, [[1, 2], [2, 1], [-1, -2], [-2, -1], [3, 3]])
    Certificates(4 of 5 certified, 4 distinct, 4 real)
    """
    points, parameters = _read(system, solutions, parameters)
    exact = exact_parameters(system, parameters)
    order = None if conjugate_pairs is None else conjugation_order(system, conjugate_pairs)
    work = _Work(_question(system, exact), points, max_bits)
    work.test_all()
    if is_real(system, exact, order):
        real, complex_ = work.decide_reality(order or list(range(len(system.unknowns))))
        real_system = True
    else:
        real = np.zeros(len(points), bool)
        complex_ = work.moved_by_conjugation(order or list(range(len(system.unknowns))))
        real_system = False
    representative = work.decide_distinctness()
    return Certificates(
        certified=work.bits > 0,
        real=real,
        complex_=complex_,
        representative=representative,
        boxes=work.boxes,
        precision=work.bits,
        exact=work.arb,
        real_system=real_system,
    )


def _read(system: System, solutions: Any, parameters: Any) -> tuple[np.ndarray, Any]:
    equations, unknowns = system.size
    if equations != unknowns:
        raise InvalidSystem(
            f"only square systems can be certified; this one has {equations} equations in {unknowns} unknowns"
        )
    if parameters is None:
        parameters = getattr(solutions, "parameters", None)
    points = np.asarray(getattr(solutions, "points", solutions), dtype=np.complex128)
    if points.size == 0:
        points = points.reshape(0, unknowns)
    if points.ndim != 2 or points.shape[1] != unknowns:
        raise InvalidSystem(f"points of shape {points.shape} were given; the shape must be (n, {unknowns})")
    return points, parameters


def _question(system: System, parameters: tuple[Exact, ...]) -> Question:
    make = partial(Question, system.program, system.jacobian_program, parameters)
    return system.once(("question", parameters), make)


class _Work:
    """The boxes of all points while they are sharpened."""

    def __init__(self, question: Question, points: np.ndarray, max_bits: int) -> None:
        self.question = question
        self.points = points
        self.max_bits = max_bits
        self.boxes = Boxes(points.copy(), np.full(points.shape, np.nan), np.full(points.shape, np.nan))
        self.bits = np.zeros(len(points), dtype=np.int64)
        self.arb: dict[int, ArbBox] = {}

    def test_all(self) -> None:
        """The fast pass, then Arb for the points that it left."""
        for start in range(0, len(self.points), CHUNK):
            part = slice(start, start + CHUNK)
            boxes = krawczyk_discs(self.question, self.points[part])
            self.boxes.midpoints[part] = boxes.midpoints
            self.boxes.radii[part] = boxes.radii
            self.boxes.unique[part] = boxes.unique
        self.bits[np.isfinite(self.boxes.radii).all(axis=1)] = DOUBLE_BITS
        for index in np.flatnonzero(self.bits == 0):
            if np.isfinite(self.points[index]).all():
                self.sharpen(int(index))

    def sharpen(self, index: int) -> bool:
        """A smaller box by more bits; whether there is one."""
        bits = max(FIRST_BITS, 2 * int(self.bits[index]))
        box = self.arb.get(index)
        start: Sequence[Any]
        if box is not None:
            start = [z.mid() for z in box.inclusion]
        else:
            start = self.boxes.midpoints[index] if self.bits[index] else self.points[index]
        while bits <= self.max_bits:
            try:
                box = krawczyk_arb(self.question, start, bits)
            except NotNearRoot:
                return False
            if box is not None:
                self.arb[index], self.bits[index] = box, bits
                where = self.boxes
                where.midpoints[index], where.radii[index], where.unique[index] = box.disc()
                return True
            bits *= 2
        return False

    # -- reality ------------------------------------------------------------------------------------------------
    def _conjugation(self, order: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """Two masks: the conjugate of the root is this root; the conjugate is another number. In doubles."""
        mid, rad, unique = self.boxes.midpoints, self.boxes.radii, self.boxes.unique
        other = rad[:, order]
        with np.errstate(invalid="ignore"):
            distance = np.abs(mid[:, order].conj() - mid)
            # The factors cover the roundings of a handful of operations; NaN compares as False.
            same = (distance * UP * UP + other * UP + TINY_SIZE <= unique).all(axis=1)
            apart = (distance * (1 - 1e-14) > (rad + other) * UP + TINY_SIZE).any(axis=1)
        return same, apart

    def _conjugation_arb(self, box: ArbBox, order: list[int]) -> tuple[bool, bool]:
        from flint import ctx

        with ctx.workprec(box.bits):  # even a conjugate is rounded to the working precision
            mirrored = [box.inclusion[k].conjugate() for k in order]
        same = all(outer.contains(inner) for outer, inner in zip(box.unique, mirrored))
        apart = any(not inner.overlaps(image) for inner, image in zip(box.inclusion, mirrored))
        return same, apart

    def moved_by_conjugation(self, order: list[int]) -> np.ndarray:
        """Roots that are not real, whatever the system; what doubles leave open stays open."""
        apart = self._conjugation(order)[1]
        for index, box in self.arb.items():
            apart[index] = self._conjugation_arb(box, order)[1]
        return apart

    def decide_reality(self, order: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """(real, not real) for a system whose roots are mapped to roots by conjugation.

        The conjugate of the root is a root; if it lies in the box where the root is alone, it is the root itself.
        """
        real, apart = self._conjugation(order)
        for index in np.flatnonzero((self.bits > 0) & ((real == apart) | (self.bits > DOUBLE_BITS))):
            i = int(index)
            real[i] = apart[i] = False
            while not (real[i] or apart[i]):
                if i in self.arb:
                    real[i], apart[i] = self._conjugation_arb(self.arb[i], order)
                    if real[i] or apart[i]:
                        break
                if not self.sharpen(i):
                    break
        return real, apart

    # -- distinctness -------------------------------------------------------------------------------------------
    def decide_distinctness(self) -> np.ndarray:
        """The first point with the same root, for each point; -1 where nothing is certified."""
        certified = np.flatnonzero(self.bits > 0)
        pairs = certified[overlapping_pairs(self.boxes.midpoints[certified], self.boxes.radii[certified])]
        same = self._same(pairs)
        equal = [(int(i), int(j)) for i, j in pairs[same]]
        equal += [(int(i), int(j)) for i, j in pairs[~same] if not self._told_apart(int(i), int(j))]
        result = representatives(len(self.points), equal)
        result[self.bits == 0] = -1
        return result

    def _same(self, pairs: np.ndarray) -> np.ndarray:
        """Pairs of which one root lies in the uniqueness box of the other, by doubles."""
        i, j = pairs[:, 0], pairs[:, 1]
        mid, rad, unique = self.boxes.midpoints, self.boxes.radii, self.boxes.unique
        distance = np.abs(mid[i] - mid[j]) * UP + TINY_SIZE
        forth = ((distance + rad[i]) * UP <= unique[j]).all(axis=1)
        back = ((distance + rad[j]) * UP <= unique[i]).all(axis=1)
        return forth | back

    def _told_apart(self, i: int, j: int) -> bool:
        """Whether two roots are proved to differ, with as many bits as it takes. False: equal, or not known."""
        while True:
            first, first_unique = self._rectangles(i)
            second, second_unique = self._rectangles(j)
            if any(not a.overlaps(b) for a, b in zip(first, second)):
                return True
            if _inside(first, second_unique) or _inside(second, first_unique):
                return False
            if self.bits[i] > self.bits[j]:
                i, j = j, i
            if not self.sharpen(i) and not self.sharpen(j):
                return False

    def _rectangles(self, index: int) -> tuple[list[Any], list[Any]]:
        """Inclusion and uniqueness boxes as Arb balls, rounded outwards and inwards."""
        if index in self.arb:
            return self.arb[index].inclusion, self.arb[index].unique
        mid, rad, unique = (part[index] for part in (self.boxes.midpoints, self.boxes.radii, self.boxes.unique))
        return _squares(mid, rad), _squares(mid, INSCRIBED * unique)


def _squares(midpoints: Iterable[complex], half: Iterable[float]) -> list[Any]:
    from flint import acb, arb

    return [acb(arb(z.real, float(h)), arb(z.imag, float(h))) for z, h in zip(midpoints, half)]


def _inside(inner: Iterable[Any], outer: Iterable[Any]) -> bool:
    return all(b.contains(a) for a, b in zip(inner, outer))
