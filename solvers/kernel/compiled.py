"""The way into the compiled kernel: numba is imported here, and only when a kernel is really wanted."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import Any

import numpy as np

from solvers.kernel.layout import layout, workspace
from solvers.kernel.reference import KINDS, Settings, Tracked, radius
from solvers.tape import Program

#: Paths tracked without looking up: a fraction of a second, so that an interruption is heard.
CHUNK = 8192

_STATE: dict[str, Any] = {}


def kernel_is_loaded() -> bool:
    """Whether the kernel has run in this process."""
    return "loaded" in _STATE


def kernel_is_cached() -> bool:
    """Whether the kernel has been compiled on this computer; if not, the first use takes some seconds.

    >>> isinstance(kernel_is_cached(), bool)
    True
    """
    return _marker().exists()


def _marker() -> Any:
    """A file that says that numba's cache holds the kernel of these sources for this processor."""
    if "marker" not in _STATE:
        from solvers.kernel.sources import cache_directory, source_digest

        given = [os.environ.get(name, "") for name in ("EVERYLINKAGE_LANES", "NUMBA_CPU_NAME", "NUMBA_CACHE_DIR")]
        name = "-".join([source_digest(), f"{sys.version_info[0]}{sys.version_info[1]}", *given])
        _STATE["marker"] = cache_directory() / ("kernel-" + "".join(c if c.isalnum() else "-" for c in name))
    return _STATE["marker"]


def lanes_in_use() -> Any:
    """The lanes of this processor."""
    from solvers.kernel.lanes import native_lanes

    return native_lanes()


def code_is_cached(program: Program, lanes: Any = None) -> bool:
    """Whether machine code of a tick program can be loaded instead of compiled."""
    from solvers.kernel import codegen

    return codegen.is_cached(program, lanes or lanes_in_use())


class Run:
    """A program bound to a way of running it: "compiled", "interpreted", "pivoted" or "double-double"."""

    def __init__(self, program: Program, way: str, lanes: Any) -> None:
        from solvers.kernel import tracker
        from solvers.kernel.interpreter import bytecode

        self.lanes, self.way = lanes, way
        self.unknowns, self.parameters = program.unknowns, program.parameters
        self.at = layout(program.unknowns, program.parameters)
        outputs = ("F", "J", "Ft") if way == "pivoted" else ("dx", "dr")
        self.address = 0
        self.first = self.matrix = self.rows = self.at.slots
        self.pattern = np.zeros((0, 2), np.int32)
        if way == "compiled":
            from solvers.kernel.codegen import Tick

            self.machine_code = Tick(program, lanes)
            self.address = self.machine_code.address
            self.mode = tracker.COMPILED
            self.code, self.outputs = np.zeros((0, 5), np.int32), np.zeros(0, np.int32)
            self.constants = np.zeros((0, 2))
        else:
            first, stride, leaf = self.at.slots, 2, 0
            if way == "double-double":
                # rows of scratch for the tick, then the inputs, then constants and values
                stride, leaf = 4, first + 4 * self.unknowns
                first = leaf + 4 * (self.unknowns + 2 * self.parameters)
            self.mode = {
                "pivoted": tracker.PIVOTED,
                "interpreted": tracker.INTERPRETED,
                "double-double": tracker.DOUBLE_DOUBLE,
            }[way]
            program_rows = bytecode(program, outputs, first, stride, leaf)
            self.first = first
            self.code, self.outputs = program_rows.code, program_rows.outputs
            self.constants, self.pattern = program_rows.constants, program_rows.pattern
            self.rows = program_rows.rows
            if way == "pivoted":
                self.matrix = self.rows
                self.rows += 2 * self.unknowns * (self.unknowns + 2)

    def track(
        self,
        x: np.ndarray,
        base: np.ndarray,
        direction: np.ndarray,
        start: float,
        end: float,
        stop: float | None,
        settings: Settings,
        kind: str,
        bend: complex = 1.0,
    ) -> Tracked:
        """As :func:`solvers.kernel.reference.track`; releases the interpreter lock."""
        from solvers.kernel import stepping, tracker

        n, m, width, count = self.unknowns, self.parameters, self.lanes.width, len(x)
        work = workspace(self.rows, width)
        values = np.repeat(self.constants.ravel(), width)
        work[self.first * width : self.first * width + len(values)] = values
        result = Tracked(
            x=np.array(x, np.complex128, order="C"),
            r=np.full(count, float(start)),
            tangent=np.zeros((count, n), np.complex128),
            status=np.zeros(count, np.int8),
            ticks=np.zeros(count, np.int64),
            steps=np.zeros(count, np.int64),
            quality=np.full(count, np.inf),
        )
        if count == 0:
            return result
        length = float(start) - float(end)
        control = stepping.Control(
            start=float(start),
            end=float(end),
            stop=float(end if stop is None else stop),
            contraction=float(settings.contraction),
            safety=float(settings.safety),
            tolerance=float(settings.tolerance),
            noise=float(settings.noise),
            largest=settings.largest_step * length,
            first=settings.first_step * length,
            smallest=float(settings.smallest_step),
            ticks=float(settings.ticks),
            infinity=float(settings.infinity),
            radius=float(radius(settings.contraction)),
            budget=float(0.1791 * radius(settings.contraction) / radius(0.125)),
            size=min(float(settings.size), 1e150) ** 2,
        )
        turn = (float(bend.real), float(bend.imag))
        starts, lines = _pairs(x), [_pairs(np.atleast_2d(values)) for values in (base, direction)]
        ends = (result.x.view(np.float64), result.r, result.tangent.view(np.float64))
        counts = (result.status, result.ticks, result.steps, result.quality)
        for first in range(0, count, CHUNK):
            rows = slice(first, first + CHUNK)
            line = [values[rows] if len(values) > 1 else values for values in lines]
            tracker.track_queue(
                self.lanes, width, work, self.at, n, m, self.mode, self.address, self.code, self.outputs,
                self.pattern, self.matrix, KINDS.index(kind), turn, control, starts[rows], *line,
                *[values[rows] for values in (*ends, *counts)],
            )  # fmt: skip
        if "loaded" not in _STATE:
            _STATE["loaded"] = True
            with contextlib.suppress(OSError):
                _marker().parent.mkdir(parents=True, exist_ok=True)
                _marker().touch()
        return result


def _pairs(values: np.ndarray) -> np.ndarray:
    """A complex array as pairs of doubles, contiguous."""
    return np.ascontiguousarray(values, np.complex128).view(np.float64)
