"""The compiled core of motion: closure equations, their charts, and the points of an arc.

A chart at a point x of the curve f = 0 with unit tangent t has the parameter τ: the point of the curve in
the plane through x + τt that is normal to t. All functions take the arrays of a
:class:`~mechanisms.closure.Closure` first.

Loaded when first needed: importing numba and compiling take seconds. Numba keeps compiled code by the date
of the file it is in: after a change here, touch :mod:`mechanisms.tube`, which has these functions inlined.
"""

from __future__ import annotations

import numpy as np
from numba import njit

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
