"""Two places in parameter space, the roots known at either, and the legs between them.

All roots known at A are carried to B along a fresh random arc, the ends merged with what was known there; all known
at B are carried back along another; and so on. Each leg tells for free how complete the sets are: of n roots
carried, the share whose ends were known already estimates the share of all roots that is known (capture and
recapture, Lincoln and Petersen).

Loops through two places lie in one complex line of parameters, and roots may hardly ever change places there. A
*detour* leads through a third place, the less like the two the longer the legs have met nothing new.

While roots are being found a lost path is let go. When hardly any are it goes up a ladder of more careful ways: roots
so ill-conditioned that double precision never confirms them are lost on every leg.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from solvers.arithmetic.double_double import DoubleDouble
from solvers.carry import carry, random_bend
from solvers.first_root import given_root, random_root
from solvers.homotopy import parameter_homotopy
from solvers.kernel.engine import Engine
from solvers.local import ORIGIN, balanced_condition, newton_step
from solvers.points import SAME, Group, PointSet, pairs_of_equals
from solvers.refine import newton_double_double
from solvers.symmetries import Exchanges, Mirror
from solvers.system import InvalidSystem, System, evaluate
from solvers.tracking import digest, engine_of

#: Legs without news after which detours are made, and detours without news after which a search has gone quiet.
QUIET_LEGS = 3
DETOURS = 3
#: Once a leg finds no more than this part of the roots, lost paths climb the ladder.
TRICKLE = 0.05
#: So many times more of either while one place has a root that the other lacks: the paths to it are lost, although
#: they climb the ladder then. It may be too large there, or too near another, for good.
UNEVEN = 2
#: More roots than this, and paths that are lost on a detour are let go: the ladder would take most of the time.
MANY = 2_000
#: Detours are made so many times over where no trace test follows: of 40 runs on chains of two links (370 and 3708
#: roots) 29 found all with one round and 40 with three, then 198 of 200.
ROUNDS = 3
#: Roots nearer to each other than this, relative, may be one root twice: of a chain of three links with a condition of
#: 1e10 two copies were 5e-7 apart.
TWINS = 1e-4
#: Tries to leave the first root, and those that do without the ladder: it may be ill-conditioned, or need pivots.
TRIES, PLAIN = 20, 4
#: So many ends of a leg are looked at; if several have a Jacobian that is singular to rounding, roots are dropped.
SAMPLE, SEVERAL = 24, 3
#: It is where both the scaled condition number and the balanced one are larger: simple roots of chains of three links,
#: which are as large as 1e10, had up to 5e38 of the former, but 3e13 of the latter.
ON_A_CURVE = 1e14
#: Unknowns smaller than this part of the typical size are rounding errors of zero.
ZERO = 1e-12
#: A first root that is smaller than this part of the parameters says nothing about the size of the others.
NOTHING = 1e-12
#: Each detour of a round leads so many times farther than the one before.
FARTHER = 10.0


#: From these parameters to those, and the bend.
Arc = tuple[np.ndarray, np.ndarray, complex]


class Detour(NamedTuple):
    """A third place: so many powers of ten farther than the two.

    All parameters grow together in the first round: roots that constants beside them keep apart change places there.
    In the others each becomes larger or smaller by a chance of its own: a homogeneous system looks the same where all
    grow together.
    """

    far: int
    apart: bool


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
    back : int
        Roots at the start that were not known there: the way back from roots at the end where no path had arrived.
    """

    carried: int
    arrived: int
    new: int
    known: int
    estimate: float
    back: int = 0


@dataclass
class Node:
    """A place in parameter space and the roots that are known there."""

    parameters: np.ndarray
    roots: PointSet


