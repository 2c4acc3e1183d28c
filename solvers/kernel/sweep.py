"""A program run over arrays of points in one compiled loop: plain values, sizes of terms, discs.

`Program.replay` runs any arithmetic, an instruction at a time, at some microseconds each. Where the numbers are
double-precision arrays and the kernel is there already, these loops do the same work in nanoseconds. Slots are
rows, points are columns; the inputs stand in the first rows, as in :class:`solvers.tape.Program`.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from solvers.arithmetic.discs import PRODUCT_ERROR, SQUARE_RANGE, TINY, TINY_SIZE, UP, U
from solvers.tape import ADD, FMA, FMS, FNMA, MUL, NEG, SQR, SUB

SMALLEST_SQUARE, LARGEST_SQUARE = SQUARE_RANGE

#: Points done together, so that what is computed stays in the processor's cache.
BLOCK = 32


@njit(inline="always")
def _inverse(z):
    """1/z by Smith's rule; not a number at zero, where numba's own division would raise."""
    if abs(z.real) >= abs(z.imag):
        ratio = z.imag / z.real
        whole = z.real + z.imag * ratio
        return complex(1 / whole, -ratio / whole)
    ratio = z.real / z.imag
    whole = z.real * ratio + z.imag
    return complex(ratio / whole, -1 / whole)


@njit(nogil=True, error_model="numpy")
def run(code, slots, inputs, width):
    """Run the instructions on the first columns of the slots, in which the inputs stand."""
    for k in range(code.shape[0]):
        op, a, b, c = code[k, 0], slots[code[k, 1]], slots[code[k, 2]], slots[code[k, 3]]
        out = slots[inputs + k]
        if op == FMA:
            for j in range(width):
                out[j] = a[j] * b[j] + c[j]
        elif op == MUL:
            for j in range(width):
                out[j] = a[j] * b[j]
        elif op == ADD:
            for j in range(width):
                out[j] = a[j] + b[j]
        elif op == FNMA:
            for j in range(width):
                out[j] = c[j] - a[j] * b[j]
        elif op == SUB:
            for j in range(width):
                out[j] = a[j] - b[j]
        elif op == FMS:
            for j in range(width):
                out[j] = a[j] * b[j] - c[j]
        elif op == SQR:
            for j in range(width):
                out[j] = a[j] * a[j]
        elif op == NEG:
            for j in range(width):
                out[j] = -a[j]
        else:
            for j in range(width):
                out[j] = _inverse(a[j])


@njit(nogil=True, error_model="numpy")
def run_sizes(code, slots, inputs, width):
    """The same on sizes: every difference made a sum."""
    for k in range(code.shape[0]):
        op, a, b, c = code[k, 0], slots[code[k, 1]], slots[code[k, 2]], slots[code[k, 3]]
        out = slots[inputs + k]
        if op == FMA or op == FMS or op == FNMA:
            for j in range(width):
                out[j] = a[j] * b[j] + c[j]
        elif op == MUL:
            for j in range(width):
                out[j] = a[j] * b[j]
        elif op == ADD or op == SUB:
            for j in range(width):
                out[j] = a[j] + b[j]
        elif op == SQR:
            for j in range(width):
                out[j] = a[j] * a[j]
        elif op == NEG:
            for j in range(width):
                out[j] = a[j]
        else:
            for j in range(width):
                out[j] = 1 / max(a[j], 1e-300)


@njit(nogil=True, cache=True, error_model="numpy")
def values(code, still, points, wanted, result):
    """Outputs of a program at complex points.

    Parameters
    ----------
    code : ndarray, shape (instructions, 4)
    still : ndarray of complex, shape (inputs - unknowns, 1 or n)
        Parameters, velocities and constants: the same for all points, or a column for each.
    points : ndarray of complex, shape (n, unknowns)
    wanted : ndarray of int, shape (outputs,)
    result : ndarray of complex, shape (n, outputs)
        Written.
    """
    n, unknowns = points.shape
    inputs = unknowns + still.shape[0]
    slots = np.empty((inputs + code.shape[0], BLOCK), np.complex128)
    own = still.shape[1] > 1
    if not own:
        for k in range(still.shape[0]):
            slots[unknowns + k, :] = still[k, 0]
    for first in range(0, n, BLOCK):
        width = min(BLOCK, n - first)
        for j in range(width):
            for k in range(unknowns):
                slots[k, j] = points[first + j, k]
            if own:
                for k in range(still.shape[0]):
                    slots[unknowns + k, j] = still[k, first + j]
        run(code, slots, inputs, width)
        for k in range(wanted.shape[0]):
            row = slots[wanted[k]]
            for j in range(width):
                result[first + j, k] = row[j]


@njit(nogil=True, cache=True, error_model="numpy")
def sizes(code, still, points, wanted, result):
    """The same on absolute values, every difference made a sum; all arrays are real. See solvers.local."""
    n, unknowns = points.shape
    inputs = unknowns + still.shape[0]
    slots = np.empty((inputs + code.shape[0], BLOCK))
    for k in range(still.shape[0]):
        slots[unknowns + k, :] = still[k]
    for first in range(0, n, BLOCK):
        width = min(BLOCK, n - first)
        for j in range(width):
            for k in range(unknowns):
                slots[k, j] = points[first + j, k]
        run_sizes(code, slots, inputs, width)
        for k in range(wanted.shape[0]):
            row = slots[wanted[k]]
            for j in range(width):
                result[first + j, k] = row[j]


@njit(inline="always")
def _size(z):
    """As solvers.arithmetic.discs.magnitude."""
    return np.sqrt(z.real * z.real + z.imag * z.imag) * UP + TINY_SIZE


@njit(inline="always")
def _product(a, a_rad, a_size, b, b_rad, b_size):
    return a * b, (a_size * (b_rad + PRODUCT_ERROR * b_size) + a_rad * (b_size + b_rad) + TINY) * UP


@njit(inline="always")
def _sum(total, a_rad, b_rad):
    return (a_rad + b_rad + U * _size(total)) * UP


@njit(inline="always")
def _reciprocal(z, rad):
    square = z.real * z.real + z.imag * z.imag
    below = np.sqrt(square) * (1 - 4 * U)
    room = (below - rad) * (1 - 4 * U)
    if room > 0 and SMALLEST_SQUARE < square < LARGEST_SQUARE:
        return complex(z.real / square, -(z.imag / square)), (rad / (below * room) + 4 * U / below) * UP + TINY
    return 0j, np.inf


@njit(nogil=True, cache=True, error_model="numpy")
def discs(code, still, still_radii, points, radii, wanted, result, result_radii):
    """The same on discs, by the rules of solvers.arithmetic.discs, rounding for rounding."""
    n, unknowns = points.shape
    inputs = unknowns + still.shape[0]
    count = inputs + code.shape[0]
    mid, rad, size = np.empty((count, BLOCK), np.complex128), np.empty((count, BLOCK)), np.empty((count, BLOCK))
    for k in range(still.shape[0]):
        mid[unknowns + k, :] = still[k]
        rad[unknowns + k, :] = still_radii[k]
        size[unknowns + k, :] = _size(still[k])
    for first in range(0, n, BLOCK):
        width = min(BLOCK, n - first)
        for j in range(width):
            for k in range(unknowns):
                mid[k, j] = points[first + j, k]
                rad[k, j] = radii[first + j, k]
                size[k, j] = _size(mid[k, j])
        for k in range(code.shape[0]):
            op, a, b, c, out = code[k, 0], code[k, 1], code[k, 2], code[k, 3], inputs + k
            for j in range(width):
                if op >= FMA:
                    z, r = _product(mid[a, j], rad[a, j], size[a, j], mid[b, j], rad[b, j], size[b, j])
                    if op == FMA:
                        z = z + mid[c, j]
                    elif op == FMS:
                        z = z - mid[c, j]
                    else:
                        z = mid[c, j] - z
                    r = _sum(z, r, rad[c, j])
                elif op == MUL:
                    z, r = _product(mid[a, j], rad[a, j], size[a, j], mid[b, j], rad[b, j], size[b, j])
                elif op == SQR:
                    z, r = _product(mid[a, j], rad[a, j], size[a, j], mid[a, j], rad[a, j], size[a, j])
                elif op == ADD:
                    z = mid[a, j] + mid[b, j]
                    r = _sum(z, rad[a, j], rad[b, j])
                elif op == SUB:
                    z = mid[a, j] - mid[b, j]
                    r = _sum(z, rad[a, j], rad[b, j])
                elif op == NEG:
                    z, r = -mid[a, j], rad[a, j]
                else:
                    z, r = _reciprocal(mid[a, j], rad[a, j])
                mid[out, j], rad[out, j], size[out, j] = z, r, _size(z)
        for k in range(wanted.shape[0]):
            row = wanted[k]
            for j in range(width):
                result[first + j, k] = mid[row, j]
                result_radii[first + j, k] = rad[row, j]
