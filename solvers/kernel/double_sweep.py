"""A program run over arrays of double-double numbers in one compiled loop, as sweep.py does for doubles.

The rules are those of solvers.arithmetic.double_double, rounding for rounding; a complex number is four doubles
(leading real and imaginary part, trailing real and imaginary part).
"""

from __future__ import annotations

import numpy as np
from numba import njit

from solvers.arithmetic.double_double import SPLITTER
from solvers.tape import ADD, FMA, FMS, MUL, NEG, SQR, SUB


@njit(inline="always")
def _two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@njit(inline="always")
def _fast_two_sum(a, b):
    s = a + b
    return s, b - (s - a)


@njit(inline="always")
def _two_product(a, b):
    c = SPLITTER * a
    a_high = c - (c - a)
    a_low = a - a_high
    c = SPLITTER * b
    b_high = c - (c - b)
    b_low = b - b_high
    p = a * b
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


@njit(inline="always")
def _add(a, c, b, d):
    s, e = _two_sum(a, b)
    t, f = _two_sum(c, d)
    s, e = _fast_two_sum(s, e + t)
    return _fast_two_sum(s, e + f)


@njit
def _sum(a, b, sign):
    re, re_low = _add(a[0], a[2], sign * b[0], sign * b[2])
    im, im_low = _add(a[1], a[3], sign * b[1], sign * b[3])
    return re, im, re_low, im_low


@njit
def _product(a, b):
    rr, rr_error = _two_product(a[0], b[0])
    ii, ii_error = _two_product(a[1], b[1])
    ri, ri_error = _two_product(a[0], b[1])
    ir, ir_error = _two_product(a[1], b[0])
    rr_error = rr_error + (a[0] * b[2] + a[2] * b[0])
    ii_error = ii_error + (a[1] * b[3] + a[3] * b[1])
    ri_error = ri_error + (a[0] * b[3] + a[2] * b[1])
    ir_error = ir_error + (a[1] * b[2] + a[3] * b[0])
    re, re_low = _two_sum(rr, -ii)
    im, im_low = _two_sum(ri, ir)
    re, re_low = _fast_two_sum(re, re_low + (rr_error - ii_error))
    im, im_low = _fast_two_sum(im, im_low + (ri_error + ir_error))
    return re, im, re_low, im_low


@njit(error_model="numpy")
def _reciprocal(a):
    if abs(a[0]) >= abs(a[1]):
        ratio = a[1] / a[0]
        whole = a[0] + a[1] * ratio
        re, im = 1 / whole, -ratio / whole
    else:
        ratio = a[0] / a[1]
        whole = a[0] * ratio + a[1]
        re, im = ratio / whole, -1 / whole
    p = _product(a, (re, im, 0.0, 0.0))
    residual = _sum((1.0, 0.0, 0.0, 0.0), p, -1.0)
    dr, di = residual[0] + residual[2], residual[1] + residual[3]
    high_re, low_re = _fast_two_sum(re, re * dr - im * di)
    high_im, low_im = _fast_two_sum(im, re * di + im * dr)
    return high_re, high_im, low_re, low_im


@njit(nogil=True, cache=True, error_model="numpy")
def values(code, still, points, wanted, result):
    """Outputs of a program.

    Parameters
    ----------
    code : ndarray, shape (instructions, 4)
    still : ndarray, shape (1 or n, inputs - unknowns, 4)
        Parameters, velocities and constants: the same for all points, or for each its own.
    points : ndarray, shape (n, unknowns, 4)
    wanted : ndarray of int, shape (outputs,)
    result : ndarray, shape (n, outputs, 4)
        Written.
    """
    n, unknowns = points.shape[0], points.shape[1]
    inputs = unknowns + still.shape[1]
    slots = np.empty((inputs + code.shape[0], 4))
    for row in range(n):
        slots[:unknowns] = points[row]
        if row == 0 or still.shape[0] > 1:
            slots[unknowns:inputs] = still[row]
        for k in range(code.shape[0]):
            op, out = code[k, 0], slots[inputs + k]
            s = slots[code[k, 1]]
            a = (s[0], s[1], s[2], s[3])
            s = slots[code[k, 2]]
            b = (s[0], s[1], s[2], s[3])
            if op >= FMA:
                s = slots[code[k, 3]]
                c = (s[0], s[1], s[2], s[3])
                p = _product(a, b)
                if op == FMA:
                    z = _sum(p, c, 1.0)
                elif op == FMS:
                    z = _sum(p, c, -1.0)
                else:
                    z = _sum(c, p, -1.0)
            elif op == MUL:
                z = _product(a, b)
            elif op == SQR:
                z = _product(a, a)
            elif op == ADD:
                z = _sum(a, b, 1.0)
            elif op == SUB:
                z = _sum(a, b, -1.0)
            elif op == NEG:
                z = (-a[0], -a[1], -a[2], -a[3])
            else:
                z = _reciprocal(a)
            out[0], out[1], out[2], out[3] = z
        for k in range(wanted.shape[0]):
            result[row, k] = slots[wanted[k]]
