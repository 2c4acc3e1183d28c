"""Paths that have broken a tracker once. Each file in nasty/ says why its paths are nasty.

A file holds a program, start points and a line of parameters; the ends were found in double-double with steps
many times shorter than usual. Engines that it does not name may fail there, but may not go astray.
"""

from typing import NamedTuple

import numpy as np
import pytest
from nasty_files import FOLDER, read

from solvers.graph import Builder
from solvers.kernel.engine import make_engine
from solvers.kernel.reference import REACHED, STALLED, Settings, _Lanes

FILES = sorted(FOLDER.glob("*.json"))
#: Paths of mechanisms: with many steps, some of them rejected.
LONG = [path for path in FILES if path.stem.startswith(("nine_points", "trammel"))]
WAYS = {
    "reference": {"prefer": "reference"},
    "interpreted": {"prefer": "interpreted"},
    "compiled": {"prefer": "compiled"},
    "pivoted": {"prefer": "compiled", "pivoted": True},
    "double-double": {"prefer": "compiled", "arithmetic": "double-double"},
    "multiprecision": {"arithmetic": "multiprecision"},
}


def load(path):
    nasty = read(path)
    return nasty.engine(), nasty.line, nasty.end, nasty.data["reached_by"]


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_nasty_path(path, way):
    engine, line, end, reached_by = load(path)
    options = dict(WAYS[way])
    engine.prefer = options.pop("prefer", "auto")
    found = engine.track(*line, **options)
    if way in reached_by:
        assert (found.status == REACHED).all()
    arrived = found.status == REACHED
    error = np.abs(found.x - end).max(axis=1) / np.abs(end).max(axis=1)
    assert np.all(error[arrived] < 1e-9)


def test_the_files_are_there():
    assert len(FILES) >= 9 and len(LONG) == 4


# -- three bugs of an early tracker, and a fourth ------------------------------------------------------------


class Tick(NamedTuple):
    """The state of a lane before and after a tick."""

    h: float
    omega: float
    h_after: float
    omega_after: float
    rejected: bool
    first: float


def history(path):
    """Track the first path with the reference, one tick at a time."""
    engine, (start, base, direction), *_ = load(path)
    lanes = _Lanes(engine.program, start[:1], base, direction, 1.0, 0.0, None, Settings(size=1.0), "line", 1.0)
    while True:
        h, omega, place = lanes.h[0], lanes.omega[0], lanes.r[0]
        lanes.tick()
        if not lanes.active.size:
            return
        moved_back = lanes.rejected[0] and lanes.r[0] != place and lanes.iteration[0] == 0
        yield Tick(h, omega, lanes.h[0], lanes.omega[0], bool(moved_back), lanes.first[0])


@pytest.mark.parametrize("path", LONG, ids=lambda path: path.stem)
def test_curvature_is_not_measured_in_rounding_noise(path):
    # A curvature taken from steps of the size of rounding errors runs away, and the step with it.
    grown = [tick for tick in history(path) if tick.omega_after > tick.omega]
    assert grown
    assert all(tick.first > Settings().noise for tick in grown)


@pytest.mark.parametrize("path", [f for f in LONG if "rounding" not in f.stem], ids=lambda path: path.stem)
def test_a_rejection_always_shortens_the_step(path):
    # Without a bound the factor could be one: the same step was rejected twenty thousand times.
    rejections = [tick for tick in history(path) if tick.rejected]
    assert rejections
    assert all(tick.h_after <= 0.8 * tick.h * (1 + 1e-12) for tick in rejections)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("path", LONG, ids=lambda path: path.stem)
def test_the_limit_on_ticks_holds_at_every_tick(path, way):
    # It was looked at only when a step was rejected: a path used 69,613 ticks.
    engine, line, *_ = load(path)
    options = dict(WAYS[way])
    engine.prefer = options.pop("prefer", "auto")
    for limit in (1, 7, 40):
        found = engine.track(*line, settings=Settings(ticks=limit), **options)
        assert np.all(found.ticks <= limit) and not np.any(found.status == REACHED)


@pytest.mark.parametrize("way", WAYS)
def test_vanishing_steps_end(way):
    # x² = r - 1/2 with its branch point on the line: steps h with r + h = r were accepted for ever.
    b = Builder(1, 1)
    x = b.unknown(0)
    engine = make_engine(b, [b.sub(b.square(x), b.parameter(0))], (np.array([[0.7]]), np.array([0.5])))
    options = dict(WAYS[way])
    engine.prefer = options.pop("prefer", "auto")
    start = np.array([[np.sqrt(0.5)], [-np.sqrt(0.5)]])
    found = engine.track(start, np.array([-0.5]), np.array([1.0]), settings=Settings(ticks=100_000), **options)
    assert (found.status == STALLED).all()
    assert found.ticks.max() < 5_000
