"""The RoboMech manipulator: the formulas and claims of its paper, tested on a manipulator drawn in round numbers.

The paper prints no dimensions.  Links, frames and angles are those of `mechanisms.families.robomech_model`.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from mechanisms.families.robomech_fit import ActiveChain, alternate, exact_active, finish, negative_chain, passive_chain
from mechanisms.families.robomech_model import Half, RoboMech
from mechanisms.reproduce.comparison import Comparison, claim, formula

__all__ = ["PHI7", "START", "comparisons", "drawn", "paths"]

#: Input angles of the paths that are synthesised again, and the angles of links 1 and 3 where the drawing
#: stands, at 90°.
PHI7 = np.radians(np.arange(72.0, 109.0, 2.0))
START = (float(np.radians(115.0)), float(np.radians(62.0)))


def drawn() -> RoboMech:
    """A = 0, D = 6, K = 3 − 0.5i; at φ7 = 90°: φ1 = 115°, φ2 = 35°, φ3 = 62°, φ4 = 140°, H = 3 + 0.5i."""
    u = [np.exp(1j * np.radians(a)) for a in (115, 35, 62, 140)]
    g, i, h, l, m, q, n = 1.4 + 1.9j, 4.7 + 1.9j, 3 + 0.5j, -1 + 0.7j, 1.5 + 0.6j, 7 + 0.8j, 4.4 + 0.6j
    b, e = 2 * u[0], 6 + 2.1 * u[2]
    bar5, bar6 = (h - g) / abs(h - g), (h - i) / abs(h - i)
    c = Half(0, 2.0, 2.6, (g - b) / u[1], abs(h - g), l / u[0], (m - g) / bar5, abs(m - l), 1.0)
    f = Half(6, 2.1, 2.5, (i - e) / u[3], abs(h - i), (q - 6) / u[2], (n - i) / bar6, abs(n - q), -1.0)
    return RoboMech(3 - 0.5j, 1.0 + 0j, c, f)


def paths() -> tuple[list[complex], list[complex]]:
    """C and F at `PHI7`."""
    mech, middle = drawn(), len(PHI7) // 2
    up = mech.positions(PHI7[middle:].tolist(), START)
    down = mech.positions(PHI7[: middle + 1][::-1].tolist(), START)
    c, f = (np.concatenate([low["C"][::-1][:-1], high["C"]]).tolist() for low, high in zip(down, up))
    return c, f


def comparisons() -> list[Comparison]:
    """The formulas and claims that the text allows to test."""
    return [*_structure(), *_positions(), *_speeds(), *_synthesis()]


def _structure() -> list[Comparison]:
    linkage = drawn().linkage(np.pi / 2, *START)
    joints = len(linkage.revolute_joints())
    input_is_8 = set(linkage.links["link8"]) & set(linkage.links["ground"])  # an input is joined to the frame
    return [
        Comparison("Sect. II", "moving links, pins", "9, 13", (float(len(linkage.moving_links)), float(joints))),
        Comparison("Sect. II", "degrees of freedom", "1", float(linkage.degrees_of_freedom)),
        claim("Eq. (1)", "the input link of the structural formula is I(0,8)", bool(input_is_8),
              "link 8 is the bar LM; the input is link 7, as Eq. (43) has it"),
    ]  # fmt: skip


def _positions() -> list[Comparison]:
    mech = drawn()
    half, h = mech.c, complex(mech.joint(np.pi / 2))
    at = half.assembled(h, START[0])
    to_g = np.angle(at["G"] - at["B"])
    own = np.angle(half.g)
    line = h - at["B"]
    cosine = (abs(half.g) ** 2 + abs(line) ** 2 - half.gh**2) / (2 * abs(half.g) * abs(line))
    return [
        formula("Eq. (63)", "direction of BG", lambda: np.angle(line) + np.arccos(cosine), lambda: to_g),
        formula("Eq. (71)", "φ2 = φ_BG + tan⁻¹(y_G/x_G)", lambda: to_g + own, lambda: np.radians(35.0),
                "the angle of r_G is subtracted, as Eq. (72) does", lambda: to_g - own),
        formula("Eq. (49)", "L turned by Γ(φ5)", lambda: half.pivot + half.l * np.exp(1j * at["phi5"]),
                lambda: -1 + 0.7j, "L is fixed to link 1: Γ(φ1)",
                lambda: half.pivot + half.l * np.exp(1j * at["phi1"])),
        claim("Sect. IV", "the conditional coordinate closes the group", bool(abs(at["gap"]) < 1e-12),
              f"{len(half.assemblies(h))} assembly of this half at φ7 = 90°, found from all trial angles"),
    ]  # fmt: skip


def _speeds() -> list[Comparison]:
    mech, h = drawn(), 1e-4
    found = mech.speeds(np.pi / 2, *START)
    c = mech.positions((np.pi / 2 + h * np.array([0, -1, 1])).tolist(), START)[0]["C"]
    slope, curve = (c[2] - c[1]) / (2 * h), (c[2] - 2 * c[0] + c[1]) / h**2
    good = abs(found["v_C"] - slope) < 1e-6 and abs(found["a_C"] - curve) < 1e-4
    return [
        claim("Eqs. (73)–(87)", "speeds and accelerations by the four loops", bool(good), "difference quotients"),
        Comparison("Eq. (77)", "det A at φ7 = 90°", "", abs(found["determinant"]), "not zero", kind="inferred"),
    ]


def _synthesis() -> list[Comparison]:
    mech, phi7 = drawn(), PHI7.tolist()
    c, f = paths()
    chains = [passive_chain(c, 0, 2.0, 2.6, 1.0), passive_chain(f, 6, 2.1, 2.5, -1.0)]
    known = ActiveChain(mech.pivot, mech.h, (mech.c.g, mech.f.g), (mech.c.gh, mech.f.gh))
    x = known.as_vector()
    start = ActiveChain.from_vector(x + 0.02 * np.random.default_rng(0).normal(size=len(x)) * np.maximum(1, abs(x)))
    _, crept = alternate(start, chains, phi7, "least-squares", 300)
    _, jammed = alternate(start, chains, phi7, "minimax", 40)
    joint = finish(start, chains, phi7)
    found = exact_active(chains, phi7, (0, 4, 9, 14, 18))
    exact = min(float(np.abs(finish(one, chains, phi7).x - x).max()) for one in found)
    dyad, _, fits = negative_chain(chains[0], known, 0, phi7)
    falls = all(b <= a * (1 + 1e-9) for a, b in pairwise(jammed))
    trivial = min(abs(d.fixed - chains[0].crank) + abs(d.moving) for d in fits.dyads)
    return [
        claim("Eqs. (21)–(24)", "the values of the Chebyshev descent never rise", falls, "40 sweeps"),
        claim("Eqs. (16)–(24)", "descent by groups reaches the minimum", min(crept[-1], jammed[-1]) < 1e-8,
              f"from 2 % off, max |q| is {crept[-1]:.1e} after 300 sweeps of least squares, {jammed[-1]:.1e} after "
              f"40 of linear programs; all groups together {joint.worst:.0e}"),
        Comparison("Sect. III", "active chains exact at five positions", "", len(found),
                   f"a complete solve; one is the original, to {exact:.0e}", kind="inferred"),
        claim("Eqs. (31)–(34)", "the negative chain is determined by its equations", trivial > 1e-3,
              "L = B, M = G satisfies them for any motion: it is link 2; it must be left out"),
        Comparison("Sect. III", "critical points of the dyad LM", "", fits.critical,
                   f"{fits.real} real, all certified; the best that is not trivial has l_LM = {dyad.length:.6f}",
                   kind="inferred"),
    ]  # fmt: skip
