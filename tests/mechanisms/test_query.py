"""The language of --where and --sort."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mechanisms import TaskError
from mechanisms.designs import Design
from mechanisms.query import parse, select, sort

DESIGNS = [
    Design("D001", 0, (), {"W1": 3 + 4j, "beta2_deg": 10.0}, worst_pose_error=1e-9),
    Design("D002", 1, ("branch",), {"W1": 1 - 2j, "beta2_deg": -30.0}, worst_pose_error=1e-7),
    Design("D003", 2, ("complex",)),
]


@pytest.mark.parametrize(
    ("text", "ids"),
    [
        ("beta2_deg < 0", ["D002"]),
        ("beta2_deg > -40 and W1_x >= 3", ["D001"]),
        ("W1_y == -2", ["D002"]),
        ("accepted = false", ["D002", "D003"]),
        ("id != D001", ["D002", "D003"]),
        ("worst_pose_error < 1e-8", ["D001"]),
        ("root>=0", ["D001", "D002", "D003"]),
    ],
)
def test_select(text, ids):
    assert [design.id for design in select(DESIGNS, text)] == ids


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("beta2 < 0", "no design has 'beta2'; did you mean beta2_deg?"),
        ("beta2_deg", "cannot read 'beta2_deg'"),
        ("beta2_deg < 0 or root = 1", "cannot read"),
        ("__import__('os').system('x') > 1", "cannot read|no design has"),
        ("beta2_deg < ten", "'ten' is not a number"),
        ("beta2_deg = ten", "beta2_deg is a number"),
        ("id = 3", "id is a word"),
        ("accepted > false", "cannot be compared"),
        ("", "cannot read"),
    ],
)
def test_what_cannot_be_read_is_said(text, words):
    with pytest.raises(TaskError, match=words):
        select(DESIGNS, text)


def test_sort_puts_the_best_first_and_those_without_the_field_last():
    assert [d.id for d in sort(DESIGNS, "beta2_deg")] == ["D002", "D001", "D003"]
    assert [d.id for d in sort(DESIGNS, "-beta2_deg")] == ["D001", "D002", "D003"]
    assert [d.id for d in sort(DESIGNS, "accepted")] == ["D001", "D002", "D003"]
    with pytest.raises(TaskError, match="did you mean beta2_deg"):
        sort(DESIGNS, "beta_deg")


@given(st.text(max_size=60))
def test_any_text_is_read_or_refused(text):
    try:
        comparisons = parse(text)
    except TaskError:
        return
    assert all(len(comparison) == 3 for comparison in comparisons)
