"""Programs interpreted in lanes: no code to generate, so tracking starts at once.

Each instruction is decoded once for all lanes of a register, which hides most of the cost of decoding. The
pivoted tick evaluates F, J and Ft in this way and eliminates with partial pivoting in each lane: slower, for
paths that the fixed order of elimination has failed, and for dense systems too long for straight-line code.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from solvers.kernel.lanes import any_lane, fma, load, maximum, negative, select, splat, store
from solvers.tape import ADD, ARITY, FMA, FMS, FNMA, INV, MUL, SQR, SUB, Program

#: Up to so many instructions every value has a row of its own: they all stay in the second-level cache.
SHORT = 3_000


class Bytecode(NamedTuple):
    """A program on rows of the workspace."""

    code: np.ndarray  # (instructions, 5) int32: operation, target row, operand rows
    constants: np.ndarray  # (constants, stride): real and imaginary part, and their trailing parts
    first: int  # row of the first constant
    rows: int  # rows in use, from the start of the workspace
    outputs: np.ndarray  # rows of dx and dr, or of F, J and Ft
    pattern: np.ndarray  # (nonzeros, 2) int32 of J


def bytecode(program: Program, names: tuple[str, ...], first: int, stride: int = 2, leaf: int = 0) -> Bytecode:
    """Give every value a row; in long programs, rows whose value is read no more to later values.

    Parameters
    ----------
    names : tuple of str
        Outputs that are wanted, in this order.
    first : int
        Row where constants and values may begin.
    stride : int
        Rows of a number: 2, or 4 in double-double.
    leaf : int
        Row of the first unknown.
    """
    leaves = program.unknowns + 2 * program.parameters
    count = len(program.constants)
    row = [leaf + stride * k for k in range(leaves)] + [first + stride * k for k in range(count)]
    outputs = [slot for name in names for slot in program.outputs[name].tolist()]
    if len(program.code) <= SHORT:
        return _bytecode_of_short(program, np.array(outputs, np.int64), first, stride, leaf)
    code = program.code.tolist()
    last = dict.fromkeys(outputs, len(code))
    for k in range(len(code) - 1, -1, -1):
        op, *operands = code[k]
        for slot in operands[: ARITY[op]]:
            last.setdefault(slot, k)
    top = first + stride * count
    free: list[int] = []
    written = []
    for k, (op, *operands) in enumerate(code):
        reads = operands[: ARITY[op]]
        rows = [row[slot] for slot in reads] + [0] * (3 - len(reads))
        # An instruction reads all its operands before it writes: it may write onto one of them.
        free += [row[slot] for slot in set(reads) if last[slot] == k and slot >= program.inputs]
        if free:
            target = free.pop()
        else:
            target, top = top, top + stride
        row.append(target)
        written.append((op, target, *rows))
    return Bytecode(
        code=np.array(written, np.int32).reshape(-1, 5),
        constants=_constants(program, stride),
        first=first,
        rows=top,
        outputs=np.array([row[slot] for slot in outputs], np.int32),
        pattern=np.ascontiguousarray(program.pattern),
    )


def _bytecode_of_short(program: Program, outputs: np.ndarray, first: int, stride: int, leaf: int) -> Bytecode:
    leaves, values = program.unknowns + 2 * program.parameters, len(program.constants) + len(program.code)
    row = np.concatenate([leaf + stride * np.arange(leaves), first + stride * np.arange(values)])
    code = np.empty((len(program.code), 5), np.int32)
    code[:, 0] = program.code[:, 0]
    code[:, 1] = row[program.inputs :]
    code[:, 2:] = row[program.code[:, 1:]]
    return Bytecode(
        code=code,
        constants=_constants(program, stride),
        first=first,
        rows=first + stride * values,
        outputs=row[outputs].astype(np.int32),
        pattern=np.ascontiguousarray(program.pattern),
    )


def _constants(program: Program, stride: int) -> np.ndarray:
    if stride == 4:
        return program.constant_halves
    return program.constant_values.view(np.float64).reshape(-1, 2)


@njit
def interpret(lanes, work, code):
    """Run bytecode on all lanes."""
    for k in range(code.shape[0]):
        op, target = code[k, 0], code[k, 1]
        a, b, c = code[k, 2], code[k, 3], code[k, 4]
        ar, ai = load(lanes, work, a), load(lanes, work, a + 1)
        if op >= FMA:
            br, bi = load(lanes, work, b), load(lanes, work, b + 1)
            cr, ci = load(lanes, work, c), load(lanes, work, c + 1)
            if op == FNMA:
                ar, ai = negative(ar), negative(ai)
            elif op == FMS:
                cr, ci = negative(cr), negative(ci)
            re = fma(ar, br, fma(negative(ai), bi, cr))
            im = fma(ar, bi, fma(ai, br, ci))
        elif op == MUL:
            br, bi = load(lanes, work, b), load(lanes, work, b + 1)
            re = fma(ar, br, negative(ai) * bi)
            im = fma(ar, bi, ai * br)
        elif op == ADD:
            re, im = ar + load(lanes, work, b), ai + load(lanes, work, b + 1)
        elif op == SUB:
            re, im = ar - load(lanes, work, b), ai - load(lanes, work, b + 1)
        elif op == SQR:
            re, im = fma(ar, ar, negative(ai) * ai), (ar + ar) * ai
        elif op == INV:
            reciprocal = splat(lanes, 1.0) / fma(ar, ar, ai * ai)
            re, im = ar * reciprocal, negative(ai) * reciprocal
        else:
            re, im = negative(ar), negative(ai)
        store(work, target, re)
        store(work, target + 1, im)


@njit
def copy_outputs(lanes, work, outputs, target):
    """Bring dx and dr to the rows where the tracker looks for them."""
    for k in range(outputs.shape[0]):
        store(work, target + 2 * k, load(lanes, work, outputs[k]))
        store(work, target + 2 * k + 1, load(lanes, work, outputs[k] + 1))


@njit
def solve_pivoted(lanes, work, outputs, pattern, n, matrix, target):
    """Solve J·dx = F and J·dr = -Ft with rows scaled and pivots chosen in each lane for itself.

    `matrix` is the row of n × (n + 2) complex numbers of scratch space, `target` that of dx and dr.
    """
    width = 2 * (n + 2)
    zero = splat(lanes, 0.0)
    for k in range(n * width):
        store(work, matrix + k, zero)
    for k in range(pattern.shape[0]):
        place = matrix + pattern[k, 0] * width + 2 * pattern[k, 1]
        source = outputs[n + k]
        store(work, place, load(lanes, work, source))
        store(work, place + 1, load(lanes, work, source + 1))
    for i in range(n):
        row = matrix + i * width
        largest = splat(lanes, 1e-290)
        for j in range(n):
            re, im = load(lanes, work, row + 2 * j), load(lanes, work, row + 2 * j + 1)
            largest = maximum(largest, maximum(re, negative(re)) + maximum(im, negative(im)))
        scale = splat(lanes, 1.0) / largest
        for j in range(2 * n):
            store(work, row + j, load(lanes, work, row + j) * scale)
        f, ft = outputs[i], outputs[n + pattern.shape[0] + i]
        for part in range(2):
            store(work, row + 2 * n + part, load(lanes, work, f + part) * scale)
            store(work, row + 2 * n + 2 + part, negative(load(lanes, work, ft + part)) * scale)
    for k in range(n):
        pivot = matrix + k * width
        column = 2 * k
        re, im = load(lanes, work, pivot + column), load(lanes, work, pivot + column + 1)
        best = fma(re, re, im * im)
        for i in range(k + 1, n):
            row = matrix + i * width
            re, im = load(lanes, work, row + column), load(lanes, work, row + column + 1)
            size = fma(re, re, im * im)
            swap = size > best
            if any_lane(swap):
                best = maximum(size, best)
                for j in range(column, width):
                    upper, lower = load(lanes, work, pivot + j), load(lanes, work, row + j)
                    store(work, pivot + j, select(swap, lower, upper))
                    store(work, row + j, select(swap, upper, lower))
        re, im = load(lanes, work, pivot + column), load(lanes, work, pivot + column + 1)
        reciprocal = splat(lanes, 1.0) / fma(re, re, im * im)
        re, im = re * reciprocal, negative(im) * reciprocal
        store(work, pivot + column, re)  # the reciprocal stays in place of the pivot
        store(work, pivot + column + 1, im)
        for i in range(k + 1, n):
            row = matrix + i * width
            ar, ai = load(lanes, work, row + column), load(lanes, work, row + column + 1)
            fr = fma(negative(ar), re, ai * im)  # minus the factor
            fi = negative(fma(ar, im, ai * re))
            minus_fi = negative(fi)
            for j in range(column + 2, width, 2):
                ur, ui = load(lanes, work, pivot + j), load(lanes, work, pivot + j + 1)
                store(work, row + j, fma(fr, ur, fma(minus_fi, ui, load(lanes, work, row + j))))
                store(work, row + j + 1, fma(fr, ui, fma(fi, ur, load(lanes, work, row + j + 1))))
    for side in range(2):
        for i in range(n - 1, -1, -1):
            row = matrix + i * width
            sr = load(lanes, work, row + 2 * (n + side))
            si = load(lanes, work, row + 2 * (n + side) + 1)
            for j in range(i + 1, n):
                ar, ai = load(lanes, work, row + 2 * j), load(lanes, work, row + 2 * j + 1)
                found = target + 2 * (side * n + j)
                xr, xi = load(lanes, work, found), load(lanes, work, found + 1)
                sr = fma(negative(ar), xr, fma(ai, xi, sr))
                si = fma(negative(ar), xi, fma(negative(ai), xr, si))
            re, im = load(lanes, work, row + 2 * i), load(lanes, work, row + 2 * i + 1)
            found = target + 2 * (side * n + i)
            store(work, found, fma(sr, re, negative(si) * im))
            store(work, found + 1, fma(sr, im, si * re))
