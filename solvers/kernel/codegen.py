"""A tick program as straight-line machine code: one vector instruction works on one number of several paths.

Real and imaginary parts live in separate registers. The code has no loop, no branch and no index: LLVM only
has to place registers and order instructions, which takes a tenth of a millisecond for each of the program's
instructions. Finished code is kept in the user's cache directory, under a hash of everything it depends on.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from solvers.kernel.lanes import Lanes
from solvers.kernel.sources import cache_directory
from solvers.tape import ADD, FMS, FNMA, INV, MUL, NEG, SQR, SUB, Program

#: Changes whenever the code written for the same program changes.
VERSION = 2
#: Object files kept in the cache; the oldest are removed beyond.
KEPT = 300

#: A number as the names of two registers; None is an exact zero.
Pair = tuple[str | None, str | None]


class Tick:
    """Machine code of a tick; `address` is that of ``void tick(double *work)``."""

    def __init__(self, program: Program, lanes: Lanes) -> None:
        path = cache_directory() / f"{_key(program, lanes)}.o"
        image = _kept(path)
        self.cached = image is not None
        if image is None:
            image = object_code(program, lanes)
            _keep(path, image)
        # The library owns the code: it must live as long as the address is used.
        self._library = llvm.JITLibraryBuilder().add_object_img(image).export_symbol("tick")
        self._library = self._library.link(_linker(), f"tick-{next(_NUMBERS)}")
        self.address = int(self._library["tick"])


def is_cached(program: Program, lanes: Lanes) -> bool:
    """Whether the code of this program can be loaded instead of compiled."""
    return (cache_directory() / f"{_key(program, lanes)}.o").exists()


def object_code(program: Program, lanes: Lanes) -> bytes:
    """Compile a tick program for this processor."""
    machine = _target_machine()
    module = llvm.parse_assembly(assembly(program, lanes))
    module.triple = machine.triple
    module.data_layout = str(machine.target_data)
    return machine.emit_object(module)


def assembly(program: Program, lanes: Lanes) -> str:
    """LLVM assembly of ``void tick(double *work)``; the rows of `work` are laid out as in tracker.py.

    Reads the rows of unknowns, parameters and velocities; writes the rows of dx and dr behind them.
    """
    return "\n".join(_Writer(program, lanes).lines())


class _Writer:
    def __init__(self, program: Program, lanes: Lanes) -> None:
        self.program, self.lanes = program, lanes
        self.type = f"<{lanes.width} x double>"
        self.text: list[str] = []
        self.names = 0
        # LLVM before 16 wants to be told what a pointer points to.
        self.typed = llvm.llvm_version_info[0] < 16
        self.double_pointer = "double*" if self.typed else "ptr"

    def lines(self) -> Iterator[str]:
        program, kind = self.program, self.type
        if self.lanes.fma:
            yield f"declare {kind} @llvm.fma.v{self.lanes.width}f64({kind}, {kind}, {kind})"
        yield f"define void @tick({self.double_pointer} noalias %work) nounwind {{"
        leaves = program.unknowns + 2 * program.parameters
        slots: list[Pair | None] = [None] * leaves
        slots += [(self.constant(z.real), self.constant(z.imag)) for z in program.constant_values.tolist()]

        def read(slot: int) -> Pair:
            value = slots[slot]
            if value is None:
                value = slots[slot] = (self.load(2 * slot), self.load(2 * slot + 1))
            return value

        for op, a, b, c in program.code.tolist():
            if op in (ADD, SUB):
                result = self.sum(read(a), read(b), op == SUB)
            elif op == NEG:
                re, im = read(a)
                result = (self.negative(re), self.negative(im))
            elif op == INV:
                result = self.inverse(read(a))
            elif op == SQR:
                result = self.square(read(a))
            elif op == MUL:
                result = self.product(read(a), read(b), (None, None), 1)
            else:
                x, y, z = read(a), read(b), read(c)
                if op == FMS:
                    z = (self.negative(z[0]), self.negative(z[1]))
                result = self.product(x, y, z, -1 if op == FNMA else 1)
            slots.append(result)
        row = 2 * leaves
        for name in ("dx", "dr"):
            for slot in program.outputs[name].tolist():
                for part in read(slot):
                    self.store(row, part)
                    row += 1
        yield from self.text
        yield "ret void"
        yield "}"

    # -- single instructions ------------------------------------------------------------------------------
    def emit(self, instruction: str) -> str:
        self.names += 1
        name = f"%v{self.names}"
        self.text.append(f"{name} = {instruction}")
        return name

    def constant(self, value: float) -> str | None:
        if value == 0:
            return None
        (bits,) = struct.unpack("<Q", struct.pack("<d", value))
        return "<" + ", ".join([f"double 0x{bits:016X}"] * self.lanes.width) + ">"

    def pointer(self, row: int) -> str:
        """Type and name of a pointer to a row."""
        first = self.emit(f"getelementptr double, {self.double_pointer} %work, i64 {row * self.lanes.width}")
        if not self.typed:
            return f"ptr {first}"
        return f"{self.type}* " + self.emit(f"bitcast double* {first} to {self.type}*")

    def load(self, row: int) -> str:
        where = self.pointer(row)
        return self.emit(f"load {self.type}, {where}, align 8")

    def store(self, row: int, value: str | None) -> None:
        where = self.pointer(row)
        self.text.append(f"store {self.type} {value or 'zeroinitializer'}, {where}, align 8")

    def negative(self, a: str | None) -> str | None:
        return a and self.emit(f"fneg {self.type} {a}")

    def times(self, a: str | None, b: str | None) -> str | None:
        return a and b and self.emit(f"fmul {self.type} {a}, {b}")

    def plus(self, a: str | None, b: str | None, minus: bool = False) -> str | None:
        if b is None:
            return a
        if a is None:
            return self.negative(b) if minus else b
        return self.emit(f"{'fsub' if minus else 'fadd'} {self.type} {a}, {b}")

    def multiply_add(self, a: str | None, b: str | None, c: str | None) -> str | None:
        if a is None or b is None:
            return c
        if c is None:
            return self.times(a, b)
        if not self.lanes.fma:
            return self.plus(self.times(a, b), c)
        kind = self.type
        return self.emit(f"call {kind} @llvm.fma.v{self.lanes.width}f64({kind} {a}, {kind} {b}, {kind} {c})")

    # -- complex numbers ----------------------------------------------------------------------------------
    def sum(self, x: Pair, y: Pair, minus: bool) -> Pair:
        return self.plus(x[0], y[0], minus), self.plus(x[1], y[1], minus)

    def product(self, x: Pair, y: Pair, z: Pair, sign: int) -> Pair:
        """sign·x·y + z; negations vanish into the fused instructions."""
        (a, b), (c, d) = x, y
        minus_a, minus_b = self.negative(a), self.negative(b)
        if sign < 0:
            a, b, minus_b = minus_a, minus_b, b
        re = self.multiply_add(a, c, self.multiply_add(minus_b, d, z[0]))
        im = self.multiply_add(a, d, self.multiply_add(b, c, z[1]))
        return re, im

    def square(self, x: Pair) -> Pair:
        a, b = x
        re = self.multiply_add(a, a, self.times(self.negative(b), b))
        im = self.times(self.plus(a, a), b)
        return re, im

    def inverse(self, x: Pair) -> Pair:
        a, b = x
        norm = self.multiply_add(a, a, self.times(b, b))
        one = self.constant(1.0)
        reciprocal = self.emit(f"fdiv {self.type} {one}, {norm or 'zeroinitializer'}")
        return self.times(a, reciprocal), self.times(self.negative(b), reciprocal)


_STATE: dict[str, Any] = {}
_NUMBERS = itertools.count()


def _target_machine() -> Any:
    if "machine" not in _STATE:
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
        given = os.environ.get("NUMBA_CPU_NAME")
        if given:
            features = os.environ.get("NUMBA_CPU_FEATURES", "")
        else:
            given, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()
        target = llvm.Target.from_default_triple()
        _STATE["cpu"] = f"{target.triple} {given} {features}"
        _STATE["machine"] = target.create_target_machine(
            cpu=given, features=features, opt=2, reloc="pic", codemodel="default", jit=True
        )
    return _STATE["machine"]


def _linker() -> Any:
    if "linker" not in _STATE:
        _STATE["linker"] = llvm.create_lljit_compiler(_target_machine())
    return _STATE["linker"]


def _key(program: Program, lanes: Lanes) -> str:
    _target_machine()
    digest = hashlib.sha256()
    digest.update(f"{VERSION} {llvmlite.__version__} {_STATE['cpu']} {lanes}".encode())
    digest.update(f"{program.unknowns} {program.parameters} {program.constants}".encode())
    digest.update(program.code.tobytes())
    for name in ("dx", "dr"):
        digest.update(program.outputs[name].tobytes())
    return digest.hexdigest()[:40]


def _kept(path: Path) -> bytes | None:
    """Code from the cache, if it is there and whole: its digest stands before it."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, image = content[:32], content[32:]
    return image if hashlib.sha256(image).digest() == digest else None


def _keep(path: Path, image: bytes) -> None:
    """Write to the cache; a directory that cannot be written to costs only time."""
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(hashlib.sha256(image).digest() + image)
        os.replace(file.name, path)
        files = sorted(path.parent.glob("*.o"), key=lambda p: p.stat().st_mtime)
        for old in files[:-KEPT]:
            old.unlink()
