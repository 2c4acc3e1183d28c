"""Coupled serial chains as a family: N geared links that guide a body or follow a path with one input.

Equations: V. Krovi, G. K. Ananthasuresh, V. Kumar, Kinematic and kinetostatic synthesis of planar coupled serial
chain mechanisms, (1)–(4).  What a task is answered by depends on how much it asks:

| task | answer |
|---|---|
| M ≤ N + 1 poses and the ratios | one chain, linear |
| 5 poses, 3 links, ranges of ratios | every chain in the box, proved (`chain_guidance`) |
| more poses | the best approximations over the ratios (`chain_fit`) |
| M ≤ N + 1 points, ratios and input angles | one chain, linear |
| 2N + 1 points and rational ratios | every chain, by homotopy (`chain_paths`) |
| more points and rational ratios | the best approximations from complete solves |
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate, Family, Free, Problem
from mechanisms.families.chain import (
    SerialChain,
    chain_for_points,
    chain_for_poses,
    gear_fraction,
    input_angles,
    whole_exponents,
)
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["CoupledSerialChain"]

#: Ratios are looked for here when a task does not say.
RATIOS = (-5.0, 5.0)
#: Approximations that a task yields.
FITS = 8
#: More paths than this are refused: an hour of work and more.
MOST_PATHS = 3_000_000
#: Gears that miss a ratio by less are not worth a word.
GEARS_MISS = 1e-12
#: Links longer than this, in sizes of the task, are no linkage.
LONGEST = 1e6


class CoupledSerialChain(Family):
    """A body through poses, or a point along a path, by geared links in a row."""

    name = "coupled-serial-chain"
    summary = "geared serial chain with one input"
    source = "Krovi, Ananthasuresh, Kumar, Kinematic and kinetostatic synthesis of planar coupled serial chains"
    pose_counts = tuple(range(2, 201))
    point_counts = tuple(range(2, 2001))
    unknowns = "links, rotations e^(i phi/q); ratios for five poses of three links"
    roots = "five points, two links: 20 for R = 2, 2 for R = -1"
    free = (
        Free("links", "integer", "number of links N"),
        Free("ratios", "number", "gear ratios of the links after the first", many=True),
        Free("phi", "angle", "input angles at the points after the first", many=True),
        Free("ratio_range", "number", "range in which ratios are looked for", range=True),
        Free("largest_turn", "angle", "bound of the input angle"),
    )
    inputs = ("link1",)
    exact = False

    def check(self, task: Task) -> None:
        """Refuse ratios, angles and numbers of positions that do not fit each other."""
        links = _links(task)
        if BODY in task.poses and BODY in task.points:
            raise TaskError(f"{task.where}: points: give poses or points, not both")
        positions = len(task.poses.get(BODY, ())) or len(task.points.get(BODY, ()))
        if links < 2:
            raise TaskError(f"{task.where}: free.links: {links} given; a coupled chain has at least 2 links")
        ratios = _ratios(task)
        if ratios is not None and (0.0 in ratios or len({1.0, *ratios[1:]}) < links):
            raise TaskError(f"{task.where}: free.ratios: the ratios 0 and 1 and equal ratios leave a link without use")
        if task.free.get("largest_turn", 1.0) <= 0:
            raise TaskError(f"{task.where}: free.largest_turn_deg: must be positive")
        if BODY in task.poses:
            if "phi" in task.free:
                raise TaskError(
                    f"{task.where}: free.phi_deg: the orientations determine the input angles; leave it out"
                )
            if ratios is None and positions <= links + 1:
                raise TaskError(
                    f"{task.where}: free.ratios: missing; {positions} poses leave the {links - 1} ratios free"
                )
            if ratios is not None and positions > links + 1:
                raise TaskError(
                    f"{task.where}: poses: {positions} given, but {links} links with given ratios meet at most "
                    f"{links + 1}; leave out free.ratios to have them searched"
                )
            return
        if ratios is None:
            raise TaskError(f"{task.where}: free.ratios: missing; a path needs the ratios of the gears")
        phi = task.free.get("phi")
        if positions <= links + 1:
            if phi is None:
                raise TaskError(
                    f"{task.where}: free.phi_deg: missing; {positions} points leave the input angles free, "
                    "one for each point after the first"
                )
            if len(phi) != positions - 1:
                raise TaskError(
                    f"{task.where}: free.phi_deg: {len(phi)} given for {positions} points; "
                    "one for each point after the first is needed"
                )
            if not (np.all(np.diff([0.0, *phi]) > 0) or np.all(np.diff([0.0, *phi]) < 0)):
                raise TaskError(f"{task.where}: free.phi_deg: the input angles must go one way, up or down from 0")
            return
        if phi is not None:
            raise TaskError(f"{task.where}: free.phi_deg: {positions} points determine the input angles; leave it out")
        if positions < 2 * links + 1:
            raise TaskError(
                f"{task.where}: points: {positions} given; {links} links take up to {links + 1} points with given "
                f"input angles, or {2 * links + 1} and more without"
            )
        from mechanisms.families.chain_paths import paths_to_track

        count = paths_to_track(whole_exponents(ratios))
        if count > MOST_PATHS:
            raise TaskError(f"{task.where}: free.ratios: these ratios mean {count} paths; choose simpler ones")

    def system(self, task: Task) -> Problem | None:
        """The polynomials of 2N + 1 points; None for everything else."""
        ratios, points = _ratios(task), task.points.get(BODY, ())
        if ratios is None or len(points) != 2 * len(ratios) + 1:
            return None
        from mechanisms.families import chain_paths as paths

        exponents = whole_exponents(ratios)
        values, _ = paths.path_parameters(points)
        known = paths.root_count(exponents)
        # Three links would need ten times as many paths as there are chains, most of them to singular ends.
        start = "multihomogeneous" if len(ratios) == 2 else paths.generic_chains(exponents, known=known)
        return Problem(
            paths.path_system(exponents),
            list(values),
            finite=known,
            start=start,
            evidence="found for complex points by monodromy from several chains, that of two links by homotopy too",
            mirror=paths.path_mirror(len(ratios)),
        )

    def freedom(self, task: Task) -> str:
        """What was done where neither one linear system nor polynomials answer."""
        ratios = _ratios(task)
        if BODY in task.poses:
            if ratios is not None:
                return ""
            if _links(task) == 3 and len(task.poses[BODY]) == 5:
                return (
                    "a box of ratios searched by subdivision: the notes say whether every chain in it is proved, and "
                    "how far the gears of the linkage miss its ratios: that alone is its pose error"
                )
            return "more poses than a chain can meet: best fits over the ratios"
        return "" if "phi" in task.free else "more points than a chain can meet: fits from all chains through some"

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Every chain of a complete solve, or the one chain, or the best approximations."""
        tell = progress or (lambda what, share: None)
        if BODY in task.poses:
            yield from self._guidance(task, tell)
        elif solutions is not None:
            yield from self._paths(task, solutions)
        elif "phi" in task.free:
            ratios = _ratios(task)
            assert ratios is not None
            chain = chain_for_points(task.points[BODY], ratios, task.free["phi"])
            yield _candidate(task, None, chain, [0.0, *task.free["phi"]])
        else:
            from mechanisms.families.chain_fit import fit_path

            tell("fitting chains to all points", 0.0)
            ratios = _ratios(task)
            assert ratios is not None
            for fit in fit_path(task.points[BODY], ratios, seed=task.seed, keep=FITS):
                yield _candidate(task, None, fit.chain, fit.phi, rms=fit.rms)

    def _guidance(self, task: Task, tell: Callable[[str, float], None]) -> Iterator[Candidate]:
        points = [pose.point for pose in task.poses[BODY]]
        angles = [pose.angle for pose in task.poses[BODY]]
        ratios, links = _ratios(task), _links(task)
        if ratios is not None:
            yield _candidate(task, None, chain_for_poses(points, angles, ratios), _phi(angles, ratios[-1]))
            return
        span = task.free.get("ratio_range", RATIOS)
        if links == 3 and len(points) == 5:
            from mechanisms.families.chain_guidance import RatioBox, five_pose_chains

            tell("searching the box of ratios", 0.0)
            turn = task.free.get("largest_turn", 2 * math.pi)
            try:
                found = five_pose_chains(points, angles, RatioBox(span, span, turn))
            except TaskError as error:
                raise TaskError(f"{task.where}: poses: {error}") from None
            proof = "every chain in the box, proved" if found.proved else f"{len(found.undecided)} boxes undecided"
            for number, chain in enumerate(found.chains):
                note = proof + _rounded(chain)
                yield _candidate(task, number, chain, _phi(angles, chain.ratios[-1]), note=note)
            return
        from mechanisms.families.chain_fit import fit_poses

        tell("fitting chains to all poses", 0.0)
        for fit in fit_poses(points, angles, links, span, seed=task.seed)[:FITS]:
            yield _candidate(task, None, fit.chain, fit.phi, rms=fit.rms)

    def _paths(self, task: Task, solutions: Solutions) -> Iterator[Candidate]:
        from mechanisms.families import chain_paths as paths

        ratios, points = _ratios(task), task.points[BODY]
        assert ratios is not None
        exponents = whole_exponents(ratios)
        real = {k: (chain, phi) for k, chain, phi in paths.real_chains(solutions, exponents, points)}
        turning = paths.is_rotation(solutions.points, len(ratios))
        for root in range(len(solutions.points)):
            if root in real:
                chain, phi = real[root]
                yield _candidate(task, root, chain, phi)
            elif not turning[root]:
                yield Candidate(root, reasons=("degenerate",), note="a rotation is zero: no chain")
            else:
                named = {f"Z{k}": complex(z) for k, z in enumerate(solutions.points[root][: len(ratios)], start=1)}
                yield Candidate(root, named, reasons=("complex",))


