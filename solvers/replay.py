"""A program at many points in double precision: compiled loops where the kernel is loaded, NumPy where it is not.

Both give the same numbers but for the last bits. Loading the kernel costs more than a small system does, so
nothing here loads it.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from typing import Any

import numpy as np

from solvers.tape import ADD, INV, MUL, NEG, SQR, SUB, Program


def values(program: Program, points: np.ndarray, parameters: np.ndarray, names: Sequence[str] = ("F",)) -> np.ndarray:
    """Named outputs side by side, shape (n, length of the outputs).

    Parameters
    ----------
    program : Program
    points : ndarray of complex, shape (n, unknowns)
    parameters : ndarray of complex, shape (parameters,), or (n, parameters) for others at each point

    Examples
    --------
    >>> from solvers.graph import Builder
    >>> b = Builder(1, 1)
    >>> program = b.finish({"F": [b.sub(b.square(b.unknown(0)), b.parameter(0))]})
    >>> values(program, np.array([[3.0], [4.0]]), np.array([9.0])).tolist()
    [[0j], [(7+0j)]]
    """
    wanted = np.concatenate([program.outputs[name] for name in names])
    result = np.empty((len(points), len(wanted)), np.complex128)
    loops = compiled_loops()
    if loops is None:
        out = program.replay(list(points.T), list(np.asarray(parameters).T))
        for k, column in enumerate(value for name in names for value in out[name]):
            result[:, k] = column
        return result
    given = np.atleast_2d(np.asarray(parameters, np.complex128)).T
    fixed = program.constant_values[:, None]
    fixed = np.broadcast_to(fixed, (len(fixed), given.shape[1]))
    still = np.concatenate([given, np.zeros_like(given), fixed])
    loops.values(program.code, still, np.ascontiguousarray(points, np.complex128), wanted, result)
    return result


def sizes(program: Program, points: np.ndarray, parameters: np.ndarray) -> np.ndarray:
    """Output F on absolute values, every difference made a sum, shape (n, equations).

    Parameters
    ----------
    points : ndarray of float, shape (n, unknowns)
        Sizes of the unknowns.
    parameters : ndarray of float, shape (parameters,)
    """
    wanted = program.outputs["F"]
    loops = compiled_loops()
    if loops is not None:
        result = np.empty((len(points), len(wanted)))
        still = np.concatenate([parameters, np.zeros(len(parameters)), np.abs(program.constant_values)])
        loops.sizes(program.code, still, np.ascontiguousarray(points), wanted, result)
        return result
    slots = [*points.T, *parameters, *[0.0] * len(parameters), *np.abs(program.constant_values)]
    for op, a, b, c in program.code.tolist():
        if op in (ADD, SUB):
            slots.append(slots[a] + slots[b])
        elif op == NEG:
            slots.append(slots[a])
        elif op == INV:
            slots.append(1 / np.maximum(slots[a], 1e-300))
        elif op in (MUL, SQR):
            slots.append(slots[a] * slots[a if op == SQR else b])
        else:
            slots.append(slots[a] * slots[b] + slots[c])
    return np.array([np.broadcast_to(slots[k], len(points)) for k in wanted.tolist()]).T


def compiled_loops(name: str = "sweep") -> Any:
    """The compiled loops for doubles and discs, or those for double-doubles, if the kernel is there."""
    from solvers.kernel.compiled import kernel_is_loaded

    if not kernel_is_loaded():
        return None
    return import_module(f"solvers.kernel.{name}")
