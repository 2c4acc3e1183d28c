"""Speed and completeness of the path tracker: ``python benchmarks/kernel.py`` (about a minute).

For the trammel through seven poses (12 unknowns) and the four-bar through nine points (24 unknowns): all roots
at generic parameters from one seed by loops, then many random targets; roots found and missed, ticks and paths
a second of one core, floating-point operations of a tick beside the measured peak of the processor, one thread
against two, AVX-512 against AVX2, cold and warm start. Rates are medians over targets and in processor time, for
other work may share the machine.
"""

from __future__ import annotations

import argparse
import ctypes
import itertools
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import llvmlite.binding as llvm
import numpy as np
from systems import (
    Fibre,
    distinct,
    fibre,
    four_bar_seed,
    four_bar_system,
    gauss,
    trammel_seed,
    trammel_system,
)

from solvers.kernel import codegen
from solvers.kernel.lanes import Lanes, native_lanes
from solvers.kernel.layout import layout, workspace
from solvers.tape import ADD, FMA, FMS, FNMA, INV, MUL, SQR, SUB, Program

#: Real operations of a complex instruction; a fused multiply-add counts as two.
FLOPS = {ADD: 2, SUB: 2, MUL: 6, SQR: 5, INV: 6, FMA: 8, FMS: 8, FNMA: 8}
SYSTEMS = {
    "trammel, seven poses": (trammel_system, trammel_seed, 560, 40),
    "four-bar, nine points": (four_bar_system, four_bar_seed, 8652, 6),
}
NUMBERS = itertools.count()
#: A three-equation system and its first root, as a new user meets the package.
FIRST_ROOT = """
import time; start = time.perf_counter()
import numpy as np
from solvers.kernel.engine import make_engine
from solvers.graph import Builder
b = Builder(3, 1)
x, y, z, p = b.unknown(0), b.unknown(1), b.unknown(2), b.parameter(0)
equations = [b.sub(b.square(x), b.multiply(p, y)), b.sub(b.square(y), z), b.sub(b.square(z), x)]
engine = make_engine(b, equations, (np.ones((1, 3)), np.ones(1)))
engine.prefer = "compiled"
end = engine.track(np.ones((1, 3)), np.array([2 + 1j]), np.array([-1 - 1j]))
assert end.status[0] == 0
print(time.perf_counter() - start, time.process_time())
"""


def machine_code(text: str, name: str):
    """A function of assembly text, called through ctypes with pointers and integers."""
    machine = codegen._target_machine()
    image = machine.emit_object(llvm.parse_assembly(text))
    builder = llvm.JITLibraryBuilder().add_object_img(image).export_symbol(name)
    library = builder.link(codegen._linker(), f"benchmark-{next(NUMBERS)}")
    function = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)(library[name])
    function.library = library
    return function


def peak(width: int, chains: int = 12, turns: int = 100_000) -> float:
    """Gflop/s of independent fused multiply-adds on registers of so many doubles."""
    kind = f"<{width} x double>"
    fma = f"@llvm.fma.v{width}f64"
    lines = [
        f"declare {kind} {fma}({kind}, {kind}, {kind})",
        f"define void @peak{width}(ptr %unused, ptr %w, i64 %n) {{",
        f"entry:\n%a = load {kind}, ptr %w, align 8\nbr label %loop",
        "loop:\n%i = phi i64 [0, %entry], [%j, %loop]",
    ]
    lines += [f"%x{k} = phi {kind} [%a, %entry], [%y{k}, %loop]" for k in range(chains)]
    lines += [f"%y{k} = call {kind} {fma}({kind} %x{k}, {kind} %a, {kind} %x{k})" for k in range(chains)]
    lines += ["%j = add i64 %i, 1\n%c = icmp ult i64 %j, %n\nbr i1 %c, label %loop, label %out\nout:"]
    lines += [f"%s{k} = fadd {kind} {'%y0' if k == 1 else f'%s{k - 1}'}, %y{k}" for k in range(1, chains)]
    lines += [f"store {kind} %s{chains - 1}, ptr %w, align 8\nret void\n}}"]
    function = machine_code("\n".join(lines), f"peak{width}")
    data = np.full(width, 1e-9)
    return 2 * width * chains * turns / least_time(lambda: function(None, data.ctypes.data, turns)) / 1e9


REPEAT = """
define void @repeat(ptr %f, ptr %w, i64 %n) {
entry:
  br label %loop
loop:
  %i = phi i64 [0, %entry], [%j, %loop]
  call void %f(ptr %w)
  %j = add i64 %i, 1
  %c = icmp ult i64 %j, %n
  br i1 %c, label %loop, label %out
out:
  ret void
}"""


