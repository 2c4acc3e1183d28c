"""How to run each peer: the same system in, its finite points, paths and CPU seconds out.

PHCpack (command phc) and Macaulay2 (command M2) are found on the PATH. bertini2 and pypolsys live best in virtual
environments of their own; the variables BERTINI2_PYTHON and POLSYS_PYTHON name their interpreters.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from solvers.formats import write_phcpack
from solvers.formats.numbers import coefficient
from solvers.supports import terms
from solvers.system import System


@dataclass
class Answer:
    """What a peer returned.

    Attributes
    ----------
    points : list of list of [re, im]
    paths : int or None
    seconds : float
        CPU seconds of the solve; without start-up where the program can tell.
    problem : str
        Why there is no answer.
    """

    points: list[list[complex]] = field(default_factory=list)
    paths: int | None = None
    seconds: float = float("nan")
    problem: str = ""


class NotInstalled(RuntimeError):
    """The peer is not on this computer."""


def _run(command: list[str], timeout: float, **options: Any) -> tuple[subprocess.CompletedProcess[str], float]:
    """Run a child on one core and return it with the CPU seconds it used."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    done = subprocess.run(
        command, timeout=timeout, capture_output=True, text=True, check=False, env=environment, **options
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return done, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _command(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        raise NotInstalled(f"the command {name} is not on the PATH")
    return found


def _interpreter(variable: str, module: str) -> str:
    if variable in os.environ:
        return os.environ[variable]
    if importlib.util.find_spec(module) is not None:
        return sys.executable
    raise NotInstalled(f"set {variable} to a Python that has {module}")


def phcpack(system: System, timeout: float) -> Answer:
    """PHCpack's black box, `phc -b`; its seconds hold the start of the process."""
    command = _command("phc")
    with tempfile.TemporaryDirectory() as folder:
        text = write_phcpack(system)
        Path(folder, "in").write_text(text)
        _, seconds = _run([command, "-b", "in", "out"], timeout, cwd=folder)
        answer, report = Path(folder, "in").read_text(), Path(folder, "out").read_text()
    points = []
    names = [str(name) for name in system.unknowns]
    for block in answer.split("THE SOLUTIONS")[-1].split("the solution for t :")[1:]:
        values = dict(re.findall(r"^ *(\w+) : +(\S+ +\S+)", block.split("==")[0], re.MULTILINE))
        if all(name in values for name in names):
            points.append([complex(*map(float, values[name].split())) for name in names])
    return Answer(points, _root_count(report), seconds)


def _root_count(report: str) -> int | None:
    """PHCpack's number of paths: the stable mixed volume, or the mixed volume, or the total degree."""
    for name in ("stable mixed volume", "mixed volume", "total degree"):
        found = re.search(rf"^{name} +: (\d+)", report, re.MULTILINE)
        if found:
            return int(found[1])
    return None


_MACAULAY2 = """
needsPackage "NumericalAlgebraicGeometry"
R = CC[%(names)s]
F = {%(equations)s}
t = cpuTime()
S = solveSystem F
print("SECONDS " | toString(cpuTime() - t))
scan(S, s -> (print "POINT"; scan(coordinates s, z -> print(
    format(17, realPart z) | " " | format(17, imaginaryPart z)))))
"""


def macaulay2(system: System, timeout: float) -> Answer:
    """Macaulay2's solveSystem (package NumericalAlgebraicGeometry), total degree."""
    command = _command("M2")
    aliases = [f"v{k}" for k in range(len(system.unknowns))]
    script = _MACAULAY2 % {"names": ",".join(aliases), "equations": ",\n".join(_sums(system, aliases, "ii"))}
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "in.m2").write_text(script)
        done, _ = _run([command, "--script", "in.m2"], timeout, cwd=folder)
    seconds = re.search(r"SECONDS (\S+)", done.stdout)
    if seconds is None:
        return Answer(problem=(done.stderr.strip().splitlines() or ["no output"])[-1][:60])
    points = []
    for block in done.stdout.split("POINT")[1:]:
        points.append([complex(*(_float(v) for v in line.split())) for line in block.strip().splitlines()])
    return Answer(points, system.bezout, float(seconds[1]))


def _float(text: str) -> float:
    return float(text.replace("e", "E")) if text[-1] != "." else float(text + "0")


_BERTINI = """
import json, sys, time, bertini
bertini.recording(False)
given = json.load(sys.stdin)
system = bertini.parse.system(given["text"])
begin = time.process_time()
solver = bertini.nag_algorithm.ZeroDimSolver(system, mptype=given["precision"])
solver.solve()
seconds = time.process_time() - begin
points = [[[float(z.real), float(z.imag)] for z in p] for p in solver.finite_solutions()]
json.dump({"points": points, "paths": int(solver.num_paths()), "seconds": seconds}, sys.stdout)
"""


