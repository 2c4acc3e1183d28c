"""Tick programs interpreted in lanes with double-double numbers: some thirty digits, for the last rungs.

A complex number takes four rows: leading parts, then trailing parts. The iterate itself is carried in
double-double from one Newton step to the next, so that cancellation in the equations no longer limits it; step
control stays in double precision. Sums and products are those of Joldes, Muller and Popescu (ACM TOMS 44, 2017).
"""

from __future__ import annotations

from numba import njit

from solvers.kernel.lanes import fma, load, negative, product_error, select, splat, store
from solvers.tape import ADD, FMA, FMS, FNMA, INV, MUL, NEG, SQR, SUB


@njit
def _add(a, a_low, b, b_low):
    """a + b, accurate even where the sum cancels."""
    s = a + b
    t = s - a
    e = (a - (s - t)) + (b - t)
    u = a_low + b_low
    t = u - a_low
    f = (a_low - (u - t)) + (b_low - t)
    e = e + u
    t = s + e
    e = (e - (t - s)) + f
    s = t + e
    return s, e - (s - t)


@njit
def _multiply(a, a_low, b, b_low):
    """a · b."""
    p = a * b
    e = product_error(a, b, p) + fma(a, b_low, a_low * b)
    s = p + e
    return s, e - (s - p)


@njit
def _complex_product(a, b):
    """Product of two numbers given as (re, im, re_low, im_low)."""
    x, x_low = _multiply(a[0], a[2], b[0], b[2])
    y, y_low = _multiply(a[1], a[3], b[1], b[3])
    re, re_low = _add(x, x_low, negative(y), negative(y_low))
    x, x_low = _multiply(a[0], a[2], b[1], b[3])
    y, y_low = _multiply(a[1], a[3], b[0], b[2])
    im, im_low = _add(x, x_low, y, y_low)
    return re, im, re_low, im_low


@njit
def _complex_sum(a, b):
    re, re_low = _add(a[0], a[2], b[0], b[2])
    im, im_low = _add(a[1], a[3], b[1], b[3])
    return re, im, re_low, im_low


@njit
def _minus(a):
    return negative(a[0]), negative(a[1]), negative(a[2]), negative(a[3])


@njit
def _inverse(lanes, a):
    """1/a: a double-precision reciprocal and one Newton step with the residual in double-double."""
    zero, one = splat(lanes, 0.0), splat(lanes, 1.0)
    reciprocal = one / fma(a[0], a[0], a[1] * a[1])
    guess = (a[0] * reciprocal, negative(a[1]) * reciprocal, zero, zero)
    rest = _complex_sum((one, zero, zero, zero), _minus(_complex_product(a, guess)))
    return _complex_sum(guess, _complex_product(guess, rest))


@njit
def _read(lanes, work, row):
    return (
        load(lanes, work, row),
        load(lanes, work, row + 1),
        load(lanes, work, row + 2),
        load(lanes, work, row + 3),
    )


@njit
def _write(work, row, a):
    store(work, row, a[0])
    store(work, row + 1, a[1])
    store(work, row + 2, a[2])
    store(work, row + 3, a[3])


@njit
def interpret_double_double(lanes, work, code):
    """Run bytecode of stride four on all lanes."""
    for k in range(code.shape[0]):
        op, target = code[k, 0], code[k, 1]
        a = _read(lanes, work, code[k, 2])
        if op == INV:
            result = _inverse(lanes, a)
        elif op == NEG:
            result = _minus(a)
        else:
            if op == SQR:
                b = a
            else:
                b = _read(lanes, work, code[k, 3])
            if op == ADD or op == SUB:
                if op == SUB:
                    b = _minus(b)
            else:
                if op == FNMA:
                    a = _minus(a)
                a = _complex_product(a, b)
                if op >= FMA:
                    b = _read(lanes, work, code[k, 4])
                    if op == FMS:
                        b = _minus(b)
            result = a
            if op != MUL and op != SQR:
                result = _complex_sum(a, b)
        _write(work, target, result)


@njit
def tick_double_double(lanes, work, at, n, m, code, outputs, extra, kind):
    """One tick in double-double on the state that the tracker keeps in double precision.

    From row `extra` on lie: 2n rows of the point of the last tick, 2n rows of its trailing parts, then the
    inputs of the program. A point that is no longer the one of the last tick has been predicted afresh: its
    trailing part is zero.
    """
    zero = splat(lanes, 0.0)
    low, inputs = extra + 2 * n, extra + 4 * n
    for k in range(2 * n):
        x = load(lanes, work, at.x + k)
        seen = load(lanes, work, extra + k)
        same = (x <= seen) & (x >= seen)
        rest = select(same, load(lanes, work, low + k), zero)
        store(work, low + k, rest)
        row = inputs + 4 * (k // 2) + k % 2
        store(work, row, x)
        store(work, row + 2, rest)
    r = load(lanes, work, at.lane)
    for k in range(2 * m):
        row = inputs + 4 * (n + k // 2) + k % 2
        p = load(lanes, work, at.p + k)
        rest = zero
        if kind == 0:  # a line: the product is known exactly
            step, base = load(lanes, work, at.direction + k), load(lanes, work, at.base + k)
            product = r * step
            p, rest = _add(base, zero, product, product_error(r, step, product))
        store(work, row, p)
        store(work, row + 2, rest)
        row += 4 * m
        store(work, row, load(lanes, work, at.v + k))
        store(work, row + 2, zero)
    interpret_double_double(lanes, work, code)
    for k in range(2 * n):
        row = outputs[k // 2] + k % 2
        x, rest = load(lanes, work, at.x + k), load(lanes, work, low + k)
        new, rest = _add(x, rest, negative(load(lanes, work, row)), negative(load(lanes, work, row + 2)))
        store(work, extra + k, new)
        store(work, low + k, rest)
        # The tracker subtracts dx in double precision; what it finds is the leading part of the new point.
        store(work, at.dx + k, x - new)
        store(work, at.dr + k, load(lanes, work, outputs[n + k // 2] + k % 2))
