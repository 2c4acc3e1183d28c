"""The compiled core of motion: steps along the configuration curve inside tubes that hold one arc only.

At a point x of the curve f = 0 with unit tangent t, the chart G(y) = [f(x + τt + y); t·y] is solved for y
at each τ of a step [0, h]. With C the inverse of G' at y = 0, τ = 0, the second derivatives of the closure
equations give
global bounds (they are sums of terms A e^{iq} and B s e^{iq}, and |e^{iq}| = 1):

    |C f(x + τt)| ≤ ½ Kt τ² + ε,     |C (f'(x + τt + y) − f'(x)) w| ≤ (K1 τ + K0 r) r    for |y|, |w| ≤ r

in the maximum norm. Where ½ Kt τ² + ε + (K1 τ + K0 r) r ≤ r and K1 τ + 2 K0 r < 1, y ↦ y − C G(y) contracts
the ball of radius r into itself, so that for each τ there is one y and no other: one arc passes, nothing
else is in the tube. The step below is the longest that the bounds allow (times a margin), so that tracing
cannot jump. It is exact but for rounding; :mod:`mechanisms.certify_motion` repeats the argument in ball
arithmetic.

Loaded when first needed: importing numba and compiling take seconds.
"""

from __future__ import annotations

import numpy as np
from numba import njit

CLOSED, LEFT, SINGULAR, TOO_LONG = 0, 1, 2, 3
MARGIN = 0.9  # of the longest step allowed; leaves a ball clearly larger than the least one
LONGEST = 0.4  # step in radians; the bounds below assume that no displacement changes by more than SLACK
WIDEST = 0.1  # radius of a tube
SLACK = 0.5  # LONGEST + WIDEST
SHORTEST = 1e-9  # a shorter step means a double point of the curve, for double precision
FAR = 1e3  # a displacement of so many linkage sizes counts as infinite
LEAST_BOUND = 1e-12  # stands for a bound that is zero: a chain of gears without loops has straight curves
NEWTON = 8  # iterations; two or three are usual


@njit(cache=True)
def evaluate(a, b, slot, c, gears, x, f, jac):
    """Write the residual and its Jacobian at x into f (m,) and jac (≥ m, n)."""
    loops, rot = a.shape
    slides = b.shape[1]
    n = rot + slides
    for l in range(loops):
        total = c[l]
        for j in range(n):
            jac[2 * l, j] = 0.0
            jac[2 * l + 1, j] = 0.0
        for k in range(rot):
            z = a[l, k] * complex(np.cos(x[k]), np.sin(x[k]))
            total += z
            jac[2 * l, k] -= z.imag
            jac[2 * l + 1, k] += z.real
        for j in range(slides):
            k = slot[j]
            z = b[l, j]
            if k < rot:
                z = z * complex(np.cos(x[k]), np.sin(x[k]))
                jac[2 * l, k] -= z.imag * x[rot + j]
                jac[2 * l + 1, k] += z.real * x[rot + j]
            total += z * x[rot + j]
            jac[2 * l, rot + j] = z.real
            jac[2 * l + 1, rot + j] = z.imag
        f[2 * l] = total.real
        f[2 * l + 1] = total.imag
    for g in range(gears.shape[0]):
        total_angle = 0.0
        for j in range(n):
            jac[2 * loops + g, j] = gears[g, j] if j < rot else 0.0
        for k in range(rot):
            total_angle += gears[g, k] * x[k]
        f[2 * loops + g] = total_angle - 2 * np.pi * np.round(total_angle / (2 * np.pi))


@njit(cache=True)
def second(a, b, slot, x, v, out):
    """Write f''(x)[v, v] into out (m,)."""
    loops, rot = a.shape
    out[:] = 0.0
    for l in range(loops):
        total = 0j
        for k in range(rot):
            total -= a[l, k] * complex(np.cos(x[k]), np.sin(x[k])) * v[k] * v[k]
        for j in range(b.shape[1]):
            k = slot[j]
            if k < rot:
                z = b[l, j] * complex(np.cos(x[k]), np.sin(x[k]))
                total += z * complex(-x[rot + j] * v[k] * v[k], 2 * v[rot + j] * v[k])
        out[2 * l] = total.real
        out[2 * l + 1] = total.imag


@njit(cache=True)
def invert(m, out):
    """Write the inverse of m (destroyed) into out by Gauss–Jordan with row pivoting; false if singular."""
    n = m.shape[0]
    for i in range(n):
        for j in range(n):
            out[i, j] = 1.0 if i == j else 0.0
    for p in range(n):
        best = p
        for i in range(p + 1, n):
            if abs(m[i, p]) > abs(m[best, p]):
                best = i
        if not abs(m[best, p]) > 0.0:
            return False
        if best != p:
            for j in range(n):
                m[p, j], m[best, j] = m[best, j], m[p, j]
                out[p, j], out[best, j] = out[best, j], out[p, j]
        r = 1.0 / m[p, p]
        for j in range(n):
            m[p, j] *= r
            out[p, j] *= r
        for i in range(n):
            if i != p:
                w = m[i, p]
                if w != 0.0:
                    for j in range(n):
                        m[i, j] -= w * m[p, j]
                        out[i, j] -= w * out[p, j]
    return True