def bertini2(system: System, timeout: float, precision: str = "double") -> Answer:
    """bertini2, total degree; `precision` is "double" or "amp" (adaptive)."""
    python = _interpreter("BERTINI2_PYTHON", "bertini")
    # Two digits each: its parser takes v10 for v1 followed by 0.
    names = [f"v{k:02}" for k in range(len(system.unknowns))]
    functions = [f"f{k:02}" for k in range(system.size[0])]
    text = f"variable_group {', '.join(names)};\nfunction {', '.join(functions)};\n"
    text += "".join(f"{f} = {s};\n" for f, s in zip(functions, _sums(system, names, "I")))
    return _python(python, _BERTINI, {"text": text, "precision": precision}, timeout)


_POLSYS = """
import json, sys, time
import numpy as np, pypolsys
given = json.load(sys.stdin)
counts = np.array([len(row) for row in given["coefficients"]])
coefficients = np.array([complex(*c) for row in given["coefficients"] for c in row])
degrees = np.array([e for row in given["exponents"] for e in row])
n = len(counts)
begin = time.process_time()
pypolsys.polsys.init_poly(n, counts, coefficients, degrees)
pypolsys.polsys.init_partition(*pypolsys.utils.make_h_part(n))
paths = pypolsys.polsys.solve(1e-8, 1e-14, 0.0)
seconds = time.process_time() - begin
roots = np.array(pypolsys.polsys.myroots)
with np.errstate(all="ignore"):
    points = roots[:n].T
points = [[[z.real, z.imag] for z in p] for p in points if np.all(np.isfinite(p))]
json.dump({"points": points, "paths": int(paths), "seconds": seconds}, sys.stdout)
"""


def pypolsys(system: System, timeout: float) -> Answer:
    """pypolsys (POLSYS_PLP), total degree."""
    python = _interpreter("POLSYS_PYTHON", "pypolsys")
    expanded = terms(system)
    given = {
        "coefficients": [[[c.real, c.imag] for c in row.tolist()] for row in expanded.coefficients],
        "exponents": [support.tolist() for support in expanded.supports],
    }
    return _python(python, _POLSYS, given, timeout)


#: What a process has solved before it meets a new system: one from mixed cells, one from the total degree.
OTHERS = ("eco6", "katsura5")

_OURS = """
import json, sys, time
from benchmarks.zoo import ZOO
from solvers import solve
given = json.load(sys.stdin)
system, *fresh = [ZOO[given["name"]].build() for _ in range(4)]
def timed(seed, system=system):
    begin = time.process_time()
    solutions = solve(system, seed=seed, certificates=False)
    return solutions, time.process_time() - begin
_, cold = timed(given["seed"] + 1)
for seed in range(2, 5):
    timed(given["seed"] + seed)
solutions, seconds = timed(given["seed"])
for other in given["others"]:
    timed(given["seed"], ZOO[other].build())
new = sorted(timed(given["seed"] + seed, one)[1] for seed, one in enumerate(fresh))[1]
points = [[[z.real, z.imag] for z in p] for p in solutions.points.tolist()]
times = {"seconds": seconds, "cold": cold, "new": new}
json.dump({"points": points, "paths": solutions.ledger.tracked, **times}, sys.stdout)
"""


def everylinkage(name: str, timeout: float, seed: int = 0) -> tuple[Answer, dict[str, float]]:
    """This solver with its own choice of start: the fifth solve of a system in a fresh process.

    Also the seconds of the first solve of the process, and of the first solve of the same system built anew, the
    median of three, when the process has solved two others: the first solves load the compiled kernel (on a fresh
    installation, compile it), and the first solve of a system chooses its start and writes its programs. Every solve
    has another seed.
    """
    given = json.dumps({"name": name, "seed": seed, "others": OTHERS})
    done, _ = _run([sys.executable, "-c", _OURS], timeout, input=given)
    if done.returncode:
        return Answer(problem=(done.stderr.strip().splitlines() or ["crashed"])[-1][:60]), {}
    found = json.loads(done.stdout)
    points = [[complex(*z) for z in p] for p in found["points"]]
    return Answer(points, found["paths"], found["seconds"]), {"first": found["cold"], "new": found["new"]}


def _python(python: str, script: str, given: Any, timeout: float) -> Answer:
    with tempfile.TemporaryDirectory() as folder:
        done, _ = _run([python, "-c", script], timeout, input=json.dumps(given), cwd=folder)
    try:
        found = json.loads(done.stdout[done.stdout.index("{") :])
    except ValueError:
        return Answer(problem=(done.stderr.strip().splitlines() or ["crashed"])[-1][:60])
    points = [[complex(*z) for z in p] for p in found["points"]]
    return Answer(points, found["paths"], found["seconds"])


def _sums(system: System, names: list[str], unit: str) -> list[str]:
    """The equations as sums of terms."""
    expanded = terms(system)
    rows = []
    for support, row in zip(expanded.supports, expanded.exact):
        parts = []
        for exponents, value in zip(support.tolist(), row):
            powers = [n if e == 1 else f"{n}^{e}" for n, e in zip(names, exponents) if e]
            parts.append("*".join([f"({coefficient(value, unit)})", *powers]))
        rows.append(" + ".join(parts) or "0")
    return rows


PEERS = {
    "phc -b": phcpack,
    "pypolsys": pypolsys,
    "bertini2 double": bertini2,
    "bertini2 amp": lambda system, timeout: bertini2(system, timeout, "amp"),
    "macaulay2": macaulay2,
}
