"""The tracker of reference.py with paths in SIMD lanes: every lane has its own path, place and step.

All lanes do the same work at each tick; what a lane makes of it (a Newton step, an accepted step, a rejected
one, the last polish) is decided by masks. A lane whose path has ended takes the next path from the queue.
The comments on the method stand in reference.py; the state machine here is the same, line by line.
"""

from __future__ import annotations

from numba import njit

from solvers.kernel.double_lanes import tick_double_double
from solvers.kernel.interpreter import copy_outputs, interpret, solve_pivoted
from solvers.kernel.lanes import call_tick, floor, fma, load, maximum, minimum, negative, splat, store, two_to_the
from solvers.kernel.layout import ALIVE, LAST, NEAR, OMEGA, QUALITY, R_ACCEPTED, SCALARS, STEPS, TICKS, R
from solvers.kernel.reference import DIVERGED, EXHAUSTED, PAUSED, REACHED, STALLED, TORIC_PART
from solvers.kernel.stepping import decide

#: How a tick is run: machine code, interpreted program, interpreted F, J, Ft with pivoting in the lanes,
#: program interpreted in double-double.
COMPILED, INTERPRETED, PIVOTED, DOUBLE_DOUBLE = range(4)
#: How the parameters move, in the order of reference.KINDS.
LINE, TORIC, ARC = range(3)


@njit(nogil=True, cache=True)
def track_queue(lanes, width, work, at, n, m, mode, address, code, outputs, pattern, matrix, kind, bend,
                control, x0, base, direction, x, r, tangent, status, ticks, steps, quality):  # fmt: skip
    """Track all paths of the queue x0; results go to the last seven arrays, row by row.

    Complex numbers are pairs of doubles: x0, x and tangent have the shape (paths, 2n), base and direction
    (paths or 1, 2m).
    """
    paths = x0.shape[0]
    following = 0
    live = 0
    for lane in range(width):
        if following < paths:
            _fill(width, work, at, n, m, lane, following, kind, control, x0, base, direction)
            following += 1
            live += 1
        else:
            _fill(width, work, at, n, m, lane, 0, kind, control, x0, base, direction)
            work[(at.lane + ALIVE) * width + lane] = -1.0
    while live > 0:
        _move_parameters(lanes, work, at, m, kind, bend)
        if mode == COMPILED:
            call_tick(address, work)
        elif mode == DOUBLE_DOUBLE:
            tick_double_double(lanes, work, at, n, m, code, outputs, matrix, kind)
        else:
            interpret(lanes, work, code)
            if mode == INTERPRETED:
                copy_outputs(lanes, work, outputs, at.dx)
            else:
                solve_pivoted(lanes, work, outputs, pattern, n, matrix, at.dx)
        ended, reached, paused, far, stalled = decide(lanes, work, at, n, control)
        if ended == 0:
            continue
        for lane in range(width):
            if not (ended >> lane) & 1:
                continue
            path = int(work[(at.lane + ALIVE) * width + lane])
            for k in range(2 * n):
                x[path, k] = work[(at.accepted + k) * width + lane]
                tangent[path, k] = work[(at.tangent + k) * width + lane]
            r[path] = work[(at.lane + R_ACCEPTED) * width + lane]
            ticks[path] = int(work[(at.lane + TICKS) * width + lane])
            steps[path] = int(work[(at.lane + STEPS) * width + lane])
            quality[path] = work[(at.lane + QUALITY) * width + lane]
            if (reached >> lane) & 1:
                status[path] = REACHED
            elif (paused >> lane) & 1:
                status[path] = PAUSED
            elif (far >> lane) & 1:
                status[path] = DIVERGED
            elif (stalled >> lane) & 1:
                status[path] = STALLED
            else:
                status[path] = EXHAUSTED
            if following < paths:
                _fill(width, work, at, n, m, lane, following, kind, control, x0, base, direction)
                following += 1
            else:
                work[(at.lane + ALIVE) * width + lane] = -1.0
                live -= 1


