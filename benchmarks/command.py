"""How long the whole command takes on the three-pose example: warm, and the very first time.

    python benchmarks/command.py            # warm: five runs of a new process each
    python benchmarks/command.py --cold     # also once with empty caches, as after installing

The goals are 3 s warm and 30 s cold, compilation included.  Exit code 1 when one is missed.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

EXAMPLE = Path(__file__).parents[1] / "examples" / "two_effectors_three_poses.toml"
WARM_GOAL, COLD_GOAL = 3.0, 30.0
RUNS = 5


def seconds(environment: dict[str, str] | None = None) -> float:
    """Wall time of one whole command in a new process."""
    command = [sys.executable, "-m", "mechanisms.cli", "solve", str(EXAMPLE)]
    begin = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=environment)
    return time.perf_counter() - begin


def cold() -> float:
    """The same with every cache in a new, empty place: bytecode, compiled kernels, fonts of Matplotlib."""
    with tempfile.TemporaryDirectory() as empty:
        caches = {
            name: str(Path(empty, name)) for name in ("NUMBA_CACHE_DIR", "PYTHONPYCACHEPREFIX", "MPLCONFIGDIR")
        }
        caches["XDG_CACHE_HOME"] = empty
        return seconds({**os.environ, **caches})


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cold", action="store_true", help="also measure the very first run")
    wanted = parser.parse_args()
    missed = False
    if wanted.cold:
        took = cold()
        missed |= took > COLD_GOAL
        print(f"cold {took:6.2f} s   (goal {COLD_GOAL:g} s)")
    seconds()  # fills the caches
    times = [seconds() for _ in range(RUNS)]
    middle = statistics.median(times)
    missed |= middle > WARM_GOAL
    spread = ", ".join(f"{t:.2f}" for t in sorted(times))
    print(f"warm {middle:6.2f} s   (goal {WARM_GOAL:g} s; median of {spread})")
    return int(missed)


if __name__ == "__main__":
    sys.exit(main())
