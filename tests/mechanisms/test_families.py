"""What every family promises, and what is proved about reality."""

from __future__ import annotations

import ast
from pathlib import Path

import numpy as np
import pytest
from sympy import Rational, symbols

from mechanisms import families
from mechanisms.families.base import BODY, Family
from mechanisms.families.reality import CONJUGATION, UNIT_NUMBERS, exchange, proved_real, real_roots
from mechanisms.tables import family_rows
from solvers import System, certify, solve

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", families.names())
def test_a_family_says_what_it_is(name):
    family = families.family(name)
    assert isinstance(family, Family) and family.name == name
    assert family.summary and family.source and family.unknowns and family.roots
    assert family.pose_counts or family.point_counts
    assert max(*family.pose_counts, *family.point_counts, 0) >= 2
    keys = [item.key for item in family.free]
    assert len(keys) == len(set(keys)) and all(item.meaning for item in family.free)
    assert all((item.kind == "angle") == item.key.endswith("_deg") for item in family.free)
    assert family.effectors == (BODY,) or len(family.effectors) > 1


def test_the_rows_of_the_table_are_plain_data():
    rows = family_rows()
    assert [row["name"] for row in rows] == list(families.names())
    assert all(isinstance(value, (str, list, bool, type(None))) for row in rows for value in row.values())


def test_solvers_know_nothing_of_mechanisms():
    for path in (ROOT / "solvers").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            modules = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            modules += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            assert not any(module.split(".")[0] == "mechanisms" for module in modules), path


def solved(equations, unknowns):
    return solve(System(equations, unknowns), seed=1)


def test_reality_of_plain_coordinates_is_proved():
    x, y = symbols("x y")
    solutions = solved([x**2 + y**2 - 5, x * y - 2], [x, y])
    assert proved_real(solutions.certificate, CONJUGATION).tolist() == [True] * 4
    solutions = solved([x**2 + 1, y - x], [x, y])
    assert not proved_real(solutions.certificate, CONJUGATION).any()


def test_reality_of_unit_numbers_is_proved():
    """2z² − 3z + 2 has its roots on the unit circle; z² − 3z + 1 has a pair 2.6, 0.38 that mirror each other."""
    z = symbols("z")
    on, off = solved([2 * z**2 - 3 * z + 2], [z]), solved([z**2 - 3 * z + 1], [z])
    assert proved_real(on.certificate, UNIT_NUMBERS).all() and real_roots(on.points, UNIT_NUMBERS).all()
    assert not proved_real(off.certificate, UNIT_NUMBERS).any() and not real_roots(off.points, UNIT_NUMBERS).any()


def test_reality_of_isotropic_pairs_is_proved():
    """z z̄ = 1, z + z̄ = s: a point of the unit circle with real part s/2, real for |s| < 2 and not for s = 3."""
    z, zc = symbols("z zc")
    for total, real in ((1, True), (3, False)):
        solutions = solved([z * zc - 1, z + zc - total], [z, zc])
        assert proved_real(solutions.certificate, exchange([1, 0])).tolist() == [real] * 2
        assert real_roots(solutions.points, exchange([1, 0])).tolist() == [real] * 2


def test_reality_is_proved_of_roots_whose_boxes_need_more_than_double_precision():
    """Roots 1e-9 apart have boxes in Arb alone, too narrow for doubles: a pair on the circle, and a pair off it."""
    z, zc, s = symbols("z zc s")
    near = 1 + Rational(1, 10**18)
    for total, unit, real in ((2 / near, 2 / near, True), (2 * near, 2 * near, False)):
        system = System([z * zc - 1, z + zc - total, s**2 - unit * s + 1], [z, zc, s])
        step = 1.4142135623730951e-9 * (1j if real else 1)
        points = [[1 + a * step, 1 - a * step, 1 + b * step] for a in (1, -1) for b in (1, -1)]
        certificate = certify(system, np.array(points))
        assert certificate.count == 4 and len(certificate.exact) == 4
        assert proved_real(certificate, exchange([1, 0])).tolist() == [real] * 4


def test_a_close_pair_is_not_taken_for_two_real_roots():
    points = np.array([[1 + 1e-9j], [1 - 1e-9j], [2.0 + 0j]])
    assert real_roots(points).tolist() == [False, False, True]
