"""The compiled core of the RoboMech search: how a half misses its path.

A half has twelve dimensions of its own and shares four, K and r_H.  Its two bars HG and LM and its end-effector C
give two views of one position:

- *stretched*: C is on its point, the angles φ1, φ2 follow from the passive chain, and the bars are too long or too
  short by r;
- *driven*: the bars are rigid, φ1, φ2 follow from r = 0, and C misses its point.

With the partial derivatives r_p, r_φ, C_p, C_φ of one position, the slopes are r_p − r_φ C_φ⁻¹ C_p and
C_p − C_φ r_φ⁻¹ r_p.  The first is defined almost everywhere but attracts to linkages that can hardly hold C (r_φ
singular); the second is what counts.

Lengths are in path sizes.  Loaded when first needed: importing numba and compiling take seconds.  Numba keeps
compiled code by the date of the file it is in: after a change here, touch `robomech_descent`, which has these
functions inlined.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mechanisms.families.robomech_joint import CLEAR

__all__ = ["FENCES", "OWN", "SHARED", "driven", "errors", "stretched"]

#: Dimensions of a half, in this order: A (x, y), l_AB, l_BC, r_G (x, y), l_HG, r_L (x, y), r_M (x, y), l_LM;
#: behind them the shared ones: K (x, y), r_H (x, y).
OWN, SHARED = 12, 4
#: Rows of a half behind its positions: three fences (see `fences`).
FENCES = 3
#: Height of a fence.
FENCE = 1e-2
#: Newton steps to the angles of a position, the step in radians after which they are exact, and the step beyond which
#: there is no assembly nearby.
NEWTON, EXACT, ASTRAY = 12, 1e-11, 0.5
#: Sine of the angle between links 1 and 2 below which a passive chain is as good as out of reach.
STRAIGHT = 1e-6


@njit(cache=True, error_model="numpy")
def _chain(own, shared, turn, first, second):
    """Directions of links 1, 2, 5 and 8, the vectors of G (both), M and L, and the lengths |HG| and |LM|."""
    u1, u2 = complex(np.cos(first), np.sin(first)), complex(np.cos(second), np.sin(second))
    g1, g2 = own[2] * u1, complex(own[4], own[5]) * u2
    hg = complex(shared[0], shared[1]) + complex(shared[2], shared[3]) * turn - complex(own[0], own[1]) - g1 - g2
    reach = np.sqrt(hg.real**2 + hg.imag**2)
    u5 = hg * (1 / reach)
    gm, al = complex(own[9], own[10]) * u5, complex(own[7], own[8]) * u1
    lm = g1 + g2 + gm - al
    span = np.sqrt(lm.real**2 + lm.imag**2)
    return u1, u2, u5, lm * (1 / span), g1, g2, gm, al, reach, span


@njit(cache=True, error_model="numpy")
def bars(own, shared, turn, first, second, r, w):
    """r: |HG| − l_HG and |LM| − l_LM for angles of links 1 and 2; w: their derivatives by both angles."""
    _, _, u5, u8, g1, g2, gm, al, reach, span = _chain(own, shared, turn, first, second)
    r[0], r[1] = reach - own[6], span - own[11]
    z1, z2 = np.conj(u5) * 1j * g1, np.conj(u5) * 1j * g2
    w[0, 0], w[0, 1] = -z1.real, -z2.real
    # link 5 turns by −Im(ū5 dG)/|HG|
    w[1, 0] = (np.conj(u8) * (1j * (g1 - al) - 1j * gm * (z1.imag / reach))).real
    w[1, 1] = (np.conj(u8) * (1j * g2 - 1j * gm * (z2.imag / reach))).real


@njit(cache=True, error_model="numpy")
def slopes(own, shared, turn, first, second, rp, cp):
    """rp (2, 16), cp (16,): partial derivatives of both bars and of C by the dimensions, angles kept."""
    u1, u2, u5, u8, _, _, gm, _, reach, _ = _chain(own, shared, turn, first, second)
    rp[:, :] = 0.0
    cp[:] = 0.0
    cp[0], cp[1], cp[2], cp[3] = 1.0, 1j, u1, u2
    # A, l_AB and r_G move G, K and r_H move H; l_BC moves C alone
    moved = (1 + 0j, 1j, u1, 0j, u2, 1j * u2, 1 + 0j, 1j, turn, 1j * turn)
    for k in range(10):
        dg, dh, at = (moved[k], 0j, k) if k < 6 else (0j, moved[k], k + OWN - 6)
        z = np.conj(u5) * (dh - dg)
        rp[0, at] = z.real
        dl = dg if k < 2 else 0j  # A carries L along
        rp[1, at] = (np.conj(u8) * (dg - dl + 1j * gm * (z.imag / reach))).real
    rp[0, 6], rp[1, 11] = -1.0, -1.0
    z = np.conj(u8) * u1
    rp[1, 7], rp[1, 8] = -z.real, z.imag
    z = np.conj(u8) * u5
    rp[1, 9], rp[1, 10] = z.real, -z.imag


@njit(cache=True, error_model="numpy")
def fences(own, shared, rows, res, at):
    """FENCE·(1 − d²/CLEAR²) where a distance d is less than CLEAR: |r_H|, |r_G|, pins of LM to those of link 2."""
    for f, (begin, end, crank) in enumerate(((14, 16, False), (4, 6, False), (7, 11, True))):
        rows[at + f, :] = 0.0
        res[at + f] = 0.0
        square = 0.0
        for k in range(begin, end):
            gap = shared[k - OWN] if k >= OWN else own[k]
            if crank and k == begin:
                gap -= own[2]
            square += gap * gap
        if square < CLEAR * CLEAR:
            res[at + f] = FENCE * (1 - square / CLEAR**2)
            for k in range(begin, end):
                gap = shared[k - OWN] if k >= OWN else own[k]
                if crank and k == begin:
                    gap -= own[2]
                    rows[at + f, 2] = 2 * FENCE * gap / CLEAR**2
                rows[at + f, k] = -2 * FENCE * gap / CLEAR**2


@njit(cache=True, error_model="numpy")
def stretched(own, shared, path, turns, elbow, angles, res, rows, slope):
    """Stretches of both bars with C on its path, (2N,) of res; the angles are written; False where out of reach."""
    count = len(path)
    a, c, pivot = own[2], own[3], complex(own[0], own[1])
    r, w, rp, cp = np.zeros(2), np.zeros((2, 2)), np.zeros((2, 16)), np.zeros(16, np.complex128)
    if not (a > 0 and c > 0):
        return False
    for j in range(count):
        line = path[j] - pivot
        square = line.real**2 + line.imag**2
        cosine = (square + a * a - c * c) / (2 * a * np.sqrt(square))
        if not abs(cosine) < 1:
            return False
        u1 = line / np.sqrt(square) * complex(cosine, elbow * np.sqrt(1 - cosine * cosine))
        u2 = (line - a * u1) / c
        angles[0, j], angles[1, j] = np.arctan2(u1.imag, u1.real), np.arctan2(u2.imag, u2.real)
        bars(own, shared, turns[j], angles[0, j], angles[1, j], r, w)
        res[j], res[count + j] = r[0], r[1]
        if slope:
            sine = (np.conj(u2) * u1).imag
            if abs(sine) < STRAIGHT:
                return False
            slopes(own, shared, turns[j], angles[0, j], angles[1, j], rp, cp)
            for k in range(16):
                first = (cp[k] * np.conj(u2)).real / (a * sine)
                second = -(cp[k] * np.conj(u1)).real / (c * sine)
                rows[j, k] = rp[0, k] + w[0, 0] * first + w[0, 1] * second
                rows[count + j, k] = rp[1, k] + w[1, 0] * first + w[1, 1] * second
    return True


@njit(cache=True, error_model="numpy")
def driven(own, shared, path, turns, angles, res, rows, slope):
    """Errors of C with rigid bars, x and y, (2N,) of res; the angles are corrected; False where nothing assembles."""
    count = len(path)
    a, c, pivot = own[2], own[3], complex(own[0], own[1])
    r, w, rp, cp = np.zeros(2), np.zeros((2, 2)), np.zeros((2, 16)), np.zeros(16, np.complex128)
    for j in range(count):
        first, second = angles[0, j], angles[1, j]
        step = 1.0
        for _ in range(NEWTON):
            bars(own, shared, turns[j], first, second, r, w)
            det = w[0, 0] * w[1, 1] - w[0, 1] * w[1, 0]
            d1, d2 = (w[0, 1] * r[1] - w[1, 1] * r[0]) / det, (w[1, 0] * r[0] - w[0, 0] * r[1]) / det
            step = max(abs(d1), abs(d2))
            if not step < ASTRAY:
                return False
            first += d1
            second += d2
            if step < EXACT:
                break
        if step >= EXACT:
            return False
        angles[0, j], angles[1, j] = first, second
        u1, u2 = complex(np.cos(first), np.sin(first)), complex(np.cos(second), np.sin(second))
        off = pivot + a * u1 + c * u2 - path[j]
        res[j], res[count + j] = off.real, off.imag
        if slope:
            slopes(own, shared, turns[j], first, second, rp, cp)
            for k in range(16):
                d1 = (w[0, 1] * rp[1, k] - w[1, 1] * rp[0, k]) / det
                d2 = (w[1, 0] * rp[0, k] - w[0, 0] * rp[1, k]) / det
                z = cp[k] + 1j * (a * d1 * u1 + c * d2 * u2)
                rows[j, k], rows[count + j, k] = z.real, z.imag
    return True


@njit(cache=True, error_model="numpy")
def errors(x, paths, turns, elbows, rigid, angles, res, rows, slope):
    """All residuals of the halves, (halves, 2N + FENCES), and their derivatives; x: own dimensions, then shared."""
    count = paths.shape[1]
    shared = x[len(x) - SHARED :]
    for k in range(len(paths)):
        own = x[OWN * k : OWN * (k + 1)]
        if rigid:
            good = driven(own, shared, paths[k], turns, angles[k], res[k], rows[k], slope)
        else:
            good = stretched(own, shared, paths[k], turns, elbows[k], angles[k], res[k], rows[k], slope)
        if not good:
            return False
        fences(own, shared, rows[k], res[k], 2 * count)
    return True
