"""Monodromy for many roots: in memory, and in a run file with the design unknowns only.

    python -m benchmarks.many_roots [--sizes 7 8 9] [--jobs N] [--ways memory file]

The system has n design unknowns x and n local ones y in a ring: x_k² = y_k and y_k² = a_k + b_k x_k x_{k+1} + c_k x_k +
d_k y_{k+1}. Where the highest terms vanish all x do, and then all y, so none of its 4^n roots (Bézout's number) is at
infinity. Each line is a process of its own: roots
found and their number, legs, paths, wall and processor seconds, largest memory (``getrusage``), and how much of it is
beyond what the process took when it had carried the first hundred roots.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from solvers import System, monodromy
from solvers.store import RunFile
from solvers.stored_monodromy import stored_monodromy

#: Roots after which the memory is that of the program itself.
FEW = 100


def ring(size: int) -> System:
    """The system with 4^size roots."""
    from sympy import symbols

    x, y, a, b, c, d = (symbols(f"{name}1:{size + 1}") for name in "xyabcd")
    equations = [x[k] ** 2 - y[k] for k in range(size)]
    for k in range(size):
        follower = (k + 1) % size
        equations.append(y[k] ** 2 - a[k] - b[k] * x[k] * x[follower] - c[k] * x[k] - d[k] * y[follower])
    return System(equations, [*x, *y], [*a, *b, *c, *d])


def whole(kept: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """The squares from the design unknowns."""
    return np.hstack([kept, kept**2])


def megabytes() -> float:
    """Largest memory of this process so far."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def measure(size: int, way: str, jobs: int, seed: int) -> dict[str, float]:
    """One search, in this process."""
    system, count = ring(size), 4**size
    base: list[float] = []

    def progress(what: str, done: int, total: int) -> None:
        if not base and done >= FEW:
            base.append(megabytes())

    wall, cpu = time.perf_counter(), time.process_time()
    if way == "memory":
        roots = monodromy(system, seed, count=count, jobs=jobs, progress=progress)
        legs, paths = len(roots.notes), roots.evidence.split(" legs of monodromy, ")[1].split()[0]
        size_of_file = 0.0
    else:
        with tempfile.TemporaryDirectory() as folder, RunFile.create(Path(folder) / "run.db", {}) as run:
            keep = system.unknowns[:size]
            roots = stored_monodromy(system, run, keep, whole, seed, count=count, jobs=jobs, progress=progress)
            legs, paths = len(roots.history), sum(leg.carried for leg in roots.history)
            size_of_file = run.path.stat().st_size / 2**20
    return {
        "roots": len(roots),
        "count": count,
        "legs": legs,
        "paths": int(paths),
        "wall": time.perf_counter() - wall,
        "cpu": time.process_time() - cpu,
        "peak": megabytes(),
        "growth": megabytes() - base[0],
        "file": size_of_file,
    }


def main() -> None:
    """Print a line for each size and way."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[7, 8, 9])
    parser.add_argument("--ways", nargs="+", choices=("memory", "file"), default=["memory", "file"])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.child:
        print(json.dumps(measure(given.sizes[0], given.ways[0], given.jobs, given.seed)))
        return
    for size in given.sizes:
        for way in given.ways:
            command = [sys.executable, "-m", "benchmarks.many_roots", "--child", "--sizes", str(size), "--ways", way]
            command += ["--jobs", str(given.jobs), "--seed", str(given.seed)]
            done = subprocess.run(command, check=True, capture_output=True, text=True)
            m = json.loads(done.stdout)
            print(
                f"{way:6s} {m['roots']} of {m['count']} roots, {m['legs']} legs, {m['paths']} paths, "
                f"{m['wall']:.0f} s (processor {m['cpu']:.0f} s), peak {m['peak']:.0f} MB, "
                f"{m['growth']:.0f} MB beyond the program, file {m['file']:.0f} MB",
                flush=True,
            )


if __name__ == "__main__":
    main()
