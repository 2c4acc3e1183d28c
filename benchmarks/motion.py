"""How many designs are judged each second on one core: four-bars, Watt II six-bars, modified Wanzer
linkages.

    python -m benchmarks.motion [--designs N] [--seed S]

Every design is a new linkage with four poses of its own circuit; deriving its closure equations, tracing
and judging are all counted, for every input that the table names. Processor time of one process is
measured, so that other work on the machine hardly matters. A certified trace and a complete analysis (all
circuits, checked against the solver) are timed for comparison.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mechanisms.certified_trace import certify_trace
from mechanisms.circuits import all_circuits
from mechanisms.closure import Closure
from mechanisms.curve import trace
from mechanisms.fourbar import judge_four_bars
from mechanisms.linkage import Input, Linkage, PinSlot
from mechanisms.motion import judge_inputs

Task = tuple[Linkage, list[dict[str, float]]]


def four_bar(rng: np.random.Generator) -> Linkage:
    """A four-bar with random joints, driven at either side."""
    a, b, c, d = (complex(*rng.normal(size=2)) for _ in range(4))
    return Linkage(
        {"A": a, "B": b, "C": c, "D": d},
        {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"},
        inputs={"crank": Input("crank"), "follower": Input("follower")},
    )


def watt2(rng: np.random.Generator) -> Linkage:
    """A Watt II with random joints, driven by each of its three links at the frame."""
    names = ("O1", "A", "A'", "P", "Q", "O3", "C", "O4", "C'")
    return Linkage(
        {name: complex(*rng.normal(size=2)) for name in names},
        {
            "ground": ("O1", "O3", "O4"),
            "crank": ("O1", "A", "A'"),
            "P-coupler": ("A", "P", "C"),
            "Q-coupler": ("A'", "Q", "C'"),
            "P-rocker": ("O3", "C"),
            "Q-rocker": ("O4", "C'"),
        },
        inputs={name: Input(name) for name in ("crank", "P-rocker", "Q-rocker")},
    )


def wanzer(rng: np.random.Generator) -> Linkage:
    """A modified Wanzer linkage near the published one with six poses, driven at its four-bar's crank."""
    places = {
        "P": 0, "A": -1 - 1.7320508j, "B": 1.9791 + 0.2393j, "C": -0.6422j, "Q": 1.3258 - 1.8860j,
        "M": -0.6476 + 0.6j, "N": -2.3886 - 3.25j, "R": -0.34 - 0.41j, "S": 0.05 - 3.43j,
    }  # fmt: skip
    points = {name: complex(z) + 0.05 * complex(*rng.normal(size=2)) for name, z in places.items()}
    return Linkage(
        points,
        {
            "ground": ("M", "N", "Q"), "crank": ("M", "R"), "coupler": ("R", "S", "A"), "follower": ("N", "S"),
            "body": ("P", "A", "B", "C"), "disc": ("Q",),
        },
        slots=[PinSlot("disc", "B", 1), PinSlot("disc", "C", 1j)],
        inputs={"crank": Input("crank")},
    )  # fmt: skip


def tasks(make: Callable[[np.random.Generator], Linkage], count: int, seed: int) -> list[Task]:
    """Random designs with four poses each, in order on a third of their circuit."""
    rng = np.random.default_rng(seed)
    found: list[Task] = []
    while len(found) < count:
        linkage = make(rng)
        circuit = trace(Closure.of(linkage))
        places = (rng.uniform(0, circuit.arcs) + np.sort(rng.uniform(0, circuit.arcs / 3, 4))) % circuit.arcs
        turned = circuit.closure.link_rotations(circuit.at(places)[0])
        poses = [{link: float(angle[j]) for link, angle in turned.items()} for j in range(4)]
        fresh = Linkage(linkage.points, linkage.links, slots=linkage.slots, inputs=linkage.inputs)
        found.append((fresh, poses))
    return found


def seconds(work: Callable[[Any], Any], items: list[Any]) -> float:
    """Processor seconds for each item."""
    start = time.process_time()
    for item in items:
        work(item)
    return (time.process_time() - start) / len(items)


def bulk_four_bars(count: int, seed: int) -> float:
    """Processor seconds for each four-bar in closed form."""
    rng = np.random.default_rng(seed)
    joints = rng.normal(size=(count, 4)) + 1j * rng.normal(size=(count, 4))
    rotations = np.zeros((count, 4, 3)) + rng.normal(size=(count, 1, 1))
    start = time.process_time()
    judge_four_bars(joints, rotations)
    return (time.process_time() - start) / count


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--designs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    print(f"{'design':34} {'inputs':>6} {'ms':>8} {'designs/s and core':>19}")
    rate = bulk_four_bars(100_000, options.seed)
    print(f"{'four-bar, closed form, in bulk':34} {1:6} {1e3 * rate:8.4f} {1 / rate:19.0f}")
    for name, make in (("four-bar", four_bar), ("Watt II", watt2), ("modified Wanzer", wanzer)):
        work = tasks(make, options.designs, options.seed)
        judge_inputs(work[0][0], None, work[0][1])
        rate = seconds(lambda task: judge_inputs(task[0], None, task[1]), work[1:])
        print(f"{name + ', traced':34} {len(work[0][0].inputs):6} {1e3 * rate:8.3f} {1 / rate:19.0f}")
    few = [linkage for linkage, _ in tasks(watt2, 20, options.seed)]
    circuits = [trace(Closure.of(linkage)) for linkage in few]
    certify_trace(circuits[0])
    rate = seconds(certify_trace, circuits)
    print(f"{'Watt II, trace certified':34} {'':6} {1e3 * rate:8.3f} {1 / rate:19.0f}")
    all_circuits(few[0], "crank")
    rate = seconds(lambda linkage: all_circuits(linkage, "crank"), few)
    print(f"{'Watt II, all circuits':34} {1:6} {1e3 * rate:8.3f} {1 / rate:19.0f}")


if __name__ == "__main__":
    main()
