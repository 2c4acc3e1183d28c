"""One system made ready for tracking: whichever way of running the tick pays for the work at hand.

An :class:`Engine` is built once for a homotopy and tracks any number of paths along any parameter lines. It is
plain data (programs as arrays), so that a worker process receives it by pickle and compiles for itself.

Faster ways cost more to set up: the NumPy reference costs nothing, the kernel must be loaded (once per process) or
compiled (once per installation), a tick must be written, with an order of elimination for this system, and in machine
code it must be compiled (once per system, unless the cache has it). As with skis, one rents until the rent would have
paid for the purchase: whatever the work turns out to be, that costs at most twice the best choice.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from solvers.graph import Builder, Node
from solvers.kernel import compiled, reference
from solvers.kernel.elimination import elimination_length, pivot_order, tick_program
from solvers.kernel.reference import Settings, Tracked
from solvers.system import differentiated, evaluate
from solvers.tape import Program

#: Multiplications by zeros of the Jacobian, with pivots chosen for each path, after which it pays to write a tick that
#: knows an order of elimination: some ten milliseconds of them. Path-ticks after which it pays whatever the Jacobian.
ZEROS_PAY, TICK_PAYS = 5e7, 150_000
#: A tick program longer than this is not written out: the loops of the pivoted tick serve instead.
LONGEST_TICK = 40_000
#: Ticks of a typical path, to foresee the work of a call.
TYPICAL_TICKS = 130
#: Path-ticks after which machine code pays: 0.2 ms to compile an instruction, 0.15 ns saved whenever it runs.
CODE_PAYS = 1_200_000
#: A tick program longer than this is interpreted, whatever the work: its machine code would not fit into caches.
LONGEST_CODE = 15_000
#: Seconds that the kernel costs when it is loaded from numba's cache, and when it must be compiled.
LOADING, COMPILING = 0.4, 10.0
#: NumPy's cost in seconds: of a tick, of an instruction, of an instruction for each path, of n³ for each path.
NUMPY_COST = (4e-4, 1.5e-6, 1.5e-8, 1e-9)

ARITHMETICS = ("double", "double-double", "multiprecision")
_ENGINES = ("auto", "reference", "interpreted", "compiled")


def make_engine(
    builder: Builder,
    equations: Sequence[Node],
    samples: tuple[Any, Any],
    moving: Sequence[int] | None = None,
    paths: int | None = None,
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
    paths : int, optional
        As of :class:`Engine`.

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
    return Engine(differentiated(builder, equations, moving), samples, moving, paths)


class Engine:
    """Tracks paths of one parametrised system.

    Parameters
    ----------
    program : Program
        Outputs F, J and Ft.
    samples, moving
        As of :func:`make_engine`.
    paths : int, optional
        How many paths are to be tracked in all, if that is known: for few of them a tick is not worth being written,
        and pivots are chosen for each path as it goes.

    Attributes
    ----------
    program : Program
    prefer : str
        "auto", or the engine to use whatever it costs: "reference", "interpreted", "compiled".
    used : str
        The engine that the last call used.
    lanes : Lanes or None
        Vectors to use instead of the processor's own.
    size : float
        Typical size of the unknowns, from the samples.
    """

    prefer = "auto"
    used = ""
    lanes: Any = None

    def __init__(
        self,
        program: Program,
        samples: tuple[Any, Any],
        moving: Sequence[int] | None = None,
        paths: int | None = None,
    ) -> None:
        points = np.atleast_2d(np.asarray(samples[0], np.complex128))
        self.program = program
        self._samples = points, np.asarray(samples[1], np.complex128)
        self._moving = None if moving is None else list(moving)
        self._tick: tuple[Program | None] | None = None
        # By the number of all paths, not by what has been tracked so far: a path must not depend on its company.
        self._with_tick = paths is None or _tick_pays(program, paths * TYPICAL_TICKS)
        self.size = float(np.median(np.abs(points).max(axis=1, initial=0.0))) or 1.0
        self._forget()

    def _forget(self) -> None:
        """Nothing has been compiled or tracked yet, in this process."""
        self._lock = threading.RLock()
        self._runs: dict[tuple[str, Any], compiled.Run] = {}
        self._path_ticks = 0
        self._code_at_hand: bool | None = None

    @property
    def tick(self) -> Program | None:
        """The whole tick as one program (outputs dx and dr); None if it is too long or has no order of pivots."""
        with self._lock:
            if self._tick is None:
                self._tick = (self._written_out(),)
            return self._tick[0]

    def _written_out(self) -> Program | None:
        program = self.program
        _, J = evaluate(program, *self._samples)
        J = J[np.isfinite(J).all(axis=(1, 2))]
        try:
            order = pivot_order(program.pattern, J)
        except np.linalg.LinAlgError:  # no fixed order of elimination; pivoting may see a way at some points
            return None
        if elimination_length(program.pattern, order) + len(program.code) > LONGEST_TICK:
            return None
        builder = Builder(program.unknowns, program.parameters)
        unknowns = [builder.unknown(k) for k in range(program.unknowns)]
        equations = program.embed(builder, unknowns, [builder.parameter(k) for k in range(program.parameters)])
        return tick_program(builder, equations, order, self._moving)

    def __getstate__(self) -> dict[str, Any]:
        fresh = ("_lock", "_runs", "_path_ticks", "_code_at_hand")
        return {name: value for name, value in self.__dict__.items() if name not in fresh}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._forget()

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
        arithmetic: str = "double",
        bend: complex = 1.0,
    ) -> Tracked:
        """Track paths from r = start down to r = end; see :func:`solvers.kernel.reference.track`.

        Parameters
        ----------
        x : ndarray, shape (paths, unknowns)
            Solutions at `start`.
        base, direction : ndarray, shape (parameters,) or (paths, parameters)
        start, end : float
            Where on the line the paths begin and end; start > end.
        stop : float, optional
            Pause a path when it has come so far, unless its next step reaches `end` at once.
        pivoted : bool
            Solve with partial pivoting at each tick, as reruns do, instead of the fixed order of elimination.
        kind : {"line", "toric", "arc"}
            Parameters base + r·direction, or base·exp(r·direction) with real direction, or the line taken on a
            circular arc of the complex plane of r that `bend` chooses.
        arithmetic : {"double", "double-double", "multiprecision"}
            Numbers of sixteen digits; of thirty-two at ten times the cost; of sixty-four at a thousand times.
            Step control and results are double in any case; a result is then correct to the last bit.

        Returns
        -------
        Tracked

        Raises
        ------
        ValueError
            Shapes do not fit the system, or an option is unknown; the message says which.
        """
        x = np.atleast_2d(np.asarray(x, np.complex128))
        base, direction = np.asarray(base, np.complex128), np.asarray(direction, np.complex128)
        self._check_shapes(x, base, direction)
        if kind not in reference.KINDS:
            raise ValueError(f"the kind of path {kind!r} is unknown; it is one of {', '.join(reference.KINDS)}")
        if kind == "toric" and np.any(direction.imag):
            raise ValueError("the exponents of a toric path must be real")
        if arithmetic not in ARITHMETICS:
            raise ValueError(f"the arithmetic {arithmetic!r} is unknown; it is one of {', '.join(ARITHMETICS)}")
        settings = settings or Settings()
        if math.isinf(settings.size):
            settings = replace(settings, size=self.size)
        if arithmetic == "double-double":
            settings = settings.in_double_double()
        self.used = self._choose(len(x), pivoted) if arithmetic == "double" else arithmetic
        if self.used == "double-double" and self.tick is None:
            self.used = "multiprecision"
        if self.used in ("reference", "multiprecision"):
            track = _multiprecision() if self.used == "multiprecision" else reference.track
            arguments: dict[str, Any] = {
                "start": start,
                "end": end,
                "stop": stop,
                "settings": settings,
                "kind": kind,
                "bend": bend,
            }
            return track(self.program, x, base, direction, **arguments)
        result = self._run(self.used).track(x, base, direction, start, end, stop, settings, kind, complex(bend))
        self._path_ticks += int(result.ticks.sum())
        return result

    def _check_shapes(self, x: np.ndarray, *lines: np.ndarray) -> None:
        n, m = self.program.unknowns, self.program.parameters
        if x.ndim != 2 or x.shape[1] != n:
            raise ValueError(f"start points of the shape {x.shape}; the system has {n} unknowns, a row is a point")
        for values in lines:
            if values.shape not in ((m,), (1, m), (len(x), m)):
                raise ValueError(
                    f"parameters of the shape {values.shape} for {len(x)} paths; the system has {m} parameters, "
                    f"so the shape is ({m},) for all paths or ({len(x)}, {m})"
                )

    def _choose(self, paths: int, pivoted: bool) -> str:
        wanted = self.prefer
        if wanted not in _ENGINES:
            raise ValueError(f"there is no engine {wanted!r}; there are {', '.join(_ENGINES)}")
        if wanted == "reference":
            return wanted
        if wanted == "auto" and not _kernel_pays(self._numpy_seconds(paths)):
            return "reference"
        if pivoted or (wanted == "auto" and not self._with_tick) or self.tick is None:
            return "pivoted"
        if wanted != "auto":
            return wanted
        if self._code_at_hand is None:
            self._code_at_hand = compiled.code_is_cached(self.tick, self.lanes)
        if self._path_ticks + paths * TYPICAL_TICKS > CODE_PAYS and len(self.tick.code) <= LONGEST_CODE:
            self._code_at_hand = True
        return "compiled" if self._code_at_hand else "interpreted"

    def _numpy_seconds(self, paths: int) -> float:
        tick, instruction, lane, solve = NUMPY_COST
        length, n = len(self.program.code), self.program.unknowns
        return 1.4 * TYPICAL_TICKS * (tick + length * (instruction + paths * lane) + paths * n**3 * solve)

    def _run(self, way: str) -> compiled.Run:
        key = (way, self.lanes or compiled.lanes_in_use())
        with self._lock:
            if key not in self._runs:
                program = self.program if way == "pivoted" else self.tick
                assert program is not None
                self._runs[key] = compiled.Run(program, way, key[1])
            return self._runs[key]


def _tick_pays(program: Program, path_ticks: int) -> bool:
    zeros = program.unknowns * (program.unknowns**2 - len(program.pattern))
    return path_ticks > TICK_PAYS or path_ticks * zeros > ZEROS_PAY


def _multiprecision() -> Any:
    from solvers.kernel import multiprecision

    return multiprecision.track


_RENT = {"seconds": 0.0}


def _kernel_pays(seconds: float) -> bool:
    """Whether the kernel is loaded, or NumPy has cost and would cost more than to load (compile) it."""
    if compiled.kernel_is_loaded():
        return True
    _RENT["seconds"] += seconds
    return _RENT["seconds"] > (LOADING if compiled.kernel_is_cached() else COMPILING)
