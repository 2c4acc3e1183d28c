"""The front door: a system in, all its roots out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.choose_start import choose_start
from solvers.clusters import with_clusters_resolved
from solvers.ends import FAILED, INFINITE, REGULAR, SINGULAR, Ends
from solvers.homotopy import Homotopy, parameter_homotopy
from solvers.ledger import are_few, broken_cycles
from solvers.polyhedral import PolyhedralError
from solvers.scaling import scales_of
from solvers.shapes import check_shape, genuine, square_up
from solvers.simple_ends import with_simple_ends
from solvers.singular_points import singular_points
from solvers.solutions import Ledger, Solutions
from solvers.system import System
from solvers.tracking import Interrupted, Progress, Run, track_all
from solvers.transfer import transfer

STARTS = ("auto", "total-degree", "multihomogeneous", "polyhedral")
#: What is said of singular ends whose number does not fit their windings.
DOUBT = "; {} paths wind round singular ends in numbers that do not fit: multiplicities there are uncertain"
#: Whole solves with a fresh random γ, when a few paths still fail after the ladder.
FRESH_STARTS = 3


def solve(
    system: System,
    parameters: Any = None,
    start: str | Solutions = "auto",
    jobs: int = 1,
    seed: int = 0,
    *,
    backend: str = "threads",
    checkpoint: Any = None,
    progress: Progress | None = None,
    certificates: bool = True,
) -> Solutions:
    """All isolated roots of a polynomial system.

    Parameters
    ----------
    system : System
        At least as many equations as unknowns. If there are more, random combinations of them are solved, and
        roots of these that are not roots of the system are counted as excess.
    parameters : mapping or sequence of numbers, optional
        Values of the system's parameters.
    start : str or Solutions
        "auto", "total-degree", "multihomogeneous", "polyhedral", or the solutions of the same system at generic
        parameters, which are then carried to the new ones. Or the structure of a linear-product start: for each
        equation a list of sets of unknowns (see :mod:`solvers.start_linear_product`).
    jobs : int
        Workers. The answer does not depend on it.
    seed : int
        Of every random choice: same seed, same roots, in the same order.
    backend : str
        "threads", "processes", "dask" or "ray".
    checkpoint : RunFile, optional
        Where finished chunks of paths are kept and found again.
    progress : callable, optional
        Called as progress(what, done, total).
    certificates : bool
        Whether to prove with Arb balls that each root exists, is simple, is distinct from the others, and is
        real or not.

    Returns
    -------
    Solutions

    Raises
    ------
    InvalidSystem
        The system cannot be solved as it stands; the message says why.
    Interrupted
        The user stopped the solve; ``error.solutions`` holds what was found.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> solve(System([x**2 + y**2 - 5, x*y - 2], [x, y]))
    Solutions(4 roots, 4 real, 0 singular, 0 failed of 4 paths)
    """
    values = system.values_of(parameters)
    run = Run(jobs=jobs, backend=backend, checkpoint=checkpoint, progress=progress)
    if isinstance(start, Solutions):
        return _from_known(system, values, start, run, seed, certificates)
    check_shape(system, values)
    square = square_up(system, seed)
    best: _Attempt | None = None
    paths = 0
    try:
        for attempt in range(FRESH_STARTS):
            homotopy = homotopy_for(square, values, start, seed + 1000 * attempt)
            try:
                found = _Attempt(homotopy, *track_all(homotopy, run))
            except PolyhedralError:
                if attempt + 1 == FRESH_STARTS and best is None:
                    raise
                continue
            if attempt:
                paths += homotopy.starts.count
                found.rungs["with a fresh start"] = paths
            if best is None or found.failed < best.failed:
                best = found
            if not best.failed or not are_few(best.failed, homotopy.starts.count):
                break
        assert best is not None
    except KeyboardInterrupt as stop:
        if isinstance(stop, Interrupted) and (best is None or int(np.sum(stop.ends.kind == FAILED)) < best.failed):
            best = _Attempt(homotopy, stop.ends, {})
        if best is None:  # nothing has been tracked yet
            raise
        raise _stopped(system, values, best, seed) from None
    return _finished(system, values, best, seed, certificates and square is system)


@dataclass
class _Attempt:
    """What a homotopy has led to."""

    homotopy: Homotopy
    ends: Ends
    rungs: dict[str, int]

    @property
    def failed(self) -> int:
        return int(np.sum(self.ends.kind == FAILED))


def _finished(system: System, values: np.ndarray, found: _Attempt, seed: int, certificates: bool) -> Solutions:
    solutions = _collect(system, values, found.homotopy, found.ends, found.rungs)
    solutions.seed = seed
    try:
        solutions = with_clusters_resolved(system, with_simple_ends(system, solutions))
        if certificates:
            _certify(system, solutions)
    except KeyboardInterrupt:
        solutions.evidence += "; stopped by the user before the roots were certified"
        raise Interrupted(found.ends, solutions) from None
    return solutions


def _stopped(system: System, values: np.ndarray, found: _Attempt, seed: int) -> Interrupted:
    """The exception that carries what was found before the user stopped."""
    solutions = _collect(system, values, found.homotopy, found.ends, found.rungs)
    solutions.seed = seed
    solutions.complete = False
    solutions.evidence = "stopped by the user before every path was tracked"
    return Interrupted(found.ends, solutions)


def _from_known(
    system: System, values: np.ndarray, known: Solutions, run: Run, seed: int, certificates: bool
) -> Solutions:
    """Roots carried from other parameters."""
    if len(known.parameters) != len(values) or known.points.shape[1] != len(system.unknowns):
        raise ValueError("the start solutions belong to a system of another shape")
    if not len(known):
        raise ValueError("the start solutions hold no root to carry")
    check_shape(system, values)
    square = square_up(system, seed)
    try:
        found = _Attempt(*transfer(square, known, values, run, seed, bool(known.complete) and _is_generic(known)))
    except Interrupted as stop:
        homotopy = parameter_homotopy(square.program, known.parameters, values, known.points, seed)
        raise _stopped(system, values, _Attempt(homotopy, stop.ends, {}), seed) from None
    solutions = _finished(system, values, found, seed, certificates and square is system)
    solutions.evidence += f"; the {len(known)} roots it starts from: {known.evidence}" if known.evidence else ""
    if solutions.complete:
        solutions.complete = known.complete
        if known.complete and not _is_generic(known):
            solutions.complete = None
            solutions.evidence += ", but perhaps fewer there than at generic parameters: carry from complex ones"
    return solutions


def _is_generic(known: Solutions) -> bool:
    """Whether there are as many known roots as anywhere, as far as can be told.

    Special parameters can have fewer roots: some may be at infinity there, or multiple. Complex parameters are
    taken for generic; at others no path may have been lost to such an end, and the number of paths must not depend
    on the parameters, as that of a polyhedral start does.
    """
    if known.start == "monodromy" or np.all(known.parameters.imag != 0):
        return True
    return known.ledger.finite == known.ledger.tracked and known.start not in ("polyhedral", "linear product")


def homotopy_for(system: System, values: np.ndarray, start: str, seed: int) -> Homotopy:
    """The homotopy that a start asks for."""
    choice = choose_start(system, values, start)
    scales = system.once(("scales", values.tobytes()), lambda: scales_of(system, values))
    return choice.homotopy(system, values, seed, scales.unknowns, scales.equations)


def _collect(system: System, values: np.ndarray, homotopy: Homotopy, ends: Ends, rungs: dict[str, int]) -> Solutions:
    points = homotopy.in_user_units(ends.x)
    right = np.ones(len(points), bool)
    found = (ends.kind == REGULAR) | (ends.kind == SINGULAR)
    right[found] = genuine(system, points[found], values)
    regular = np.flatnonzero((ends.kind == REGULAR) & right)
    singular = np.flatnonzero((ends.kind == SINGULAR) & right)
    account = Ledger(
        tracked=len(ends.kind),
        finite=len(regular),
        singular=len(singular),
        excess=int(np.sum(~right)),
        at_infinity=int(np.sum(ends.kind == INFINITE)),
        failed=int(np.sum(ends.kind == FAILED)),
        rungs=rungs,
        failures=[(k, ends.why.get(k, "not tracked")) for k in np.flatnonzero(ends.kind == FAILED).tolist()],
    )
    # A number of paths that does not fit their windings: a multiplicity, or a root beside it, is in doubt.
    doubt = len(broken_cycles(ends)) if homotopy.complete else 0
    return Solutions(
        points=points[regular],
        singular=singular_points(
            system, values, points[singular], ends.winding[singular], ends.typical, homotopy.unknown_scale
        ),
        parameters=values,
        ledger=account,
        unknowns=system.unknowns,
        paths=regular,
        start=homotopy.name,
        complete=None if doubt and not account.failed else account.failed == 0,
        evidence=_evidence(homotopy, account) + (DOUBT.format(doubt) if doubt else ""),
    )


def _evidence(homotopy: Homotopy, account: Ledger) -> str:
    if account.failed:
        return f"{account.failed} of {account.tracked} paths failed"
    reason = f" ({homotopy.reason})" if homotopy.reason else ""
    name = homotopy.name if "homotopy" in homotopy.name else f"{homotopy.name} homotopy"
    return f"all {account.tracked} paths of the {name}{reason} are accounted for"


def _certify(system: System, solutions: Solutions) -> None:
    try:
        from solvers.certify import certify
    except ImportError:
        return
    solutions.certificate = certify(system, solutions)


__all__ = ["STARTS", "Interrupted", "homotopy_for", "solve"]
