"""Paths that pass near infinity half way: they arrive, without a projective patch.

Unknowns are measured each in its own size, so a path may run far out and come back. What it may run out of is digits:
in a mechanism that has grown to 1e9 times its task the differences that matter are in the eighteenth digit.
Measured on the paths frozen in nasty/infinity, two families of linkages led past a pole on purpose and a pair of
sheets that meet at infinity:

* double precision follows the trammel out to 1e8 times its size, the branch to 1e5, the nine-point linkage to 1e6;
* double-double, the third rung of the ladder, follows the trammel to 1e13, the branch to 1e6 (p to 1e-12), the
  nine-point linkage to 1e8.

A random path comes so near to infinity with a chance of the order of one over these numbers.

A moving projective patch, in which no unknown is large, would not need fewer digits. The roots at infinity that
paths of linkages pass are singular, as the highest terms of their equations vanish together on whole families: in the
patch the condition number grows as fast, and it is not smaller than that of the affine unknowns, each in its own
size. The last test measures just that. Digits help, charts do not; so there is no patch.
"""

import numpy as np
import pytest
from nasty_files import FOLDER, read

from solvers.ends import REGULAR
from solvers.kernel.reference import REACHED
from solvers.system import evaluate
from solvers.tracking import Run, track_all

FILES = sorted((FOLDER / "infinity").glob("*.json"))
#: Those that sixteen digits lead astray or stop.
NEED_DIGITS = {"branch_1e-12", "nine_points_1e-8", "trammel_1e-9", "trammel_1e-12"}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_ladder_brings_every_path_home(path):
    nasty = read(path)
    ends, used = track_all(nasty.homotopy(), Run())
    assert np.all(ends.kind == REGULAR) and not ends.why
    assert nasty.errors(ends.x).max() < 1e-12
    assert ("in double-double" in used) >= (path.stem in NEED_DIGITS)
    assert "in multiprecision" not in used


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_double_precision_may_stop_but_does_not_go_astray(path):
    nasty = read(path)
    done = nasty.engine().track(*nasty.line)
    arrived = done.status == REACHED
    assert not (path.stem in NEED_DIGITS and arrived.any())
    assert np.all(nasty.errors(done.x)[arrived] < 1e-9)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_path_really_passes_near_infinity(path):
    nasty = read(path)
    size = float(path.stem.rsplit("_", 1)[1])
    size = size**0.5 if path.stem.startswith("branch") else size
    far = np.abs(nearest(nasty)[0]).max()
    assert 0.5 / size < far < 2 / size and np.abs(nasty.end).max() < 100


def nearest(nasty):
    """The points farthest out, and the parameters there."""
    r = nasty.data["nearest"]
    done = nasty.engine().track(*nasty.line, end=r, arithmetic="double-double")
    assert np.all(done.status == REACHED)
    return done.x, nasty.base + r * nasty.direction


@pytest.mark.parametrize("name", ["nine_points_1e-6", "trammel_1e-6"])
def test_a_projective_patch_would_be_no_better_conditioned(name):
    nasty = read(FOLDER / "infinity" / f"{name}.json")
    points, parameters = nearest(nasty)
    engine = nasty.engine()
    _, J = evaluate(engine.program, points, parameters)
    x, J = points[0], J[0]
    affine = condition(J * np.abs(x))
    # x = y/w with y, w on the patch that is centred at this very point: no chart is better there.
    w = 1 / np.linalg.norm(np.append(x, 1))
    patch = np.zeros((len(x) + 1, len(x) + 1), complex)
    patch[:-1, :-1], patch[:-1, -1] = J / w, -J @ x / w
    patch[-1] = np.append(x * w, w).conj()
    assert affine > 1e7  # singular at infinity …
    assert condition(patch) > 0.5 * affine  # … in this chart as well


def condition(J):
    return np.linalg.cond(J / np.abs(J).max(axis=1, keepdims=True))
