"""Coupled serial chains: the tables, equations and claims of Krovi, Ananthasuresh and Kumar, computed again."""

from __future__ import annotations

import numpy as np

from mechanisms.families.chain import SerialChain, chain_for_points, free_choices, link_matrix
from mechanisms.families.kinetostatics import Load, Springs, energy, input_torque
from mechanisms.families.peak_torque import PeakTask, least_peak_torque, solve_links
from mechanisms.families.torque_profile import match_profile
from mechanisms.reproduce.comparison import Comparison, claim, formula

__all__ = ["comparisons", "feeder"]

#: Example A: the plate and the mouth, cm, and the load, N.
PLATE, MOUTH, LOAD = -18.29 + 4.41j, 25.19 + 25.19j, Load(-1j)


def feeder(degrees: float = 60.0, longest: float = 50.0) -> PeakTask:
    """Example A with bounds; the paper prints none."""
    rotation = (float(np.radians(10.0)), float(np.radians(degrees)))
    return PeakTask(PLATE, MOUTH, LOAD, rotation=rotation, longest=longest, stiffest=20.0)


def comparisons() -> list[Comparison]:
    """Every printed number, formula and claim of the paper."""
    return [*_tables(), *_formulas(), *_example_a(), *_example_b()]


def _tables() -> list[Comparison]:
    items = []
    printed = {2: ("7, 3", "6, 6"), 3: ("10, 5", "9, 9"), 4: ("13, 6", "12, 12"), 5: ("16, 8", "15, 15")}
    for links, rows in printed.items():
        for guided, words in zip((True, False), rows):
            most = max(m for m in range(2, 40) if free_choices(links, m, guided) >= 0)
            what = f"N = {links}, {'guidance' if guided else 'path'}: free choices at M = 0, largest M"
            items.append(Comparison("Table 1", what, words, (free_choices(links, 0, guided), most)))
    for spring, printed_row, extra in (("no springs", "6, 4, 2", 0), ("Ω = θ", "8, 6, 4", 2), ("Ω ≠ θ", "10, 8, 6", 4)):
        # Z0, Z1, Z2, R1 and M − 1 rotations, springs; 3 equations for each point
        ours = tuple(float(6 + extra - 2 * m) for m in range(3))
        items.append(Comparison("Table 2", f"free choices at M = 0, 1, 2, {spring}", printed_row, ours))
    why = "three equations for each of five points, and M + 8 variables"
    items.append(Comparison("Table 2", "M = 5, Ω = θ: equations, variables", "10, 13", (15.0, 13.0), why))
    return items


def _formulas() -> list[Comparison]:
    rng = np.random.default_rng(4)
    ratio, phi = -1.7, rng.uniform(-2, 2, 5)
    chain = SerialChain(0.3j, (1.1 - 0.4j, 0.7 + 0.9j), (1.0, ratio))
    moves = chain.tip(phi) - chain.tip(0.0)
    links = np.array(chain.links)
    rates = np.array([1.0, ratio])
    load, springs = Load(0.4 - 1.3j, 0.6), Springs((2.0, 3.0), (0.2, -0.4))
    slope = (energy(chain, phi + 1e-5, load, springs) - energy(chain, phi - 1e-5, load, springs)) / 2e-5
    torque = input_torque(chain, phi, load, springs)
    items = [
        formula("Eq. (3)", "matrix entries e^{iRφ−1}", lambda: np.exp(1j * np.outer(phi, rates) - 1) @ links,
                lambda: moves, "e^{iRφ} − 1: the 1 is not in the exponent", lambda: link_matrix(rates, phi) @ links),
        claim("Eqs. (7), (11)", "the torque is the slope of the energy", bool(np.allclose(torque, slope, atol=1e-6)),
              "difference quotients of the potential of load and springs"),
    ]  # fmt: skip
    items += [_sign_of_14(), _columns_of_15()]
    square = chain_for_points(list(chain.tip(np.r_[0.0, phi[:2]])), (1.0, ratio), phi[:2])
    why = "N + 1 points give the links of a known chain back"
    good = bool(np.allclose(square.links, chain.links))
    return [*items, claim("Eq. (4)", "linear up to M = N + 1 points", good, why)]


def _sign_of_14() -> Comparison:
    """Links by the last row as printed and as corrected; the torque in the last position must vanish."""
    task, phi = feeder(180.0, 500.0), float(np.radians(90))
    springs = Springs((5.0, 2.0))
    ends = []
    for sign in (-1.0, 1.0):  # −T_S2 is what springs of negative stiffness would ask for
        links = solve_links(task, 2, [-1.5, phi, sign * 5.0, sign * 2.0])[0][0]
        chain = SerialChain(0, tuple(links), (1.0, -1.5))
        ends.append(abs(float(input_torque(chain, phi, LOAD, springs))))
    why = f"with +T_S2 the last position is free of torque; with −T_S2 {ends[0]:.1f} N·cm are left"
    return Comparison("Eq. (14)", "−T_S2 in the last row", "formula", ends[0] < 1e-9, why, "formula", ends[1] < 1e-9)


