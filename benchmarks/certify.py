"""How long certificates take, and which arithmetic decides: ``python -m benchmarks.certify``.

Alt's four-bar through nine points (24 equations), at generic complex parameters and at a real task, where reality
is decided too; and Wilkinson's polynomial, which double precision cannot decide.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np
import sympy

from benchmarks.systems import engine_of, fibre, four_bar_seed, four_bar_system, trammel_seed, trammel_system
from solvers.certify import Certificates, certify
from solvers.refine import refine
from solvers.system import System


def report(title: str, system: System, points: np.ndarray, parameters: Any = (), **options: Any) -> Certificates:
    """Certify three times, print the shortest time."""
    seconds = []
    for _ in range(3):
        start = time.perf_counter()
        result = certify(system, points, parameters, **options)
        seconds.append(time.perf_counter() - start)
    print(f"{title:34} {min(seconds):7.3f} s   {result}", flush=True)
    return result


def main() -> None:
    """Print the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--seed", type=int, default=5)
    rng = np.random.default_rng(options.parse_args().seed)

    x = sympy.Symbol("x")
    wilkinson = System([sympy.expand(sympy.prod(x - k for k in range(1, 21)))], [x])
    report("Wilkinson, degree 20", wilkinson, np.arange(1, 21)[:, None])

    trammel = trammel_system()
    known = fibre(trammel, trammel_seed, 560, rng)
    report("trammel, generic", trammel, known.points, known.parameters)

    four_bar = four_bar_system()
    known = fibre(four_bar, four_bar_seed, 8652, rng)
    report("nine points, 1442 generic roots", four_bar, known.points[:1442], known.parameters)
    report("nine points, all generic roots", four_bar, known.points, known.parameters)
    start = time.perf_counter()
    refined = refine(four_bar, known.points[:1442], known.parameters)
    print(f"{'nine points, 1442 refined':34} {time.perf_counter() - start:7.3f} s   {refined}", flush=True)
    start = time.perf_counter()
    refined = refine(four_bar, known.points[:100], known.parameters, digits=50)
    print(f"{'nine points, 100 refined':34} {time.perf_counter() - start:7.3f} s   {refined}", flush=True)

    delta = rng.normal(size=8) + 1j * rng.normal(size=8)
    target = np.concatenate([delta, delta.conj()])
    engine = engine_of(four_bar, known.points[:1], known.parameters)
    end = engine.track(known.points, target, known.parameters - target)
    symbols = {str(symbol): symbol for symbol in four_bar.unknowns}
    pairs = [(symbols[name], symbols[name + "c"]) for name in "xayb"]
    pairs += [(symbols[f"turn{k}"], symbols[f"back{k}"]) for k in range(1, 9)]
    report("nine points, a real task", four_bar, end.x[end.status == 0], target, conjugate_pairs=pairs)


if __name__ == "__main__":
    main()