@dataclass
class Search:
    """The state of a run: two nodes and the history of the legs.

    `elsewhere` roots have been found at the fuller node that the legs have not met.
    """

    engine: Engine
    nodes: list[Node]
    group: Group | None
    seed: int
    jobs: int
    backend: str
    typical: float
    ladder: bool = False
    valid: Callable[[np.ndarray], np.ndarray] | None = None
    mirror: Mirror | None = None
    exchanges: Exchanges | None = None
    history: list[Leg] = field(default_factory=list)
    tracked: int = 0
    lost: int = 0
    elsewhere: int = 0

    def fuller(self) -> Node:
        """The node with more roots."""
        return max(self.nodes, key=lambda node: len(node.roots))

    def settle(self, system: System) -> None:
        """Tell roots that are near to each other apart in 32 digits: one that is ill-conditioned may be there twice."""
        for node in self.nodes:
            points = node.roots.points
            rows = np.unique(pairs_of_equals(points, TWINS))
            if not rows.size:
                continue
            values = DoubleDouble(node.parameters)
            x, errors = newton_double_double(
                system.program, system.jacobian_program, DoubleDouble(points[rows]), values
            )
            sure = errors < SAME
            points = points.copy()
            points[rows[sure]] = x.hi[sure]
            node.roots = PointSet(points.shape[1], floor=node.roots.floor)
            node.roots.add(points)

    def leg(self, source: int, detour: Detour | None = None) -> Leg:
        """Carry all roots of a node to the other one along fresh arcs, perhaps with a detour.

        Back along the same arcs come the roots there that are known but have not been arrived at.
        """
        a, b = self.nodes[source], self.nodes[1 - source]
        points = a.roots.points
        ladder = self.ladder and (detour is None or len(points) <= MANY)
        unknowns, values = self._exchange(points.shape[1], len(a.parameters))
        way = arcs(self.seed, len(self.history), a.parameters[values], b.parameters, detour)
        ends = self._carried(points[:, unknowns], way, ladder)
        on_curves = self._meets_curves(ends, b.parameters)
        if on_curves:
            ends = self._without_curves(ends, b.parameters)
        before = len(a.roots), len(b.roots)
        self.lost += len(points) - len(ends)
        seen = self._add(b, ends)
        recaptured = int((np.unique(seen) < before[1]).sum())
        new = max(len(b.roots) - before[1], 0)
        estimate = before[1] * (recaptured + new) / recaptured if recaptured else np.inf
        missed = np.setdiff1d(np.arange(len(b.roots)), seen[: len(ends)])
        way = [(end, start, 1 / bend) for start, end, bend in reversed(way)]
        back = self._carried(b.roots.points[missed], way, ladder)[:, np.argsort(unknowns)]
        self._add(a, self._without_curves(back, a.parameters) if on_curves else back)
        known, found_back = len(b.roots), max(len(a.roots) - before[0], 0)
        leg = Leg(len(points), len(ends), new, known, float(max(estimate, known)), found_back)
        self.history.append(leg)
        self.ladder |= new <= TRICKLE * len(b.roots)
        return leg

    def _exchange(self, columns: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The exchange of unknowns and of parameters that this leg begins with."""
        if self.exchanges is None:
            return np.arange(columns), np.arange(count)
        return self.exchanges(np.random.default_rng([self.seed, 14, len(self.history)]))

    def _carried(self, points: np.ndarray, way: list[Arc], ladder: bool) -> np.ndarray:
        """Ends of the paths that start at these points and are not lost on the way."""
        for start, end, bend in way:
            self.tracked += len(points)
            points = carry(self.engine, points, start, end, bend, self.jobs, self.backend, self.typical, ladder)
        if self.valid is not None:
            points = points[self.valid(points)]
        return points

    def _meets_curves(self, points: np.ndarray, parameters: np.ndarray) -> bool:
        """Whether several of a few ends of a leg lie on curves of roots; then what is known is looked through, too.

        A path that has jumped to a curve ends at another point of it each time, so that they become more and more. Of
        the roots that a leg has missed most may be ill-conditioned: they say nothing.
        """
        few = points[np.random.default_rng(len(points)).permutation(len(points))[:SAMPLE]]
        if self._on_curves(few, parameters).sum() < SEVERAL:
            return False
        for node in self.nodes:
            roots = self._without_curves(node.roots.points, node.parameters)
            node.roots = PointSet(roots.shape[1], node.roots.tolerance, floor=node.roots.floor)
            node.roots.add(roots)
        return True

    def _without_curves(self, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        return points[~self._on_curves(points, parameters)]

    def _on_curves(self, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
        """Where the Jacobian is singular to rounding."""
        _, _, condition = newton_step(self.engine.program, points, parameters, self.typical)
        singular = condition > ON_A_CURVE
        doubtful = np.where(np.abs(points[singular]) > ZERO * self.typical, points[singular], 0.0)
        singular[singular] = balanced_condition(evaluate(self.engine.program, doubtful, parameters)[1]) > ON_A_CURVE
        return np.asarray(singular)

    def _add(self, node: Node, points: np.ndarray) -> np.ndarray:
        """Add roots to a node, and their images; the number of each there, those of the images behind."""
        if self.group is not None:
            points = self.group.representatives(points, node.parameters)
        if self.mirror is not None:
            images = self.mirror.points(points)
            images = images[np.isfinite(images).all(axis=1)]
            if self.group is not None:
                images = self.group.representatives(images, node.parameters)
            points = np.concatenate([points, images])
        return node.roots.add(points)


def arcs(
    seed: int, number: int, start: np.ndarray, end: np.ndarray, detour: Detour | None = None
) -> list[Arc]:
    """The way of a leg, as (from, to, bend): one arc, or two by way of a third place, the `detour`.

    It depends on the number of the leg alone: a search that is resumed goes on as it would have.
    """
    rng = np.random.default_rng([seed, 12, number])
    places = [start, end]
    if detour is not None:
        apart = rng.uniform(-1, 1, len(start)) if detour.apart else 1.0
        places.insert(1, FARTHER ** (detour.far * apart) * sizes(start) * gaussian(rng, len(start)))
    return [(a, b, random_bend(rng)) for a, b in itertools.pairwise(places)]


def quiet_enough(uneven: bool, tested: bool) -> int:
    """Legs without news that end a search, that of a set which is tested in another way, too, sooner."""
    return (UNEVEN if uneven else 1) * (QUIET_LEGS + (1 if tested else ROUNDS) * DETOURS)


def detour_of(quiet: int, farther: int = 0) -> Detour | None:
    """Which detour a leg makes after so many without news: none at first, then all in turn, farther if asked for.

    >>> [detour_of(quiet) for quiet in (2, 3, 5, 8)]
    [None, Detour(far=0, apart=False), Detour(far=2, apart=False), Detour(far=2, apart=True)]
    """
    turn, number = divmod(quiet - QUIET_LEGS, DETOURS)
    return Detour(number + farther, turn % ROUNDS > 0) if turn >= 0 else None


def two_nodes(
    system: System, start: tuple[Any, Any] | None, rng: np.random.Generator, mirror: Mirror | None = None
) -> tuple[Engine, list[Node], float]:
    """An engine, two generic nodes, the first of which holds a root, and the typical size of the unknowns.

    The root is the given one, or one made at random, carried away from parameters that were made to fit it. With a
    mirror the nodes are their own images.

    Raises
    ------
    InvalidSystem
        No first root can be made, or no path leaves it.
    """
    point, values = random_root(system, rng) if start is None else given_root(system, start)
    typical, sides = float(np.abs(point).max()), float(np.abs(values).max(initial=0.0))
    if typical <= NOTHING * sides:  # the first root is the origin
        typical = sides or 1.0
    engine = engine_of(parameter_homotopy(system.program, values, values, point))
    columns = len(system.unknowns)
    scale = np.maximum(np.abs(values), 0.1 * np.abs(values).max(initial=1.0))
    # Leave the seed: its parameters are special. A few tries, as the seed may be ill-conditioned.
    for tried in range(TRIES):
        sets = [PointSet(columns, seed=k, floor=ORIGIN * typical) for k in range(2)]
        nodes = [Node(scale * gaussian(rng, len(scale)), roots) for roots in sets]
        if mirror is not None:
            for node in nodes:
                node.parameters = (node.parameters + mirror.parameters(node.parameters)) / 2
        bend = np.exp(1j * rng.uniform(0.3, 2.8))
        arrived = carry(engine, point, values, nodes[0].parameters, bend, typical=typical, ladder=tried >= PLAIN)
        if len(arrived):
            nodes[0].roots.add(arrived)
            return engine, nodes, typical
    raise InvalidSystem("no path leaves the start pair: is it a regular root of the system?")


def sizes(parameters: np.ndarray) -> np.ndarray:
    """Sizes of parameters; of small ones a tenth of the largest."""
    size = np.abs(parameters)
    return np.asarray(np.maximum(size, 0.1 * size.max(initial=1e-300)))


def gaussian(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Random complex numbers of variance one."""
    return np.asarray((rng.normal(size=shape) + 1j * rng.normal(size=shape)) / np.sqrt(2))


def evidence_of(history: list[Leg], tracked: int, lost: int, group: Group | None, known: int) -> str:
    """What the legs have shown, in words; `known` counts orbits where there is a group.

    >>> evidence_of([Leg(5, 5, 0, 5, 5.0)], 5, 0, None, 5)
    '1 leg of monodromy, 5 paths, capture–recapture estimate 5'
    """
    order = group.order if group else 1
    text = f"{_counted(len(history), 'leg')} of monodromy, {_counted(tracked, 'path')}"
    if lost:
        text += f" ({lost} lost on the way)"
    if history and np.isfinite(history[-1].estimate):
        text += f", capture–recapture estimate {history[-1].estimate * order:.0f}"
    if group is not None:
        text += f", {_counted(known, 'orbit')} of {order}"
    return text


def _counted(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


class Memory:
    """Known roots in the run file after each leg, so that a killed search goes on from there."""

    def __init__(self, checkpoint: Any, system: System, seed: int, search: Search) -> None:
        self.checkpoint, self.search = checkpoint, search
        if checkpoint is not None:
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
            if "back" in kept:
                self.search.nodes[1 - int(kept["node"][0])].roots.add(kept["back"])
            numbers = kept["leg"]
            carried, arrived, new, size = (int(v) for v in numbers[:4])
            self.search.history.append(Leg(carried, arrived, new, size, float(numbers[4]), *map(int, numbers[5:])))
            self.search.tracked += int(numbers[0])
            self.search.lost += int(numbers[0] - numbers[1])

    def keep(self) -> None:
        """Append the news of the last leg."""
        if self.checkpoint is None:
            return
        leg = self.search.history[-1]
        number = len(self.search.history) - 1
        target = 1 - number % 2
        here, roots = self.search.nodes[1 - target].roots, self.search.nodes[target].roots
        arrays = {
            "node": np.array([target], np.int64),
            "points": roots.points[len(roots) - leg.new :],
            "back": here.points[len(here) - leg.back :],
            "leg": np.array([leg.carried, leg.arrived, leg.new, leg.known, leg.estimate, leg.back], np.float64),
        }
        self.checkpoint.append(self.stage, number, arrays)
