"""Chunks, the run file and the ladder round a homotopy."""

import threading

import numpy as np
import pytest
import sympy
from nasty_files import FOLDER, read

from benchmarks.zoo import ZOO
from solvers import System, solve, tracking
from solvers.ends import FAILED, REGULAR
from solvers.homotopy import parameter_homotopy
from solvers.kernel.reference import Settings
from solvers.solve import homotopy_for
from solvers.store import RunFile
from solvers.tracking import LAST_RUNG, Interrupted, Run, digest, track_all

x, y, a = sympy.symbols("x y a")


def total_degree(name="cyclic5", seed=0):
    return homotopy_for(ZOO[name].build(), np.zeros(0), "total-degree", seed)


class Memory:
    """A run file that forgets nothing and lives nowhere."""

    def __init__(self):
        self.stages = {}

    def chunks(self, stage):
        return dict(self.stages.get(stage, {}))

    def append(self, stage, number, arrays):
        self.stages.setdefault(stage, {})[number] = arrays


def same(one, other):
    return all(np.array_equal(getattr(one, n), getattr(other, n), equal_nan=True) for n in ("x", "kind", "winding"))


def test_finished_chunks_are_not_tracked_again():
    homotopy, memory, said = total_degree(), Memory(), []
    whole, _ = track_all(homotopy, Run(checkpoint=memory))
    again, _ = track_all(homotopy, Run(checkpoint=memory, progress=lambda *what: said.append(what)))
    assert same(whole, again) and said[0] == ("total degree", 120, 120)


def test_reasons_of_failures_come_back_from_a_run_file(tmp_path):
    homotopy, hasty = total_degree(), Settings(ticks=30)
    with RunFile.create(tmp_path / "run.db", {}) as run:
        first, _ = track_all(homotopy, Run(checkpoint=run), hasty, ladder=False)
        again, _ = track_all(homotopy, Run(checkpoint=run), hasty, ladder=False)
    assert np.any(first.kind == FAILED) and first.why == again.why and same(first, again)
    assert sorted(first.why) == np.flatnonzero(first.kind == FAILED).tolist()


@pytest.mark.parametrize(
    "spoil",
    [
        lambda arrays: arrays.pop("mark"),
        lambda arrays: arrays.update(x=arrays["x"][:-1]),
        lambda arrays: arrays.update(kind=arrays["kind"][:, None]),
        lambda arrays: arrays.update(other=np.zeros(1)),
    ],
)
def test_chunks_that_do_not_fit_are_tracked_again(spoil):
    homotopy, memory = total_degree(), Memory()
    whole, _ = track_all(homotopy, Run(checkpoint=memory))
    for chunks in memory.stages.values():
        for arrays in chunks.values():
            spoil(arrays)
    again, _ = track_all(homotopy, Run(checkpoint=memory))
    assert same(whole, again)


def test_every_computation_has_a_name_of_its_own():
    system = System([x**2 - a, y - x], [x, y], [a])
    swapped = System([y - x, x**2 - a], [x, y], [a])
    points = np.array([[1, 1], [-1, -1], [1, 1], [1, 1], [1, 1], [2, 2]], complex)
    other = points.copy()
    other[5] = 3
    names = {
        digest(parameter_homotopy(system.program, [1], [2], points)),
        digest(parameter_homotopy(system.program, [1], [3], points)),
        digest(parameter_homotopy(system.program, [1.5], [2], points)),
        digest(parameter_homotopy(system.program, [1], [2], points[:5])),
        digest(parameter_homotopy(system.program, [1], [2], other)),
        digest(parameter_homotopy(system.program, [1], [2], points, seed=1)),
        digest(parameter_homotopy(swapped.program, [1], [2], points)),
        digest(parameter_homotopy(System([x**2 - a, y + x], [x, y], [a]).program, [1], [2], points)),
        digest(total_degree(seed=0)),
        digest(total_degree(seed=1)),
    }
    assert len(names) == 10
    assert digest(total_degree(seed=1)) in names


