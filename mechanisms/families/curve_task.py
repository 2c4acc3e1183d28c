"""From points of a path to the problem of the coupler curve, and from its roots back to four-bars."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Candidate, Free, Problem
from mechanisms.families.four_bar_curve import (
    NAMES,
    cognate,
    curve_columns,
    curve_mirror,
    curve_system,
    nine_point_mirror,
    nine_point_system,
    swap,
    swapped_curve,
)
from mechanisms.families.four_bar_generic import COUNTS, curve_name
from mechanisms.families.reality import Mirror, real_roots
from mechanisms.families.trammel_linkage import CurveFourBar

if TYPE_CHECKING:
    from solvers import Solutions, System

__all__ = ["CURVE_FREE", "CurveTask", "Found", "degenerate_points"]

#: The paper's parameters of the four-bar that a task may choose.
CURVE_FREE = (
    Free("x_M", "length", "fixed pivot of the crank"),
    Free("y_M", "length", "fixed pivot of the crank"),
    Free("x_N", "length", "fixed pivot of the rocker"),
    Free("y_N", "length", "fixed pivot of the rocker"),
    Free("L_MR", "length", "crank"),
    Free("L_NS", "length", "rocker"),
    Free("e", "length", "coupler: A to R along RS"),
    Free("f", "length", "coupler: A to S along RS"),
    Free("g", "length", "coupler: distance of A from the line RS"),
)
#: Most points that a coupler curve, a sextic that passes three times through each circular point, has in common
#: with a line or a circle that is no part of it.
MOST_ON_LINE = MOST_ON_CIRCLE = 6
#: More points than this on one line are not general: straight links, with pivots at infinity, pass them.
ON_LINE = 3
#: Points this near to a line or circle, relative to their extent, are on it.
ON_CURVE = 1e-9
#: A link shorter than this part of the size of the path is no link.
SHORTEST = 1e-9


@dataclass(frozen=True, eq=False)
class Found:
    """A real four-bar.

    Attributes
    ----------
    root : int
    four_bar : CurveFourBar
    curve : int
        Number of the coupler curve, or of the four-bar, counted by its first root: roots that are cognates or the
        same linkage with its dyads exchanged have the same number.
    """

    root: int
    four_bar: CurveFourBar
    curve: int


@dataclass(frozen=True, eq=False)
class CurveTask:
    """Points that a coupler point visits, and what is chosen of the four-bar.

    Parameters
    ----------
    points : (points,) complex array
    chosen : mapping of str to float
        Of the names of Eq. (19), in the same frame as the points.
    """

    points: NDArray[np.complex128]
    chosen: Mapping[str, float]

    def check(self) -> None:
        """Refuse a wrong number of choices, choices that are no length, and points that no curve of general kind meets.

        Raises
        ------
        ValueError
            One sentence.
        """
        count, wanted = len(self.points), len(NAMES) - len(self.points)
        if len(self.chosen) != wanted:
            many = "too many" if len(self.chosen) > wanted else "too few"
            example = {1: "g", 2: "y_N and g", 3: "y_M, y_N and g"}.get(wanted, "")
            hint = f", as the paper chooses {example}" if example and len(self.chosen) < wanted else ""
            raise ValueError(
                f"free: {count} points leave {wanted} of {', '.join(NAMES)} to be chosen; "
                f"{len(self.chosen)} {'is' if len(self.chosen) == 1 else 'are'} {many}{hint}"
            )
        for name in ("L_MR", "L_NS"):
            if self.chosen.get(name, 1.0) <= 0:
                raise ValueError(f"free.{name}: a link needs a positive length")
        message = degenerate_points(self.points)
        if message:
            raise ValueError(f"points: {message}")

    @cached_property
    def unit(self) -> float:
        """Extent of the points."""
        return float(max(abs(a - b) for a, b in combinations(self.points, 2)))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The chosen parameters in the paper's order."""
        return tuple(name for name in NAMES if name in self.chosen)

    @property
    def nine(self) -> bool:
        """Whether it is the problem of nine points, which has unknowns of its own."""
        return not self.names

    @property
    def name(self) -> str:
        """The entry of the catalogue."""
        return curve_name(len(self.points), self.names)

    @cached_property
    def mirror(self) -> Mirror:
        """What conjugation does to the roots."""
        return nine_point_mirror() if self.nine else curve_mirror(len(self.points), self.names)

    @cached_property
    def values(self) -> NDArray[np.complex128]:
        """Parameters of the system: points from the first one, in units of their extent."""
        moved = (self.points - self.points[0]) / self.unit
        pairs = np.stack([moved, moved.conj()], axis=1)
        if self.nine:
            return pairs[1:].ravel()
        origin = self.points[0]
        shift = {"x_M": origin.real, "x_N": origin.real, "y_M": origin.imag, "y_N": origin.imag}
        numbers = [(self.chosen[name] - shift.get(name, 0.0)) / self.unit for name in self.names]
        return np.concatenate([pairs.ravel(), np.array(numbers, np.complex128)])

    def system(self) -> System:
        """The system, which is the same for all tasks of this shape."""
        return nine_point_system() if self.nine else curve_system(len(self.points), self.names)

    def problem(self) -> Problem:
        """The system with this task's parameters."""
        known, source = COUNTS.get(self.name, (None, ""))
        line = most_on_a_line(self.points)
        if known is not None and len(line) > ON_LINE:
            which = f"{', '.join(map(str, line[:-1]))} and {line[-1]}"
            source += f"; here points {which} are on one line, and some roots are at infinity or multiple instead"
        return Problem(
            self.system(),
            self.values,
            finite=known,
            evidence=source,
            mirror=self.mirror,
            catalogue=self.name,
        )

    def four_bars(self, solutions: Solutions, first_root: int = 0) -> Iterator[Candidate | Found]:
        """Every root: a real four-bar, or why it is none."""
        points = solutions.points
        real = real_roots(points, self.mirror)
        images = self.mirror.image(points) if len(points) else points
        curve = self._curves(points, np.flatnonzero(real))
        for k, point in enumerate(points):
            root = first_root + k
            if not real[k]:
                yield Candidate(root, reasons=("complex",))
                continue
            four_bar = self._four_bar((point + images[k]) / 2)
            shortest = min(four_bar.L_MR, four_bar.L_NS, abs(four_bar.e + four_bar.f))
            if not shortest > SHORTEST * self.unit:
                yield Candidate(root, four_bar.parameters(), reasons=("degenerate",), note="a link has no length")
                continue
            if not self.nine and "g" not in self.names and not {"e", "f"} & set(self.names):
                if four_bar.e + four_bar.f < 0:  # (e, f, g) → −(e, f, g) turns the coupler's frame by a half-turn
                    note = "the same linkage as another root, its coupler's frame turned by half a turn"
                    yield Candidate(root, four_bar.parameters(), reasons=("degenerate",), note=note)
                    continue
            yield Found(root, four_bar, first_root + int(curve[k]))

    def _four_bar(self, point: NDArray[np.complex128]) -> CurveFourBar:
        origin, unit = self.points[0], self.unit
        if self.nine:
            a, z, b, w = point[[0, 2, 4, 6]]
            direction = (w - z) / abs(w - z)
            r, s = z / direction, w / direction
            turns = np.angle(direction) + np.concatenate([[0.0], np.angle(point[8::2])])
            e, f, g = -r.real * unit, s.real * unit, -(r.imag + s.imag) / 2 * unit
            return CurveFourBar(origin - a * unit, origin - b * unit, e, f, g, turns, self.points)
        design = len(NAMES) - len(self.names)
        values = dict(zip(curve_columns(self.names), point[:design].real * unit))
        values |= {name: self.chosen[name] for name in self.names}
        for name, shift in zip(("x_M", "y_M", "x_N", "y_N"), (origin.real, origin.imag) * 2):
            if name not in self.names:
                values[name] += shift
        pivots = complex(values["x_M"], values["y_M"]), complex(values["x_N"], values["y_N"])
        turns = np.angle(point[design::2])
        return CurveFourBar(*pivots, values["e"], values["f"], values["g"], turns, self.points)

    def _curves(self, points: NDArray[np.complex128], rows: NDArray[np.intp]) -> NDArray[np.intp]:
        """For each root the first of those that draw the same curve; the given rows only."""
        from solvers.points import PointSet

        first = np.arange(len(points))
        exchange = swap if self.nine else swapped_curve(self.names)
        if exchange is None or not len(rows):
            return first
        chosen = points[rows]
        images = [chosen, exchange(chosen)]
        if self.nine:
            for _ in range(2):
                images.append(cognate(images[-1], self.values))
                images.append(swap(images[-1]))
        known = PointSet(points.shape[1])
        known.add(chosen)
        place = np.stack([np.where((p := known.find(image)) < 0, np.arange(len(rows)), p) for image in images])
        first[rows] = rows[place.min(axis=0)]
        return first


