"""Every system of the zoo on many seeds: is the answer always the same, and always the published one?

    python -m benchmarks.seeds [SYSTEM …] [--seeds 100] [--start auto]

Printed for each system: seeds with the published number of roots, every path accounted for and the same verdict on
singular ends; mean CPU seconds and roots per CPU second. Seeds that differ are listed. Exit code 1 if any does.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from typing import Any

from benchmarks.zoo import ZOO, Benchmark
from solvers import solve


def verdict(benchmark: Benchmark, solutions: Any) -> tuple[str, tuple[int, ...]]:
    """What is wrong ("" for nothing), and the numbers that must not depend on the seed."""
    ledger = solutions.ledger
    singular = len(solutions.singular.points)
    numbers = (ledger.finite, singular, sum(solutions.singular.multiplicity.tolist()))
    if ledger.failed:
        return f"{ledger.failed} paths failed", numbers
    if not ledger.balanced:
        return f"unbalanced: {ledger!r}", numbers
    if ledger.finite != benchmark.isolated:
        return f"{ledger.finite} roots instead of {benchmark.isolated}", numbers
    if singular < benchmark.singular:
        return f"{singular} singular points instead of {benchmark.singular}", numbers
    return "", numbers


def many_seeds(name: str, seeds: int, start: str) -> bool:
    """Solve one system on many seeds and print a line; whether all went well."""
    benchmark = ZOO[name]
    system = benchmark.build()
    wrong: dict[int, str] = {}
    numbers: Counter[tuple[int, ...]] = Counter()
    solve(system, seed=seeds, start=start, certificates=False)  # loads what is compiled
    begin = time.process_time()
    for seed in range(seeds):
        try:
            problem, found = verdict(benchmark, solve(system, seed=seed, start=start, certificates=False))
            numbers[found] += 1
        except ArithmeticError as error:
            problem = str(error)
        if problem:
            wrong[seed] = problem
    seconds = (time.process_time() - begin) / seeds
    agreed = "one verdict" if len(numbers) == 1 else f"{len(numbers)} verdicts"
    good = seeds - len(wrong)
    print(
        f"{name:10} {good:4} of {seeds} seeds, {agreed:11} {benchmark.isolated:5} roots "
        f"{seconds:8.3f} CPU s {benchmark.isolated / seconds:9.0f} roots/s",
        flush=True,
    )
    for seed, problem in list(wrong.items())[:5]:
        print(f"           seed {seed}: {problem}")
    return not wrong and len(numbers) == 1


def main(arguments: list[str] | None = None) -> int:
    """Run and print; 1 if any seed went wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.seeds", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=f"of {', '.join(ZOO)}; default: all")
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--start", default="auto", help="auto, total-degree, multihomogeneous or polyhedral")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.systems if name not in ZOO]
    if unknown:
        parser.error(f"there is no system {unknown[0]}; there are {', '.join(ZOO)}")
    results = [many_seeds(name, options.seeds, options.start) for name in options.systems or ZOO]
    return 0 if all(results) else 1


if __name__ == "__main__":
    sys.exit(main())
