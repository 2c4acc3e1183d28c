"""The frozen paths of nasty/ as a user meets them: with endgame and ladder, every one ends where it must.

Those in nasty/ends are nasty in how they end: at double roots, near-double ones, at zero, far out, at infinity.
"""

import numpy as np
import pytest
from nasty_files import FOLDER, read

from solvers.carry import carry
from solvers.ends import NAMES, REGULAR
from solvers.tracking import Run, engine_of, track_all

PATHS = sorted(FOLDER.glob("*.json"))
ENDS = sorted((FOLDER / "ends").glob("*.json"))
#: The rung that brings a path home, where the first try does not.
RUNGS = {
    "multiplied_out_past_infinity": "in multiprecision",
    "nine_points_far_links": "in double-double",
    "trammel_past_infinity": "in double-double",
}


@pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)
def test_the_ladder_brings_nasty_paths_home(path):
    nasty = read(path)
    homotopy = nasty.homotopy()
    engine_of(homotopy).prefer = "interpreted"  # the kernel, even where NumPy would do
    ends, used = track_all(homotopy, Run())
    assert np.all(ends.kind == REGULAR) and nasty.errors(ends.x).max() < 1e-9
    assert list(used)[-1:] == [RUNGS[path.stem]] if path.stem in RUNGS else not used


@pytest.mark.parametrize("path", ENDS, ids=lambda path: path.stem)
def test_nasty_ends_are_what_they_are(path):
    nasty = read(path)
    ends, _ = track_all(nasty.homotopy(), Run())
    kinds = [NAMES[kind] for kind in ends.kind]
    assert kinds == nasty.data["kinds"] and not ends.why
    finite = np.array(kinds) != "at infinity"
    error = np.abs(ends.x - nasty.end).max(axis=1) / np.maximum(np.abs(nasty.end).max(axis=1), 1)
    # A double root is known to half the digits of its equation, in double precision.
    assert np.all(error[finite] < np.where(ends.kind[finite] == REGULAR, 1e-9, 1e-6))


@pytest.mark.parametrize("name", ["double_root", "one_goes_to_infinity", "close_pair", "simple_root_at_zero"])
def test_loops_take_only_good_roots_for_roots(name):
    """Monodromy has no endgame: what goes to infinity or to a double root is no root to go on from.

    Of two simple roots that are close sixteen digits do not show enough: the ladder finds them.
    """
    nasty = read(FOLDER / "ends" / f"{name}.json")
    regular = nasty.end[np.array(nasty.data["kinds"]) == "finite"]
    way = engine_of(nasty.homotopy()), nasty.start, nasty.base + nasty.direction, nasty.base, 1.0
    for ladder in (False, True):
        arrived = carry(*way, typical=float(np.abs(nasty.start).max()), ladder=ladder)
        if name == "close_pair" and not ladder:
            continue
        assert arrived.shape == regular.shape
        assert np.abs(arrived - regular).max(initial=0) < 1e-6


def test_every_file_has_its_reason_and_its_test():
    for path in FOLDER.rglob("*.json"):
        assert len(read(path).data["reason"]) > 40
    assert len(ENDS) >= 6
