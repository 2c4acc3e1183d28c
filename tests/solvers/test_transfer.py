"""Known roots carried to other parameters: all arrive, or someone is told."""

import sys

import numpy as np
import pytest
import sympy

from benchmarks.systems import trammel_seed, trammel_system
from solvers import InvalidSystem, Solutions, System, monodromy, solve
from solvers.ends import FAILED, REGULAR, SINGULAR, Ends
from solvers.kernel.reference import Settings
from solvers.points import pairs_of_equals
from solvers.solutions import Ledger, Singular
from solvers.tracking import Interrupted, Run, track_all
from solvers.transfer import fill_gaps, sweep, transfer

module = sys.modules["solvers.transfer"]
x, y, a, b, c, d = sympy.symbols("x y a b c d")
#: A step control that jumps from path to path all the time.
CARELESS = Settings(contraction=1.5, safety=0.3, tolerance=1e-2, largest_step=1.0)


def curves():
    return System([x**2 + a * x * y + y**2 - b, x**3 + c * y**2 + d], [x, y], [a, b, c, d])


def from_points(points, parameters):
    points = np.asarray(points, complex)
    nothing = np.zeros(0, np.int64)
    return Solutions(
        points=points,
        singular=Singular(np.zeros((0, points.shape[1])), nothing, nothing, nothing),
        parameters=np.asarray(parameters, complex),
        ledger=Ledger(tracked=len(points), finite=len(points)),
        complete=True,
    )


def ends_at(points, kind, condition=1.0):
    points = np.atleast_2d(np.asarray(points, complex).T).T
    count = len(points)
    return Ends(
        x=points,
        kind=np.array(kind, np.int8),
        winding=np.zeros(count, np.int64),
        condition=np.full(count, condition),
        ticks=np.zeros(count, np.int64),
        why={k: "lost" for k in range(count) if kind[k] == FAILED},
        typical=1.0,
    )


# -- the right roots -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(5))
def test_real_to_real_against_a_fresh_solve(seed):
    rng = np.random.default_rng(seed)
    system = curves()
    here, there = rng.normal(size=(2, 4))
    known = solve(system, here, start="total-degree", certificates=False)
    carried = solve(system, there, start=known, seed=seed)
    fresh = solve(system, there, start="total-degree", certificates=False)
    assert len(carried) == len(fresh) == 6 == carried.certificate.distinct
    assert len(pairs_of_equals(np.concatenate([carried.points, fresh.points]), 1e-8)) == 6
    assert carried.ledger.balanced and carried.complete


def test_the_straight_line_between_real_parameters_crosses_a_double_root():
    # x² = a from a = 1 to a = -1 meets the double root at a = 0: only a detour gets by.
    system = System([x**2 - a], [x], [a])
    known = solve(system, [1])
    for seed in range(10):
        carried = solve(system, [-1], start=known, seed=seed)
        assert np.allclose(np.sort_complex(carried.points[:, 0]), [-1j, 1j]) and carried.complete


def test_carried_to_where_two_roots_meet():
    system = System([x**2 - a], [x], [a])
    known = monodromy(system, seed=1)
    carried = solve(system, [0], start=known)
    assert len(carried) == 0 and carried.singular.multiplicity.tolist() == [2] and carried.ledger.balanced
    assert np.abs(carried.singular.points).max() < 1e-6


@pytest.mark.parametrize(
    "values, roots, multiplicities", [([2, 1], [-1, 1], [2, 2]), ([1, 0], [0], [2]), ([0, 0], [0], [4])]
)
def test_orbits_carried_to_where_roots_meet(values, roots, multiplicities):
    system = System([x**4 - a * x**2 + b], [x], [a, b])
    for seed in range(4):
        known = monodromy(system, seed=seed, symmetry=[lambda points: -points])
        carried = solve(system, values, start=known, seed=seed)
        singular = carried.singular
        assert np.allclose(np.sort(singular.points.real.ravel()), roots, atol=1e-6), seed
        assert singular.multiplicity.tolist() == singular.winding.tolist() == multiplicities, seed
        assert carried.complete and carried.ledger.balanced, seed


def test_roots_that_have_just_parted_on_a_line_of_roots():
    # At a = 0 six roots meet on x = 0, all of which are roots: the mean of those that are near each other is one, too.
    system = System([a * x * y**3 + a * x + x**2 * y - 2 * x * y**3, a * x * y - 3 * x**3 * y], [x, y], [a])
    for seed in range(3):
        known = solve(system, [0.5 + 0.7j], seed=seed)
        for near in (1e-5, 1e-6, 1e-8, 1e-10, 1e-13):
            carried = solve(system, [near], start=known, seed=seed)
            assert len(carried) == 6 and carried.complete and not len(carried.singular), (seed, near)