def _candidate(
    task: Task,
    root: int | None,
    chain: SerialChain,
    phi: Sequence[float] | NDArray[Any],
    note: str = "",
    rms: float | None = None,
) -> Candidate:
    named = chain.parameters() | {f"phi{k}": float(p) for k, p in enumerate(phi[1:], start=2)}
    angles = frozenset(f"phi{k}" for k in range(2, len(phi) + 1))
    if not np.isfinite(chain.lengths).all() or max(chain.lengths) > LONGEST * task.size:
        return Candidate(root, named, reasons=("degenerate",), note="links without bound", angles=angles)
    linkage = chain.linkage(task.title, task.length_unit)
    extra = {} if rms is None else {"rms_error": rms}
    return Candidate(root, named, linkage, chain.poses(phi), note=note, angles=angles, extra=extra)


def _rounded(chain: SerialChain) -> str:
    """What gears of whole teeth lose."""
    lost = max(abs(float(gear_fraction(ratio)) - ratio) for ratio in chain.ratios)
    return f"; gears miss its ratios by {lost:.0e}" if lost > GEARS_MISS else ""


def _links(task: Task) -> int:
    ratios = task.free.get("ratios")
    given = task.free.get("links", None if ratios is None else len(ratios) + 1)
    if given is None:
        return 3 if len(task.poses.get(BODY, ())) >= 5 else 2
    if ratios is not None and given != len(ratios) + 1:
        raise TaskError(
            f"{task.where}: free.ratios: {len(ratios)} given for {given} links; the first link has the ratio 1, "
            "each other link one of its own"
        )
    return int(given)


def _ratios(task: Task) -> tuple[float, ...] | None:
    given = task.free.get("ratios")
    return None if given is None else (1.0, *map(float, given))


def _phi(angles: Sequence[float], last: float) -> list[float]:
    return [0.0, *input_angles(angles, last)]
