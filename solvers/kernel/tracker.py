"""The tracker of reference.py with paths in SIMD lanes: every lane has its own path, place and step.

All lanes do the same work at each tick; what a lane makes of it (a Newton step, an accepted step, a rejected
one, the last polish) is decided by masks. A lane whose path has ended takes the next path from the queue.
The comments on the method stand in reference.py; the state machine here is the same, line by line.
"""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from solvers.kernel.interpreter import copy_outputs, interpret, solve_pivoted
from solvers.kernel.lanes import (
    any_lane,
    bits,
    call_tick,
    floor,
    fma,
    load,
    maximum,
    minimum,
    negative,
    outside,
    rough_reciprocal,
    select,
    splat,
    sqrt,
    store,
    two_to_the,
)
from solvers.kernel.layout import (
    ALIVE,
    FIRST,
    H_BEFORE,
    ITERATION,
    LAST,
    OMEGA,
    POLISHING,
    QUALITY,
    R_ACCEPTED,
    REJECTED,
    SCALARS,
    STEPS,
    TICKS,
    H,
    R,
)
from solvers.kernel.reference import (
    ALWAYS_GOOD,
    CORRECTIONS,
    DIVERGED,
    EXACT,
    EXHAUSTED,
    NOISE,
    PAUSED,
    REACHED,
    SHRINKING,
    SMALL,
    STALLED,
    START_TICKS,
)
from solvers.kernel.reference import POLISHING as POLISHING_TICKS

#: How a tick is run: machine code, interpreted program, interpreted F, J, Ft with pivoting in the lanes.
COMPILED, INTERPRETED, PIVOTED = range(3)


class Control(NamedTuple):
    """Numbers that steer a call."""

    start: float
    end: float
    stop: float
    contraction: float
    safety: float
    tolerance: float
    largest: float  # step, absolute
    first: float  # largest first step, absolute
    smallest: float  # step, beside r
    ticks: float
    infinity: float
    radius: float  # h(contraction)
    budget: float  # constant of the step formula


