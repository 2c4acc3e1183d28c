"""Coupler curves through points: the paper's four-bars, published counts, Roberts' theorem on real linkages."""

import math
from collections import defaultdict

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.catalogue import load
from mechanisms.families.curve_task import CurveTask, degenerate_points
from mechanisms.families.four_bar_generic import _nine_point_orbit
from mechanisms.task import TaskError
from solvers import solve
from solvers.points import PointSet
from tests.mechanisms import suarez

#: C. W. Wampler, A. P. Morgan, A. J. Sommese, Complete solution of the nine-point path synthesis problem for four-bar
#: linkages, J. Mech. Des. 114(1), 1992: problem 3, and what it has.
PROBLEM_3 = [(0.25, 0), (0.52, 0.1), (0.8, 0.7), (1.2, 1), (1.4, 1.3), (1.1, 1.48), (0.7, 1.4), (0.2, 1), (0.02, 0.4)]
REAL_TRIPLES = 64
#: The other problems of the same paper: points, and the numbers of finite roots and of real triples that every detour
#: tried here has found.  Four points of problem 4 are on one line: four cognate triples have a pivot at infinity.
OTHERS = {
    1: (
        [(0.8961867, -0.09802917), (1.2156535, -1.187491), (1.5151435, -0.85449808), (1.6754775, -0.48768058),
         (1.713869, -0.30099232), (1.7215236, 0.03269953), (1.6642029, 0.33241088), (1.4984171, 0.74435576),
         (1.3011834, 0.92153806)],
        8652,
        21,
    ),
    2: (
        [(0, 0), (0.30, -0.1), (0.70, 0), (0.82, 0.2), (0.90, 0.4), (0.90, 0.7), (0.60, 0.7), (0.10, 0.5), (0, 0.3)],
        8652,
        45,
    ),
    4: (
        [(1, 0.875), (0.75, 0.625), (0.5, 0.375), (0.25, 0.125), (0, 0), (0.96824583, 1.32287565),
         (1.56124949, 1.7320508), (1.85404962, 1.93649167), (1.98431348, 2.0)],
        8652 - 24,
        63,
    ),
}  # fmt: skip


def task(points, free=(), **more):
    rows = [{"x": float(x), "y": float(y)} for x, y in points]
    return Task.from_dict({"mechanism": "four-bar-path", "points": rows, "free": dict(free), **more})


def pairs(places):
    return [(z.real, z.imag) for z in places]


@pytest.fixture(scope="module")
def six():
    free = {name: suarez.TABLE_5[name] for name in suarez.CURVE_CHOICES[6]}
    return synthesize(task(pairs(suarez.A_POINTS[:6]), free, solve={"seed": 1}))


@pytest.fixture(scope="module")
def nine():
    return synthesize(task(PROBLEM_3, solve={"seed": 1}))


def test_six_points_give_all_roots_and_the_papers_four_bar(six):
    assert six.roots["count"] == 1320 and six.ledger["failed"] == 0
    real = [d for d in six.designs if d.linkage is not None]
    names = ("x_M", "x_N", "L_MR", "L_NS", "e", "f")
    misses = [max(abs(d.parameters[n] - suarez.TABLE_5[n]) for n in names) for d in real]
    assert sum(miss <= 5.001e-5 for miss in misses) == 1
    for design in real:
        size = max(1.0, design.extent)
        assert abs(design.parameters["g"] - 1.8) < 1e-9 and abs(design.parameters["y_M"] - 0.6) < 1e-9
        assert design.worst_pose_error < 1e-7 * size


def test_moved_points_move_the_linkages(six):
    """Choices are coordinates of the same plane: shifting points and pivots shifts every design."""
    shift = 3.0 - 2.0j
    free = {"y_M": 0.6 - 2.0, "y_N": -3.25 - 2.0, "g": 1.8}
    moved = synthesize(task(pairs(suarez.A_POINTS[:6] + shift), free, solve={"seed": 2}))
    pivots = [
        sorted((round(d.pivots["M"].real + dx, 5), round(d.pivots["N"].real + dx, 5)) for d in r.designs if d.linkage)
        for r, dx in ((six, 3.0), (moved, 0.0))
    ]
    near = [p for p in pivots[0] if max(map(abs, p)) < 50]
    found = np.array(pivots[1])
    assert len(near) > 50
    assert all(np.abs(found - p).max(axis=1).min() < 1e-4 for p in near)


@pytest.mark.slow
def test_problem_3_has_64_real_cognate_triples(nine):
    assert nine.roots["count"] == 8652
    curves = defaultdict(list)
    for design in nine.designs:
        if "complex" not in design.reasons:
            curves[design.extra["curve"]].append(design)
    assert len(curves) == REAL_TRIPLES
    assert {len(group) for group in curves.values()} == {6}


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("number", OTHERS)
def test_other_problems_have_whole_triples(number, seed):
    """Every finite root is proved, and with a root the five others of its orbit are there."""
    points, finite, triples = OTHERS[number]
    part = CurveTask(np.array([complex(*p) for p in points]), {})
    found = solve(part.system(), part.values, start=load("four-bar-path:9"), seed=seed)
    assert found.ledger.finite == found.certificate.distinct == finite
    assert found.ledger.at_infinity == 8652 - finite and not found.ledger.failed
    known = PointSet(24, 1e-5)  # cognates of ill-conditioned roots lose half of their digits
    known.add(found.points)
    assert all((known.find(image) >= 0).all() for image in _nine_point_orbit(found.points, part.values))
    assert part.problem().real(found.points).sum() == 6 * triples


