"""How surely each start finds all roots of each system of the zoo, in one table.

    python -m benchmarks.rates [SYSTEM …] [--seeds 100] [--start START …] [--limit PATHS] [--seconds SECONDS]

For every system and every start that applies (total degree, multihomogeneous, polyhedral), over many seeds: seeds
on which the published number of roots was found and no path failed; fewest and most roots; paths; failed paths of
all seeds together; how many different verdicts on singular ends and ends at infinity there were (1 is right);
paths that the ladder had to track again, of all; CPU seconds a seed. Starts with more paths than the limit are
left out and said to be. Systems with solution sets of positive dimension may have another number of singular
ends on every seed. Exit code 1 if any seed of any line went wrong.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from benchmarks.zoo import ZOO, Benchmark
from solvers import System, solve
from solvers.choose_start import STARTS, choose_start
from solvers.supports import TooManyTerms


@dataclass
class Rate:
    """What many seeds have shown for one system and start."""

    published: int
    paths: int = 0
    seeds: int = 0
    good: int = 0
    failed: int = 0
    again: int = 0
    seconds: float = 0.0
    found: Counter[int] = field(default_factory=Counter)
    verdicts: Counter[tuple[int, int, int]] = field(default_factory=Counter)
    wrong: list[int] = field(default_factory=list)

    def count(self, system: System, start: str, seed: int) -> None:
        """Solve once more."""
        begin = time.process_time()
        self.seeds += 1
        try:
            solutions = solve(system, seed=seed, start=start, certificates=False)
        except ArithmeticError:
            self.wrong.append(seed)
            return
        finally:
            self.seconds += time.process_time() - begin
        ledger = solutions.ledger
        self.paths = ledger.tracked
        self.failed += ledger.failed
        self.again += sum(ledger.rungs.values())
        self.found[ledger.finite] += 1
        ends = sorted(solutions.singular.multiplicity.tolist())
        self.verdicts[(len(ends), sum(ends), ledger.at_infinity)] += 1
        if ledger.finite == self.published and ledger.balanced and not ledger.failed:
            self.good += 1
        else:
            self.wrong.append(seed)

    def line(self) -> str:
        """One row of the table."""
        low, high = min(self.found, default=0), max(self.found, default=0)
        roots = f"{low}" if low == high else f"{low}…{high}"
        return (
            f"{self.good:5}/{self.seeds:<4} {roots:>9}/{self.published:<5} {self.paths:6} {self.failed:6} "
            f"{len(self.verdicts):8} {self.again / max(self.seeds * self.paths, 1):8.2%} "
            f"{self.seconds / max(self.seeds, 1):9.3f}"
        )


HEAD = (
    f"{'system':10} {'start':17} {'good/seeds':>10} {'found/published':>15} {'paths':>6} {'failed':>6} "
    f"{'verdicts':>8} {'again':>8} {'CPU s':>9}"
)


def measure(
    name: str, benchmark: Benchmark, starts: list[str], seeds: int, limit: int, seconds: float
) -> list[tuple[str, Rate]]:
    """Print a line for each start; those that do not apply are named."""
    system, rates = benchmark.build(), []
    for start in starts:
        try:
            paths = choose_start(system, np.zeros(0), start).paths
        except TooManyTerms:
            print(f"{name:10} {start:17} too many terms")
            continue
        if paths > limit:
            print(f"{name:10} {start:17} left out: {paths} paths")
            continue
        rate, begin = Rate(benchmark.isolated), time.perf_counter()
        for seed in range(seeds):
            rate.count(system, start, seed)
            if time.perf_counter() - begin > seconds:
                break
        more = f"  wrong on seeds {rate.wrong[:6]}" if rate.wrong else ""
        print(f"{name:10} {start:17}{rate.line()}{more}", flush=True)
        rates.append((start, rate))
    return rates


def main(arguments: list[str] | None = None) -> int:
    """Run and print; 1 if any seed went wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rates", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=f"of {', '.join(ZOO)}; default: all")
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--start", nargs="*", default=list(STARTS), choices=STARTS, help="default: all three")
    parser.add_argument("--limit", type=int, default=5000, help="leave out starts with more paths (default 5000)")
    parser.add_argument("--seconds", type=float, default=1e9, help="go on to the next line after so many seconds")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.systems if name not in ZOO]
    if unknown:
        parser.error(f"there is no system {unknown[0]}; there are {', '.join(ZOO)}")
    solve(ZOO["noon3"].build(), certificates=False)  # loads what is compiled
    print(HEAD)
    wrong = 0
    for name in options.systems or ZOO:
        for _, rate in measure(name, ZOO[name], options.start, options.seeds, options.limit, options.seconds):
            wrong += len(rate.wrong)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