def test_carried_to_where_a_root_is_at_infinity():
    system = System([a * x**2 + x - 1], [x], [a])
    carried = solve(system, [0], start=monodromy(system, seed=1))
    assert np.allclose(carried.points, [[1]])
    assert (carried.ledger.finite, carried.ledger.at_infinity, carried.ledger.failed) == (1, 1, 0)


def test_units_of_the_parameters_do_not_matter():
    r, e = sympy.symbols("r e")
    circles = System([x**2 + y**2 - r**2, (x - e) ** 2 + y**2 - 4 * r**2], [x, y], [r, e])
    known = monodromy(circles, seed=2)
    for unit in (1e-4, 1.0, 1e4):
        carried = solve(circles, [3 * unit, 4 * unit], start=known)
        assert carried.complete and np.allclose(carried.points[:, 0], -11 / 8 * unit, rtol=1e-12)
        assert carried.certificate.real.all() and len(carried) == 2


def test_sweep_answers_in_the_order_of_the_targets():
    system = curves()
    known = monodromy(system, seed=0)
    targets = np.random.default_rng(0).normal(size=(6, 4))
    for target, found in zip(targets, sweep(system, known, targets)):
        assert np.array_equal(found.parameters, target) and len(found) == 6 and found.complete
        assert np.abs(system.evaluate(found.points, target)[0]).max() < 1e-9


@pytest.fixture(scope="module")
def trammel():
    point, values = trammel_seed(np.random.default_rng(3))
    system = trammel_system()
    return system, monodromy(system, seed=3, start=(point, values), count=560)


def test_random_targets_of_the_trammel_are_complete(trammel):
    system, known = trammel
    rng = np.random.default_rng(8)
    for k in range(5):
        target = rng.normal(size=18) + 1j * rng.normal(size=18)
        found = solve(system, target, start=known, seed=k, certificates=False)
        assert len(found) == 560 and found.complete and found.ledger.balanced
        assert len(pairs_of_equals(found.points, 1e-9)) == 0


@pytest.mark.slow
def test_four_hundred_random_targets_of_the_trammel_are_complete(trammel):
    system, known = trammel
    rng = np.random.default_rng(9)
    for k in range(400):
        target = rng.normal(size=18) + 1j * rng.normal(size=18)
        found = solve(system, target, start=known, seed=k, certificates=False)
        assert len(found) == 560 and found.complete, (k, found.ledger)


# -- losses are seen and made good ---------------------------------------------------------------------------


def test_what_careless_tracking_loses_is_found_on_detours(trammel, monkeypatch):
    system, known = trammel
    asked = []

    def careless(homotopy, run, ladder=True):
        asked.append(homotopy.starts.count)
        return track_all(homotopy, run, CARELESS if len(asked) == 1 else None, ladder=False)

    monkeypatch.setattr(module, "track_all", careless)
    rng = np.random.default_rng(1)
    target = rng.normal(size=18) + 1j * rng.normal(size=18)
    found = solve(system, target, start=known, certificates=False)
    assert len(asked) >= 2 and found.ledger.rungs["by another way"] >= 560
    assert len(found) == 560 and found.complete and len(pairs_of_equals(found.points, 1e-9)) == 0


def test_when_every_way_is_careless_what_is_missing_is_told(trammel, monkeypatch):
    system, known = trammel
    absurd = Settings(contraction=3.0, safety=0.05, tolerance=0.1, largest_step=1.0, ticks=60)
    monkeypatch.setattr(
        module, "track_all", lambda homotopy, run, ladder=True: track_all(homotopy, run, absurd, ladder=False)
    )
    rng = np.random.default_rng(2)
    target = rng.normal(size=18) + 1j * rng.normal(size=18)
    found = solve(system, target, start=known, certificates=False)
    assert found.ledger.balanced and found.ledger.tracked == 560
    assert found.ledger.failed > 0 and found.complete is False
    assert len(pairs_of_equals(found.points, 1e-9)) == 0
    assert len(found.ledger.failures) == found.ledger.failed


def test_roots_lost_on_the_way_to_the_waypoint_count_as_failed(monkeypatch):
    genuine = module.waypoint
    monkeypatch.setattr(
        module, "waypoint", lambda *given: (lambda place, points: (place, points[:-1]))(*genuine(*given))
    )
    system = curves()
    rng = np.random.default_rng(0)
    known = solve(system, rng.normal(size=4), start="total-degree", certificates=False)
    found = solve(system, rng.normal(size=4), start=known, certificates=False)
    # Each detour loses one of the six, another one each time or the same.
    assert found.ledger.tracked == 6 and found.ledger.balanced
    assert len(found) + found.ledger.failed == 6
    assert found.complete == (len(found) == 6)


def test_an_ill_conditioned_root_found_twice_fills_no_gap():
    ends = ends_at([1.0, 2.0, 3.0], [REGULAR, FAILED, REGULAR], condition=1e9)
    again = ends_at([1.0 + 3e-7, 3.0 - 3e-7], [REGULAR, REGULAR], condition=1e9)
    fill_gaps(ends, again)
    assert ends.kind.tolist() == [REGULAR, FAILED, REGULAR]
    again = ends_at([1.0 + 3e-7, 2.0], [REGULAR, REGULAR], condition=1e9)
    fill_gaps(ends, again)
    assert ends.kind.tolist() == [REGULAR] * 3 and ends.x[:, 0].tolist() == [1, 2, 3] and not ends.why