@pytest.mark.slow
def test_cognates_draw_one_curve(nine):
    """The coupler curve of one four-bar, from its motion, satisfies Eq. (19) with the parameters of its cognates."""
    import sympy

    from mechanisms.closure import Closure
    from mechanisms.curve import trace
    from mechanisms.families.wanzer_equations import coupler_curve_equation

    equation = coupler_curve_equation()
    value = sympy.lambdify((*equation.unknowns, *equation.point), equation.equation, cse=True)
    curves = defaultdict(list)
    for design in nine.designs:
        if design.linkage is not None:
            curves[design.extra["curve"]].append(design)
    for group in list(curves.values())[::9]:
        closure = Closure.of(group[0].linkage)
        circuit = trace(closure)
        states = circuit.at(np.linspace(0, circuit.arcs, 40))[0]
        path = np.array([closure.points_at(state)["A"] for state in states])
        pivots = {tuple(sorted(round(z.real, 6) for z in design.pivots.values())) for design in group}
        assert len(pivots) == 3
        for design in group:
            numbers = [design.parameters[str(name)] for name in equation.unknowns]
            on = np.abs(value(*numbers, path.real, path.imag))
            off = np.abs(value(*numbers, path.real + 0.01, path.imag))
            assert np.median(on) < 1e-6 * np.median(off)


@pytest.mark.slow
def test_a_known_four_bar_is_found_from_nine_of_its_points():
    """Made the other way round: points of a random crank-rocker lead back to it and to both of its cognates."""
    m, n, crank, coupler, rocker, arm = 0.3 + 0.2j, 2.1 + 0.4j, 0.6, 1.7, 1.2, 0.8 + 0.9j
    places = []
    for angle in np.linspace(0, 2 * math.pi, 9, endpoint=False):
        r = m + crank * np.exp(1j * angle)
        d = abs(n - r)
        turn = (n - r) / d * np.exp(1j * math.acos((coupler**2 + d**2 - rocker**2) / (2 * coupler * d)))
        places.append(r + arm * turn)
    result = synthesize(task(pairs(places), solve={"seed": 5}))
    good = [d for d in result.accepted if d.full_rotation]
    found = [d for d in good if abs(d.pivots["M"] - m) < 1e-6 and abs(d.pivots["N"] - n) < 1e-6]
    assert len(found) == 1
    assert found[0].parameters["L_MR"] == pytest.approx(crank, abs=1e-7)
    assert found[0].parameters["L_NS"] == pytest.approx(rocker, abs=1e-7)
    same = [d for d in result.designs if d.linkage and d.extra["curve"] == found[0].extra["curve"]]
    assert len(same) == 6


@pytest.mark.parametrize(
    "points, free, message",
    [
        ([(k, 0.5 * k) for k in range(9)], {}, "on one line"),
        ([(math.cos(k), math.sin(k)) for k in range(7)] + [(3, 0), (4, 1)], {}, "on one circle"),
        ([(math.cos(k), math.sin(k)) for k in range(8)], {"g": 1.0}, "on one circle"),
        ([(k, k**2) for k in range(8)], {}, "as the paper chooses g"),
        ([(k, k**2) for k in range(7)], {"g": 1.0}, "too few"),
        ([(k, k**2) for k in range(9)], {"g": 1.0}, "too many"),
        ([(k, k**2) for k in range(8)], {"L_MR": -1.0}, "positive length"),
        ([(k, k**2) for k in range(5)], {}, "5 given"),
        ([(0, 0), (1, 1), (2, 4), (0, 0), (3, 9), (4, 16)], {"g": 1, "y_M": 1, "y_N": 1}, "the same"),
    ],
)
def test_points_and_choices_without_sense_are_explained(points, free, message):
    with pytest.raises(TaskError, match=message):
        task(points, free)


def test_points_on_a_line_are_named_in_the_evidence():
    """Two lines meet in problem 4; the longer one is named.  General points are not suspected."""
    for points, line in ((OTHERS[4][0], "points 0, 1, 2 and 3 are on one line"), (OTHERS[1][0], "")):
        evidence = CurveTask(np.array([complex(*p) for p in points]), {}).problem().evidence
        assert ("on one line" in evidence) == bool(line) and line in evidence


def test_six_points_on_a_line_are_allowed():
    assert degenerate_points(np.arange(6) + 0j) == ""
    assert "line" in degenerate_points(np.array([0, 1, 2, 3, 4, 5, 6.5, 1j]))
    assert degenerate_points(np.exp(1j * np.arange(6))) == ""
