"""Kiper's paper: the verdicts, and that a wrong number would be noticed."""

from __future__ import annotations

from collections import Counter

import pytest

from mechanisms.reproduce import comparison_table, reproduce
from mechanisms.reproduce.comparison import Comparison, formula, same_digits


@pytest.fixture(scope="module")
def items():
    return reproduce("kiper")


def test_nothing_differs_without_an_explanation(items):
    assert Counter(item.verdict for item in items) == {"agrees": 43, "misprint": 17, "not so": 2, "inferred": 1}


def test_exactly_the_known_formulas_are_misprinted(items):
    wrong = {(i.where, i.what) for i in items if i.kind == "formula" and i.verdict == "misprint"}
    assert wrong == {
        ("Eq. (8)", "W1y"), ("Eq. (9)", "Z1y"), ("Eq. (10)", "W2"), ("Eq. (11)", "Z2"), ("Eq. (13)", "Z4"),
        ("Eq. (14)", "W1"), ("Eq. (16)", "W2"), ("Eq. (18)", "C"), ("Eq. (18)", "D"), ("Eq. (18)", "E"),
        ("Eq. (21)", "imaginary part"),
    }  # fmt: skip


def test_numbers_that_are_not_printed(items):
    values = {item.what: item.ours for item in items}
    assert values["δPQ"] == 45 + 15j
    assert values["η3 (degrees)"] == pytest.approx(-31.7026, abs=1e-4)
    assert values["length of Q's coupler, printed as |Z2 + Z4|"] == pytest.approx(2.302538, abs=1e-6)


def test_a_wrong_number_is_noticed():
    assert Comparison("x", "y", "12.902", 12.9014).verdict == "differs"
    assert Comparison("x", "y", "12.902", 12.9019).verdict == "agrees"
    assert formula("x", "y", lambda: 1.0, lambda: 2.0, "try this", lambda: 3.0).verdict == "differs"
    assert formula("x", "y", lambda: 1.0, lambda: 2.0, "try this", lambda: 2.0).verdict == "misprint"


@pytest.mark.parametrize(
    ("printed", "ours", "same"),
    [
        ("16.515", 16.5154, True),
        ("16.515", 16.5156, False),
        ("-3.170 + 12.268i", -3.17 + 12.2679j, True),
        ("-3.170 + 12.268i", -3.17 - 12.2679j, False),
        ("(29, -14.170)", (29.0, -14.1699), True),
        ("(29, -14.170)", (29.0,), False),
        ("9, 6, 3", (9, 6, 3), True),
        ("9, 6, 3", (9, 6, 4), False),
    ],
)
def test_digits(printed, ours, same):
    assert same_digits(printed, ours) is same


def test_the_table_prints(items):
    from rich.console import Console

    console = Console(width=200, record=True, file=open("/dev/null", "w"))
    console.print(comparison_table("kiper", items))
    text = console.export_text()
    assert "63 items: 43 agrees, 17 misprint, 2 not so, 1 inferred" in text
    assert all(item.as_dict()["verdict"] == item.verdict for item in items)
