"""Monodromy for more roots than fit into memory.

The loops are those of :mod:`solvers.monodromy`. The roots are in a run file, some unknowns of each, and are read,
carried and written batch by batch; what is in memory of each is 32 bytes that tell whether it is known. A batch that is
finished is in the file, so a search that was killed at any moment goes on with the next one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from solvers.carry import carry
from solvers.homotopy import parameter_homotopy
from solvers.kernel.engine import Engine
from solvers.key_index import KeyIndex
from solvers.legs import Leg, arcs, detour_of, evidence_of, quiet_enough, two_nodes
from solvers.monodromy import MOST_LEGS, QUIET_PATHS
from solvers.points import Group, Symmetry
from solvers.store import RunFile
from solvers.stored_roots import BATCH, Restore, StoredRoots, columns_of
from solvers.symmetries import checked_group
from solvers.system import InvalidSystem, System
from solvers.tracking import digest

#: A root that is restored from its stored unknowns must be the same to this precision, relative.
RESTORED = 1e-6

Progress = Callable[[str, int, int], None]


def stored_monodromy(
    system: System,
    run: RunFile,
    keep: Sequence[Any] | None = None,
    restore: Restore | None = None,
    seed: int = 0,
    symmetry: Sequence[Symmetry] = (),
    start: tuple[Any, Any] | None = None,
    *,
    jobs: int = 1,
    backend: str = "threads",
    count: int | None = None,
    batch: int = BATCH,
    progress: Progress | None = None,
) -> StoredRoots:
    """All roots at generic parameters, in a run file.

    There is no trace test: the points of its curve are ten times as many as the roots.

    Parameters
    ----------
    system : System
        With parameters.
    run : RunFile
        Where the roots are stored. A search that was stopped goes on from what is in it.
    keep : sequence of unknowns (symbols, names or numbers), optional
        What is stored of each root; by default everything. No two roots may agree in all of them.
    restore : callable, optional
        ``restore(kept, parameters)``: whole roots (n, unknowns) from the stored unknowns (n, kept), in the order of
        `keep`, at parameters (m,). A few correct digits are enough, as Newton's method supplies the others.
    symmetry, start, count
        As for :func:`solvers.monodromy`: one root of each orbit is stored.
    batch : int
        Roots that are in memory at once.

    Returns
    -------
    StoredRoots

    Raises
    ------
    InvalidSystem
        As for :func:`solvers.monodromy`; or `restore` does not give back the first root.
    ValueError
        Something to be kept is no unknown.

    Examples
    --------
    The squares are not stored:

    >>> import pathlib, tempfile
    >>> from sympy import symbols
    >>> x, y, a, b = symbols("x y a b")
    >>> system = System([x**2 - y, y**2 + a*x + b], [x, y], [a, b])
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "run.db"
    >>> with RunFile.create(path, {}) as run:
    ...     roots = stored_monodromy(
    ...         system, run, keep=[x], restore=lambda kept, _: np.hstack([kept, kept**2]), count=4
    ...     )
    ...     len(roots), roots.kept().shape, roots.points().shape
    (4, (4, 1), (4, 2))
    """
    rows, columns = system.size
    if rows != columns or not system.parameters:
        raise InvalidSystem("monodromy needs as many equations as unknowns, and parameters to move")
    chosen = columns_of(keep, system.unknowns)
    rng = np.random.default_rng([seed, 11])
    engine, nodes, typical = two_nodes(system, start, rng)
    first, values = nodes[0].roots.points[:1], nodes[0].parameters
    _check(first, values, chosen, restore)
    group = checked_group(system, symmetry, first, values) if symmetry else None
    if group is not None:
        first = group.representatives(first, values)
    whole = parameter_homotopy(system.program, values, nodes[1].parameters, first, seed)
    name = hashlib.sha256(repr((digest(whole), chosen, batch)).encode()).hexdigest()[:24]
    stage = f"stored monodromy {name}"
    places = [StoredRoots(run, stage, node.parameters, chosen, restore) for node in nodes]
    loops = _Loops(engine, places, group, seed, typical, jobs, backend, batch, progress)
    loops.recall(first)
    wanted = None if count is None else -(-count // (group.order if group else 1))
    while len(loops.history) < MOST_LEGS:
        if max(map(len, places)) >= wanted if wanted is not None else loops.quiet():
            break
        loops.leg()
    return _result(loops, wanted, group)


class _Loops:
    """The state of a search: two places, an index of the roots at either, and how far the last leg has come."""

    def __init__(
        self,
        engine: Engine,
        places: list[StoredRoots],
        group: Group | None,
        seed: int,
        typical: float,
        jobs: int,
        backend: str,
        batch: int,
        progress: Progress | None,
    ) -> None:
        self.engine, self.places, self.group, self.seed = engine, places, group, seed
        self.typical, self.jobs, self.backend, self.batch, self.progress = typical, jobs, backend, batch, progress
        self.run, self.stage = places[0].run, places[0].stage
        self.index = [KeyIndex(len(place.keep), seed=k) for k, place in enumerate(places)]
        self.history: list[Leg] = []
        self.tracked = self.lost = 0
        self.number = 0  # of the next chunk in the run file
        self.done: list[np.ndarray] = []  # carried, arrived, recaptured, new, paths of this leg's batches

    def recall(self, first: np.ndarray) -> None:
        """Take up what is in the run file, or begin with the first root."""
        numbers = self.run.numbers(self.stage)
        for number in numbers:
            chunk = self.run.chunk(self.stage, number)
            self.index[int(chunk["node"][0])].add(chunk["kept"])
            self._note(int(chunk["node"][0]), chunk["kept"])
            if number:
                self._tell(chunk["batch"])
        if not numbers:
            kept = first[:, self.places[0].keep]
            self.run.append(self.stage, 0, {"node": np.zeros(1, np.int64), "kept": kept})
            self.index[0].add(kept)
            self._note(0, kept)

    def leg(self) -> Leg:
        """Carry all roots of one place to the other, batch by batch, from the first batch that is not in the file."""
        source = len(self.history) % 2
        a, b = self.places[source], self.places[1 - source]
        legs, total = len(self.history), len(a)
        way = arcs(self.seed, legs, a.parameters, b.parameters, detour_of(self._quiet_legs()[0]))
        while len(self.history) == legs:
            at = len(self.done) * self.batch
            points = a.points(at, at + self.batch)
            ends, tracked = points, 0
            for start, end, bend in way:
                tracked += len(ends)
                ends = carry(self.engine, ends, start, end, bend, self.jobs, self.backend, self.typical, ladder=True)
            if self.group is not None:
                ends = self.group.representatives(ends, b.parameters)
            kept = ends[:, b.keep]
            known = self.index[1 - source].find(kept)
            recaptured = len(np.unique(known[known >= 0]))
            new = kept[self.index[1 - source].add(kept)]
            told = np.array([len(points), len(ends), recaptured, len(new), tracked], np.int64)
            self.run.append(
                self.stage, self.number, {"node": np.array([1 - source], np.int64), "kept": new, "batch": told}
            )
            self._note(1 - source, new)
            self._tell(told)
            if self.progress is not None:
                self.progress(f"monodromy, leg {legs + 1}, {len(b)} roots", min(at + self.batch, total), total)
        return self.history[-1]

    def quiet(self) -> bool:
        """Whether enough of the last legs have met nothing new, on detours either."""
        legs, paths = self._quiet_legs()
        uneven = len(self.places[0]) != len(self.places[1])
        return legs >= quiet_enough(uneven, tested=False) and paths >= QUIET_PATHS

    def _quiet_legs(self) -> tuple[int, int]:
        """How many of the last legs have met nothing new, and how many paths they had."""
        news = [k for k, leg in enumerate(self.history) if leg.new]
        last = self.history[news[-1] + 1 if news else 0 :]
        return len(last), sum(leg.carried for leg in last)

    def _note(self, node: int, kept: np.ndarray) -> None:
        """The next chunk of the run file holds these roots of a place."""
        self.places[node].note(self.number, len(kept))
        self.number += 1

    def _tell(self, told: np.ndarray) -> None:
        """A batch is finished; a leg is when all roots of its source have been carried."""
        self.done.append(told)
        carried, arrived, recaptured, new, tracked = np.sum(self.done, axis=0).tolist()
        source = len(self.history) % 2
        if carried < len(self.places[source]):
            return
        known = len(self.places[1 - source])
        estimate = (known - new) * (recaptured + new) / recaptured if recaptured else np.inf
        self.history.append(Leg(carried, arrived, new, known, float(max(estimate, known))))
        self.tracked += tracked
        self.lost += carried - arrived
        self.done = []


def _check(first: np.ndarray, values: np.ndarray, chosen: list[int], restore: Restore | None) -> None:
    """Refuse a way back to whole roots that does not lead to the first one."""
    if restore is None:
        if chosen != list(range(first.shape[1])):
            raise InvalidSystem("some unknowns are not kept; give restore(kept, parameters), which finds them again")
        return
    again = np.asarray(restore(first[:, chosen], values))
    if again.shape != first.shape:
        raise InvalidSystem(f"restore gives points of the shape {again.shape} where {first.shape} is meant")
    error = np.abs(again - first).max() / np.abs(first).max()
    if not error < RESTORED:
        raise InvalidSystem(f"restore does not give back the first root: it is {error:.1e} away, relative")


def _result(loops: _Loops, wanted: int | None, group: Group | None) -> StoredRoots:
    found = max(loops.places, key=len)
    order = group.order if group else 1
    found.history = loops.history
    found.evidence = evidence_of(loops.history, loops.tracked, loops.lost, group, len(found))
    if wanted is not None:
        found.complete = len(found) == wanted
        found.evidence += f", known count {wanted * order} {'reached' if found.complete else 'not reached'}"
    return found
