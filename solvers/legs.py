"""Two places in parameter space, the roots known at either, and the legs between them.

All roots known at A are carried to B along a fresh random arc, the ends merged with what was known there; all known
at B are carried back along another; and so on. Each leg tells for free how complete the sets are: of n roots
carried, the share whose ends were known already estimates the share of all roots that is known (capture and
recapture, Lincoln and Petersen).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from solvers.carry import carry, random_bend
from solvers.homotopy import parameter_homotopy
from solvers.kernel.engine import Engine
from solvers.points import Group, PointSet
from solvers.system import System


@dataclass
class Leg:
    """What one leg has shown.

    Attributes
    ----------
    carried, arrived, new : int
        Paths tracked, roots found at the end, and how many of these were not known there.
    known : int
        Roots known at the end, afterwards.
    estimate : float
        Number of roots by capture and recapture.
    """

    carried: int
    arrived: int
    new: int
    known: int
    estimate: float


@dataclass
class Node:
    """A place in parameter space and the roots that are known there."""

    parameters: np.ndarray
    roots: PointSet


@dataclass
class Search:
    """The state of a run: two nodes and the history of the legs."""

    engine: Engine
    nodes: list[Node]
    group: Group | None
    rng: np.random.Generator
    jobs: int
    backend: str
    typical: float
    ladder: bool = False
    history: list[Leg] = field(default_factory=list)
    tracked: int = 0
    lost: int = 0

    def leg(self, source: int) -> Leg:
        """Carry all roots of a node to the other one along a fresh arc."""
        a, b = self.nodes[source], self.nodes[1 - source]
        before, points = len(b.roots), a.roots.points
        bend = random_bend(self.rng)
        way = (self.engine, points, a.parameters, b.parameters, bend)
        ends = carry(*way, self.jobs, self.backend, self.typical, self.ladder)
        self.tracked += len(points)
        self.lost += len(points) - len(ends)
        if self.group is not None:
            ends = self.group.representatives(ends, b.parameters)
        known = b.roots.find(ends)
        recaptured = len(np.unique(known[known >= 0]))
        b.roots.add(ends)
        new = len(b.roots) - before
        seen = recaptured + new
        estimate = before * seen / recaptured if recaptured else np.inf
        self.history.append(Leg(len(points), len(ends), new, len(b.roots), float(max(estimate, len(b.roots)))))
        return self.history[-1]


class Memory:
    """Known roots in the run file after each leg, so that a killed search goes on from there."""

    def __init__(self, checkpoint: Any, system: System, seed: int, search: Search) -> None:
        self.checkpoint, self.search = checkpoint, search
        if checkpoint is not None:
            from solvers.tracking import digest

            node = search.nodes[0]
            first = node.roots.points[:1]
            whole = parameter_homotopy(system.program, node.parameters, node.parameters, first, seed)
            self.stage = f"monodromy {digest(whole)}"

    def recall(self) -> None:
        """Take up where an earlier run was stopped: same nodes, same random numbers, all legs it had finished."""
        if self.checkpoint is None:
            return
        for _, kept in sorted(self.checkpoint.chunks(self.stage).items()):
            node = self.search.nodes[int(kept["node"][0])]
            node.roots.add(kept["points"])
            numbers = kept["leg"]
            carried, arrived, new, size = (int(v) for v in numbers[:4])
            self.search.history.append(Leg(carried, arrived, new, size, float(numbers[4])))
            self.search.tracked += int(numbers[0])
            self.search.lost += int(numbers[0] - numbers[1])
            random_bend(self.search.rng)  # the one that leg has used

    def keep(self) -> None:
        """Append the news of the last leg."""
        if self.checkpoint is None:
            return
        leg = self.search.history[-1]
        number = len(self.search.history) - 1
        target = 1 - number % 2
        roots = self.search.nodes[target].roots
        arrays = {
            "node": np.array([target], np.int64),
            "points": roots.points[len(roots) - leg.new :],
            "leg": np.array([leg.carried, leg.arrived, leg.new, leg.known, leg.estimate], np.float64),
        }
        self.checkpoint.append(self.stage, number, arrays)