@njit(nogil=True, cache=True)
def track_queue(lanes, width, work, at, n, m, mode, address, code, outputs, pattern, matrix, toric,
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
            _fill(width, work, at, n, m, lane, following, toric, control, x0, base, direction)
            following += 1
            live += 1
        else:
            _fill(width, work, at, n, m, lane, 0, toric, control, x0, base, direction)
            work[(at.lane + ALIVE) * width + lane] = -1.0
    while live > 0:
        _move_parameters(lanes, work, at, m, toric)
        if mode == COMPILED:
            call_tick(address, work)
        else:
            interpret(lanes, work, code)
            if mode == INTERPRETED:
                copy_outputs(lanes, work, outputs, at.dx)
            else:
                solve_pivoted(lanes, work, outputs, pattern, n, matrix, at.dx)
        ended, reached, paused, far, stalled = _step(lanes, work, at, n, control)
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
                _fill(width, work, at, n, m, lane, following, toric, control, x0, base, direction)
                following += 1
            else:
                work[(at.lane + ALIVE) * width + lane] = -1.0
                live -= 1


@njit
def _fill(width, work, at, n, m, lane, path, toric, control, x0, base, direction):
    """Put a path into a lane."""
    largest = 0.0
    for k in range(n):
        largest = max(largest, x0[path, 2 * k] ** 2 + x0[path, 2 * k + 1] ** 2)
    for k in range(2 * n):
        value = x0[path, k]
        work[(at.x + k) * width + lane] = value
        work[(at.trial + k) * width + lane] = value
        work[(at.accepted + k) * width + lane] = value
        work[(at.before + k) * width + lane] = value
        work[(at.tangent + k) * width + lane] = 0.0
        work[(at.tangent_before + k) * width + lane] = 0.0
    for k in range(n):
        size = x0[path, 2 * k] ** 2 + x0[path, 2 * k + 1] ** 2
        work[(at.weight + k) * width + lane] = 1.0 / max(size, 1e-8 * largest, 1e-60)
    row = path if base.shape[0] > 1 else 0
    for k in range(2 * m):
        work[(at.base + k) * width + lane] = base[row, k]
    row = path if direction.shape[0] > 1 else 0
    for k in range(2 * m):
        work[(at.direction + k) * width + lane] = direction[row, k]
        if not toric:
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


@njit
def _move_parameters(lanes, work, at, m, toric):
    """Parameters of each lane at its own r."""
    r = load(lanes, work, at.lane + R)
    if not toric:
        for k in range(2 * m):
            p = fma(r, load(lanes, work, at.direction + k), load(lanes, work, at.base + k))
            store(work, at.p + k, p)
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


@njit
def _step(lanes, work, at, n, control):
    """What every lane makes of a tick; returns masks of the lanes that have ended, and how."""
    zero, one = splat(lanes, 0.0), splat(lanes, 1.0)
    # The Newton step, its size, and how far the prediction was off.
    largest, total, off = zero, zero, zero
    for k in range(n):
        row = 2 * k
        weight = load(lanes, work, at.weight + k)
        dr_, di = load(lanes, work, at.dx + row), load(lanes, work, at.dx + row + 1)
        size = fma(dr_, dr_, di * di) * weight
        largest = maximum(largest, size)
        total = total + size
        xr = load(lanes, work, at.x + row) - dr_
        xi = load(lanes, work, at.x + row + 1) - di
        store(work, at.x + row, xr)
        store(work, at.x + row + 1, xi)
        er = load(lanes, work, at.trial + row) - xr
        ei = load(lanes, work, at.trial + row + 1) - xi
        off = maximum(off, fma(er, er, ei * ei) * weight)
    step = sqrt(largest)
    finite = total < splat(lanes, 1e290)

    lane = at.lane
    alive = load(lanes, work, lane + ALIVE) >= zero
    polish = load(lanes, work, lane + POLISHING)
    polishing = polish > zero
    moving = alive & outside(polishing)
    iteration = load(lanes, work, lane + ITERATION)
    corrected = iteration > zero
    first = load(lanes, work, lane + FIRST)
    last = load(lanes, work, lane + LAST)
    steps = load(lanes, work, lane + STEPS)
    under_way = steps > zero
    omega = load(lanes, work, lane + OMEGA)
    floor_of_omega = splat(lanes, 0.1)
    contraction = splat(lanes, control.contraction)

    fresh = corrected & (iteration <= one) & (first > splat(lanes, NOISE)) & finite
    omega = select(fresh, maximum((step + step) / (first * first), floor_of_omega), omega)
    bad = outside(finite)
    bad = bad | (corrected & (step > contraction * last) & (step > splat(lanes, ALWAYS_GOOD)))
    bad = bad | (outside(corrected) & under_way & (omega * step > splat(lanes, 8.0 * control.radius)))
    tolerance = splat(lanes, control.tolerance)
    settled = corrected & (step < splat(lanes, SMALL)) & (omega * step * step < tolerance + tolerance)
    good = ((step < tolerance) | settled) & outside(bad)
    bad = bad | (outside(good) & (iteration >= splat(lanes, float(CORRECTIONS))))
    good = good & moving
    bad = bad & moving

    quality = load(lanes, work, lane + QUALITY)
    shrunk = polishing & finite & (step < quality)
    finished = (
        outside(finite)
        | (step > splat(lanes, SHRINKING) * quality)
        | (step < splat(lanes, EXACT))
        | (polish >= splat(lanes, float(POLISHING_TICKS)))
    )
    finished = finished & polishing & alive
    quality = select(good | (polishing & finite), step, quality)
    store(work, lane + QUALITY, quality)
    polish = select(polishing, polish + one, polish)
    count = load(lanes, work, lane + TICKS) + one
    store(work, lane + TICKS, count)

    decided = good | bad
    store(work, lane + FIRST, select(corrected, first, step))
    store(work, lane + LAST, select(decided, splat(lanes, 1e300), step))
    store(work, lane + ITERATION, select(decided, zero, iteration + one))
    exhausted = (count >= splat(lanes, control.ticks)) & alive
    if not any_lane(decided | polishing | exhausted):
        store(work, lane + OMEGA, omega)
        return bits(finished), bits(finished), bits(finished), bits(finished), bits(finished)

    # Length of the next step.
    h = load(lanes, work, lane + H)
    h_before = load(lanes, work, lane + H_BEFORE)
    r = load(lanes, work, lane + R)
    r_accepted = load(lanes, work, lane + R_ACCEPTED)
    rejected = load(lanes, work, lane + REJECTED) > zero
    cubic = h_before > zero
    error = maximum(sqrt(off), splat(lanes, 1e-14))
    reach = sqrt(splat(lanes, control.budget) / (maximum(omega, floor_of_omega) * error)) * h
    reach = reach * select(cubic, h + h_before, one)
    hermite = (sqrt(fma(h, h, splat(lanes, 4.0) * reach)) - h) * splat(lanes, 0.5 / control.safety)
    euler = minimum(reach * splat(lanes, 1.0 / control.safety), h + h)
    longer = select(cubic, hermite, euler)
    longer = minimum(longer, select(rejected, h, splat(lanes, 5.0) * h))
    longer = minimum(longer, splat(lanes, control.largest))
    starting = good & outside(under_way)
    if any_lane(starting):
        longer = select(starting, _first_step(lanes, work, at, n, control), longer)
    if any_lane(bad):
        shorter = h * _shrinkage(lanes, step, last, iteration, corrected & finite, control)
    else:
        shorter = h
    h_before = select(good, select(under_way, h, zero), h_before)
    r_accepted = select(good, r, r_accepted)
    h = select(good, longer, select(bad, shorter, h))
    store(work, lane + H_BEFORE, h_before)
    store(work, lane + R_ACCEPTED, r_accepted)
    store(work, lane + OMEGA, select(good, maximum(omega * splat(lanes, 0.5), floor_of_omega), omega))
    steps = select(good, steps + one, steps)
    store(work, lane + STEPS, steps)
    store(work, lane + REJECTED, select(bad, one, select(good, zero, load(lanes, work, lane + REJECTED))))

    # Stop exactly at the stop and at the end.
    end, stop = splat(lanes, control.end), splat(lanes, control.stop)
    nearly = splat(lanes, 0.999)
    left, to_stop = r_accepted - end, r_accepted - stop
    ending = h >= left * nearly
    stopping = outside(ending) & (to_stop > zero) & (h >= to_stop * nearly)
    h = select(ending, left, select(stopping, to_stop, h))
    h = select(decided, h, load(lanes, work, lane + H))
    store(work, lane + H, h)
    place = select(ending, end, select(stopping, stop, r_accepted - h))
    store(work, lane + R, select(decided, place, r))

    # New accepted points, and predictions from them.
    taken = good | shrunk
    cubic = h_before > zero
    span = select(cubic, h_before, zero)
    u = select(cubic, h / select(cubic, h_before, one), zero)
    size = zero
    for k in range(2 * n):
        x = load(lanes, work, at.x + k)
        accepted = load(lanes, work, at.accepted + k)
        slope = load(lanes, work, at.tangent + k)
        before = select(good, accepted, load(lanes, work, at.before + k))
        slope_before = select(good, slope, load(lanes, work, at.tangent_before + k))
        accepted = select(taken, x, accepted)
        slope = select(taken, load(lanes, work, at.dr + k), slope)
        store(work, at.before + k, before)
        store(work, at.tangent_before + k, slope_before)
        store(work, at.accepted + k, accepted)
        store(work, at.tangent + k, slope)
        size = maximum(size, accepted * accepted)
        # Hermite: with two points behind, accepted + u(s + u(c2 + u c3)), slopes by -r over the last step
        s, s_before = slope * span, slope_before * span
        delta = accepted - before
        c3 = negative(s + s_before + delta + delta)
        c2 = c3 - s - delta
        trial = fma(u, fma(u, fma(u, c3, c2), negative(s)), accepted)
        trial = select(cubic, trial, accepted - h * slope)
        x = select(decided, trial, x)
        store(work, at.x + k, x)
        store(work, at.trial + k, select(decided, trial, load(lanes, work, at.trial + k)))
    least = maximum(size * splat(lanes, 1e-8), splat(lanes, 1e-60))
    for k in range(n):
        re = load(lanes, work, at.accepted + 2 * k)
        im = load(lanes, work, at.accepted + 2 * k + 1)
        store(work, at.weight + k, rough_reciprocal(maximum(fma(re, re, im * im), least)))

    # Who has ended, and how.
    arrived = good & (r_accepted <= end)
    store(work, lane + POLISHING, select(arrived, one, polish))
    paused = good & (r_accepted <= stop) & outside(arrived)
    far = good & (size > splat(lanes, control.infinity * control.infinity))
    stalled = bad & (
        (h < splat(lanes, control.smallest) * maximum(r_accepted, negative(r_accepted)))
        | (outside(under_way) & (count > splat(lanes, float(START_TICKS))))
    )
    ended = exhausted | stalled | far | paused | finished
    return bits(ended), bits(finished), bits(paused), bits(far), bits(stalled)


@njit
def _first_step(lanes, work, at, n, control):
    """Move the unknowns by a few per cent at most; the tangent is the one that was just solved for."""
    speed = splat(lanes, 1e-60)
    for k in range(n):
        re, im = load(lanes, work, at.dr + 2 * k), load(lanes, work, at.dr + 2 * k + 1)
        speed = maximum(speed, fma(re, re, im * im) * load(lanes, work, at.weight + k))
    return minimum(splat(lanes, 0.03) / sqrt(speed), splat(lanes, control.first))


@njit
def _shrinkage(lanes, step, last, iteration, measured, control):
    """Factor of a rejected step from the contraction that Newton's method has shown."""
    one, two = splat(lanes, 1.0), splat(lanes, 2.0)
    theta = step / last
    for k in range(1, CORRECTIONS + 1):
        theta = select(iteration > splat(lanes, float(k)), sqrt(theta), theta)
    theta = maximum(minimum(theta, splat(lanes, 1e3)), splat(lanes, 0.5 * control.contraction))
    theta = select(measured, theta, splat(lanes, 1e3))
    twice = theta + theta
    radius = twice * (sqrt(fma(twice, twice, one)) - twice)
    half = control.contraction
    top = (1.0 + 2.0 * half * ((half * half + 1.0) ** 0.5 - half)) ** 0.5 - 1.0
    factor = sqrt(sqrt(splat(lanes, top) / (sqrt(fma(two, radius, one)) - one)))
    factor = select(theta > splat(lanes, 100.0), splat(lanes, 0.25), factor)
    return minimum(maximum(factor, splat(lanes, 0.1)), splat(lanes, 0.8))
