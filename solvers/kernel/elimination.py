"""A sparse LU factorisation written onto the tape, its pivots chosen once per system.

One *tick* of the tracker evaluates a system and solves J·dx = F (a Newton step) and J·dr = -Ft (the tangent).
The sparsity of J never changes along a path, so the order of elimination is found once and the whole tick
becomes one straight-line program. A rotation kept as a local unknown makes J block-arrow; picking pivots by
Markowitz' count eliminates such blocks first, without being told about them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from solvers.graph import Builder, Node
from solvers.tape import ARITY, Program

#: A pivot must be at least this large beside its column, in every sample; small enough to leave the sparsest
#: order free, large enough that growth over a dozen eliminations stays far below the eight digits Newton needs.
THRESHOLD = 0.02

Pivot = tuple[int, int]


def pivot_order(pattern: np.ndarray, samples: np.ndarray) -> list[Pivot]:
    """Pivots (row, column) of a sparse elimination without fill in excess of need.

    Parameters
    ----------
    pattern : ndarray, shape (nonzeros, 2)
        Structural nonzeros of the Jacobian.
    samples : ndarray, shape (samples, n, n), complex
        Jacobians at typical points, among them start points; a pivot must be safe in all of them.

    Returns
    -------
    list of (int, int)
        One pivot for each unknown, in order of elimination (Markowitz, *Management Science* 3, 1957).

    Raises
    ------
    numpy.linalg.LinAlgError
        The Jacobian is structurally singular, or there are no samples.
    """
    work = np.array(samples, dtype=np.complex128)
    if not len(work):
        raise np.linalg.LinAlgError("there is no finite Jacobian to choose pivots from")
    size = work.shape[1]
    work /= np.maximum(np.abs(work).max(axis=2, keepdims=True), 1e-300)
    work /= np.maximum(np.abs(work).max(axis=1, keepdims=True), 1e-300)
    filled = np.zeros((size, size), bool)
    filled[pattern[:, 0], pattern[:, 1]] = True
    rows, columns = np.ones(size, bool), np.ones(size, bool)
    order: list[Pivot] = []
    for _ in range(size):
        active = filled & rows[:, None] & columns[None, :]
        magnitude = np.where(active, np.abs(work), 0.0)
        largest = np.maximum(magnitude.max(axis=1, keepdims=True), 1e-300)
        safety = (magnitude / largest).min(axis=0)
        cost = np.outer(active.sum(1) - 1.0, active.sum(0) - 1.0)
        safe = active & (safety >= THRESHOLD)
        if not safe.any():
            safe = active & (safety >= safety[active].max()) if active.any() else active
        if not safe.any():
            raise np.linalg.LinAlgError("the Jacobian is structurally singular")
        score = np.where(safe, cost - 0.5 * safety, np.inf)
        r, c = map(int, np.unravel_index(np.argmin(score), score.shape))
        order.append((r, c))
        rows[r] = columns[c] = False
        below = np.flatnonzero(filled[:, c] & rows)
        right = np.flatnonzero(filled[r] & columns)
        pivot = work[:, r, c]
        pivot = np.where(np.abs(pivot) < 1e-300, 1e-300, pivot)
        for i in below:
            factor = work[:, i, c] / pivot
            work[:, i, right] -= factor[:, None] * work[:, r, right]
            filled[i, right] = True
    return order


def elimination_length(pattern: np.ndarray, order: Sequence[Pivot]) -> int:
    """About how many instructions the elimination takes: multiply-adds on the matrix and two right-hand sides."""
    rows: dict[int, set[int]] = {}
    for i, j in pattern.tolist():
        rows.setdefault(i, set()).add(j)
    length = 0
    for r, c in order:
        pivot_row = rows.pop(r)
        for entries in rows.values():
            if c in entries:
                entries |= pivot_row
                entries.discard(c)
                length += len(pivot_row) + 2
        length += 2 * len(pivot_row)
    return length


def tick_program(
    builder: Builder,
    equations: Sequence[Node],
    order: Sequence[Pivot],
    moving: Sequence[int] | None = None,
) -> Program:
    """The whole tick as one program.

    Outputs
    -------
    dx : Newton step, J·dx = F, so that x - dx is the corrected point
    dr : tangent, J·dr = -Ft, the motion of the point as the parameters move with their velocities
    """
    size = len(order)
    matrix: list[dict[int, Node]] = [dict(builder.gradient(node)) for node in equations]
    moved = builder.derivative_along_velocity(equations, moving)
    right = [[node, builder.negate(dot)] for node, dot in zip(equations, moved)]
    inverse: list[Node] = []
    left_rows = set(range(size))
    for r, c in order:
        left_rows.discard(r)
        pivot_row = matrix[r]
        inverse.append(builder.invert(pivot_row[c]))
        for i in sorted(left_rows):
            entry = matrix[i].pop(c, None)
            if entry is None:
                continue
            factor = builder.multiply(entry, inverse[-1])
            for j, value in pivot_row.items():
                if j != c:
                    old = matrix[i].get(j, builder.zero)
                    matrix[i][j] = builder.sub(old, builder.multiply(factor, value))
            for k in (0, 1):
                right[i][k] = builder.sub(right[i][k], builder.multiply(factor, right[r][k]))
    solution: list[list[Node]] = [[builder.zero, builder.zero] for _ in range(size)]
    for (r, c), reciprocal in zip(reversed(order), reversed(inverse)):
        for k in (0, 1):
            total = right[r][k]
            for j, value in matrix[r].items():
                if j != c:
                    total = builder.sub(total, builder.multiply(value, solution[j][k]))
            solution[c][k] = builder.multiply(total, reciprocal)
    return depth_first(builder.finish({"dx": [s[0] for s in solution], "dr": [s[1] for s in solution]}))


def depth_first(program: Program) -> Program:
    """The same program with every value computed just before its first use, as the outputs ask for them.

    A value then waits for a short time only: fewer registers are spilled, and a tick of Alt's 24 equations runs
    a third faster than in the order in which its instructions were written.
    """
    code, first = program.code.tolist(), program.inputs
    place: dict[int, int] = {k: k for k in range(first)}
    order: list[int] = []
    for root in [slot for slots in program.outputs.values() for slot in slots.tolist()]:
        stack = [root]
        while stack:
            slot = stack[-1]
            if slot in place:
                stack.pop()
                continue
            op, *operands = code[slot - first]
            waiting = [operand for operand in operands[: ARITY[op]] if operand not in place]
            if waiting:
                stack += reversed(waiting)
                continue
            place[slot] = first + len(order)
            order.append(slot - first)
            stack.pop()
    rows = []
    for k in order:
        op, *operands = code[k]
        used = [place[operand] for operand in operands[: ARITY[op]]]
        rows.append((op, *used, *[0] * (3 - len(used))))
    return replace(
        program,
        code=np.array(rows, np.int32).reshape(-1, 4),
        outputs={
            name: np.array([place[slot] for slot in slots.tolist()], np.int32)
            for name, slots in program.outputs.items()
        },
    )