@njit
def _fill(width, work, at, n, m, lane, path, kind, control, x0, base, direction):
    """Put a path into a lane."""
    largest = 0.0
    for k in range(n):
        largest = max(largest, x0[path, 2 * k] ** 2 + x0[path, 2 * k + 1] ** 2)
    for k in range(2 * n):
        value = x0[path, k]
        work[(at.x + k) * width + lane] = value
        work[(at.accepted + k) * width + lane] = value
        work[(at.before + k) * width + lane] = value
        work[(at.tangent + k) * width + lane] = 0.0
        work[(at.tangent_before + k) * width + lane] = 0.0
    for k in range(n):
        size = x0[path, 2 * k] ** 2 + x0[path, 2 * k + 1] ** 2
        work[(at.weight + k) * width + lane] = 1.0 / max(size, 1e-8 * min(largest, control.size), 1e-60)
    row = path if base.shape[0] > 1 else 0
    for k in range(2 * m):
        work[(at.base + k) * width + lane] = base[row, k]
    row = path if direction.shape[0] > 1 else 0
    fastest = 1e-300
    for k in range(2 * m):
        fastest = max(fastest, abs(direction[row, k]))
        work[(at.direction + k) * width + lane] = direction[row, k]
        if kind == LINE:
            work[(at.v + k) * width + lane] = direction[row, k]
    first = at.lane * width + lane
    for k in range(SCALARS):
        work[first + k * width] = 0.0
    work[first + R * width] = control.start
    work[first + R_ACCEPTED * width] = control.start
    work[first + OMEGA * width] = 1.0
    work[first + LAST * width] = 1e300
    work[first + QUALITY * width] = 1e300
    work[first + ALIVE * width] = path
    work[first + NEAR * width] = TORIC_PART / fastest if kind == TORIC else 1e300


@njit
def _move_parameters(lanes, work, at, m, kind, bend):
    """Parameters of each lane at its own r."""
    r = load(lanes, work, at.lane + R)
    if kind == LINE:
        for k in range(2 * m):
            p = fma(r, load(lanes, work, at.direction + k), load(lanes, work, at.base + k))
            store(work, at.p + k, p)
        return
    if kind == ARC:
        _move_along_arc(lanes, work, at, m, r, bend)
        return
    for k in range(0, 2 * m, 2):
        rate = load(lanes, work, at.direction + k)
        factor = _exp(lanes, r * rate)
        re = load(lanes, work, at.base + k) * factor
        im = load(lanes, work, at.base + k + 1) * factor
        store(work, at.p + k, re)
        store(work, at.p + k + 1, im)
        store(work, at.v + k, re * rate)
        store(work, at.v + k + 1, im * rate)


@njit
def _move_along_arc(lanes, work, at, m, r, bend):
    """p = base + s·direction with s = r / d, d = r + bend·(1 - r), and its velocity bend/d²·direction."""
    one = splat(lanes, 1.0)
    bend_re, bend_im = splat(lanes, bend[0]), splat(lanes, bend[1])
    rest = one - r
    dr_, di = fma(bend_re, rest, r), bend_im * rest
    size = one / fma(dr_, dr_, di * di)
    inverse_re, inverse_im = dr_ * size, negative(di * size)
    sr, si = r * inverse_re, r * inverse_im
    square_re = inverse_re * inverse_re - inverse_im * inverse_im
    square_im = (inverse_re + inverse_re) * inverse_im
    vr, vi = bend_re * square_re - bend_im * square_im, bend_re * square_im + bend_im * square_re
    for k in range(0, 2 * m, 2):
        re, im = load(lanes, work, at.direction + k), load(lanes, work, at.direction + k + 1)
        store(work, at.p + k, fma(sr, re, load(lanes, work, at.base + k)) - si * im)
        store(work, at.p + k + 1, fma(sr, im, load(lanes, work, at.base + k + 1)) + si * re)
        store(work, at.v + k, vr * re - vi * im)
        store(work, at.v + k + 1, vr * im + vi * re)


@njit
def _exp(lanes, y):
    """exp by y = k·log 2 + z and the Taylor polynomial of degree 13: |z| < 0.35 leaves an error below 1e-17."""
    y = maximum(minimum(y, splat(lanes, 690.0)), splat(lanes, -690.0))
    k = floor(fma(y, splat(lanes, 1.4426950408889634), splat(lanes, 0.5)))
    # log 2 in two parts, the first with trailing zeros, so that the difference is exact
    z = fma(k, splat(lanes, -0.6931471803691238), y)
    z = fma(k, splat(lanes, -1.9082149292705877e-10), z)
    total = splat(lanes, 1.0)
    for j in range(13, 0, -1):
        total = fma(total * splat(lanes, 1.0 / j), z, splat(lanes, 1.0))
    return total * two_to_the(k)
