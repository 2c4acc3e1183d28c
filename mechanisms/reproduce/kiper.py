"""Kiper's Watt II with two end-effectors: his tables, formulas and examples, computed again.

Numbers come from the program's own road (`mechanisms.synthesize`), formulas are evaluated as printed at random
data beside what SymPy and linear algebra make of Eqs. (1)–(5).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mechanisms.families.dyads import dyad_equations, three_pose_dyads, turn
from mechanisms.reproduce.comparison import Comparison, claim
from mechanisms.reproduce.kiper_formulas import formulas
from mechanisms.task import Task

__all__ = ["comparisons", "three_pose_task", "two_pose_task"]

#: The offset of the reference points that the three-pose example does not print.
OFFSET = 45 + 15j
#: Table 1: poses, equations -> unknowns, equations, free selections as printed.
TABLE = {(2, "(1–3)"): (9, 6, 3), (2, "(4–5)"): (10, 4, 6), (3, "(1–3)"): (10, 10, 0), (3, "(4–5)"): (12, 8, 4)}


_Poses = Sequence[tuple[complex, float]]


def two_pose_task(**free: Any) -> Task:
    """The example of Sect. 3, with its free choices or others."""
    chosen = free or {
        "beta2_deg": -90.0,
        "W1_x": -35.0,
        "Z1_x": 6.0,
        "eta2_deg": -60.0,
        "W3_x": -30.0,
        "W3_y": 5.0,
        "phi2_deg": -100.0,
        "W4_x": -5.0,
        "W4_y": 10.0,
    }
    return _task([(0, 0), (40 + 15j, -120)], [(20, 0), (40 - 5j, -60)], chosen)


def three_pose_task(eta3_deg: float = -20.0) -> Task:
    """The example of Sect. 4, with the offset that is not printed."""
    p = [(0, 0), (15 + 5j, -45), (25 + 10j, -30)]
    q = [(OFFSET, 0), (OFFSET + 20 + 10j, -60), (OFFSET + 30 + 5j, -45)]
    free = {"eta2_deg": -15.0, "eta3_deg": eta3_deg, "phi2_deg": -20.0, "phi3_deg": -45.0}
    return _task(p, q, free)


def comparisons() -> list[Comparison]:
    """Every printed number, formula and claim of the paper."""
    return [*_table_1(), *formulas(), *_two_poses(), *_three_poses()]


def _table_1() -> list[Comparison]:
    """Counts from the symbols that occur in the equations: two scalars a vector, one a rotation."""
    items = []
    for (poses, numbers), printed in TABLE.items():
        which = (1, 2, 3) if numbers == "(1–3)" else (4, 5)
        ours = count(poses, which)
        words = ", ".join("–" if n == 0 else str(n) for n in printed)
        holds = ours == printed
        what = f"{poses} poses, Eqs. {numbers}"
        items.append(Comparison("Table 1", what, words.replace("–", "0"), ours, "" if holds else "count differs"))
    unknowns, equations, _ = count(4, (1, 2, 3))
    why = f"four poses: {equations} equations (1)–(3) for {unknowns} unknowns"
    items.append(claim("Sect. 2", "more than three poses are not possible", equations > unknowns, why))
    return items


def count(poses: int, numbers: tuple[int, ...]) -> tuple[int, int, int]:
    """Scalar unknowns, scalar equations and free choices of some of Eqs. (1)–(5).

    >>> count(3, (1, 2, 3)), count(4, (1, 2, 3))
    ((10, 10, 0), (11, 14, 0))
    """
    equations = {
        str(e): e for pose in range(2, poses + 1) for k, e in dyad_equations(pose).items() if k in numbers
    }
    symbols = {symbol.name for e in equations.values() for symbol in e.free_symbols}
    vectors = sum(name[0] in "WZ" for name in symbols)
    rotations = sum(name.rstrip("0123456789") in ("beta", "eta", "phi") for name in symbols)
    unknowns = 2 * vectors + rotations
    return unknowns, 2 * len(equations), max(0, unknowns - 2 * len(equations))


def _two_poses() -> list[Comparison]:
    from mechanisms.synthesize import synthesize

    where = "Sect. 3 example"
    (design,) = synthesize(two_pose_task()).designs
    v = {name: complex(value) for name, value in design.parameters.items() if name[0] in "WZ"}
    pivots = {name: (z.real, z.imag) for name, z in design.pivots.items()}
    rows: list[tuple[str, str, Any, str]] = [
        ("W1y", "12.902", v["W1"].imag, ""),
        ("Z1y", "1.268", v["Z1"].imag, ""),
        ("W2", "-3.170 + 12.268i", v["W2"], ""),
        ("Z2", "-5.830 + 1.902i", v["Z2"], ""),
        ("Z3", "-7.887 + 10.207i", v["Z3"], ""),
        ("Z4", "-3.711 + 2.804i", v["Z4"], ""),
    ]
    lengths = {"W1": "37.302", "Z1": "6.133", "W2": "12.671", "Z2": "6.133"}
    lengths |= {"W3": "30.414", "Z3": "12.899", "W4": "11.180", "Z4": "4.651"}
    rows += [(f"|{name}|", printed, abs(v[name]), "") for name, printed in lengths.items()]
    p_coupler, q_coupler = abs(v["Z1"] - v["Z3"]), abs(v["Z2"] - v["Z4"])
    label = f"the number is |Z1 − Z3|, the coupler's length; the sum is {abs(v['Z1'] + v['Z3']):.3f}"
    copied = (
        f"copied from the line above: |Z2 − Z4| = {q_coupler:.3f} is the coupler's length, "
        f"and the sum is {abs(v['Z2'] + v['Z4']):.3f}"
    )
    rows += [
        ("length of P's coupler", "16.515", p_coupler, ""),
        ("… printed as |Z1 + Z3|", "16.515", abs(v["Z1"] + v["Z3"]), label),
        ("length of Q's coupler, printed as |Z2 + Z4|", "16.515", q_coupler, copied),
        ("fixed joint of dyad 1", "(29, -14.170)", pivots["O1"], ""),
        ("fixed joint of dyad 3", "(37.887, -15.207)", pivots["O3"], ""),
        ("fixed joint of dyad 4", "(28.711, -12.804)", pivots["O4"], ""),
    ]
    items = [Comparison(where, what, printed, ours, why) for what, printed, ours, why in rows]
    (other,) = synthesize(two_pose_task(beta2_deg=-90.0, W1_x=-35.0, W1_y=12.9, **_OUTER)).designs
    works = (other.worst_pose_error or 0.0) < 1e-9 and other.linkage is not None
    why = (
        "with β2, W1x and W1y chosen, Eq. (2) gives Z1 and Eqs. (1), (3) W2, Z2, to rounding here; what really "
        "depends on each other for a given β2, whatever the poses, is W1x and W2x, and W1y and W2y"
    )
    items.append(claim("Sect. 3", "W1x and W1y cannot both be selected", not works, why))
    angle = design.min_transmission_deg or 0.0
    why = f"both poses on one branch, in order, driven at the crank; transmission angle at least {angle:.1f}°"
    items.append(claim(where, "the mechanism moves between its two poses (Fig. 3)", design.accepted, why))
    return items


_OUTER = {"eta2_deg": -60.0, "W3_x": -30.0, "W3_y": 5.0, "phi2_deg": -100.0, "W4_x": -5.0, "W4_y": 10.0}


def _three_poses() -> list[Comparison]:
    from mechanisms.synthesize import synthesize

    where = "Sect. 4 example"
    result = synthesize(three_pose_task())
    real = [design for design in result.designs if design.linkage is not None]
    design = min(real, key=lambda d: abs(d.parameters["beta2_deg"] + 5.908))
    v = {name: complex(value) for name, value in design.parameters.items() if name[0] in "WZ"}
    printed = {"W2": 6.848 + 102.869j, "Z2": -14.468 + 2.556j, "W1": -49.057 + 83.162j}
    offset = printed["W2"] + printed["Z2"] - printed["W1"] - v["Z1"]
    eta3 = _printed_eta3()
    w3, z3 = (complex(x) for x in three_pose_dyads((math.radians(-15), eta3), _ALPHA, (15 + 5j, 25 + 10j)))
    copied = "the digits of W1 printed twice; Eq. (15) gives this, and with it Eqs. (1) and (2) hold"
    eta = (
        f"the printed W3, Z3 satisfy Eq. (4) for η2 = −15° and η3 = {math.degrees(eta3):.5f}°, "
        "and are then right to all digits: η3 is the misprint, the vectors are the author's design"
    )
    rows: list[tuple[str, str, Any, str]] = [
        ("β2 (degrees)", "-5.908", design.parameters["beta2_deg"], ""),
        ("β3 (degrees)", "-13.576", design.parameters["beta3_deg"], ""),
        ("W1", "-49.057 + 83.162i", v["W1"], ""),
        ("Z1", "-49.057 + 83.162i", v["Z1"], copied),
        ("W2", "6.848 + 102.869i", v["W2"], ""),
        ("Z2", "-14.468 + 2.556i", v["Z2"], ""),
        ("η3 (degrees)", "-20", math.degrees(eta3), eta),
        ("W3 at η3 = −20°", "-28.833 + 31.755i", v["W3"], "see η3"),
        ("Z3 at η3 = −20°", "-1.233 + 7.690i", v["Z3"], "see η3"),
        ("W3 at the corrected η3", "-28.833 + 31.755i", w3, ""),
        ("Z3 at the corrected η3", "-1.233 + 7.690i", z3, ""),
        ("W4", "-8.850 + 30.196i", v["W4"], ""),
        ("Z4", "-12.185 + 3.517i", v["Z4"], ""),
    ]
    told = f"not printed; W2 + Z2 − W1 − Z1 of the printed solution is {offset.real:.3f} + {offset.imag:.3f}i"
    items = [Comparison(where, "δPQ", "–", OFFSET, told, kind="inferred")]
    items += [Comparison(where, what, text, ours, why) for what, text, ours, why in rows]
    five = sum("degenerate" not in d.reasons for d in result.designs)
    why = (
        f"true, and not sharp: three of the {result.roots['count']} roots, (0, 0), (α2, α3), (γ2, γ3), are every "
        f"task's and no linkage; at most {five} are left, an odd number of them real, here {len(real)}"
    )
    items.append(claim("Sect. 4", "there are at most eight real solutions for β2", five <= 8, why))
    corrected = synthesize(three_pose_task(math.degrees(eta3)))
    good = min(corrected.designs, key=lambda d: abs(d.parameters.get("beta2_deg", 99.0) + 5.908))
    others = [d for d in corrected.designs if d.linkage is not None and d is not good]
    faults = "; ".join(
        f"that at β2 = {d.parameters['beta2_deg']:.2f}°: {', '.join(d.reasons) or 'no defect'}" for d in others
    )
    why = f"at the corrected η3 driven at the crank. The other two real designs have defects ({faults})"
    items.append(claim(where, "the mechanism passes its three poses (Fig. 4)", good.accepted, why))
    items.append(_motion_as_printed(design))
    return items


_ALPHA = (math.radians(-45), math.radians(-30))


def _motion_as_printed(design: Any) -> Comparison:
    why = f"with η3 = −20° as printed it does not: {', '.join(design.reasons) or 'no defect'} defect"
    return claim("Sect. 4 example", "… and with η3 as printed", design.accepted, why)


def _printed_eta3() -> float:
    """The rotation of W3 to pose 3 that the printed vectors belong to, sharpened from their three decimals.

    Eq. (4) for j = 3 gives it to about 1e-5 from the printed W3 and Z3.  The value whose dyad is nearest to the
    printed one is found by minimising over η3 alone; η2 = −15° is as printed.
    """
    from scipy.optimize import minimize_scalar

    w3, z3 = -28.833 + 31.755j, -1.233 + 7.690j
    rough = float(np.angle(1 + (25 + 10j - complex(turn(_ALPHA[1])) * z3) / w3))

    def miss(eta3: float) -> float:
        w, z = three_pose_dyads((math.radians(-15), eta3), _ALPHA, (15 + 5j, 25 + 10j))
        return abs(complex(w) - w3) ** 2 + abs(complex(z) - z3) ** 2

    options = {"xatol": 1e-12}
    best = minimize_scalar(miss, bounds=(rough - 1e-3, rough + 1e-3), method="bounded", options=options)
    return float(best.x)


def _task(p: _Poses, q: _Poses, free: Mapping[str, float]) -> Task:
    def poses(given: _Poses) -> list[dict[str, float]]:
        return [{"x": complex(z).real, "y": complex(z).imag, "angle_deg": float(a)} for z, a in given]

    return Task.from_dict(
        {
            "mechanism": "watt2-two-effectors",
            "effectors": {"P": {"poses": poses(p)}, "Q": {"poses": poses(q)}},
            "free": free,
        }
    )