def most_on_a_line(points: NDArray[np.complex128]) -> list[int]:
    """The most points that are on one line.

    Examples
    --------
    >>> most_on_a_line(np.array([0, 1, 2, 1j, 3, 1 + 1j]))
    [0, 1, 2, 4]
    """
    size = float(np.abs(points - points.mean()).max()) or 1.0
    best: list[int] = []
    for a, b in combinations(points, 2):
        if a != b:
            off = np.abs(((points - a) * np.conj(b - a)).imag) / abs(b - a)
            best = max(best, np.flatnonzero(off < ON_CURVE * size).tolist(), key=len)
    return best


def degenerate_points(points: NDArray[np.complex128]) -> str:
    """Why points are on no coupler curve but a degenerate one; empty when they may be on many.

    A line meets a coupler curve in at most six points, a circle in six beside the circular points, unless it is part
    of the curve.

    Examples
    --------
    >>> degenerate_points(np.arange(7) + 0j)[:38]
    'points 0, 1, 2, 3, 4, 5, 6 are on one '
    >>> degenerate_points(np.arange(6) + 0j)
    ''
    """
    size = float(np.abs(points - points.mean()).max()) or 1.0
    z = (points - points.mean()) / size
    for triple in combinations(range(len(z)), 3):
        a, b, c = z[list(triple)]
        rows = np.array([[abs(p) ** 2, p.real, p.imag, 1.0] for p in (a, b, c)])
        curve = np.linalg.svd(rows)[2][-1]  # the circle or line through the three
        on = np.flatnonzero(
            np.abs(np.stack([np.abs(z) ** 2, z.real, z.imag, np.ones(len(z))], axis=1) @ curve) < ON_CURVE
        )
        if len(on) > MOST_ON_LINE:
            straight = abs(curve[0]) < ON_CURVE
            which = ", ".join(map(str, on))
            what, most = ("line", MOST_ON_LINE) if straight else ("circle", MOST_ON_CIRCLE)
            return (
                f"points {which} are on one {what}; a coupler curve of a four-bar has at most {most} points in common "
                f"with a {what} that is no part of it, and four-bars that draw a whole {what} are degenerate and "
                f"come in infinite families: move a point, or leave points out"
            )
    return ""
