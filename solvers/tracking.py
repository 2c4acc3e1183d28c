"""From a homotopy to the ends of all its paths: chunks, workers, run file, ladder."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol
from weakref import WeakKeyDictionary

import numpy as np

from solvers import ledger, parallel
from solvers.endgame import finish
from solvers.ends import FAILED, SINGULAR, Ends
from solvers.homotopy import Homotopy, Listed
from solvers.kernel.engine import Engine, make_engine
from solvers.kernel.reference import Settings
from solvers.tape import Program

Progress = Callable[[str, int, int], None]

#: Paths that the last rung of the ladder takes on. It costs some thousand times as much as double precision, a second
#: for a path; and when more paths than this are too ill-conditioned for 32 digits it is the equations that need help.
FEW_PATHS = 32
#: Of paths to far ends, which are the same steps again and again and never stuck, it takes more.
FEW_FAR_PATHS = 128
#: Largest radii of the endgame's loops on the rungs. Roots near to each other are told apart the later one loops, but
#: paths to ill-conditioned roots at infinity are lost sooner than that: each has a rung in double-double.
LOOPS = (2e-6, 1.0, 2e-10)
#: Paths of a chunk on the rungs: each takes some ten or hundred times as long as in the first pass.
CAREFUL_CHUNK = 32
#: The smallest radius of the endgame in double-double arithmetic.
DEEPEST = 1e-26
#: On the last rung loops begin here and end there. Until then a path that grows is only followed: where a root lies so
#: far out that the path turns to it at r = 1e-14 or later, loops farther away show only where it seemed to go.
FAR_LOOPS, FAR_DEEPEST = 1e-30, 1e-34
#: A homotopy that looks at radii smaller than this has parameters that keep all their digits there.
ALL_DIGITS = 1e-16
#: The name of the last rung in the ledger.
LAST_RUNG = "in multiprecision"


class Checkpoint(Protocol):
    """Where finished chunks are kept: see :class:`solvers.store.RunFile`."""

    def chunks(self, stage: str) -> dict[int, dict[str, np.ndarray]]: ...

    def append(self, stage: str, number: int, arrays: dict[str, np.ndarray]) -> None: ...


@dataclass
class Run:
    """How a homotopy is to be tracked.

    Attributes
    ----------
    jobs : int
        Workers.
    backend : str
        One of ``solvers.parallel.BACKENDS``.
    checkpoint : Checkpoint or None
        Keeps finished chunks, and gives back those of an earlier run.
    progress : callable (what, done, total) or None
    """

    jobs: int = 1
    backend: str = "threads"
    checkpoint: Checkpoint | None = None
    progress: Progress | None = None

    def say(self, what: str, done: int, total: int) -> None:
        if self.progress is not None:
            self.progress(what, done, total)


def track_all(
    homotopy: Homotopy, run: Run, settings: Settings | None = None, ladder: bool = True, precise: bool = True
) -> tuple[Ends, dict[str, int]]:
    """Track every path of a homotopy; returns the ends, and how many paths each rung of the ladder saw.

    Without the ladder doubtful paths are only marked as failed; if it is not `precise`, it ends before its last rung,
    64 digits, which take seconds for a path. When the user interrupts, the ends found so far
    are returned inside :class:`Interrupted`.
    """
    settings = settings or Settings()
    engine = engine_of(homotopy)
    ends = _empty(homotopy.starts.count, homotopy.program.unknowns)
    ends.typical = engine.size
    stage = "" if run.checkpoint is None else f"paths {digest(homotopy)}"
    chunks = parallel.cut(homotopy.starts.count)
    kept = _kept(run, stage, chunks, homotopy.program.unknowns)
    for number, part in kept.items():
        ends.replace(chunks[number], part)
    tasks = [(n, (engine, homotopy, chunk, settings)) for n, chunk in enumerate(chunks) if n not in kept]
    done = homotopy.starts.count - sum(len(chunks[number]) for number, _ in tasks)
    try:
        run.say(homotopy.name, done, homotopy.starts.count)
        for number, part in parallel.run(_track_chunk, tasks, run.jobs, run.backend):
            ends.replace(chunks[number], part)
            if run.checkpoint is not None:
                run.checkpoint.append(stage, number, _to_arrays(part))
            done += len(chunks[number])
            run.say(homotopy.name, done, homotopy.starts.count)
        last = _Precise(engine, homotopy, ends, homotopy.complete)
        rungs = _rungs(engine, homotopy, settings, run, last if precise else None) if ladder else iter(())
        used = ledger.climb(ends, rungs, lambda name, n: run.say(name, 0, n), homotopy.complete)
        if LAST_RUNG in used:
            used[LAST_RUNG] = last.tracked
    except KeyboardInterrupt:
        ledger.settle(ends)
        raise Interrupted(ends) from None
    return ends, used


class Interrupted(KeyboardInterrupt):
    """The user stopped a solve.

    Attributes
    ----------
    ends : Ends
        What was found before (paths that were not tracked are marked as failed).
    solutions : Solutions or None
        The same as a result, when the front door has seen the exception.
    """

    def __init__(self, ends: Ends, solutions: Any = None) -> None:
        super().__init__("stopped by the user")
        self.ends = ends
        self.solutions = solutions


_ENGINES: WeakKeyDictionary[Program, Engine] = WeakKeyDictionary()


def engine_of(homotopy: Homotopy) -> Engine:
    """The compiled tick of a homotopy: made once for each program, and used again for other parameters."""
    engine = _ENGINES.get(homotopy.program)
    if engine is None:
        # A listed start is carried again and again, to many targets.
        paths = None if isinstance(homotopy.starts, Listed) else homotopy.starts.count
        if "J" in homotopy.program.outputs:
            engine = Engine(homotopy.program, homotopy.samples(), homotopy.moving, paths)
        else:
            engine = make_engine(*homotopy.builder(), homotopy.samples(), homotopy.moving, paths)
        _ENGINES[homotopy.program] = engine
    return engine


def digest(homotopy: Homotopy) -> str:
    """A name for one computation: the same program, parameters, start and seed have the same digest."""
    state = hashlib.sha256()
    program = homotopy.program
    for array in (program.code, program.outputs["F"], homotopy.start, homotopy.target):
        state.update(np.ascontiguousarray(array).tobytes())
    sizes = (program.unknowns, program.parameters, homotopy.starts.count)
    state.update(repr((program.constants, homotopy.name, homotopy.kind, sizes, homotopy.seed)).encode())
    # Starts that are made by a rule follow from what is above; a list can differ anywhere.
    listed = isinstance(homotopy.starts, Listed)
    first = homotopy.starts.points(np.arange(homotopy.starts.count if listed else min(4, homotopy.starts.count)))
    state.update(np.ascontiguousarray(first).tobytes())
    return state.hexdigest()[:24]


def _track_chunk(
    engine: Engine | _Options, homotopy: Homotopy, chunk: np.ndarray, settings: Settings, *endgame: float
) -> Ends:
    return finish(
        engine,
        homotopy.program,
        homotopy.starts.points(chunk),
        homotopy.target,
        homotopy.direction,
        settings,
        homotopy.smallest,
        *endgame,
    )


def _rungs(
    engine: Engine, homotopy: Homotopy, settings: Settings, run: Run, last: _Precise | None
) -> Iterator[tuple[str, Callable[[np.ndarray], Ends]]]:
    """Ever more careful ways to track a path, however careless the first was.

    None of them changes to a projective patch. A path that passes near infinity loses digits, not room: unknowns are
    measured each in its own size, and the patch is no better conditioned (measured in
    ``tests/solvers/test_near_infinity.py``, with paths that come within 1e-12 of infinity and arrive).
    """

    def rung(
        name: str, how: Settings, first_loop: float, **options: Any
    ) -> tuple[str, Callable[[np.ndarray], Ends]]:
        endgame = (first_loop, DEEPEST if "arithmetic" in options else 1.0)

        def track(rows: np.ndarray) -> Ends:
            ends = _empty(len(rows), homotopy.program.unknowns)
            chunks = parallel.cut(len(rows), CAREFUL_CHUNK)
            careful = _Options(engine, options)
            tasks = [(n, (careful, homotopy, rows[chunk], how, *endgame)) for n, chunk in enumerate(chunks)]
            done = 0
            for number, part in parallel.run(_track_chunk, tasks, run.jobs, run.backend):
                ends.replace(chunks[number], part)
                done += len(chunks[number])
                run.say(name, done, len(rows))
            return ends

        return name, track

    usual = Settings()
    tight = replace(
        settings,
        contraction=min(settings.contraction, usual.contraction),
        safety=max(settings.safety, usual.safety),
        tolerance=min(settings.tolerance, usual.tolerance),
        largest_step=min(settings.largest_step, usual.largest_step),
        ticks=max(settings.ticks, usual.ticks),
    ).tighter()
    yield rung("with tighter steps", tight, LOOPS[0], pivoted=True)
    yield rung("in double-double", tight, LOOPS[1], arithmetic="double-double")
    yield rung("in double-double with tighter steps", tight.tighter(), LOOPS[2], arithmetic="double-double")
    # The precision of Arb numbers is one setting for all threads: nobody else may be at work.
    if last is not None and last.is_worth_it() and threading.current_thread() is threading.main_thread():
        yield LAST_RUNG, last


class _Precise:
    """The last rung: 64 digits, for paths that were lost on their way, or wind in numbers that do not fit.

    These have been taken round several of a few roots that are as near to one another as the smallest radius tells
    apart; with more digits there are smaller ones. A path that was seen at the first radius of the endgame and failed
    later is left alone, unless it was growing: at a finite end a limit does not settle, or paths are many to one end,
    and no number of digits helps.
    """

    def __init__(self, engine: Engine, homotopy: Homotopy, ends: Ends, complete: bool = False) -> None:
        self.engine, self.homotopy, self.ends, self.complete = engine, homotopy, ends, complete
        self.tracked = 0

    def wanted(self) -> np.ndarray:
        """Rows that need the digits."""
        rows = ledger.doubtful(self.ends, self.complete)
        late = (self.ends.kind[rows] == FAILED) & np.isfinite(self.ends.mark[rows]) & ~self.ends.leaving[rows]
        return np.asarray(rows[~late])

    def is_worth_it(self) -> bool:
        """Whether there are paths that need the digits, and not too many."""
        rows = self.wanted()
        far = int(np.sum(self.ends.leaving[rows]))
        few = ledger.are_few(rows.size, len(self.ends.kind))
        return bool(rows.size) and few and rows.size - far <= FEW_PATHS and far <= FEW_FAR_PATHS

    def __call__(self, rows: np.ndarray) -> Ends:
        names = ("x", "kind", "winding", "condition", "mark", "leaving")
        kept = {name: getattr(self.ends, name)[rows] for name in names}
        why = {k: self.ends.why[row] for k, row in enumerate(rows.tolist()) if row in self.ends.why}
        part = Ends(**kept, ticks=np.zeros(len(rows), np.int64), why=why)
        needed = np.flatnonzero(np.isin(rows, self.wanted()))
        options = _Options(self.engine, {"arithmetic": "multiprecision"})
        deep = self.ends.leaving[rows[needed]] | (self.ends.kind[rows[needed]] == SINGULAR)
        far = self.homotopy
        if far.smallest < ALL_DIGITS:
            far = replace(far, smallest=FAR_DEEPEST)
        for homotopy, chunk, endgame in (
            (self.homotopy, needed[~deep], ()),
            (far, needed[deep], (FAR_LOOPS, FAR_DEEPEST)),
        ):
            if chunk.size:
                again = _track_chunk(options, homotopy, rows[chunk], Settings(), *endgame)
                part.replace(chunk, again)
        self.tracked += len(needed)
        return part


class _Options:
    """An engine with some options of its tracker set."""

    def __init__(self, engine: Engine, options: dict[str, Any]) -> None:
        self._engine, self._options = engine, options
        self.program, self.size = engine.program, engine.size

    def track(self, *arguments: Any, **keywords: Any) -> Any:
        return self._engine.track(*arguments, **{**keywords, **self._options})


#: What the run file holds of each path, and beside it the reasons of failures.
_STORED = ("x", "kind", "winding", "condition", "ticks", "mark", "leaving")


def _empty(count: int, size: int) -> Ends:
    return Ends(
        x=np.full((count, size), np.nan, np.complex128),
        kind=np.full(count, FAILED, np.int8),
        winding=np.zeros(count, np.int64),
        condition=np.full(count, np.inf),
        ticks=np.zeros(count, np.int64),
    )


def _to_arrays(ends: Ends) -> dict[str, np.ndarray]:
    arrays = {name: getattr(ends, name) for name in _STORED}
    arrays["why"] = np.frombuffer(json.dumps(list(ends.why.items())).encode(), np.uint8)
    return arrays


def _kept(run: Run, stage: str, chunks: list[np.ndarray], unknowns: int) -> dict[int, Ends]:
    """Chunks that an earlier run has finished. What does not fit (another version's chunks) is tracked again."""
    kept = {}
    stored = {} if run.checkpoint is None else run.checkpoint.chunks(stage)
    for number, arrays in stored.items():
        if number < len(chunks) and set(arrays) == {*_STORED, "why"}:
            count = len(chunks[number])
            shapes = {name: (count, unknowns) if name == "x" else (count,) for name in _STORED}
            if all(arrays[name].shape == shape for name, shape in shapes.items()):
                why = {int(row): str(text) for row, text in json.loads(bytes(arrays["why"]))}
                x, kind, winding, condition, ticks, mark, leaving = (arrays[name] for name in _STORED)
                kept[number] = Ends(x, kind, winding, condition, ticks, why, mark, leaving)
    return kept
