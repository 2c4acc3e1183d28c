"""Levenberg–Marquardt with geodesic acceleration for one half of a RoboMech manipulator, or for both.

Given K and r_H, the halves have nothing in common: the least-squares problem of both is bordered, and every step
eliminates the dimensions of each half on its own (Householder reflections; normal equations would lose the narrow
directions).  M. K. Transtrum, J. P. Sethna, Improvements to the Levenberg–Marquardt algorithm for nonlinear
least-squares minimization: a straight step leaves a narrow curved valley at once, a bent one does not.

Loaded when first needed: importing numba and compiling take seconds.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from mechanisms.families.robomech_kernel import FENCES, OWN, SHARED, errors

__all__ = ["descend"]

#: Part of a step over which its acceleration is measured, how often the damping is raised before a descent ends, its
#: first and its least value.
PROBE, TRIES, FIRST_DAMPING, LEAST_DAMPING = 0.1, 14, 1e-3, 1e-20


@njit(cache=True, error_model="numpy")
def reflect(a, columns):
    """Householder reflections that make the first columns of a triangular, in place."""
    m, n = a.shape
    for k in range(min(columns, m)):
        norm = 0.0
        for i in range(k, m):
            norm += a[i, k] * a[i, k]
        norm = np.sqrt(norm)
        if norm == 0.0:
            continue
        if a[k, k] > 0:
            norm = -norm
        a[k, k] -= norm
        scale = -1.0 / (norm * a[k, k])
        for j in range(k + 1, n):
            total = 0.0
            for i in range(k, m):
                total += a[i, k] * a[i, j]
            total *= scale
            for i in range(k, m):
                a[i, j] -= total * a[i, k]
        a[k, k] = norm
        for i in range(k + 1, m):
            a[i, k] = 0.0


@njit(cache=True, error_model="numpy")
def triangle(blocks, border, joint, out):
    """The triangular factor of a bordered matrix, with its right side: (n, n + 1).

    blocks (halves, m, OWN + SHARED + 1) are overwritten; border (rows, SHARED + 1) holds rows of the shared
    dimensions alone.
    """
    halves, m, width = blocks.shape
    n = OWN * halves + (SHARED if joint else 0)
    out[:, :] = 0.0
    left = m - OWN
    rest = np.zeros((halves * left + len(border), SHARED + 1))
    rest[halves * left :] = border
    for k in range(halves):
        reflect(blocks[k], OWN)
        at = OWN * k
        out[at : at + OWN, at : at + OWN] = blocks[k, :OWN, :OWN]
        if joint:
            out[at : at + OWN, n - SHARED : n] = blocks[k, :OWN, OWN : width - 1]
        out[at : at + OWN, n] = blocks[k, :OWN, width - 1]
        rest[k * left : (k + 1) * left] = blocks[k, OWN:, OWN:]
    if joint:
        reflect(rest, SHARED)
        out[n - SHARED : n, n - SHARED :] = rest[:SHARED]


@njit(cache=True, error_model="numpy")
def back(t, x):
    """t x = right side of the triangular t, (n, n + 1)."""
    n = len(t)
    for i in range(n - 1, -1, -1):
        total = t[i, n]
        for j in range(i + 1, n):
            total -= t[i, j] * x[j]
        x[i] = total / t[i, i]


@njit(cache=True, error_model="numpy")
def damp(upper, root, joint, small, border):
    """The triangular factor with root·1 under it, cut into blocks for `triangle`."""
    halves, n = len(small), len(upper)
    border[:, :] = 0.0
    small[:, :, :] = 0.0
    for k in range(halves):
        at = OWN * k
        small[k, :OWN, :OWN] = upper[at : at + OWN, at : at + OWN]
        small[k, :OWN, OWN + SHARED] = upper[at : at + OWN, n]
        if joint:
            small[k, :OWN, OWN : OWN + SHARED] = upper[at : at + OWN, n - SHARED : n]
        for i in range(OWN):
            small[k, OWN + i, i] = root
    if joint:
        border[:SHARED] = upper[n - SHARED :, n - SHARED :]
        for i in range(SHARED):
            border[SHARED + i, i] = root


@njit(cache=True, error_model="numpy")
def acceleration(res, ahead, rows, step, joint, damped, slant, bent):
    """bent: the damped least-squares solution of J bent = r'', the second derivative of the residuals along the step.

    r'' = 2/h² (r(x + h step) − r − h J step) for h = PROBE; the right side of `damped` is lost.
    """
    n = len(step)
    slant[:] = 0.0
    for k in range(res.shape[0]):
        for i in range(res.shape[1]):
            along = 0.0
            for j in range(OWN):
                along += rows[k, i, j] * step[OWN * k + j]
            if joint:
                for j in range(SHARED):
                    along += rows[k, i, OWN + j] * step[n - SHARED + j]
            bend = 2 / PROBE * ((ahead[k, i] - res[k, i]) / PROBE - along)
            for j in range(OWN):
                slant[OWN * k + j] += rows[k, i, j] * bend
            if joint:
                for j in range(SHARED):
                    slant[n - SHARED + j] += rows[k, i, OWN + j] * bend
    for i in range(n):
        value = slant[i]
        for j in range(i):
            value -= damped[j, i] * damped[j, n]
        damped[i, n] = value / damped[i, i]
    back(damped, bent)


@njit(cache=True, error_model="numpy")
def descend(start, paths, turns, elbows, start_angles, rigid, joint, steps, look, gain, stop):
    """Levenberg–Marquardt steps with geodesic acceleration for one half or both; sizes are path sizes.

    M. K. Transtrum, J. P. Sethna, Improvements to the Levenberg–Marquardt algorithm for nonlinear least-squares
    minimization: a straight step leaves a narrow curved valley at once, a bent one does not.

    Parameters
    ----------
    start : (12·halves + 4,) array
        Dimensions of each half, then the shared ones, which move only if `joint`.
    start_angles : (halves, 2, N) array
        Near which a driven linkage is assembled.
    look, gain
        Every `look` steps the descent ends unless the sum of squares has fallen by the factor `gain`.
    stop : float
        Sum of squares at which it ends.

    Returns
    -------
    x, angles, value : arrays and float
        The root of the mean square; infinite where there is no linkage at the start.
    """
    halves, count = paths.shape
    m = 2 * count + FENCES
    x, angles = start.copy(), start_angles.copy()
    n = OWN * halves + (SHARED if joint else 0)
    res, rows = np.zeros((halves, m)), np.zeros((halves, m, 16))
    if not errors(x, paths, turns, elbows, rigid, angles, res, rows, True):
        return x, angles, np.inf
    ahead, new = np.zeros((halves, m)), np.zeros((halves, m))
    spare = np.zeros((halves, m, 16))
    trial, turned = x.copy(), angles.copy()
    step, bent, slant = np.zeros(n), np.zeros(n), np.zeros(n)
    upper, damped = np.zeros((n, n + 1)), np.zeros((n, n + 1))
    blocks, small = np.zeros((halves, m, OWN + SHARED + 1)), np.zeros((halves, 2 * OWN, OWN + SHARED + 1))
    border, free = np.zeros((2 * SHARED, SHARED + 1)), np.zeros((0, SHARED + 1))
    total = np.sum(res * res)
    before, damping = total, FIRST_DAMPING
    for taken in range(1, steps + 1):
        blocks[:, :, : OWN + SHARED] = rows
        blocks[:, :, OWN + SHARED] = -res
        triangle(blocks, free, joint, upper)
        better = False
        for _ in range(TRIES):
            damp(upper, np.sqrt(damping), joint, small, border)
            triangle(small, border, joint, damped)
            back(damped, step)
            trial[:] = x
            trial[:n] += PROBE * step
            turned[:] = angles
            if errors(trial, paths, turns, elbows, rigid, turned, ahead, spare, False):
                acceleration(res, ahead, rows, step, joint, damped, slant, bent)
                if 0.25 * np.sum(bent * bent) <= 0.5625 * np.sum(step * step):
                    trial[:] = x
                    trial[:n] += step - 0.5 * bent
                    turned[:] = angles
                    if errors(trial, paths, turns, elbows, rigid, turned, new, spare, False):
                        if np.sum(new * new) < total:
                            better = True
                            break
            damping = max(4 * damping, LEAST_DAMPING)
        if not better:
            break
        x[:], angles[:] = trial, turned
        errors(x, paths, turns, elbows, rigid, angles, res, rows, True)
        total = np.sum(res * res)
        damping = max(damping / 6, LEAST_DAMPING)
        if total <= stop:
            break
        if taken % look == 0:
            if total > gain * before:
                break
            before = total
    return x, angles, np.sqrt(total / (2 * halves * count))
