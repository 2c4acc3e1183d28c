"""The zoo: polynomial systems whose numbers of roots are published, each with its source.

Every entry of :data:`ZOO` is a :class:`Benchmark`: a function that builds the system exactly (decimal data are
kept as fractions) and the numbers that others found. ``python -m benchmarks.zoo`` lists them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from benchmarks import algebra, kinematics
from solvers.system import System


@dataclass(frozen=True)
class Benchmark:
    """A system and what is known of its solutions.

    Attributes
    ----------
    name : str
    build : callable
        Returns the System.
    isolated : int
        Number of isolated nonsingular solutions, over the complex numbers.
    source : str
        Where the system and the number come from.
    total_degree, mixed_volume : int or None
        Of the supports without further points (solutions with a zero coordinate are not counted by the latter).
    real : int or None
        How many of the isolated solutions are real.
    singular : int
        Isolated singular solutions, each counted once.
    component : bool
        Whether there are solutions of positive dimension as well.
    """

    name: str
    build: Callable[[], System]
    isolated: int
    source: str
    total_degree: int | None = None
    mixed_volume: int | None = None
    real: int | None = None
    singular: int = 0
    component: bool = False


def _family(
    name: str, build: Callable[[int], System], numbers: dict[int, int], source: str, **known: Callable[[int], int]
) -> list[Benchmark]:
    return [
        Benchmark(
            f"{name}{n}",
            lambda n=n: build(n),  # type: ignore[misc]
            isolated,
            source,
            **{key: value(n) for key, value in known.items()},  # type: ignore[arg-type]
        )
        for n, isolated in numbers.items()
    ]


_DEMO = "PHCpack demonstration database"
_CYCLIC = {5: 70, 6: 156, 7: 924}

ZOO: dict[str, Benchmark] = {
    benchmark.name: benchmark
    for benchmark in [
        Benchmark("watt2", kinematics.watt2_three_poses, 8, "Kiper", total_degree=16),
        Benchmark(
            "burmester",
            kinematics.burmester_five_poses,
            4,
            "Burmester 1888",
            total_degree=16,
            real=4,
        ),
        Benchmark("quartics", algebra.dense_quartics, 64, "Bézout", total_degree=64, mixed_volume=64),
        *_family("noon", algebra.noon, {n: 3**n - 2 * n for n in range(3, 7)}, _DEMO, total_degree=lambda n: 3**n),
        *_family("cyclic", algebra.cyclic, _CYCLIC, _DEMO, mixed_volume=lambda n: _CYCLIC[n]),
        *_family(
            "katsura",
            algebra.katsura,
            {n: 2**n for n in range(5, 11)},
            _DEMO,
            total_degree=lambda n: 2**n,
        ),
        *_family(
            "eco", algebra.eco, {n: 2 ** (n - 2) for n in range(5, 10)}, _DEMO, mixed_volume=lambda n: 2 ** (n - 2)
        ),
        *_family(
            "chandra",
            algebra.chandra,
            {n: 2 ** (n - 1) for n in (6, 8)},
            _DEMO,
            total_degree=lambda n: 2**n,
            mixed_volume=lambda n: 2 ** (n - 1),
        ),
        *_family(
            "reimer", algebra.reimer, {5: 144}, _DEMO, total_degree=lambda n: 720, mixed_volume=lambda n: 720
        ),
        Benchmark("caprasse", algebra.caprasse, 24, _DEMO, total_degree=144, mixed_volume=48, singular=8),
        Benchmark("cassou", algebra.cassou, 16, _DEMO, total_degree=1344, mixed_volume=24),
        Benchmark("heart", algebra.heart, 4, _DEMO, total_degree=576, mixed_volume=121, real=2),
        Benchmark("boon", algebra.boon, 8, _DEMO, total_degree=1024, mixed_volume=20, real=8),
        Benchmark("virasoro", algebra.virasoro, 256, _DEMO, total_degree=256, mixed_volume=200),
        Benchmark(
            "ipp",
            kinematics.ipp,
            64,
            _DEMO,
            total_degree=256,
            mixed_volume=64,
        ),
        Benchmark("ipp2", kinematics.ipp2, 16, _DEMO, total_degree=1024, mixed_volume=288),
        Benchmark("fourbar5", kinematics.fourbar_five_points, 36, _DEMO, total_degree=256, mixed_volume=36),
        Benchmark(
            "stewart",
            kinematics.stewart_gough,
            40,
            "Dietmaier 1998",
            total_degree=4096,
            mixed_volume=1536,
            real=40,
        ),
        Benchmark("rbpl24", kinematics.rbpl24, 40, _DEMO, total_degree=576, mixed_volume=80, real=24),
        Benchmark("d1", algebra.d1, 48, _DEMO, total_degree=4608, mixed_volume=192, real=16),
    ]
}


def main() -> None:
    """Print the zoo as a table."""
    print(f"{'name':10} {'n':>3} {'total degree':>12} {'mixed volume':>12} {'roots':>6}  source")
    for name, benchmark in ZOO.items():
        system = benchmark.build()
        volume = benchmark.mixed_volume if benchmark.mixed_volume is not None else ""
        numbers = f"{system.size[1]:3} {system.bezout:12} {volume:>12} {benchmark.isolated:6}"
        print(f"{name:10} {numbers}  {benchmark.source}")


if __name__ == "__main__":
    main()
