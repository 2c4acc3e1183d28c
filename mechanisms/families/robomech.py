"""The RoboMech manipulator as a family: two end-effectors along two paths, one input whose angles are prescribed.

Equations: Structurally parametric synthesis and position analysis of a RoboMech class parallel manipulator with
two end-effectors, IAENG Int. J. Applied Mathematics 50(2), 2020.  A task that gives the passive chains is
completed by every active chain that is exact at five positions and by negative chains that are proved to be the
best (`mechanisms.families.robomech_joint`); without them, all 28 dimensions are searched
(`mechanisms.families.robomech_search`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from mechanisms.families.base import Candidate, Family, Free, Problem
from mechanisms.families.robomech_fit import PassiveChain, passive_chain
from mechanisms.families.robomech_joint import ManipulatorFit, complete_manipulators
from mechanisms.families.robomech_model import INPUTS
from mechanisms.families.robomech_search import fit_manipulator
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["RoboMechFamily"]

#: Manipulators that a task yields.
FITS = 6
_CHAINS = {"C": ("A_x", "A_y", "l_AB", "l_BC", "elbow_C"), "F": ("D_x", "D_y", "l_DE", "l_EF", "elbow_F")}


class RoboMechFamily(Family):
    """Two end-effectors along two paths by one input."""

    name = "robomech"
    summary = "RoboMech manipulator with two end-effectors"
    source = "Structurally parametric synthesis and position analysis of a RoboMech class parallel manipulator"
    effectors = ("C", "F")
    point_counts = tuple(range(8, 501))
    unknowns = "K, r_H, r_G, r_I of the active chain; r_L, r_M; r_Q, r_N"
    roots = "256 paths for the active chain, 25 critical points of each negative dyad"
    free = (
        Free("phi7", "angle", "input angles at the points", many=True),
        *(Free(name, "length", "passive chain") for names in _CHAINS.values() for name in names[:4]),
        *(Free(names[4], "integer", "sign of the elbow in (8), (9): 1 or -1") for names in _CHAINS.values()),
        Free("norm", "text", "what is made least", choices=("least-squares", "minimax")),
    )
    inputs = INPUTS
    exact = False

    def check(self, task: Task) -> None:
        """Refuse tasks without input angles, half a passive chain, lengths that are not positive."""
        phi7, count = task.free.get("phi7"), len(task.points["C"])
        if phi7 is None:
            raise TaskError(f"{task.where}: free.phi7_deg: missing; give the input angle at each point")
        if len(phi7) != count:
            raise TaskError(
                f"{task.where}: free.phi7_deg: {len(phi7)} given for {count} points; one for each is needed"
            )
        steps = np.diff(phi7)
        if not (np.all(steps > 0) or np.all(steps < 0)):
            raise TaskError(f"{task.where}: free.phi7_deg: the input angles must go one way, up or down")
        given = [name for names in _CHAINS.values() for name in names[:4] if name in task.free]
        if given and len(given) < 8:
            missing = next(n for names in _CHAINS.values() for n in names[:4] if n not in task.free)
            raise TaskError(f"{task.where}: free.{missing}: missing; give both passive chains in full, or none")
        for effector, names in _CHAINS.items():
            if task.free.get(names[4], 1) not in (1, -1):
                raise TaskError(f"{task.where}: free.{names[4]}: is 1 or -1")
            if given:
                try:
                    self._chain(task, effector)
                except TaskError as error:
                    raise TaskError(f"{task.where}: effectors.{effector}.points: {error}") from None

    def system(self, task: Task) -> Problem | None:
        """None: the chains are solved one after the other."""
        return None

    def freedom(self, task: Task) -> str:
        """What was done instead of one solve."""
        if "l_AB" in task.free:
            return "passive chains given: all active chains exact at five positions, fitted to all positions"
        return "all 28 dimensions searched from the minima of both halves: the best found, not proved to be the best"

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """The best manipulators, each measured with its input alone driven."""
        c, f, phi7 = list(task.points["C"]), list(task.points["F"]), list(task.free["phi7"])
        norm = task.free.get("norm", "least-squares")
        if "l_AB" in task.free:
            chains = [self._chain(task, effector) for effector in self.effectors]
            fits = complete_manipulators(chains, c, f, phi7, norm, task.seed)
        else:
            fits = fit_manipulator(c, f, phi7, norm, task.seed, progress=progress)
        for fit in fits[:FITS]:
            yield _candidate(task, fit, phi7)

    def _chain(self, task: Task, effector: str) -> PassiveChain:
        x, y, crank, rod, elbow = (task.free.get(name, 1) for name in _CHAINS[effector])
        return passive_chain(task.points[effector], complex(x, y), crank, rod, float(elbow))


def _candidate(task: Task, fit: ManipulatorFit, phi7: list[float]) -> Candidate:
    mechanism = fit.mechanism
    if not np.all(np.isfinite(fit.errors)):
        return Candidate(
            None,
            mechanism.parameters(),
            reasons=("inexact",),
            note="the links would have to stretch too much: it does not move through all positions",
            extra={"stretch": fit.stretch},
        )
    proof = "; ".join(f"{name}: {dyads.summary}" for name, dyads in zip(("LM", "NQ"), fit.proofs))
    return Candidate(
        None,
        mechanism.parameters(),
        mechanism.linkage(phi7[0], *fit.start, task.title, task.length_unit),
        mechanism.poses(phi7, fit.start),
        note=proof,
        pose_error=fit.worst,
        extra={"rms_error": fit.rms, "stretch": fit.stretch},
    )
