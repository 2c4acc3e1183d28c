"""All circuits of a linkage, and their branches for an input: nothing is left out.

A circuit on which the input never stands still is closed and takes the input through every value, so that
the assemblies at one value show it; any other holds a dead centre. Both are found by complete polynomial
solves, each is traced inside its tubes, and then the traced curves are held against the solves: every dead
centre must be on one of them, and at further values of the input they must show exactly the assemblies that
the solver finds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mechanisms.assemblies import assemblies
from mechanisms.branches import Branches
from mechanisms.closure import Closure
from mechanisms.critical import DeadCentres, dead_centres
from mechanisms.curve import ENDS, Circuit
from mechanisms.doublepoints import connected, double_point
from mechanisms.linkage import Input, Linkage

#: Where assemblies are solved: golden parts of a turn, which no symmetric linkage makes special.
GOLDEN = 0.6180339887498949
#: At how many values of the input assemblies are solved: all but the last begin traces (one would do, but
#: for circuits that go to infinity), and all are held against the traces.
VALUES = 3


@dataclass(frozen=True, eq=False)
class Motion:
    """Every circuit of a linkage, cut into branches for one input.

    Attributes
    ----------
    pieces : tuple of Branches
        Traced pieces of the configuration curve: whole circuits, but for linkages with double points.
    component : tuple of int
        For each piece the number of its circuit.
    dead_centres : DeadCentres
        All of them, solved, not traced.
    complete : bool
        Whether the traced circuits agree with the solves. False with ``doubts``.
    doubts : tuple of str
        What does not agree, in sentences.
    """

    pieces: tuple[Branches, ...]
    component: tuple[int, ...]
    dead_centres: DeadCentres
    complete: bool
    doubts: tuple[str, ...]

    @property
    def branches(self) -> int:
        """Number of branches of all circuits together."""
        return sum(piece.count for piece in self.pieces)

    @property
    def circuits(self) -> int:
        """Number of circuits."""
        return len(set(self.component))

    def __repr__(self) -> str:
        plurals = "s" * (self.circuits != 1), "es" * (self.branches != 1)
        text = f"Motion({self.circuits} circuit{plurals[0]}, {self.branches} branch{plurals[1]}"
        return text + (", complete)" if self.complete else f"; {' '.join(self.doubts)})")


def all_circuits(linkage: Linkage, driven: Input | str, seed: int = 0) -> Motion:
    """Find every circuit of a linkage.

    Parameters
    ----------
    linkage : Linkage
        With one degree of freedom.
    driven : Input or str
        The input that cuts the circuits into branches.
    seed : int
        Of the solver's random choices.

    Returns
    -------
    Motion

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> all_circuits(four_bar, Input("crank"))
    Motion(2 circuits, 2 branches, complete)
    >>> all_circuits(four_bar, Input("follower"))
    Motion(2 circuits, 4 branches, complete)
    """
    if isinstance(driven, str):
        driven = linkage.inputs[driven]
    closure = Closure.of(linkage)
    dead = dead_centres(linkage, driven, seed=seed)
    values = _values(closure, driven, dead)
    solved = [assemblies(linkage, driven, value, seed=seed) for value in values]
    # Assemblies first: a trace is best begun away from the critical points.
    circuits: list[Circuit] = []
    component: list[int] = []
    for x in [x for found in solved[:-1] for x in found.x] + list(dead.x[~dead.double]):
        if not any(circuit.locate(x) is not None for circuit in circuits):
            pieces = connected(closure, x)
            component += [max(component, default=-1) + 1] * len(pieces)
            circuits += pieces
    cut = tuple(Branches.of(circuit, driven) for circuit in circuits)
    doubts = _doubts(cut, dead, values, [found.x for found in solved])
    return Motion(cut, tuple(component), dead, not doubts, tuple(doubts))


def _values(closure: Closure, driven: Input, dead: DeadCentres) -> list[float]:
    """Inputs for the assemblies: anywhere on a turn; between the dead centres for a slider."""
    if not driven.translation:
        return [math.tau * ((GOLDEN * (k + 1)) % 1.0) for k in range(VALUES)]
    low, high = (dead.value.min(), dead.value.max()) if len(dead.value) else (-closure.scale, closure.scale)
    return [low + (high - low) * ((GOLDEN * (k + 1)) % 1.0) for k in range(VALUES)]


def _doubts(cut: tuple[Branches, ...], dead: DeadCentres, values: list[float], solved: list[np.ndarray]) -> list[str]:
    doubts = []
    traced = sum(len(branches.cuts) for branches in cut)
    if traced != int((~dead.double).sum()):
        doubts.append(f"The traces pass {traced} dead centres, the solver finds {int((~dead.double).sum())}.")
    for value, x in zip(values, solved):
        passed = sum(_passes(branches, value) for branches in cut)
        if passed != len(x):
            doubts.append(f"At the input {value:.6g} the traces have {passed} assemblies, the solver {len(x)}.")
        lost = sum(all(branches.circuit.locate(row) is None for branches in cut) for row in x)
        if lost:
            doubts.append(f"At the input {value:.6g} {lost} assemblies are on no traced circuit.")
    for branches in cut:
        for end in branches.circuit.ends:
            if end == ENDS[3]:
                doubts.append(f"A circuit {end}.")
        ends = zip((branches.circuit.x[0], branches.circuit.x[-1]), branches.circuit.ends)
        if any(end == ENDS[2] and double_point(branches.circuit.closure, x) is None for x, end in ends):
            doubts.append("A trace stopped where no double point could be found.")
    return doubts


def _passes(branches: Branches, value: float) -> int:
    """How often a circuit has the input at a value; modulo full turns for a rotation."""
    count = 0
    if branches.endless and _is_rotation(branches):
        low, high = branches.range(0)
        return round((high - low) / math.tau)
    for number in range(branches.count):
        low, high = branches.range(number)
        if not _is_rotation(branches):
            count += low <= value <= high
        else:
            count += math.floor((high - value) / math.tau) - math.ceil((low - value) / math.tau) + 1
    return count


def _is_rotation(branches: Branches) -> bool:
    return bool(branches.gradient[: branches.circuit.closure.rotations].any())
