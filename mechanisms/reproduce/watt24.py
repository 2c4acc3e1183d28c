"""Watt II through 24 points: the printed linkage, its vectors, its recipe and its claims, computed again."""

from __future__ import annotations

import numpy as np

from mechanisms.families.watt2_path import (
    WattLinkage,
    fit_watt,
    rank_of_equation_3,
    recipe_with_given_angles,
)
from mechanisms.reproduce.comparison import Comparison, claim

__all__ = ["POINTS", "THETA", "comparisons", "printed_linkage"]

#: Sect. IV: the precision points, in metres.
POINTS = np.array(
    [
        0.344 + 0.527j, 0.284 + 0.523j, 0.224 + 0.508j, 0.169 + 0.483j, 0.121 + 0.449j, 0.082 + 0.408j,
        0.054 + 0.365j, 0.037 + 0.321j, 0.031 + 0.280j, 0.036 + 0.244j, 0.049 + 0.216j, 0.071 + 0.197j,
        0.098 + 0.190j, 0.132 + 0.195j, 0.170 + 0.215j, 0.214 + 0.249j, 0.269 + 0.295j, 0.335 + 0.349j,
        0.406 + 0.395j, 0.462 + 0.429j, 0.485 + 0.456j, 0.477 + 0.481j, 0.446 + 0.503j, 0.400 + 0.520j,
    ]
)  # fmt: skip
#: Equal steps of one anticlockwise turn; its end is not a point of its own.
THETA = np.radians(15.0 * np.arange(24))
#: Sect. VI: lengths in metres, angles in degrees.
PRINTED = {
    "Z1": (0.223, 88.35), "Z2": (0.587, 210.88), "Z3": (0.313, 40.57), "Z4": (0.283, 200.19), "Z5": (0.281, 80.33),
    "Z6": (0.249, 96.37), "Z7": (0.525, 87.83), "Z8": (0.173, 56.15), "Z9": (0.286, 152.12), "Z10": (0.490, 0.01),
    "Z11": (0.203, 0.05),
}  # fmt: skip
#: Sect. IV: ranges of the rotations, degrees.
RANGES = {"alpha": (0.0, 60.0), "beta": (-15.0, 60.0), "gamma": (-22.5, 75.0), "phi": (-7.5, 11.25)}
#: A printed length and angle are right when the vector is within the rounding of both.
ROUNDING = 1.5e-3


def printed_linkage() -> WattLinkage:
    """The printed vectors, home at the first point."""
    z = {name: length * np.exp(1j * np.radians(angle)) for name, (length, angle) in PRINTED.items()}
    return WattLinkage(POINTS[0] - z["Z1"] - z["Z3"], z["Z1"], z["Z3"], z["Z4"], z["Z7"], z["Z6"], z["Z8"], z["Z9"])


def comparisons() -> list[Comparison]:
    """Every printed number and claim of the paper."""
    return [*_vectors(), *_recipe(), *_motion(), *_better()]


def _vectors() -> list[Comparison]:
    items = []
    for name, value in printed_linkage().derived().items():
        length, angle = PRINTED[name]
        near = abs(value - length * np.exp(1j * np.radians(angle))) < ROUNDING
        why = f"{abs(value):.4f} ∠ {np.degrees(np.angle(value)) % 360:.2f}° from the other printed vectors"
        items.append(claim("Eqs. (4)–(7)", f"{name} = {length} ∠ {angle}°, to the rounding of the others", near, why))
    return items


def _recipe() -> list[Comparison]:
    share = np.arange(24) / 24
    ramps = {name: np.radians(low + (high - low) * share) for name, (low, high) in RANGES.items()}
    where = "Sect. V, steps 3–6"
    true = printed_linkage().rotations(THETA)
    pairs = [("Z1", "Z3", THETA, "alpha", 1), ("Z7", "Z4", None, "alpha", 2)]
    items = []
    for first, second, crank, angle, number in pairs:
        start = THETA if crank is not None else ramps["beta"]
        _, _, rms = recipe_with_given_angles(POINTS, start, ramps[angle])
        why = f"with rotations that run evenly through the printed ranges (1)–(2) leave a residual of {rms:.3f} m"
        items.append(claim(where, f"Eq. ({number}) with assumed rotations gives {first}, {second}", rms < 1e-3, why))
        start = THETA if crank is not None else true["beta"]
        z, w, rms = recipe_with_given_angles(POINTS, start, true[angle])
        near = all(
            abs(value - PRINTED[name][0] * np.exp(1j * np.radians(PRINTED[name][1]))) < ROUNDING
            for name, value in ((first, z), (second, w))
        )
        why = f"the rotations of the real motion give the printed vectors, with a residual of {rms:.1e} m"
        items.append(claim(where, f"{first}, {second} follow from Eq. ({number}) with the true rotations", near, why))
    inside = all(
        low - 1e-9 <= np.degrees(true[name]).min() and np.degrees(true[name]).max() <= high
        for name, (low, high) in RANGES.items()
    )
    why = "the ranges are envelopes of rotations that are far from linear"
    items.append(claim("Sect. IV", "the rotations of the linkage stay within the printed ranges", inside, why))
    rank, values = rank_of_equation_3(printed_linkage(), THETA)
    why = f"singular values {values[0]:.3g}, {values[1]:.3g}, {values[2]:.1e}: rank {rank}; the loop's scale is free"
    items.append(claim("Sect. V, step 7", "Eq. (3) determines Z8, Z9 and Z6", rank == 3, why))
    return items


def _motion() -> list[Comparison]:
    errors = np.abs(printed_linkage().trace(THETA) - POINTS)
    swing = np.linspace(0, 2 * np.pi, 400)
    closes = bool(np.all(np.isfinite(printed_linkage().rotations(swing)["gamma"])))
    rms, worst = float(np.sqrt(np.mean(errors**2))), float(errors.max())
    return [
        claim("Fig. 3", "the linkage can turn fully and traces the path", closes, f"rms error {1e3 * rms:.2f} mm"),
        Comparison("Sect. VI", "rms distance of the real motion, m", "", rms, "simulated", kind="inferred"),
        Comparison("Sect. VI", "largest distance of the real motion, m", "", worst, "simulated", kind="inferred"),
    ]


def _better() -> list[Comparison]:
    first, second = fit_watt(POINTS, THETA, exact_first=True)[:2]
    words = "home at the first point, 15° steps; two timed cognates draw the same curve"
    return [
        Comparison("–", "least rms distance with this timing, m", "", first.rms, words, kind="inferred"),
        Comparison("–", "… its largest distance, m", "", first.worst, repr(first.crank_fits), kind="inferred"),
        Comparison("–", "crank of the cognate, m", "", abs(first.design.z1), "", kind="inferred"),
        Comparison("–", "crank of the printed linkage's kind, m", "", abs(second.design.z1), "", kind="inferred"),
    ]