def test_an_interruption_keeps_chunks_and_the_ladder():
    homotopy, memory = total_degree("cyclic6"), Memory()
    calls = []

    def progress(*what):
        calls.append(what)
        if len(calls) == 3:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stop:
        track_all(homotopy, Run(checkpoint=memory, progress=progress))
    (chunks,) = memory.stages.values()
    assert len(chunks) == 2 and np.sum(stop.value.ends.kind == REGULAR) > 0
    again, _ = track_all(homotopy, Run(checkpoint=memory))
    whole, _ = track_all(homotopy, Run())
    assert same(again, whole)


def test_interrupted_on_the_ladder_no_root_counts_twice():
    homotopy = total_degree("noon4")
    careless = Settings(contraction=1.5, safety=0.3, tolerance=1e-2, largest_step=1.0)

    def progress(what, done, total):
        if "steps" in what:
            raise KeyboardInterrupt

    with pytest.raises(Interrupted) as stop:
        track_all(homotopy, Run(progress=progress), careless)
    ends = stop.value.ends
    regular = ends.x[ends.kind == REGULAR]
    distance = np.abs(regular[:, None] - regular[None]).max(axis=2) + np.eye(len(regular))
    assert distance.min() > 1e-6 and np.any(ends.kind == FAILED)


def test_paths_that_were_given_up_reach_their_ends_on_the_ladder():
    ends, used = track_all(total_degree(), Run(), Settings(ticks=30))
    assert np.sum(ends.kind == REGULAR) == 70 and not np.any(ends.kind == FAILED) and used and not ends.why


# -- the last rung -------------------------------------------------------------------------------------------


def beyond_double_double():
    """The homotopy of a nasty path that needs 64 digits, and its ends."""
    nasty = read(FOLDER / "multiplied_out_past_infinity.json")
    return nasty.homotopy(), nasty.end


def test_what_double_double_cannot_follow_is_tracked_with_64_digits():
    homotopy, expected = beyond_double_double()
    ends, used = track_all(homotopy, Run())
    assert used["in double-double with tighter steps"] == used[LAST_RUNG] == len(expected)
    assert np.all(ends.kind == REGULAR) and not ends.why
    assert np.abs(ends.x - expected).max() < 1e-12


def test_too_many_paths_are_not_taken_to_the_last_rung(monkeypatch):
    monkeypatch.setattr(tracking, "FEW_PATHS", 3)
    homotopy, expected = beyond_double_double()
    ends, used = track_all(homotopy, Run())
    assert LAST_RUNG not in used and sorted(ends.why) == list(range(len(expected)))
    assert np.all(ends.kind == FAILED)


def test_the_last_rung_is_climbed_in_the_main_thread_only():
    homotopy, _ = beyond_double_double()
    results = []
    worker = threading.Thread(target=lambda: results.append(track_all(homotopy, Run())))
    worker.start()
    worker.join()
    ((ends, used),) = results
    assert LAST_RUNG not in used and np.all(ends.kind == FAILED)


def test_ends_that_do_not_settle_are_left_alone_on_the_last_rung():
    # A path that was seen at the first radius and failed later has no limit that more digits would show.
    homotopy, expected = beyond_double_double()
    ends, _ = track_all(homotopy, Run(), ladder=False)
    ends.mark[2] = 1 + 2j
    ends.why[2] = "undecided"
    precise = tracking._Precise(tracking.engine_of(homotopy), homotopy, ends)
    part = precise(np.arange(4))
    assert precise.tracked == 3 and part.kind.tolist() == [REGULAR, REGULAR, FAILED, REGULAR]
    assert part.why == {2: "undecided"} and part.ticks[2] == 0
    assert np.abs(np.delete(part.x - expected, 2, axis=0)).max() < 1e-12


def test_the_ladder_uses_all_workers_and_says_how_far_it_is():
    system, said = ZOO["boon"].build(), []
    solve(system, start="total-degree", certificates=False)  # loads the kernel
    alone, together = (
        solve(system, start="total-degree", certificates=False, jobs=jobs, progress=lambda *line: said.append(line))
        for jobs in (1, 2)
    )
    assert alone.ledger.rungs == together.ledger.rungs and np.array_equal(alone.points, together.points)
    climbing = alone.ledger.rungs["in double-double"]
    assert climbing > tracking.CAREFUL_CHUNK
    steps = [done for what, done, total in said if (what, total) == ("in double-double", climbing)]
    assert len(steps) == 6 and steps[::3] == [0, 0] and steps[2::3] == [climbing, climbing]
