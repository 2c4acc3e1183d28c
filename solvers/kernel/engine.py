"""One system made ready for tracking: whichever way of running the tick pays for the work at hand.

An :class:`Engine` is built once for a homotopy and tracks any number of paths along any parameter lines. It is
plain data (programs as arrays), so that a worker process receives it by pickle and compiles for itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from solvers.kernel import reference
from solvers.kernel.reference import Settings, Tracked
from solvers.system import differentiated
from solvers.tape import Builder, Node, Program


def make_engine(
    builder: Builder,
    equations: Sequence[Node],
    samples: tuple[Any, Any],
    moving: Sequence[int] | None = None,
) -> Engine:
    """Prepare equations on a graph for tracking.

    Parameters
    ----------
    builder : Builder
        The graph that holds the equations.
    equations : sequence of nodes
        As many as unknowns.
    samples : (points, parameters)
        Typical points (samples, unknowns) and parameters (parameters,) or (samples, parameters), start points
        for instance: a handful. The order of elimination is chosen by the Jacobians there.
    moving : sequence of int, optional
        Indices of the parameters that move; all, if not given. Directions of the others must be zero.

    Returns
    -------
    Engine

    Examples
    --------
    >>> b = Builder(1, 1)
    >>> x, p = b.unknown(0), b.parameter(0)
    >>> engine = make_engine(b, [b.sub(b.square(x), p)], (np.array([[1.0]]), np.array([1.0])))
    >>> end = engine.track(np.array([[1.0], [-1.0]]), base=np.array([4.0]), direction=np.array([-3.0]))
    >>> end.x.real.round(6).tolist()
    [[2.0], [-2.0]]
    """
    program = differentiated(builder, list(equations), moving)
    points, parameters = samples
    return Engine(program, np.atleast_2d(points), np.asarray(parameters))


class Engine:
    """Tracks paths of one parametrised system. Made by :func:`make_engine`."""

    def __init__(self, program: Program, points: np.ndarray, parameters: np.ndarray) -> None:
        self.program = program
        self._points, self._parameters = points, parameters

    def track(
        self,
        x: np.ndarray,
        base: np.ndarray,
        direction: np.ndarray,
        start: float = 1.0,
        end: float = 0.0,
        stop: float | None = None,
        settings: Settings | None = None,
        pivoted: bool = False,
        kind: str = "line",
    ) -> Tracked:
        """Track paths from r = start down to r = end; see :func:`solvers.kernel.reference.track`.

        Parameters
        ----------
        x : ndarray, shape (paths, unknowns)
            Solutions at `start`.
        base, direction : ndarray, shape (parameters,) or (paths, parameters)
        pivoted : bool
            Solve with partial pivoting at each tick, as reruns do, instead of the fixed order of elimination.
        kind : {"line", "toric"}
            Parameters base + r·direction, or base·exp(r·direction) with real direction.
        """
        return reference.track(
            self.program, x, base, direction, start=start, end=end, stop=stop, settings=settings, kind=kind
        )