def test_gaps_are_filled_with_one_root_each():
    ends = ends_at([1.0, 0, 0, 0], [REGULAR, FAILED, FAILED, FAILED])
    fill_gaps(ends, ends_at([5.0, 5.0, 1.0, 6.0], [REGULAR] * 4))
    assert ends.kind.tolist() == [REGULAR, REGULAR, REGULAR, FAILED]
    assert sorted(ends.x[ends.kind == REGULAR, 0].real.tolist()) == [1, 5, 6]
    fill_gaps(ends, ends_at([7.0], [SINGULAR]))
    assert ends.kind.tolist()[3] == FAILED


def test_orbits_that_fail_stay_failed(monkeypatch):
    """A lost path has no point; that must not be mistaken for a point at infinity."""
    system = System([x**4 + a * x**2 * y + b, y**2 + c * x**2 - 1], [x, y], [a, b, c])
    known = monodromy(system, seed=1, symmetry=[lambda points: points * [-1, 1]])

    def losing(homotopy, run, ladder=True):
        ends, used = track_all(homotopy, run, ladder=ladder)
        ends.kind[0], ends.x[0], ends.why[0] = FAILED, np.nan, "lost"
        return ends, used

    whole = solve(system, [1, 2, 3], start=known, certificates=False)
    assert len(whole) == 8 and whole.ledger.failed == 0
    monkeypatch.setattr(module, "track_all", losing)
    monkeypatch.setattr(module, "fill_gaps", lambda ends, others: None)
    found = solve(system, [1, 2, 3], start=known, certificates=False)
    assert (len(found), found.ledger.failed, found.ledger.at_infinity) == (6, 2, 0)
    assert found.complete is False


def test_interrupted_on_a_detour_the_first_finds_are_kept(trammel, monkeypatch):
    system, known = trammel
    asked = []

    def stopping(homotopy, run, ladder=True):
        asked.append(1)
        if len(asked) == 2:
            raise KeyboardInterrupt
        ends, used = track_all(homotopy, run, ladder=False)
        ends.kind[:10] = FAILED
        return ends, used

    monkeypatch.setattr(module, "track_all", stopping)
    with pytest.raises(Interrupted) as stop:
        solve(system, known.parameters[::-1], start=known)
    assert len(stop.value.solutions) == 550 and stop.value.solutions.complete is False


def test_transfer_itself_tells_its_detours():
    system = curves()
    known = monodromy(system, seed=0)
    homotopy, ends, rungs = transfer(system, known, np.array([1, 2, 3, 4 + 0j]), Run(), seed=0)
    assert homotopy.starts.count == len(ends.kind) == 6 and np.all(ends.kind == REGULAR)
    assert rungs == {}


# -- no claim without evidence -------------------------------------------------------------------------------


def test_special_parameters_are_no_proof_of_completeness():
    system = System([a * x**2 + x - 1], [x], [a])
    known = solve(system, [0])
    assert known.complete and len(known) == 1
    carried = solve(system, [1], start=known)
    assert len(carried) == 1 and carried.complete is None
    assert "generic" in carried.evidence
    assert solve(system, [1], start=solve(system, [2 + 1j])).complete


def test_what_was_incomplete_stays_incomplete():
    known = monodromy(System([x**2 - a], [x], [a]), count=3)
    assert known.complete is False
    assert solve(System([x**2 - a], [x], [a]), [2], start=known).complete is False


@pytest.mark.parametrize(
    "known, error, message",
    [
        (from_points(np.ones((1, 2)), [1, 1, 1]), ValueError, "another shape"),
        (from_points(np.ones((1, 3)), [1, 1, 1, 1]), ValueError, "another shape"),
        (from_points(np.ones((0, 2)), [1, 1, 1, 1]), ValueError, "no root to carry"),
    ],
)
def test_a_start_that_does_not_fit_is_refused(known, error, message):
    with pytest.raises(error, match=message):
        solve(curves(), [1, 2, 3, 4], start=known)


def test_targets_without_isolated_roots_are_refused():
    system = System([a * x + y - 1, b * x + y - 2], [x, y], [a, b])
    known = monodromy(system, seed=0)
    with pytest.raises(InvalidSystem, match=r"dependent|multiples"):
        solve(system, [3, 3], start=known)


def test_start_points_that_are_no_roots_fail():
    system = curves()
    found = solve(system, [1, 2, 3, 4], start=from_points([[5, 5], [6, 7]], [1j, 1, 1, 1]), certificates=False)
    assert len(found) == 0 and found.ledger.failed == 2 and found.complete is False
