"""The same systems through this solver and through every peer that is installed, each root checked by a judge.

    python -m benchmarks.peers [SYSTEM …] [--peers 'phc -b' macaulay2 …] [--timeout 120] [--json FILE]

Printed for each system and program: distinct true roots, missed (of the known number), duplicates, paths, CPU
seconds on one core, true roots per CPU second, and how many times as many this solver finds per second. One run,
no tuning: read ratios under three as undecided. A program that misses roots is marked with !. Of this solver the
fifth solve is compared; beside it stand the first one of the process, and that of a system it has not seen when it has
solved others, with the ratio for that one.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.check_roots import Judge
from benchmarks.peer_programs import PEERS, Answer, NotInstalled, everylinkage
from benchmarks.zoo import ZOO

#: The systems of the published comparison.
PAGE = (
    *("watt2", "burmester", "quartics", "noon4", "noon5", "cyclic5", "cyclic6", "cyclic7"),
    *("katsura6", "katsura8", "katsura10", "eco8", "chandra6", "chandra8", "ipp", "ipp2", "fourbar5", "stewart"),
)
OURS = "everylinkage"


def compare(name: str, peers: list[str], timeout: float) -> list[dict[str, Any]]:
    """One row for each program."""
    benchmark = ZOO[name]
    system = benchmark.build()
    judge = Judge(system)
    rows = []
    for peer in [OURS, *peers]:
        others: dict[str, float] = {}
        try:
            if peer == OURS:
                answer, others = everylinkage(name, timeout)
            else:
                answer = PEERS[peer](system, timeout)
        except subprocess.TimeoutExpired:
            answer = Answer(problem=f"unfinished in {timeout:.0f} s")
        except NotInstalled:
            continue
        row: dict[str, Any] = {"system": name, "program": peer, "problem": answer.problem}
        if not answer.problem:
            verdict = judge(answer.points)
            row |= {
                "roots": verdict.distinct,
                "missed": benchmark.isolated - verdict.distinct,
                "duplicates": verdict.duplicates,
                "returned": verdict.returned,
                "paths": answer.paths,
                "seconds": answer.seconds,
                "rate": verdict.distinct / max(answer.seconds, 1e-6),
                **others,
            }
        rows.append(row)
    ours = rows[0].get("rate")
    for row in rows:
        row["ratio"] = ours / row["rate"] if ours and row.get("rate") else None
        row["ratio new"] = row["ratio"] * rows[0]["seconds"] / rows[0]["new"] if row["ratio"] else None
    return rows


def show(row: dict[str, Any]) -> str:
    """One line of the table."""
    head = f"{row['system']:10} {row['program']:16}"
    if row["problem"]:
        return f"{head} {row['problem']}"
    mark = "!" if row["missed"] else " "
    ratio = " " * 8
    if row["ratio"] and row["program"] != OURS:
        ratio = f"{row['ratio']:8.1f} ({row['ratio new']:.1f})"
    first = f"   (first {row['first']:.2f} s, as a new system {row['new']:.3f} s)" if "first" in row else ""
    return (
        f"{head} {row['roots']:6}{mark} {row['missed']:6} {row['duplicates']:6} {row['paths'] or '':>7} "
        f"{row['seconds']:9.3f} {row['rate']:10.0f} {ratio}{first}"
    )


def main(arguments: list[str] | None = None) -> int:
    """Run the comparison and print it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peers", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=f"of {', '.join(ZOO)}; default: the page")
    parser.add_argument("--peers", nargs="*", choices=list(PEERS), default=list(PEERS))
    parser.add_argument("--timeout", type=float, default=120.0, help="seconds for one program on one system")
    parser.add_argument("--json", metavar="FILE", help="write the rows to a file as well")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.systems if name not in ZOO]
    if unknown:
        parser.error(f"there is no system {unknown[0]}; there are {', '.join(ZOO)}")
    columns = f"{'roots':>6}  {'missed':>6} {'twice':>6} {'paths':>7} {'CPU s':>9} {'roots/s':>10} {'ratio':>8}"
    print(f"{'system':10} {'program':16} {columns}")
    rows = []
    for name in options.systems or PAGE:
        for row in compare(name, options.peers, options.timeout):
            print(show(row), flush=True)
            rows.append(row)
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
