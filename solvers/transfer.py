"""Known roots carried to other parameters, with detours for what gets lost on the way.

From generic complex parameters the straight line to any others meets no singular system, with probability one.
Real parameters are not generic: between two real choices the line may cross parameters where two roots meet, so
the roots go first to a random complex waypoint. When a path fails, or two end on one root, all roots go again by
way of another waypoint, and what the detours find is put together until the count is full.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from solvers.carry import carry, random_bend
from solvers.ends import FAILED, INFINITE, REGULAR, SINGULAR, Ends
from solvers.homotopy import Homotopy, parameter_homotopy
from solvers.ledger import SAME_ROOT, UNCERTAINTY, clashing, settle
from solvers.legs import gaussian, sizes
from solvers.local import ORIGIN
from solvers.points import Group, PointSet, pairs_of_equals
from solvers.solutions import Solutions
from solvers.system import System
from solvers.tracking import Interrupted, Run, engine_of, track_all

#: Detours by way of other waypoints before missing roots are reported as failed.
DETOURS = 6
#: Tries to reach a waypoint with every root.
WAYPOINTS = 12


def transfer(
    system: System, known: Solutions, values: np.ndarray, run: Run, seed: int, whole: bool = False
) -> tuple[Homotopy, Ends, dict[str, int]]:
    """Carry all known roots, the `whole` fibre or some, to the parameters `values`.

    Returns
    -------
    homotopy : Homotopy
        Of the last detour.
    ends : Ends
        One row for each known root: what the first detour found, with missing ends replaced by what others found.
    rungs : dict of str to int
        Paths of the retry ladder and of the detours.
    """
    if known.group is not None and known.orbit is not None:
        return _transfer_orbits(system, known, values, run, seed)
    return _transfer(system, known, values, run, seed, None, whole)


def _transfer_orbits(
    system: System, known: Solutions, values: np.ndarray, run: Run, seed: int
) -> tuple[Homotopy, Ends, dict[str, int]]:
    """Carry one root of each orbit; the others are its images at the new parameters."""
    assert known.group is not None and known.orbit is not None
    _, first = np.unique(known.orbit, return_index=True)
    chosen = replace(known, points=known.points[first], group=None, orbit=None)
    homotopy, ends, rungs = _transfer(system, chosen, values, run, seed, known.group)
    order = known.group.order
    images = known.group.orbits(ends.x, values).transpose(1, 0, 2)
    finite = (ends.kind == REGULAR) | (ends.kind == SINGULAR)
    images[~finite] = ends.x[~finite][:, None]
    whole = Ends(
        x=images.reshape(-1, images.shape[2]),
        kind=np.repeat(ends.kind, order),
        winding=np.repeat(ends.winding, order),
        condition=np.repeat(ends.condition, order),
        ticks=np.repeat(ends.ticks, order),
        why={row * order + k: text for row, text in ends.why.items() for k in range(order)},
        typical=ends.typical,
    )
    whole.kind[np.repeat(finite, order) & ~np.isfinite(whole.x).all(axis=1)] = INFINITE
    name = f"parameter homotopy of one root in each orbit of {order}"
    return replace(homotopy, name=name), whole, rungs


def _transfer(
    system: System, known: Solutions, values: np.ndarray, run: Run, seed: int, group: Group | None, whole: bool = False
) -> tuple[Homotopy, Ends, dict[str, int]]:
    rng = np.random.default_rng([seed, 23])
    real = not np.any(np.iscomplex(known.parameters))
    fibre = waypoint(system, known, rng, run) if real else (known.parameters, known.points)
    whole &= len(fibre[1]) == len(known)
    homotopy = parameter_homotopy(system.program, *_line(fibre, values), seed, whole=whole)
    ends, rungs = track_all(homotopy, run)
    ends = _padded(ends, len(known))
    _canonical(ends, group, values)
    if np.all(ends.kind != FAILED):
        return homotopy, ends, rungs
    try:
        for _ in range(DETOURS):
            fibre = waypoint(system, known, rng, run)
            homotopy = parameter_homotopy(system.program, *_line(fibre, values), seed)
            again, _ = track_all(homotopy, replace(run, checkpoint=None), ladder=False)
            _canonical(again, group, values)
            rungs["by another way"] = rungs.get("by another way", 0) + len(again.kind)
            if np.all(again.kind != FAILED) and len(again.kind) == len(known):
                return homotopy, again, rungs
            fill_gaps(ends, again)
            if np.all(ends.kind != FAILED):
                break
    except KeyboardInterrupt as stop:
        if isinstance(stop, Interrupted):
            fill_gaps(ends, stop.ends)
        raise Interrupted(ends) from None
    return homotopy, ends, rungs


def _padded(ends: Ends, count: int) -> Ends:
    """Ends with a failed row for each known root that was lost on the way to the waypoint."""
    missing = count - len(ends.kind)
    if missing <= 0:
        return ends
    whole = Ends(
        x=np.concatenate([ends.x, np.full((missing, ends.x.shape[1]), np.nan)]),
        kind=np.concatenate([ends.kind, np.full(missing, FAILED, np.int8)]),
        winding=np.concatenate([ends.winding, np.zeros(missing, np.int64)]),
        condition=np.concatenate([ends.condition, np.full(missing, np.inf)]),
        ticks=np.concatenate([ends.ticks, np.zeros(missing, np.int64)]),
        mark=np.concatenate([ends.mark, np.full(missing, np.nan)]),
        why=ends.why | {len(ends.kind) + k: "lost on the way to the waypoint" for k in range(missing)},
        typical=ends.typical,
    )
    return whole


def _line(fibre: tuple[np.ndarray, np.ndarray], values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return fibre[0], values, fibre[1]


def _canonical(ends: Ends, group: Group | None, values: np.ndarray) -> None:
    """Put the representative of its orbit in place of each end, so that equal orbits show as a clash."""
    if group is None:
        return
    regular = np.flatnonzero(ends.kind == REGULAR)
    ends.x[regular] = group.representatives(ends.x[regular], values)
    for row in clashing(ends):
        ends.kind[row] = FAILED
        ends.why[int(row)] = "ends in the same orbit as another path"


def fill_gaps(ends: Ends, others: Ends) -> None:
    """Put regular roots that only the other ends have in place of failed ones.

    A root counts as known when the two ends agree within their uncertainty: ill-conditioned ones found on two ways
    differ in more than the last digits.
    """
    settle(others)
    failed, known = np.flatnonzero(ends.kind == FAILED), np.flatnonzero(ends.kind == REGULAR)
    sound = np.flatnonzero(others.kind == REGULAR)
    both = np.concatenate([ends.x[known], others.x[sound]])
    tolerance = np.maximum(SAME_ROOT, UNCERTAINTY * np.concatenate([ends.condition[known], others.condition[sound]]))
    pairs = pairs_of_equals(both, tolerance, floor=max(ORIGIN * ends.typical, 1e-300))
    fresh = np.delete(sound, pairs[:, 1][pairs[:, 1] >= len(known)] - len(known))[: len(failed)]
    rows = failed[: len(fresh)]
    for name in ("x", "kind", "winding", "condition"):
        getattr(ends, name)[rows] = getattr(others, name)[fresh]
    # The way of another detour is not that of the other rows.
    ends.mark[rows] = np.nan
    for row in rows.tolist():
        ends.why.pop(row, None)


def waypoint(system: System, known: Solutions, rng: np.random.Generator, run: Run) -> tuple[np.ndarray, np.ndarray]:
    """All known roots at other generic complex parameters: (parameters, points)."""
    values = known.parameters
    engine = engine_of(parameter_homotopy(system.program, values, values, known.points))
    typical = float(np.median(np.abs(known.points).max(axis=1))) or 1.0
    best: tuple[np.ndarray, np.ndarray] | None = None
    for _ in range(WAYPOINTS):
        place = sizes(values) * gaussian(rng, len(values))
        bend = random_bend(rng)
        points = carry(engine, known.points, values, place, bend, run.jobs, run.backend, typical)
        distinct = PointSet(points.shape[1])
        distinct.add(points)
        if best is None or len(distinct) > len(best[1]):
            best = place, distinct.points
        if len(distinct) == len(known):
            break
    assert best is not None
    return best


def sweep(
    system: System,
    known: Solutions,
    targets: Sequence[Any],
    jobs: int = 1,
    seed: int = 0,
    certificates: bool = False,
) -> Iterator[Solutions]:
    """The roots at many parameters, from one generic fibre; the work of setting up is done once.

    Parameters
    ----------
    known : Solutions
        All roots at generic complex parameters, from :func:`solvers.monodromy` or an earlier solve.
    targets : sequence of parameter values
        Each as :func:`solvers.solve` takes them.

    Yields
    ------
    Solutions
        In the order of `targets`.

    Examples
    --------
    >>> from sympy import symbols
    >>> from solvers import System, monodromy
    >>> x, a = symbols("x a")
    >>> system = System([x**2 - a], [x], [a])
    >>> known = monodromy(system, count=2)
    >>> [sorted(s.points.real.round(6).ravel().tolist()) for s in sweep(system, known, [[4], [9]])]
    [[-2.0, 2.0], [-3.0, 3.0]]
    """
    from solvers.solve import solve

    for k, target in enumerate(targets):
        yield solve(system, target, start=known, jobs=jobs, seed=seed + k, certificates=certificates)
