"""Where everything lies in the workspace of the compiled kernel: rows of one double for each lane.

A complex number takes two rows, real part first. The first rows are the contract with a tick: it reads
unknowns, parameters and velocities and writes dx and dr. The state of the lanes follows, then the slots of the
interpreted program.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Layout(NamedTuple):
    """First rows of the parts of the workspace, for n unknowns and m parameters."""

    x: int  # 2n trial point
    p: int  # 2m parameters
    v: int  # 2m their velocities
    dx: int  # 2n Newton step
    dr: int  # 2n tangent
    accepted: int  # 2n
    tangent: int  # 2n
    before: int  # 2n
    tangent_before: int  # 2n
    weight: int  # n, inverse squares
    base: int  # 2m
    direction: int  # 2m
    lane: int  # scalars of a lane, see below
    slots: int  # of the interpreter


#: Scalars of a lane, one row each, counted from Layout.lane.
R, H, R_ACCEPTED, H_BEFORE, OMEGA, ITERATION, LAST = range(7)
FIRST, REJECTED, TICKS, STEPS, POLISHING, QUALITY, ALIVE, NEAR = range(7, 15)
SCALARS = 15


def layout(unknowns: int, parameters: int) -> Layout:
    """The layout for so many unknowns and parameters.

    >>> layout(2, 1).dx
    8
    """
    n, m = unknowns, parameters
    sizes = [2 * n, 2 * m, 2 * m] + [2 * n] * 6 + [n, 2 * m, 2 * m, SCALARS]
    return Layout(*np.concatenate([[0], np.cumsum(sizes)]).tolist())


def workspace(rows: int, width: int) -> np.ndarray:
    """Zeroed rows on a 64-byte boundary, the size of a cache line and of the widest register."""
    memory = np.zeros(rows * width + 8)
    skip = (-memory.ctypes.data % 64) // 8
    return memory[skip : skip + rows * width]
