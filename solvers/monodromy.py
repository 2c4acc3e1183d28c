"""All roots from one: carry what is known round loops in parameter space until nothing new appears.

Two generic parameter points A and B are joined by circular arcs, each with its own random bend. All roots known
at A are carried to B, the ends merged with what was known there; all known at B are carried back along another
arc; and so on: one leg a step, where a triangle would need three. Each leg tells for free how complete the sets
are: of n roots carried, the share whose ends were known already estimates the share of all roots that is known
(capture and recapture, Lincoln and Petersen).

The loops stop on evidence: nothing new in several legs, the estimate at its count, orbits of the symmetry group
full, and the trace test of :mod:`solvers.trace` passed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from solvers.ends import REGULAR, Ends
from solvers.legs import (
    Memory,
    Node,
    Search,
    detour_of,
    evidence_of,
    gaussian,
    quiet_enough,
    sizes,
    two_nodes,
)
from solvers.points import Group, PointSet, Symmetry
from solvers.solutions import Ledger, Singular, Solutions
from solvers.strays import strays
from solvers.symmetries import Exchanges, Mirror, checked_group
from solvers.system import InvalidSystem, System
from solvers.tracking import Interrupted

if TYPE_CHECKING:
    from solvers.trace import Trace

#: Without a trace test so many paths must have met nothing new: three legs of a single root prove nothing.
QUIET_PATHS = 100
#: A failed trace test means that roots are missing, or points of the test's own; each goes along another line of
#: parameters, after more loops.
MOST_TESTS = 6
#: Legs after which the loops end, whatever has happened.
MOST_LEGS = 200
#: Arcs to one place while roots are lost on the way there.
MOST_ARCS = 8


def monodromy(
    system: System,
    seed: int = 0,
    symmetry: Sequence[Symmetry] = (),
    start: tuple[Any, Any] | None = None,
    *,
    jobs: int = 1,
    backend: str = "threads",
    count: int | None = None,
    invariant: Any = None,
    valid: Callable[[np.ndarray], np.ndarray] | None = None,
    mirror: Mirror | None = None,
    exchanges: Exchanges | None = None,
    trace: bool = True,
    certificates: bool = False,
    progress: Callable[[str, int, int], None] | None = None,
    checkpoint: Any = None,
) -> Solutions:
    """All roots at generic parameters, from one root that is easy to find.

    Loops permute the roots that hang together: those of one irreducible component. From a root that is given only
    these are found, and ``complete`` speaks of them. Without one, Newton's method from random points looks for others
    in the end, and the loops go on with what it finds; a component that it misses stays unknown.

    Parameters
    ----------
    system : System
        With parameters.
    seed : int
    symmetry : sequence of functions
        Each maps points (n, unknowns), or points and their parameters, to points (n, unknowns): solutions to
        solutions of the same parameters, which are given as an array of the shape (m,) or (n, m).
        One root of each orbit is carried; the result holds all members.
    start : (point, parameters), optional
        A root to begin with, which chooses the component; by default one is made from a random point, by solving
        for the parameters.
    count : int, optional
        The number of roots where it is known: the loops stop there, without a trace test.
    invariant : SymPy expression, optional
        A rational function of the unknowns that the symmetries leave alone; lets the trace test work on orbits.
    valid : callable, optional
        ``valid(points)``: which of the points (n, unknowns) belong to the roots that are wanted. Others, where a
        denominator vanishes that was cleared for instance, lie apart, but a path may jump to them.
    mirror : Mirror, optional
        Complex conjugation. The loops then lead through parameters that are their own image, and every root that is
        found brings its image with it: both are missed only if neither path is there.
    exchanges : callable, optional
        ``exchanges(rng)``: a random exchange of unknowns and one of parameters, as index arrays, which together map
        roots to roots. They mix the roots far better than loops alone.
    trace : bool
        Whether to test completeness by the trace test.
    checkpoint : RunFile, optional
        Keeps what is known after each leg, and takes it up again.

    Returns
    -------
    Solutions
        With ``evidence``, ``complete`` and the history of the legs in ``notes``.

    Raises
    ------
    InvalidSystem
        The system is not square, has no parameters, or no first root can be made.
    Interrupted
        The user stopped the loops; ``error.solutions`` holds what was found.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, a, b = symbols("x a b")
    >>> monodromy(System([x**3 + a*x + b], [x], [a, b])).points.shape
    (3, 1)
    """
    rows, columns = system.size
    if rows != columns or not system.parameters:
        raise InvalidSystem("monodromy needs as many equations as unknowns, and parameters to move")
    rng = np.random.default_rng([seed, 11])
    engine, nodes, typical = two_nodes(system, start, rng, mirror)
    probe = nodes[0].roots.points[:1]
    group = checked_group(system, symmetry, probe, nodes[0].parameters) if symmetry else None
    if group is not None:
        first = PointSet(columns, floor=nodes[0].roots.floor)
        first.add(group.representatives(probe, nodes[0].parameters))
        nodes[0].roots = first
    search = Search(engine, nodes, group, seed, jobs, backend, typical, valid=valid, mirror=mirror, exchanges=exchanges)
    wanted = None if count is None else -(-count // (group.order if group else 1))
    memory = Memory(checkpoint, system, seed, search)
    memory.recall()
    try:
        test = _loop_until_complete(system, search, wanted, trace, invariant, seed, progress, memory, start is None)
        if mirror is not None:
            _leave_mirror(search, rng)
        return _result(system, search, group, wanted, test, seed, certificates)
    except KeyboardInterrupt:
        solutions = _result(system, search, group, wanted, None, seed, False)
        if wanted is None or not solutions.complete:
            solutions.complete = False
            solutions.evidence += "; stopped by the user"
        raise Interrupted(_as_ends(solutions.points), solutions) from None


def _as_ends(points: np.ndarray) -> Ends:
    count = len(points)
    return Ends(
        x=points,
        kind=np.full(count, REGULAR, np.int8),
        winding=np.zeros(count, np.int64),
        condition=np.full(count, np.nan),
        ticks=np.zeros(count, np.int64),
    )


def _loop_until_complete(
    system: System,
    search: Search,
    wanted: int | None,
    trace: bool,
    invariant: Any,
    seed: int,
    progress: Callable[[str, int, int], None] | None,
    memory: Memory,
    everything: bool,
) -> Trace | None:
    from solvers.trace import trace_test

    rng = np.random.default_rng([seed, 16])
    quiet, paths, tests, test = 0, 0, 0, None
    while len(search.history) < MOST_LEGS:
        source = len(search.history) % 2
        leg = search.leg(source, detour_of(quiet, 2 * tests))  # after a failed test detours lead farther
        memory.keep()
        sizes = [len(node.roots) for node in search.nodes]
        if progress is not None:
            progress("monodromy", max(sizes), max(sizes) if not np.isfinite(leg.estimate) else round(leg.estimate))
        quiet, paths = (0, 0) if leg.new or leg.back else (quiet + 1, paths + leg.carried)
        uneven = sizes[0] != sizes[1]
        search.ladder |= uneven and quiet > 1
        if wanted is not None:
            if max(sizes) >= wanted:
                search.settle(system)
                if len(search.fuller().roots) >= wanted:
                    break
            continue
        mixed = search.exchanges is not None  # no root stays missing because the way to it is a special one
        if quiet < quiet_enough(uneven and not mixed, trace or mixed) or (not trace and paths < QUIET_PATHS):
            continue
        search.settle(system)
        node = search.fuller()
        others = strays(system, node.parameters, node.roots, rng, search.typical, search.group, search.valid)
        if len(others) and everything:
            node.roots.add(others)
            quiet = 0
            continue
        search.elsewhere = len(others)
        if not trace:
            break
        test = trace_test(
            system,
            node.parameters,
            node.roots.points,
            seed=1000 * tests + seed,
            jobs=search.jobs,
            invariant=invariant,
            group=search.group,
            progress=progress,
        )
        quiet = 0
        if len(test.extra):  # roots that the loops have missed are no reason to give up
            extra = test.extra if search.group is None else search.group.representatives(test.extra, node.parameters)
            node.roots.add(extra)
            search.ladder = True  # it needs more care to keep them
            continue
        tests += 1
        if test.passed or tests == MOST_TESTS:
            break
    return test


def _leave_mirror(search: Search, rng: np.random.Generator) -> None:
    """Carry everything to general parameters: from some that are their own image, lines to others meet collisions."""
    home = search.fuller()
    roots = PointSet(home.roots.points.shape[1], floor=home.roots.floor)
    away = Node(sizes(home.parameters) * gaussian(rng, len(home.parameters)), roots)
    way = replace(search, nodes=[home, away], mirror=None, ladder=True, history=[], tracked=0, lost=0)
    while len(away.roots) < len(home.roots) and len(way.history) < MOST_ARCS:
        way.leg(0)
    search.tracked += way.tracked
    if len(away.roots) >= len(home.roots):
        search.nodes = [away, home]


def _result(
    system: System,
    search: Search,
    group: Group | None,
    wanted: int | None,
    test: Trace | None,
    seed: int,
    certificates: bool,
) -> Solutions:
    node = search.fuller()
    representatives = node.roots.points
    points, orbit = representatives, np.arange(len(representatives))
    order = 1
    notes = [repr(leg) for leg in search.history]
    if group is not None:
        order = group.order
        points = group.members(representatives, node.parameters)
        orbit = node.roots.find(group.representatives(points, node.parameters))
        if len(points) != order * len(representatives):
            notes.append(f"{order * len(representatives) - len(points)} members missing: some orbits are not full")
    evidence = evidence_of(search.history, search.tracked, search.lost, group, len(representatives))
    if search.elsewhere:
        evidence += ", Newton's method finds others that hang together with none of these"
    if test is not None:
        evidence += f", {test}"
    complete = None if test is None else test.passed
    if wanted is not None:
        complete = len(representatives) == wanted
        evidence += f", known count {wanted * order} {'reached' if complete else 'not reached'}"
    empty = np.zeros((0, points.shape[1]))
    solutions = Solutions(
        points=points,
        singular=Singular(empty, np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64)),
        parameters=node.parameters,
        ledger=Ledger(tracked=len(points), finite=len(points)),
        unknowns=system.unknowns,
        paths=np.arange(len(points)),
        start="monodromy",
        seed=seed,
        evidence=evidence,
        complete=complete,
        notes=notes,
        orbit=orbit,
        group=group,
    )
    if certificates:
        from solvers.certify import certify

        solutions.certificate = certify(system, solutions)
    return solutions
