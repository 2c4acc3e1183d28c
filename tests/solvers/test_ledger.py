"""No path is lost without anyone being told: clashes are seen wherever they end, and the ladder repairs them."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.zoo import ZOO
from solvers.ends import FAILED, INFINITE, PRECISE, REGULAR, SINGULAR, Ends, fingerprints
from solvers.kernel.reference import Settings
from solvers.ledger import broken_cycles, clashing, climb, doubtful, settle
from solvers.points import pairs_of_equals
from solvers.solve import homotopy_for
from solvers.tracking import Run, track_all

#: A step control that jumps from path to path all the time.
CARELESS = Settings(contraction=1.5, safety=0.3, tolerance=1e-2, largest_step=1.0)


def ends_at(points, kind=None, mark=None, condition=1.0, typical=1.0):
    x = np.atleast_2d(np.asarray(points, complex).T).T
    count = len(x)
    return Ends(
        x=x,
        kind=np.full(count, REGULAR, np.int8) if kind is None else np.array(kind, np.int8),
        winding=np.zeros(count, np.int64),
        condition=np.full(count, condition),
        ticks=np.zeros(count, np.int64),
        mark=None if mark is None else np.array(mark, complex),
        typical=typical,
    )


# -- which points are equal ------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    count=st.integers(0, 40),
    size=st.integers(1, 4),
    tolerance=st.sampled_from([1e-12, 1e-6, 1e-2, 0.5]),
    several=st.booleans(),
)
def test_pairs_are_those_of_comparing_all_with_all(seed, count, size, tolerance, several):
    rng = np.random.default_rng(seed)
    places = rng.normal(size=(max(count // 3, 1), size)) + 1j * rng.normal(size=(max(count // 3, 1), size))
    points = places[rng.integers(len(places), size=count)] * (1 + tolerance * rng.normal(size=(count, size)))
    points *= 10.0 ** rng.integers(-3, 4, size=(count, 1)) if several else 1
    allowed = tolerance * rng.uniform(0.1, 2, count) if several else np.full(count, tolerance)
    reach = allowed * np.abs(points).max(axis=1, initial=0)
    expected = {
        (i, j)
        for i, j in itertools.combinations(range(count), 2)
        if np.abs(points[i] - points[j]).max() <= max(reach[i], reach[j])
    }
    found = pairs_of_equals(points, allowed if several else tolerance)
    assert len(found) == len(expected) and set(map(tuple, found.tolist())) == expected


def test_two_ends_on_one_root_clash():
    assert clashing(ends_at([1, 2, 3, 2 + 1e-12])).tolist() == [1, 3]


def test_two_ends_at_the_origin_clash():
    # Relative to itself no point equals zero: two ends at 1e-34 and 1e-33 are one root all the same.
    assert clashing(ends_at([1e-34, 1e-33, 1])).tolist() == [0, 1]
    # Points that the endgame can tell apart are no clash.
    assert clashing(ends_at([1e-12, 2e-12, 1])).tolist() == []


def test_ill_conditioned_ends_clash_within_their_uncertainty():
    points = [1, 1 + 1e-7]
    assert clashing(ends_at(points)).size == 0
    assert clashing(ends_at(points, condition=1e9)).tolist() == [0, 1]


@pytest.mark.parametrize("kind", [REGULAR, SINGULAR, INFINITE])
def test_two_paths_that_ran_together_clash_wherever_they_end(kind):
    # Singular ends and ends at infinity may rightly agree; what may not agree is where the paths were before.
    ends = ends_at([1, 1 if kind != REGULAR else 2, 5], [kind] * 3, [2 + 1j, 2 + 1j + 1e-11, 3])
    assert clashing(ends).tolist() == [0, 1]
    apart = ends_at([1, 1 if kind != REGULAR else 2, 5], [kind] * 3, [2 + 1j, 2 + 1.001j, 3])
    assert clashing(apart).size == 0


def test_fingerprints_tell_paths_to_infinity_apart_by_their_small_coordinates():
    one = np.array([[1e18 + 2e18j, 1.0, 0.0]])
    other = np.array([[1e18 + 2e18j, 1.0 + 1e-5, 0.0]])
    noise = one * (1 + 1e-14)
    mark = fingerprints(one, 1e-8)
    assert np.isfinite(mark).all()
    assert abs(fingerprints(other, 1e-8) - mark) > 1e-6
    assert abs(fingerprints(noise, 1e-8) - mark) < 1e-11


# -- the ladder ------------------------------------------------------------------------------------------------


def test_failed_and_clashing_paths_are_doubtful():
    ends = ends_at([1, 1, 2, 3], [REGULAR, REGULAR, FAILED, REGULAR])
    assert doubtful(ends).tolist() == [0, 1, 2]


def test_a_chain_of_jumps_is_undone_link_by_link():
    # Path k has taken the place of path k+1; only the last two clash until each in turn is put right.
    count = 9
    ends = ends_at([*range(2, count + 1), count])
    asked = []

    def right(rows):
        asked.append(rows.tolist())
        return ends_at(rows + 1)

    used = climb(ends, iter([("with care", right)]))
    assert ends.x[:, 0].tolist() == list(range(1, count + 1))
    assert used == {"with care": count} == {"with care": sum(map(len, asked))}
    assert not ends.why and np.all(ends.kind == REGULAR)


def test_what_clashes_on_every_rung_fails_but_the_root_stays():
    ends = ends_at([4, 4, 7])
    seen = []
    used = climb(
        ends,
        iter([("first", lambda rows: ends_at([4] * len(rows))), ("second", lambda rows: ends_at([4] * len(rows)))]),
        lambda name, n: seen.append((name, n)),
    )
    assert used == {"first": 2, "second": 2} and seen == [("first", 2), ("second", 2)]
    assert ends.kind.tolist() == [REGULAR, FAILED, REGULAR]
    assert list(ends.why) == [1] and "same root as another path" in ends.why[1]


def test_a_ladder_that_is_not_needed_is_not_climbed():
    used = climb(ends_at([1, 2]), iter([("never", lambda rows: pytest.fail("no path is in doubt"))]))
    assert used == {}


def test_settling_keeps_one_of_three():
    ends = ends_at([4, 4, 4])
    settle(ends)
    assert ends.kind.tolist() == [REGULAR, FAILED, FAILED]


# -- jumps provoked on real paths ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["noon4", "cyclic5", "katsura6", "fourbar5"])
def test_jumps_are_seen_and_put_right(name):
    benchmark = ZOO[name]
    homotopy = homotopy_for(benchmark.build(), np.zeros(0), "total-degree", seed=3)
    careless, _ = track_all(homotopy, Run(), CARELESS, ladder=False)
    assert np.sum(careless.kind == REGULAR) < benchmark.isolated
    ends, used = track_all(homotopy, Run(), CARELESS)
    assert used["with tighter steps"] > 0
    assert not np.any(ends.kind == FAILED)
    assert np.sum(ends.kind == REGULAR) == benchmark.isolated
    careful, _ = track_all(homotopy, Run())
    assert np.array_equal(np.bincount(ends.kind, minlength=4), np.bincount(careful.kind, minlength=4))


@pytest.mark.parametrize("seed", range(4))
def test_without_a_ladder_nothing_that_is_missing_goes_unnoticed(seed):
    benchmark = ZOO["fourbar5"]
    homotopy = homotopy_for(benchmark.build(), np.zeros(0), "total-degree", seed)
    ends, _ = track_all(homotopy, Run(), CARELESS, ladder=False)
    settle(ends)
    found, failed = int(np.sum(ends.kind == REGULAR)), int(np.sum(ends.kind == FAILED))
    assert found < benchmark.isolated <= found + failed


def test_jumps_to_paths_that_go_to_singular_ends_or_to_infinity_are_seen():
    homotopy = homotopy_for(ZOO["fourbar5"].build(), np.zeros(0), "total-degree", seed=0)
    ends, _ = track_all(homotopy, Run(), CARELESS, ladder=False)
    both = pairs_of_equals(ends.mark[np.isfinite(ends.mark), None], 1e-8, floor=1.0)
    kinds = ends.kind[np.isfinite(ends.mark)]
    assert np.any(kinds[both] == SINGULAR) and np.any(kinds[both] == INFINITE)


def test_without_a_ladder_clashes_count_as_failed():
    homotopy = homotopy_for(ZOO["noon4"].build(), np.zeros(0), "total-degree", seed=0)
    ends, used = track_all(homotopy, Run(), CARELESS, ladder=False)
    assert used == {} and np.any(ends.kind == FAILED)
    assert sorted(ends.why) == np.flatnonzero(ends.kind == FAILED).tolist()


def test_a_lone_singular_end_beside_a_regular_root_is_doubtful():
    """To a multiple root lead several paths; a curve of roots does not pass a regular one."""
    points = [1.0, 1 + 1e-7, 5.0, 7.0, 7.0, 7 + 1e-7]
    beside = ends_at(points, [REGULAR, SINGULAR, SINGULAR, SINGULAR, SINGULAR, REGULAR])
    beside.winding[:] = [0, 1, 1, 2, 2, 0]
    assert broken_cycles(beside).tolist() == [1]
    assert doubtful(beside, complete=True).tolist() == [1] and not len(doubtful(beside))


def test_ends_known_to_all_digits_may_be_nearer_than_others():
    near = [1.0, 1 + 1e-12]
    assert clashing(ends_at(near)).tolist() == [0, 1]
    assert clashing(ends_at(near, condition=PRECISE)).tolist() == []
    assert clashing(ends_at([1.0, 1 + 1e-15], condition=PRECISE)).tolist() == [0, 1]
