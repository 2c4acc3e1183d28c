"""Does a linkage really perform its task? Circuit, branch and order of its poses, for each input.

The whole circuit through pose 0 is traced inside tubes (:mod:`mechanisms.curve`), so that "on the same
circuit" is a fact; it is cut at the dead centres of the input, where the determinant of the closure
equations without the input changes sign, so that "on the same branch" is one too. Signs of square roots,
which jump where nothing singular happens, are not used.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mechanisms.branches import Branches
from mechanisms.certified_trace import certify_trace
from mechanisms.closure import Closure
from mechanisms.curve import Circuit, need_one_freedom, settle
from mechanisms.doublepoints import connected
from mechanisms.linkage import Input, Linkage, LinkageError
from mechanisms.transmission import Transmission
from mechanisms.verdict import Verdict

#: A pose that has to move by more than this (radians, or parts of the linkage's size) to close the loops is
#: not reached.
REACHED = 1e-2
#: Dips of the transmission angle between nodes that are looked at more closely, the lowest first.
DIPS = 5
#: A dip that is still higher than the least by this (radians) after a closer look is not looked at again.
ENOUGH = 0.02

__all__ = ["Placed", "Pose", "Verdict", "judge", "judge_inputs", "judge_many", "least_transmission"]

Pose = Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Placed:
    """Poses found on the circuits of a linkage: traced once, judged for as many inputs as wanted.

    Attributes
    ----------
    linkage : Linkage
    circuits : tuple of Circuit
        Traced pieces of the configuration curve: whole circuits, but for linkages with double points.
    component : tuple of int
        For each piece the number of the circuit that it belongs to; pieces joined by a double point have one.
    circuit_of : tuple of int
        For each pose the piece that holds it, or −1.
    places, moved : tuple of float
        Its place there, and how far it had to move to close the loops.
    """

    linkage: Linkage
    circuits: tuple[Circuit, ...]
    component: tuple[int, ...]
    circuit_of: tuple[int, ...]
    places: tuple[float, ...]
    moved: tuple[float, ...]
    certified: bool | None = None

    @classmethod
    def of(cls, linkage: Linkage, poses: Sequence[Pose], certify: bool = False) -> Placed:
        """Trace the circuit through each pose and find the poses on them; prove the traces if asked to.

        Raises
        ------
        LinkageError
            If there is no pose, a pose leaves a link's rotation open, or the linkage has not one degree of
            freedom.
        """
        if not poses:
            raise LinkageError("no poses to judge; give at least pose 0")
        closure = Closure.of(linkage)
        need_one_freedom(closure)
        circuits: list[Circuit] = []
        component: list[int] = []
        circuit_of, places, moved = [], [], []
        for pose in poses:
            x, change = settle(closure, closure.configuration(pose))
            moved.append(change)
            number, place = -1, math.nan
            if change <= REACHED:
                number, place = _find(circuits, x)
                if number < 0:
                    pieces = connected(closure, x)
                    if not pieces[0].arcs:
                        raise LinkageError(f"pose {len(moved) - 1} stands in a double point, where the motion forks")
                    number, place = len(circuits), pieces[0].locate(x) or 0.0
                    component += [max(component, default=-1) + 1] * len(pieces)
                    circuits += pieces
            circuit_of.append(number)
            places.append(place)
        if circuit_of[0] < 0:
            raise LinkageError("pose 0 does not close the loops of the linkage; the rotations do not belong to it")
        proved = all(certify_trace(circuit).certified for circuit in circuits) if certify else None
        found = (tuple(circuits), tuple(component), tuple(circuit_of), tuple(places), tuple(moved))
        return cls(linkage, *found, certified=proved)

    @property
    def circuit_numbers(self) -> tuple[int, ...]:
        """For each pose the number of its circuit, −1 if it closes nowhere."""
        return tuple(self.component[piece] if piece >= 0 else -1 for piece in self.circuit_of)

    def judge(self, driven: Input) -> Verdict:
        """Return the verdict for one input."""
        self.linkage.check_input(driven)
        cut = [Branches.of(circuit, driven) for circuit in self.circuits]
        first = cut[0]
        home = first.index(self.places[0])
        # Branches are counted through the pieces of a circuit.
        before = [
            sum(cut[k].count for k in range(n) if self.component[k] == own) for n, own in enumerate(self.component)
        ]
        branch_of = tuple(
            -1 if number < 0 else before[number] + cut[number].index(place)
            for number, place in zip(self.circuit_of, self.places)
        )
        circuits = self.circuit_numbers
        same_circuit = all(number == 0 for number in circuits)
        on_home = [n == 0 and first.holds(home, p) for n, p in zip(self.circuit_of, self.places)]
        if not all(on_home) and same_circuit and first.near_cut(self.places[0]):
            # Pose 0 in a dead centre belongs to two branches: try the other one.
            for other in range(first.count):
                if all(first.holds(other, p) for p in self.places):
                    home, on_home = other, [True] * len(on_home)
        same_branch = same_circuit and all(on_home) and not first.still
        low, high = first.range(home)
        turns = not driven.translation and (first.endless or high - low >= 2 * math.pi - 1e-9)
        if first.endless:
            turns = not driven.translation and abs(high - low) > 1.0
        travel = first.order(self.places, home) if same_branch else None
        notes = _notes(self, branch_of, on_home, travel is not None, home)
        if not same_branch:
            return Verdict(
                same_circuit, False, False, bool(turns), 0.0, math.inf, 0.0, (low, high),
                circuits, branch_of, self.moved, notes, self.certified,
            )  # fmt: skip
        way = travel if travel is not None else _hull(first, self.places, home)
        transmission = least_transmission(Transmission(self.linkage, driven), first.circuit, way)
        return Verdict(
            True, True, travel is not None, bool(turns), math.degrees(transmission), _speed_ratio(first, way),
            first.clearance(way, home), (low, high), circuits, branch_of, self.moved, notes, self.certified,
        )  # fmt: skip


def judge(linkage: Linkage, driven: Input | str, poses: Sequence[Pose], certify: bool = False) -> Verdict:
    """Judge the motion of a linkage through its poses for one input.

    Parameters
    ----------
    linkage : Linkage
        With one degree of freedom.
    driven : Input or str
        What is driven; a string names one of ``linkage.inputs``.
    poses : sequence of mapping
        Configurations in the order of visit, pose 0 first: rotation of each moving link from the reference,
        radians. They may be a little off (as rounded numbers are); each is first moved to close the loops
        exactly.

    Returns
    -------
    Verdict

    Raises
    ------
    LinkageError
        If a link's rotation is missing, or the linkage has not one degree of freedom, or pose 0 closes
        nowhere.

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> from mechanisms.curve import trace
    >>> poses = [trace(Closure.of(four_bar)).at(place)[0] for place in (0.0, 5.0, 9.0)]
    >>> poses = [dict(zip(("crank", "coupler", "follower"), pose)) for pose in poses]
    >>> judge(four_bar, Input("crank"), poses)
    Verdict(defect-free, full rotation, transmission angle at least 45.0°)
    >>> judge(four_bar, Input("follower"), poses).reasons
    ('branch',)
    """
    return judge_inputs(linkage, {"": driven}, poses, certify)[""]


def judge_inputs(
    linkage: Linkage, inputs: Mapping[str, Input | str] | None, poses: Sequence[Pose], certify: bool = False
) -> dict[str, Verdict]:
    """Judge several inputs (all of ``linkage.inputs`` if None) with one trace; see :func:`judge`."""
    chosen = dict(linkage.inputs) if inputs is None else dict(inputs)
    placed = Placed.of(linkage, poses, certify)
    return {name: placed.judge(_input(linkage, driven)) for name, driven in chosen.items()}


def judge_many(linkages: Iterable[Linkage], poses: Iterable[Sequence[Pose]], jobs: int = 1) -> list[dict[str, Verdict]]:
    """Judge many designs, each with its own poses, for all of its inputs.

    Parameters
    ----------
    linkages : iterable of Linkage
    poses : iterable of sequence of mapping
    jobs : int
        Worker processes (joblib); the verdicts do not depend on it.

    Returns
    -------
    list of dict of str to Verdict
    """
    work = list(zip(linkages, poses, strict=True))
    if jobs == 1 or len(work) < 2:
        return [judge_inputs(linkage, None, task) for linkage, task in work]
    from joblib import Parallel, delayed

    size = max(1, math.ceil(len(work) / (4 * jobs)))
    chunks = [work[i : i + size] for i in range(0, len(work), size)]
    parts = Parallel(n_jobs=jobs)(delayed(_judge_chunk)(chunk) for chunk in chunks)
    return [verdict for part in parts for verdict in part]


def _judge_chunk(work: list[tuple[Linkage, Sequence[Pose]]]) -> list[dict[str, Verdict]]:
    return [judge_inputs(linkage, None, task) for linkage, task in work]


def _input(linkage: Linkage, driven: Input | str) -> Input:
    if isinstance(driven, Input):
        return driven
    if driven not in linkage.inputs:
        raise LinkageError(f"no input {driven!r}; known are {', '.join(map(repr, linkage.inputs)) or 'none'}")
    return linkage.inputs[driven]


def _find(circuits: Sequence[Circuit], x: np.ndarray) -> tuple[int, float]:
    for number, circuit in enumerate(circuits):
        place = circuit.locate(x)
        if place is not None:
            return number, place
    return -1, math.nan


def least_transmission(transmission: Transmission, circuit: Circuit, way: tuple[float, float]) -> float:
    """Return the least transmission angle (radians) between two places of a circuit, refined between nodes."""
    low, high = min(way), max(way)
    halves = np.arange(math.floor(2 * low) + 1, math.ceil(2 * high)) / 2
    places = np.concatenate([[low], halves, [high]])
    angles = _angles(transmission, circuit, places)
    least = float(angles.min())
    padded = np.concatenate([[math.inf], angles, [math.inf]])
    dips = np.flatnonzero((angles <= padded[:-2]) & (angles <= padded[2:]))
    for dip in dips[np.argsort(angles[dips])][:DIPS]:
        near = places[max(dip - 1, 0)], places[min(dip + 1, len(places) - 1)]
        for _ in range(3):  # each round looks eight times closer
            if near[1] - near[0] < 1e-9:
                break
            fine = np.linspace(*near, 17)
            found = _angles(transmission, circuit, fine)
            best = int(np.argmin(found))
            least = min(least, float(found[best]))
            near = fine[max(best - 1, 0)], fine[min(best + 1, 16)]
            if found[best] > least + ENOUGH:
                break
    return least


def _angles(transmission: Transmission, circuit: Circuit, places: np.ndarray) -> np.ndarray:
    return transmission.angle(circuit.at(places % circuit.arcs if circuit.closed else places)[0])


def _hull(branches: Branches, places: Sequence[float], number: int) -> tuple[float, float]:
    """The least piece of a branch that holds all places; the whole of an endless one."""
    low, high = branches.interval(number)
    if branches.endless:
        return low, high
    arcs = branches.circuit.arcs
    steps = [low + ((p - low) % arcs) if branches.circuit.closed else p for p in places]
    steps = [p - arcs if p > high + 1e-6 else p for p in steps]
    return min(steps), max(steps)


def _speed_ratio(branches: Branches, way: tuple[float, float]) -> float:
    circuit = branches.circuit
    low, high = min(way), max(way)
    places = np.concatenate([[low], np.arange(math.floor(low) + 1, math.ceil(high)), [high]])
    _, tangent = circuit.at(places % circuit.arcs if circuit.closed else places)
    turning = np.abs(tangent[:, : circuit.closure.rotations]).max(axis=1)
    rate = np.abs(tangent @ branches.gradient) * branches.unit
    return float((turning / np.maximum(rate, 1e-300)).max())


def _notes(
    placed: Placed, branch_of: Sequence[int], on_home: Sequence[bool], ordered: bool, home: int
) -> tuple[str, ...]:
    notes = []
    for j, (number, here) in enumerate(zip(placed.circuit_numbers, on_home)):
        if number < 0:
            notes.append(f"Pose {j} is not reached: no configuration of the linkage is near it.")
        elif number > 0:
            notes.append(f"Pose {j} is on circuit {number}, pose 0 on circuit 0.")
        elif not here:
            notes.append(f"Pose {j} is on branch {branch_of[j]}, pose 0 on branch {home}.")
    if not notes and not ordered:
        notes.append("The poses are not visited in their order.")
    open_ends = {
        f"Circuit {number} {end}."
        for piece, number in zip(placed.circuits, placed.component)
        for end in piece.ends
        if end not in ("closed", "start")
    }
    return (*notes, *sorted(open_ends))