@njit(cache=True)
def frame(a, b, slot, c, gears, x, t, f, jac, inv):
    """At x, turn t (any vector that is not normal to the curve) into the unit tangent and inv into C.

    C's last column is the tangent, its others are normal to it. False if the Jacobian drops rank.
    """
    n = x.shape[0]
    evaluate(a, b, slot, c, gears, x, f, jac)
    for j in range(n):
        jac[n - 1, j] = t[j]
    if not invert(jac, inv):
        return False
    norm = 0.0
    for j in range(n):
        norm += inv[j, n - 1] ** 2
    norm = np.sqrt(norm)
    if not np.isfinite(norm):
        return False
    for j in range(n):
        t[j] = inv[j, n - 1] / norm
    for i in range(n - 1):
        along = 0.0
        for j in range(n):
            along += t[j] * inv[j, i]
        for j in range(n):
            inv[j, i] -= along * t[j]
    for j in range(n):
        inv[j, n - 1] = t[j]
    return True


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
def correct(a, b, slot, c, gears, base, t, y, f, jac, inv):
    """Newton for y in [f(base + y); t·y] = 0; return the size of the last correction."""
    n = base.shape[0]
    x = np.empty(n)
    last = np.inf
    for _ in range(NEWTON):
        along = 0.0
        for j in range(n):
            x[j] = base[j] + y[j]
            along += t[j] * y[j]
        evaluate(a, b, slot, c, gears, x, f, jac)
        for j in range(n):
            jac[n - 1, j] = t[j]
        if not invert(jac, inv):
            return np.inf
        size = 0.0
        for i in range(n):
            d = inv[i, n - 1] * along
            for j in range(n - 1):
                d += inv[i, j] * f[j]
            y[i] -= d
            size = max(size, abs(d))
        if size < 1e-14 or (size < 1e-11 and size > 0.25 * last):
            return size
        last = size
    return last


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
    return status, count, xs[: count + 1], ts[: count + 1], ds[: count + 1], hs[:count], rs[:count]


@njit(cache=True)
def on_arc(a, b, slot, c, gears, x, t, d, tau):
    """Return (configurations, unit tangents) of the arc through x at the chart parameters tau (k,)."""
    n = x.shape[0]
    xs = np.empty((tau.shape[0], n))
    ts = np.empty((tau.shape[0], n))
    f = np.empty(n)
    jac = np.empty((n, n))
    inv = np.empty((n, n))
    y = np.empty(n)
    base = np.empty(n)
    tangent = np.empty(n)
    for i in range(tau.shape[0]):
        for j in range(n):
            base[j] = x[j] + tau[i] * t[j]
            y[j] = 0.5 * tau[i] ** 2 * d[j]
        correct(a, b, slot, c, gears, base, t, y, f, jac, inv)
        for j in range(n):
            xs[i, j] = base[j] + y[j]
            tangent[j] = t[j]
        frame(a, b, slot, c, gears, xs[i], tangent, f, jac, inv)
        ts[i] = tangent
    return xs, ts


@njit(cache=True)
def on_arcs(a, b, slot, c, gears, xs, ts, ds, hs, places):
    """Return (configurations, unit tangents) at places (k,): arc numbers plus fractions of their steps."""
    arcs, n = hs.shape[0], xs.shape[1]
    out = np.empty((places.shape[0], n))
    tangents = np.empty((places.shape[0], n))
    tau = np.empty(1)
    for i in range(places.shape[0]):
        arc = min(max(int(np.floor(places[i])), 0), arcs - 1)
        fraction = places[i] - arc
        if fraction == 0.0 or fraction == 1.0:
            node = arc + int(fraction)
            out[i] = xs[node]
            tangents[i] = ts[node]
            continue
        tau[0] = fraction * hs[arc]
        x, t = on_arc(a, b, slot, c, gears, xs[arc], ts[arc], ds[arc], tau)
        out[i] = x[0]
        tangents[i] = t[0]
    return out, tangents


@njit(cache=True)
def turning(a, b, slot, c, gears, x, t, d, low, high, g):
    """Return the chart parameter in [low, high] where the input g·x stands still; its rate changes sign there."""
    ends = np.array([low, high])
    _, ts = on_arc(a, b, slot, c, gears, x, t, d, ends)
    p, q = ts[0] @ g, ts[1] @ g
    if (p > 0) == (q > 0):  # an end stands in the dead centre, and rounding took its sign
        return low if abs(p) < abs(q) else high
    kept = 0  # which end the last step kept: Illinois halves its value when it is kept twice
    for _ in range(80):
        if high - low < 1e-14:
            break
        middle = low - p * (high - low) / (q - p)  # false position
        if not (low < middle < high):
            middle = 0.5 * (low + high)
        _, ts = on_arc(a, b, slot, c, gears, x, t, d, np.array([middle]))
        m = ts[0] @ g
        if abs(m) < 1e-15:
            return middle
        if (m > 0) == (p > 0):
            low, p = middle, m
            q = 0.5 * q if kept == 1 else q
            kept = 1
        else:
            high, q = middle, m
            p = 0.5 * p if kept == -1 else p
            kept = -1
    return 0.5 * (low + high)
