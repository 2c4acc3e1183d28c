"""Parallel poses within tolerances, against grids and exact cases."""

from __future__ import annotations

import numpy as np
import pytest

from mechanisms import Task, TaskError, synthesize
from mechanisms.families.motion_dyads import Poses
from mechanisms.families.tolerance import Tolerances
from mechanisms.families.translation_fit import nearest_translation
from mechanisms.families.translations import circle_of, line_of

TRAY = [(0, 0, 0), (30, 40, 0), (80, 55, 0), (125, 35, 0), (100, 46, 0)]


def zones(count, reach):
    return Tolerances(np.full(count, reach), np.full(count, reach), np.zeros(count))


def test_the_least_share_agrees_with_a_search_over_circles():
    """Each position goes to the point of the circle that is nearest in the larger of |x| and |y|."""
    poses = Poses.of(TRAY[:4])
    moved, share = nearest_translation(poses, zones(4, 10.0))
    centre, radius = circle_of(moved)
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 4001))
    rng = np.random.default_rng(0)

    def needed(c, r):
        way = c + r * turn[:, None] - poses.points
        return np.maximum(np.abs(way.real), np.abs(way.imag)).min(axis=0).max() / 10.0

    assert needed(centre, radius) == pytest.approx(share, abs=2e-2)
    others = [needed(centre + 3 * complex(*rng.normal(size=2)), radius + 3 * rng.normal()) for _ in range(300)]
    assert min(others) > share - 2e-2


def test_positions_on_a_circle_or_a_line_stay():
    turns = np.exp(1j * np.array([0.1, 0.5, 1.1, 1.9]))
    for places, exact in ((3 + 2 * turns, circle_of), (np.array([0, 1, 3, 4]) * (2 + 1j), line_of)):
        poses = Poses(places.astype(complex), np.zeros(4))
        moved, share = nearest_translation(poses, zones(4, 0.1))
        assert exact(poses) is not None
        assert share < 1e-6 and np.abs(moved.points - places).max() < 1e-7


def test_exact_positions_are_not_moved():
    poses = Poses.of(TRAY)
    zone = np.array([0.0, 5.0, 5.0, 0.0, 5.0])
    moved, share = nearest_translation(poses, Tolerances(zone, zone, np.zeros(5)))
    assert np.abs(moved.points - poses.points)[[0, 3]].max() < 1e-12
    assert 0.1 < share < 1


def test_parallel_poses_within_tolerances_have_designs():
    rows = [dict(zip(("x", "y", "angle_deg"), map(float, row))) for row in TRAY[:4]]
    given = {"mechanism": "four-bar-motion", "poses": rows}
    with pytest.raises(TaskError, match="give tolerances"):
        Task.from_dict(given)
    with pytest.raises(TaskError, match="widen the tolerances"):
        Task.from_dict({**given, "free": {"tolerance_x": [0.01] * 4}})
    reach = {"tolerance_x": [0.0, 6.0, 6.0, 0.0], "tolerance_y": [0.0, 6.0, 6.0, 0.0]}
    result = synthesize(Task.from_dict({**given, "free": reach}))
    assert result.accepted
    for design in result.accepted:
        assert {"parallelogram", "Scotch yoke"} >= {design.extra["kind"]}
        assert 0 < design.worst_pose_error <= 6 * 2**0.5
        assert len(design.extra["moved"]) == 4 and "of their tolerances" in design.note
