"""Where a pivot may be: a point, a box, a line along an axis, or anywhere."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Region"]

Interval = tuple[float, float]


@dataclass(frozen=True)
class Region:
    """Where a pivot may be: intervals of x and y, a point when both are single numbers; None is anywhere.

    Examples
    --------
    >>> Region((0, 1), None).holds(np.array([0.5 + 9j, 2.0])).tolist()
    [True, False]
    >>> Region((3, 3), (4, 4)).point
    (3+4j)
    """

    x: Interval | None = None
    y: Interval | None = None

    @property
    def given(self) -> bool:
        """Whether it asks for anything."""
        return self.x is not None or self.y is not None

    @property
    def point(self) -> complex | None:
        """The place, if both coordinates are numbers."""
        if self.x is None or self.y is None or self.x[0] != self.x[1] or self.y[0] != self.y[1]:
            return None
        return complex(self.x[0], self.y[0])

    def holds(self, places: NDArray[np.complex128]) -> NDArray[np.bool_]:
        """Which places lie in it; infinite ones lie in no region that asks for anything."""
        inside = np.ones(np.shape(places), dtype=bool)
        for side, values in ((self.x, places.real), (self.y, places.imag)):
            if side is not None:
                inside &= (values >= side[0]) & (values <= side[1])
        return inside

    def sample(self, unit: NDArray[np.float64], middle: complex, reach: float) -> NDArray[np.complex128]:
        """Points of the unit square mapped into it; open sides are filled up to `reach` about `middle`."""
        coordinates = []
        for side, centre, column in ((self.x, middle.real, 0), (self.y, middle.imag, 1)):
            low, high = side if side is not None else (centre - reach, centre + reach)
            coordinates.append(low + (high - low) * unit[:, column])
        return coordinates[0] + 1j * coordinates[1]


    def along(
        self, start: NDArray[np.complex128], way: NDArray[np.complex128], unit: NDArray[np.float64], size: float
    ) -> NDArray[np.complex128]:
        """Points of lines, one of each, inside it; without sides, over the whole lines, most of them near their start.

        Parameters
        ----------
        start, way : (n,) complex arrays
            Points of the lines and their directions, of unit length.
        unit : (n,) float array
            Numbers from 0 to 1 that choose.
        size : float
            What near means.
        """
        low, high = np.full(len(start), -np.inf), np.full(len(start), np.inf)
        for side, place, step in ((self.x, start.real, way.real), (self.y, start.imag, way.imag)):
            if side is not None:
                with np.errstate(divide="ignore", invalid="ignore"):
                    ends = np.sort((np.array(side)[:, None] - place) / step, axis=0)
                low, high = np.fmax(low, ends[0]), np.fmin(high, ends[1])
        # the tangent maps the angle at which the line is seen from its start to a length
        first, last = np.arctan(low / size), np.arctan(high / size)
        shift = size * np.tan(first + (last - first) * unit)
        return np.asarray(start + way * np.where(low <= high, shift, np.inf))