def least_time(work, repeats: int = 25) -> float:
    """The shortest of many runs: what the processor can do when nothing disturbs it."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)


def tick_seconds(program: Program, lanes: Lanes, point: np.ndarray, parameters: np.ndarray) -> float:
    """Seconds of one tick (all lanes) in machine code, at a generic point."""
    tick = codegen.Tick(program, lanes)
    work = workspace(layout(program.unknowns, program.parameters).slots, lanes.width)
    inputs = np.concatenate([point, parameters, 0.3 * parameters])
    rows = work.reshape(-1, lanes.width)
    rows[: 2 * len(inputs) : 2], rows[1 : 2 * len(inputs) : 2] = inputs.real[:, None], inputs.imag[:, None]
    repeat = machine_code(REPEAT, "repeat")
    return least_time(lambda: repeat(tick.address, work.ctypes.data, 1000)) / 1000


def flops(program: Program) -> int:
    """Real operations of a tick in one lane."""
    return sum(FLOPS.get(op, 0) for op in program.code[:, 0].tolist())


def measure(name: str, seed: int) -> None:
    """Print the figures of one system."""
    make, seed_of, count, targets = SYSTEMS[name]
    rng = np.random.default_rng(seed)
    start = time.perf_counter()
    found = fibre(make(), seed_of, count, rng)
    seconds = time.perf_counter() - start
    engine, tick = found.engine, found.engine.tick
    sizes = f"{tick.unknowns} unknowns, {tick.parameters} parameters, a tick of {len(tick.code)} instructions"
    print(f"\n{name}: {sizes}")
    print(f"  roots at generic parameters   {len(found.points)} of {count}, ", end="")
    print(f"by {found.loops} loops, {found.paths} paths, {seconds:.1f} s")
    engine.prefer = "compiled"
    goals = [gauss(rng, len(found.parameters)) for _ in range(targets)]
    for arithmetic in ("compiled", "interpreted"):
        engine.prefer = arithmetic
        targets_report(found, goals if arithmetic == "compiled" else goals[: max(targets // 4, 2)])
    engine.prefer = "compiled"
    two_threads(found, goals[0])
    lanes = native_lanes()
    for width in sorted({lanes.width, 4}, reverse=True):
        top = peak(width)
        each = tick_seconds(tick, Lanes(width, lanes.fma), found.points[0], found.parameters)
        rate = flops(tick) * width / each / 1e9
        print(
            f"  a tick, {width} lanes                {each / width * 1e9:.1f} ns a path, {rate:.1f} Gflop/s, "
            f"{rate / top:.0%} of the peak of {top:.0f}"
        )


def targets_report(found: Fibre, goals: list[np.ndarray]) -> None:
    """Track all roots to random targets; count losses, jumps and rates."""
    engine, points, at = found.engine, found.points, found.parameters
    engine.track(points[:8], goals[0], at - goals[0])
    lost = jumps = rescued = 0
    rates, ticks, steps = [], [], []
    for goal in goals:
        start = time.thread_time()
        end = engine.track(points, goal, at - goal)
        rates.append(len(points) / (time.thread_time() - start))
        ticks.append(end.ticks.mean())
        steps.append(end.steps.mean())
        good = end.status == 0
        jumps += int(good.sum()) - len(distinct(end.x[good]))
        if not good.all():
            again = engine.track(points[~good], goal, at - goal, arithmetic="double-double")
            rescued += int((again.status == 0).sum())
            lost += int((~good).sum())
    paths = len(points) * len(goals)
    print(f"  {len(goals):>2} random targets, {engine.used:<11} {np.median(rates):,.0f} paths/s, ", end="")
    print(f"best {max(rates):,.0f}; {np.mean(ticks):.0f} ticks and {np.mean(steps):.0f} steps a path, ", end="")
    print(f"{1e9 / np.median(np.array(rates) * ticks):.0f} ns a tick")
    print(f"      of {paths:,} paths {lost} lost, {rescued} of them found in double-double; {jumps} jumped")


def two_threads(found: Fibre, goal: np.ndarray) -> None:
    """The same paths on one thread and on two."""
    engine, at = found.engine, found.parameters
    points = np.concatenate([found.points] * max(1, 8000 // len(found.points)))
    halves = np.array_split(points, 8)

    def run(threads: int) -> float:
        start = time.perf_counter()
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(lambda part: engine.track(part, goal, at - goal), halves))
        return time.perf_counter() - start

    run(2)
    ratios = [run(1) / run(2) for _ in range(5)]
    print(f"  two threads                   {np.median(ratios):.2f} times one (best {max(ratios):.2f})")


def start_up() -> None:
    """Seconds from a fresh process to the first root, with empty caches and with full ones."""
    with tempfile.TemporaryDirectory() as folder:
        places = {"NUMBA_CACHE_DIR": f"{folder}/numba", "EVERYLINKAGE_CACHE": f"{folder}/code"}
        environment = {**os.environ, **places}

        def once() -> list[float]:
            command = [sys.executable, "-c", FIRST_ROOT]
            done = subprocess.run(command, env=environment, check=True, capture_output=True, text=True)
            return [float(word) for word in done.stdout.split()]

        first = once()
        later = np.median([once() for _ in range(5)], axis=0)
        print(f"\nfirst root in a fresh process, kernel forced: {first[0]:.2f} s the first time ever ", end="")
        print(f"({first[1]:.2f} s of processor time), {later[0]:.2f} s afterwards ({later[1]:.2f} s)")


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--no-avx2", action="store_true", help="skip the second run with AVX2 only")
    options = parser.parse_args()
    cpu = os.environ.get("NUMBA_CPU_NAME", llvm.get_host_cpu_name())
    print(f"{cpu}, {native_lanes()}")
    for name in SYSTEMS:
        measure(name, options.seed)
    if native_lanes().width == 8 and not options.no_avx2:
        print("\nthe same with AVX2 only")
        sys.stdout.flush()
        environment = {**os.environ, "NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2,+fma,+bmi,+bmi2"}
        subprocess.run([sys.executable, Path(__file__), "--no-avx2"], env=environment, check=True)
    if "NUMBA_CPU_NAME" not in os.environ:
        start_up()


if __name__ == "__main__":
    main()
