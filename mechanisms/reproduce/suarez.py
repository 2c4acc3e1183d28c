"""The modified Wanzer linkage of Suárez-Velásquez, Cervantes-Sánchez and Rico-Martínez, computed again.

Tables 5 and 6 are looked up among all solutions of the program's own solves; the printed equations are evaluated at
random data beside what SymPy makes of the geometry.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Candidate
from mechanisms.families.curve_task import CurveTask
from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_linkage import CurveFourBar, modified_linkage, modified_poses
from mechanisms.families.trammel_task import Placed, TrammelTask
from mechanisms.reproduce.comparison import Comparison, claim
from mechanisms.reproduce.suarez_formulas import formulas
from mechanisms.task import Task

__all__ = ["TABLES", "comparisons", "poses_task"]

#: Table 4: x, y, β in degrees.
POSES = (
    (0.00, 0.00, 90.00),
    (0.45, 0.24, 77.36),
    (1.32, 0.42, 55.03),
    (2.29, 0.17, 30.20),
    (2.88, -0.43, 10.03),
    (2.95, -0.97, 1.71),
    (2.60, -1.26, 10.03),
    (1.93, -1.57, 30.20),
)
#: L_AP and δ of all three examples.
L_AP, DELTA_DEG = 2.0, 240.0
#: Tables 5, 6, 7 as printed, by the number of poses.
TABLES: dict[int, dict[str, str]] = {
    6: {
        "x_B": "1.9791", "y_B": "0.2393", "x_C": "0.0000", "y_C": "-0.6422", "x_Q": "1.3258", "y_Q": "-1.8860",
        "theta0": "0.0000", "a": "-2.1252", "b": "1.3258", "x_M": "-0.6476", "y_M": "0.6000", "x_N": "-2.3886",
        "y_N": "-3.2500", "e": "0.6259", "f": "2.4334", "g": "1.8000", "L_MR": "1.0570", "L_NS": "2.2288",
    },
    7: {
        "x_B": "1.7931", "y_B": "-0.0273", "x_C": "1.2916", "y_C": "-1.0358", "x_Q": "1.5249", "y_Q": "-1.5556",
        "theta0": "0.0000", "a": "-1.5284", "b": "0.2333", "x_M": "0.3259", "y_M": "2.0997", "x_N": "-1.3909",
        "y_N": "-1.7500", "e": "2.3850", "f": "1.1688", "g": "1.8000", "L_MR": "1.1179", "L_NS": "1.8230",
    },
    8: {
        "x_B": "-1.0555", "y_B": "-3.1004", "x_C": "3.6548", "y_C": "-0.7435", "x_Q": "3.5231", "y_Q": "-3.3015",
        "theta0": "-2.8999", "a": "0.0306", "b": "-0.0023", "x_M": "2.4618", "y_M": "2.6287", "x_N": "6.3114",
        "y_N": "-6.8307", "e": "2.8766", "f": "0.2351", "g": "2.2857", "L_MR": "2.1484", "L_NS": "10.5636",
    },
}  # fmt: skip
#: Table 2: what is chosen.
TRAMMEL_CHOICE = {6: ("theta0", "x_C"), 7: ("theta0",)}
CURVE_CHOICE = {6: ("y_M", "y_N", "g"), 7: ("y_N", "g"), 8: ("g",)}
TRAMMEL = ("x_B", "y_B", "x_C", "y_C", "x_Q", "y_Q")
CURVE = ("x_M", "y_M", "x_N", "y_N", "L_MR", "L_NS", "e", "f", "g")
_SIGN_OF_A = "the sign is opposite to Eq. (1), in all three tables; b agrees with Eq. (3)"


def poses_task(poses: int, **free: float) -> Task:
    """The first poses of Table 4.

    >>> poses_task(7)
    Task('rotatory-trammel', body: 7 poses)
    """
    rows = [{"x": x, "y": y, "angle_deg": angle} for x, y, angle in POSES[:poses]]
    return Task.from_dict({"mechanism": "rotatory-trammel", "poses": rows, "free": free})


def a_points(poses: int) -> NDArray[np.complex128]:
    """The places of A by Eq. (18)."""
    return np.array(
        [complex(x, y) + L_AP * np.exp(1j * math.radians(angle + DELTA_DEG - 90.0)) for x, y, angle in POSES[:poses]]
    )


def comparisons() -> list[Comparison]:
    """Every printed number, formula and claim that can be computed."""
    items = [*_table_1(), *formulas(), *_table_2()]
    for poses in (6, 7):
        items += _example(poses)
    return [*items, *_third_example()]


def _table_1() -> list[Comparison]:
    from mechanisms.families.wanzer_equations import gauge_derivatives

    derivative, _ = gauge_derivatives()
    why = (
        "turning B and C about their midpoint with the disk changes nothing: the derivative of Eq. (16) along this "
        f"field is {derivative} identically, so that seven unknowns are six essential ones"
    )
    return [
        Comparison("Table 1", "unknowns of Eq. (6), and most poses", "2, 3", (2, 3)),
        Comparison("Table 1", "essential unknowns of Eq. (16), and most poses", "7, 8", (6, 7), why),
    ]


def _table_2() -> list[Comparison]:
    """Design parameters and free ones must add up; those of Eq. (17) by the essential ones."""
    items = []
    for poses, printed in ((6, "5, 2"), (7, "6, 1"), (8, "7, 0")):
        equations = poses - 1
        essential = 6
        why = "" if equations <= essential else "seven equations, six essential parameters: over-determined by one"
        ours = (min(equations, essential), 7 - min(equations, essential))
        items.append(Comparison("Table 2", f"Eq. (17), {poses} poses: parameters, free", printed, ours, why))
    for poses, printed in ((6, "6, 3"), (7, "7, 2"), (8, "8, 1")):
        items.append(Comparison("Table 2", f"Eq. (19), {poses} poses: parameters, free", printed, (poses, 9 - poses)))
    return items


def _example(poses: int) -> list[Comparison]:
    table, where = TABLES[poses], f"Table {poses - 1}"
    trammels, trammel_count = _trammels(poses)
    four_bars, curve_count = _four_bars(poses)
    trammel = _nearest(trammels, table, TRAMMEL, lambda found: found.parameters())
    four_bar = _nearest(four_bars, table, CURVE, lambda found: found.four_bar.parameters())
    items = _numbers(where, table, trammel.parameters(), TRAMMEL, TRAMMEL_CHOICE[poses])
    items += [
        Comparison(where, "a", table["a"], trammel.trammel.a, _SIGN_OF_A),
        Comparison(where, "b", table["b"], trammel.trammel.b),
    ]
    items += _numbers(where, table, four_bar.four_bar.parameters(), CURVE, CURVE_CHOICE[poses])
    items += [
        Comparison(where, "trammels, real", "", (trammel_count, len(trammels)), kind="inferred", why="all of them"),
        Comparison(where, "four-bars, real", "", (curve_count, len(four_bars)), kind="inferred", why="all of them"),
    ]
    verdict = _verdict(poses, trammel, four_bar.four_bar)
    what = "free of branch and order defects, driven by the crank MR"
    why = f"{verdict!r}".removeprefix("Verdict(").removesuffix(")")
    return [*items, claim(f"Sect. 9.{poses - 5}", what, not verdict.reasons, why)]


def _numbers(
    where: str,
    table: Mapping[str, str],
    ours: Mapping[str, float],
    names: Iterable[str],
    chosen: Iterable[str],
) -> list[Comparison]:
    return [Comparison(where, name, table[name], ours[name]) for name in names if name not in chosen]


@cache
def _trammels(poses: int) -> tuple[list[Placed], int]:
    """Real trammels for the first poses, and the number of complex ones."""
    free = {"theta0_deg": 0.0, "x_C": 0.0} if poses == 6 else {"theta0_deg": 0.0}
    part = TrammelTask(poses_task(poses, **free))
    solutions = _solve(part.problem())
    found = [each for each in part.trammels(solutions) if not isinstance(each, Candidate)]
    return found, len(solutions.points)


@cache
def _four_bars(poses: int) -> tuple[list[Any], int]:
    """Real four-bars for the places of A, and the number of complex ones."""
    chosen = {name: float(TABLES[poses][name]) for name in CURVE_CHOICE[poses]}
    part = CurveTask(a_points(poses), chosen)
    solutions = _solve(part.problem())
    found = [each for each in part.four_bars(solutions) if not isinstance(each, Candidate)]
    return found, len(solutions.points)


def _solve(problem: Any, certificates: bool = False) -> Any:
    from mechanisms.catalogue import generic
    from solvers import solve

    start = generic(problem.catalogue)
    return solve(problem.system, problem.parameters, start, seed=1, certificates=certificates)


def _nearest(
    found: Iterable[Any], table: Mapping[str, str], names: Iterable[str], of: Callable[[Any], Mapping[str, float]]
) -> Any:
    """The solution that the authors printed."""
    printed = {name: float(table[name]) for name in names}

    def distance(each: Any) -> float:
        values = of(each)
        return max(abs(values[name] - value) for name, value in printed.items())

    return min(found, key=distance)


def _verdict(poses: int, trammel: Placed, four_bar: CurveFourBar) -> Any:
    from mechanisms.motion import judge

    part = TrammelTask(poses_task(poses))
    linkage = modified_linkage(trammel.trammel, four_bar)
    return judge(linkage, "crank", modified_poses(trammel.disk, part.turns, four_bar))


def _third_example() -> list[Comparison]:
    """Table 7: an exact four-bar, a trammel that is none."""
    from mechanisms.families.base import Solved
    from mechanisms.families.eight_absence import absence
    from mechanisms.families.eight_poses import seven_of
    from mechanisms.families.wanzer_modified import trammel_signs

    table = TABLES[8]
    four_bars, count = _four_bars(8)
    four_bar = _nearest(four_bars, table, CURVE, lambda found: found.four_bar.parameters())
    items = _numbers("Table 7", table, four_bar.four_bar.parameters(), CURVE, CURVE_CHOICE[8])
    items.append(Comparison("Table 7", "four-bars, real", "", (count, len(four_bars)), "all of them", kind="inferred"))

    printed = {name: float(table[name]) for name in TRAMMEL}
    theta0 = math.radians(float(table["theta0"]))
    trammel = Trammel(
        complex(printed["x_B"], printed["y_B"]),
        complex(printed["x_C"], printed["y_C"]),
        complex(printed["x_Q"], printed["y_Q"]),
        theta0,
    )
    items.append(Comparison("Table 7", "a", table["a"], round(trammel.a, 4), _SIGN_OF_A))
    residual, nearest = _least_squares(trammel)
    why = (
        f"Eq. (17) has no solution near it: its residual comes down to {residual:.6e} and no further, at "
        f"x_B, … y_Q = {', '.join(f'{value:.6f}' for value in nearest)}; the Jacobian is singular (the gauge)"
    )
    items.append(claim("Table 7", "the trammel visits eight poses exactly", residual < 1e-9, why))
    task = poses_task(8)
    problem = seven_of(task).problem()
    proof = absence(task, Solved(problem, _solve(problem, certificates=True)))
    why = (
        f"at {proof.excluded} of the {proof.roots} roots of the first seven poses the eighth equation is proved not to "
        f"hold; it is at least {proof.least:.1e}"
    )
    items.append(claim("Sect. 9.3", "the eight poses of Table 4 can be visited exactly", not proof.proved, why))
    signs = trammel_signs(
        trammel,
        complex(a_points(1)[0]),
        np.array([complex(x, y) for x, y, _ in POSES]),
        np.radians([angle - POSES[0][2] for *_, angle in POSES]),
        trammel.disk_turns(
            [complex(x, y) for x, y, _ in POSES], [math.radians(angle - POSES[0][2]) for *_, angle in POSES]
        ),
    )
    both = bool(signs.min() < 0 < signs.max())
    why = f"the trammel's determinant has the signs {', '.join('+' if s > 0 else '−' for s in signs)} in poses 0 … 7"
    return [*items, claim("Sect. 9.3.1", "the third example is not free of branch defects", both, why)]


def _least_squares(trammel: Trammel) -> tuple[float, tuple[float, ...]]:
    """Where Gauss and Newton's method on Eq. (14) ends, θ₀ kept: norm of what is left, and the parameters."""
    import sympy
    from scipy.optimize import least_squares

    from mechanisms.families.wanzer_equations import trammel_equations

    equations = trammel_equations()
    residual = sympy.lambdify((*equations.unknowns, *equations.pose), equations.synthesis / 2, cse=True)
    poses = [(x, y, math.radians(angle - POSES[0][2])) for x, y, angle in POSES[1:]]

    def left(values: NDArray[np.float64]) -> list[float]:
        return [residual(*values, trammel.theta0, *pose) for pose in poses]

    start = [part for z in (trammel.B, trammel.C, trammel.Q) for part in (z.real, z.imag)]
    found = least_squares(left, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, method="lm")
    return float(np.linalg.norm(found.fun)), tuple(map(float, found.x))