def _columns_of_15() -> Comparison:
    """Stiffnesses by the spring columns as printed and as corrected; both ends must be free of torque."""
    task, ratio = feeder(180.0, 500.0), -1.5
    phi, *angles = (float(np.radians(v)) for v in (90, -30, 100, 200, 50))
    theta, psi = np.array(angles[:2]), np.array(angles[2:])
    links = solve_links(task, 3, [ratio, phi, *theta, *(psi - theta)])[0][0]
    chain = SerialChain(0, tuple(links), (1.0, ratio))
    held = input_torque(chain, np.array([0.0, phi]), LOAD)
    d1, d2 = theta[0] - psi[0], (theta[1] - psi[1]) - (theta[0] - psi[0])
    deflected = np.array([[d1, d2], [d1 + phi, d2 + (ratio - 1) * phi]])
    left = []
    for factor in (1.0, ratio - 1.0):
        stiffness = np.linalg.solve(deflected * np.array([1.0, factor]), -held)
        work = deflected @ (stiffness * np.array([1.0, ratio - 1.0]))
        left.append(float(np.abs(held + work).max()))
    why = f"D11, (R−1)·D12, D21, (R−1)·D22; as printed {left[0]:.1f} N·cm are left at an end"
    return Comparison(
        "Eq. (15)", "spring columns without (R−1)", "formula", left[0] < 1e-9, why, "formula", left[1] < 1e-9
    )


def _example_a() -> list[Comparison]:
    task = feeder()
    first = least_peak_torque(task, 1)
    second = least_peak_torque(task, 2)
    third = least_peak_torque(task, 3, samples=2**13)
    where, bounds = "Example A", "for φ2 ≤ 60°, links ≤ 50 cm, κ ≤ 20; the paper prints no bounds and no values"
    gain = first.peak / second.peak
    why = (
        f"best peak {second.peak:.3f} N·cm as without springs: relaxed in the lower position they only add energy, and "
        f"the peak cannot fall below {first.bound:.3f}; −T_S2 in Eq. (14) stands for negative stiffness"
    )
    links = solve_links(task, 1, [-1.5, np.radians(90)])[0][0]
    half_turn = least_peak_torque(feeder(180.0), 1)
    energy_of = "the same work against the load, over the rotation that is used"
    return [
        Comparison(where, "gain of height times load, N·cm", "20.78", task.work),
        Comparison(where, "Case I, R = −1.5, φ2 = 90°: Z1", "", complex(links[0]), "Eq. (12)", kind="inferred"),
        Comparison(where, "Case I: least peak torque, N·cm", "", first.peak, bounds, kind="inferred"),
        Comparison(where, "… and its energy bound 20.78/|φ2|", "", first.bound, energy_of, kind="inferred"),
        Comparison(where, "Case I, φ2 ≤ 180°: least peak torque, N·cm", "", half_turn.peak,
                   "half the work: T = 10.39 sin φ, by many chains near R = −1", kind="inferred"),
        Comparison(where, "… and its energy bound 20.78/|φ2|", "", half_turn.bound, energy_of, kind="inferred"),
        Comparison(where, "Case II: least peak torque, N·cm", "", second.peak, "no better than without springs",
                   kind="inferred"),
        Comparison(where, "… and its energy bound", "", second.bound, "", kind="inferred"),
        claim(where, "Case II reduces the torque by an order of magnitude", gain > 10, why),
        Comparison(where, "Case III: least peak torque found, N·cm", "", third.peak, bounds, kind="inferred"),
        Comparison(where, "… and its energy bound", "", third.bound, "the springs give what the load takes",
                   kind="inferred"),
        claim(where, "Case III reduces the torque by an order of magnitude", first.peak / third.peak > 10,
              "springs that are wound up in the lower position, by at most 540°"),
    ]  # fmt: skip


def _example_b() -> list[Comparison]:
    items = []
    profiles = {
        "quadratic": (lambda s: s**2 - 0.6 * s - 0.16, lambda s: (s - 0.8) * (s + 0.2)),
        "cubic": (lambda s: s**3 - s**2 + 0.08 * s + 0.064, lambda s: (s - 0.4) * (s - 0.8) * (s + 0.2)),
    }
    grid = np.linspace(0, 1, 7)
    for name, (profile, factors) in profiles.items():
        same = bool(np.allclose(profile(grid), factors(grid)))
        items.append(claim("Fig. 10", f"the {name} profile has simple zeros", same, "its factors multiplied out"))
        for ratio in (2.0, 0.5):
            fit = match_profile(profile, ratio, norm="minimax")
            why = "proved by a linear program for this ratio; it falls as R goes to 0 and |Z2| to infinity"
            items.append(
                Comparison("Fig. 10", f"{name}, R = {ratio:g}: least largest error", "", fit.worst, why, "inferred")
            )
    return items
