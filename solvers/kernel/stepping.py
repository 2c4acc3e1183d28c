"""Step control in lanes: what each lane makes of a tick. See reference.py, which says the same in NumPy."""

from __future__ import annotations

from typing import NamedTuple

from numba import njit

from solvers.kernel.lanes import (
    any_lane,
    bits,
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
)
from solvers.kernel.layout import (
    ALIVE,
    FIRST,
    H_BEFORE,
    ITERATION,
    LAST,
    NEAR,
    OMEGA,
    POLISHING,
    QUALITY,
    R_ACCEPTED,
    REJECTED,
    STEPS,
    TICKS,
    H,
    R,
)
from solvers.kernel.reference import (
    ABOVE_NOISE,
    CORRECTIONS,
    EXACT,
    HARMLESS,
    SHRINKING,
    SMALL,
    START_TICKS,
    TORIC_PART,
)
from solvers.kernel.reference import POLISHING as POLISHING_TICKS


class Control(NamedTuple):
    """Numbers that steer a call."""

    start: float
    end: float
    stop: float
    contraction: float
    safety: float
    tolerance: float
    noise: float
    largest: float  # step, absolute
    first: float  # largest first step, absolute
    smallest: float  # step, beside r
    ticks: float
    infinity: float
    radius: float  # h(contraction)
    budget: float  # constant of the step formula
    size: float  # typical size of the unknowns, squared


@njit
def decide(lanes, work, at, n, control):
    """What every lane makes of a tick; returns masks of the lanes that have ended, and how."""
    zero, one = splat(lanes, 0.0), splat(lanes, 1.0)
    # The Newton step and its size.
    largest, total = zero, zero
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

    fresh = corrected & (iteration <= one) & (first > splat(lanes, ABOVE_NOISE * control.noise)) & finite
    omega = select(fresh, maximum((step + step) / (first * first), floor_of_omega), omega)
    stagnant = corrected & (step > contraction * last)
    harmless = (step < splat(lanes, control.noise)) & (omega * step < splat(lanes, HARMLESS))
    bad = outside(finite) | (stagnant & outside(harmless))
    bad = bad | (outside(corrected) & under_way & (omega * step > splat(lanes, 8.0 * control.radius)))
    tolerance = splat(lanes, control.tolerance)
    settled = corrected & (step < splat(lanes, SMALL)) & (omega * step * step < tolerance + tolerance)
    good = ((step < tolerance) | settled | (stagnant & harmless)) & outside(bad)
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
    first = select(corrected, first, step)
    store(work, lane + FIRST, first)
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
    error = maximum(first, splat(lanes, 1e-14))
    reach = sqrt(splat(lanes, control.budget) / (maximum(omega, floor_of_omega) * error)) * h
    reach = reach * select(cubic, h + h_before, one)
    hermite = (sqrt(fma(h, h, splat(lanes, 4.0) * reach)) - h) * splat(lanes, 0.5 / control.safety)
    euler = minimum(reach * splat(lanes, 1.0 / control.safety), h + h)
    longer = select(cubic, hermite, euler)
    longer = minimum(longer, select(rejected, h, splat(lanes, 5.0) * h))
    longer = minimum(longer, splat(lanes, control.largest))
    longer = minimum(longer, maximum(splat(lanes, TORIC_PART) * r, load(lanes, work, lane + NEAR)))
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
    for k in range(n):
        modulus = zero
        for row in (2 * k, 2 * k + 1):
            x = load(lanes, work, at.x + row)
            accepted = load(lanes, work, at.accepted + row)
            slope = load(lanes, work, at.tangent + row)
            before = select(good, accepted, load(lanes, work, at.before + row))
            slope_before = select(good, slope, load(lanes, work, at.tangent_before + row))
            accepted = select(taken, x, accepted)
            slope = select(taken, load(lanes, work, at.dr + row), slope)
            store(work, at.before + row, before)
            store(work, at.tangent_before + row, slope_before)
            store(work, at.accepted + row, accepted)
            store(work, at.tangent + row, slope)
            modulus = fma(accepted, accepted, modulus)
            # Hermite: with two points behind, accepted + u(s + u(c2 + u c3)), slopes by -r over the last step
            s, s_before = slope * span, slope_before * span
            delta = accepted - before
            c3 = negative(s + s_before + delta + delta)
            c2 = c3 - s - delta
            trial = fma(u, fma(u, fma(u, c3, c2), negative(s)), accepted)
            trial = select(cubic, trial, accepted - h * slope)
            store(work, at.x + row, select(decided, trial, x))
        size = maximum(size, modulus)
        store(work, at.weight + k, modulus)
    least = maximum(minimum(size, splat(lanes, control.size)) * splat(lanes, 1e-8), splat(lanes, 1e-60))
    for k in range(n):
        modulus = load(lanes, work, at.weight + k)
        store(work, at.weight + k, rough_reciprocal(maximum(modulus, least)))

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
