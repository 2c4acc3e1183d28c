"""Compiled: steps along the configuration curve inside tubes that hold one arc only.

At a point x of the curve f = 0 with unit tangent t, the chart G(y) = [f(x + τt + y); t·y] is solved for y
at each τ of a step [0, h]. With C the inverse of G' at y = 0, τ = 0, the second derivatives of the closure
equations give global bounds (they are sums of terms A e^{iq} and B s e^{iq}, and |e^{iq}| = 1):

    |C f(x + τt)| ≤ ½ Kt τ² + ε,     |C (f'(x + τt + y) − f'(x)) w| ≤ (K1 τ + K0 r) r    for |y|, |w| ≤ r

in the maximum norm. Where ½ Kt τ² + ε + (K1 τ + K0 r) r ≤ r and K1 τ + 2 K0 r < 1, y ↦ y − C G(y) contracts
the ball of radius r into itself, so that for each τ there is one y and no other: one arc passes, nothing
else is in the tube. The step below is the longest that the bounds allow (times a margin), so that tracing
cannot jump. It is exact but for rounding; :mod:`mechanisms.certified_trace` repeats the argument in ball
arithmetic.

Loaded when first needed: importing numba and compiling take seconds.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mechanisms.chart import correct, frame, second

CLOSED, LEFT, SINGULAR, TOO_LONG = 0, 1, 2, 3
MARGIN = 0.9  # of the longest step allowed; leaves a ball clearly larger than the least one
LONGEST = 0.4  # step in radians; the bounds below assume that no displacement changes by more than SLACK
WIDEST = 0.1  # radius of a tube
SLACK = 0.5  # LONGEST + WIDEST
SHORTEST = 1e-9  # a shorter step means a double point of the curve, for double precision
FAR = 1e3  # a displacement of so many linkage sizes counts as infinite
LEAST_BOUND = 1e-12  # stands for a bound that is zero: a chain of gears without loops has straight curves


@njit(cache=True)
def bounds(a, b, slot, x, t, inv):
    """Return the constants (Kt, K1, K0) of the module's inequalities."""
    loops, rot = a.shape
    slides = b.shape[1]
    n = rot + slides
    kt, k1, k0 = 0.0, 0.0, 0.0
    for i in range(n):
        rt, r1, r0 = 0.0, 0.0, 0.0
        for k in range(rot):
            z = 0j
            for l in range(loops):
                w = a[l, k]
                for j in range(slides):
                    if slot[j] == k:
                        w += b[l, j] * x[rot + j]
                z += complex(inv[i, 2 * l], -inv[i, 2 * l + 1]) * w
            size = abs(z)
            for j in range(slides):
                if slot[j] == k:
                    u = 0j
                    for l in range(loops):
                        u += complex(inv[i, 2 * l], -inv[i, 2 * l + 1]) * b[l, j]
                    mixed = abs(u)
                    size += SLACK * mixed
                    rt += 2 * mixed * abs(t[k] * t[rot + j])
                    r1 += mixed * (abs(t[k]) + abs(t[rot + j]))
                    r0 += 2 * mixed
            rt += size * t[k] * t[k]
            r1 += size * abs(t[k])
            r0 += size
        kt = max(kt, rt)
        k1 = max(k1, r1)
        k0 = max(k0, r0)
    return kt, k1, k0


@njit(cache=True)
def step_rule(kt, k1, k0, eps, longest):
    """Return (h, r): a step and the radius of its tube, h = 0 if there is none."""
    if k0 * eps > 1e-3:
        return 0.0, 0.0
    kt, k0 = max(kt, LEAST_BOUND), max(k0, LEAST_BOUND)
    h = min(longest, MARGIN / (k1 + np.sqrt(2 * k0 * kt)))
    for _ in range(60):
        half = (1 - k1 * h) / (2 * k0)
        push = (0.5 * kt * h * h + eps) / k0
        if half > 0 and half * half > push:
            least = half - np.sqrt(half * half - push)
            if least < 0.5 * WIDEST:
                # Between the least ball that holds the arc and the largest that holds no other.
                return h, min(WIDEST, 0.5 * (least + half))
        h *= 0.8
    return 0.0, 0.0


@njit(cache=True)
def trace(a, b, slot, c, gears, start, direction, room, longest):
    """Follow the curve from start until it closes, leaves, meets a double point, or fills the room.

    Returns (status, count, x, t, d, h, r): nodes x with tangents t and curvature vectors d (count + 1
    rows), steps h and radii r (count rows). The last node of a closed curve is the start, plus full turns.
    """
    n = start.shape[0]
    rot = a.shape[1]
    xs = np.empty((room + 1, n))
    ts = np.empty((room + 1, n))
    ds = np.zeros((room + 1, n))
    hs = np.empty(room)
    rs = np.empty(room)
    f = np.empty(n)
    f2 = np.empty(n)
    jac = np.empty((n, n))
    inv = np.empty((n, n))
    work = np.empty((n, n))
    x = start.copy()
    t = direction.copy()
    y = np.empty(n)
    base = np.empty(n)
    status = TOO_LONG
    count = 0
    while True:
        if not frame(a, b, slot, c, gears, x, t, f, jac, inv):
            status = SINGULAR
            t = ts[count - 1].copy() if count else t
            xs[count] = x
            ts[count] = t
            break
        xs[count] = x
        ts[count] = t
        second(a, b, slot, x, t, f2)
        eps = 1e-15
        for i in range(n):
            e, d = 0.0, 0.0
            for j in range(n - 1):
                e += inv[i, j] * f[j]
                d -= inv[i, j] * f2[j]
            eps = max(eps, abs(e))
            ds[count, i] = d
        if count == room:
            break
        for j in range(rot, n):
            if abs(x[j]) > FAR:
                status = LEFT
        if status == LEFT:
            break
        kt, k1, k0 = bounds(a, b, slot, x, t, inv)
        h, r = step_rule(kt, k1, k0, eps, longest)
        done = False
        while h > SHORTEST:
            for j in range(n):
                base[j] = x[j] + h * t[j]
                y[j] = 0.5 * h * h * ds[count, j]
            size = correct(a, b, slot, c, gears, base, t, y, f, jac, work)
            if size < 1e-8 and np.max(np.abs(y)) <= r:
                done = True
                break
            h, r = step_rule(kt, k1, k0, eps, 0.5 * h)
        if not done:
            status = SINGULAR
            break
        # Is the start on this very arc?
        if count > 0:
            along = 0.0
            for j in range(n):
                work[0, j] = start[j] - x[j]
                if j < rot:
                    work[0, j] -= 2 * np.pi * np.round(work[0, j] / (2 * np.pi))
                along += work[0, j] * t[j]
            off, facing = 0.0, 0.0
            for j in range(n):
                off = max(off, abs(work[0, j] - along * t[j]))
                facing += t[j] * ts[0, j]
            if along > 0 and along <= h and off <= r and facing > 0:
                hs[count] = along
                rs[count] = r
                count += 1
                for j in range(n):
                    xs[count, j] = x[j] + work[0, j]
                ts[count] = ts[0]
                ds[count] = ds[0]
                status = CLOSED
                break
        hs[count] = h
        rs[count] = r
        for j in range(n):
            x[j] = base[j] + y[j]
        count += 1
    # Copies, so that a circuit does not keep the whole room.
    nodes, tangents, bends = xs[: count + 1].copy(), ts[: count + 1].copy(), ds[: count + 1].copy()
    return status, count, nodes, tangents, bends, hs[:count].copy(), rs[:count].copy()
