"""Every way of running the tracker finds the same roots: NumPy, interpreted, compiled, pivoted, double-double."""

import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from kernel_systems import difference, katsura, roots, univariate

from solvers.graph import Builder
from solvers.kernel import compiled
from solvers.kernel import engine as engine_module
from solvers.kernel.lanes import Lanes, native_lanes
from solvers.kernel.reference import DIVERGED, EXHAUSTED, PAUSED, REACHED, STALLED, Settings

WAYS = {
    "reference": {"prefer": "reference"},
    "interpreted": {"prefer": "interpreted"},
    "compiled": {"prefer": "compiled"},
    "pivoted": {"prefer": "compiled", "pivoted": True},
    "double-double": {"prefer": "compiled", "arithmetic": "double-double"},
    "multiprecision": {"arithmetic": "multiprecision"},
}


def tracked(engine, way, *arguments, lanes=None, **options):
    options = {**WAYS[way], **options}
    engine.prefer, engine.lanes = options.pop("prefer", "auto"), lanes
    return engine.track(*arguments, **options)


@pytest.fixture(scope="module")
def magnets():
    return katsura(4)


@pytest.fixture(scope="module")
def expected(magnets):
    engine, *line = magnets
    return tracked(engine, "reference", *line)


def test_the_reference_finds_katsura_s_sixteen_roots(magnets, expected):
    engine, _, base, direction = magnets
    assert (expected.status == REACHED).all()
    assert len({tuple(row) for row in np.round(expected.x, 8)}) == 16
    F = np.array(engine.program.replay(list(expected.x.T), list(base + 0 * direction))["F"])
    assert np.abs(F).max() < 1e-13


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("lanes", [native_lanes(), Lanes(4), Lanes(2, fma=False)], ids=str)
def test_the_same_ends_path_by_path(magnets, expected, way, lanes):
    engine, *line = magnets
    found = tracked(engine, way, *line, lanes=lanes)
    assert (found.status == REACHED).all()
    assert np.abs(found.x - expected.x).max() < 1e-13
    assert np.abs(found.tangent - expected.tangent).max() < 1e-9
    assert np.abs(found.steps - expected.steps).max() <= 3
    assert found.quality.max() < 1e-11  # unknowns that end at zero are weighed with 1e-4 of the largest


def test_machine_code_and_interpreter_agree_to_the_last_bit(magnets):
    engine, *line = magnets
    interpreted, code = tracked(engine, "interpreted", *line), tracked(engine, "compiled", *line)
    assert np.array_equal(interpreted.x, code.x)
    assert np.array_equal(interpreted.ticks, code.ticks)


@pytest.mark.parametrize("way", ["compiled", "pivoted"])
def test_a_path_does_not_depend_on_its_company(magnets, way):
    engine, starts, base, direction = magnets
    together = tracked(engine, way, starts, base, direction)
    alone = [tracked(engine, way, start[None], base, direction) for start in starts]
    assert np.array_equal(together.x, np.concatenate([one.x for one in alone]))
    assert np.array_equal(together.ticks, np.concatenate([one.ticks for one in alone]))


@pytest.mark.parametrize("way", WAYS)
def test_each_path_may_have_its_own_line(way):
    rng = np.random.default_rng(3)
    engine = univariate(3)
    start = rng.normal(size=4) + 1j * rng.normal(size=4)
    targets = rng.normal(size=(3, 4)) + 1j * rng.normal(size=(3, 4))
    found = tracked(engine, way, roots(start), targets, start - targets)
    assert (found.status == REACHED).all()
    for x, target in zip(found.x, targets):
        assert np.abs(roots(target) - x).min() < 1e-12


@pytest.mark.parametrize("way", WAYS)
def test_toric_paths_follow_powers_of_a_vanishing_parameter(way):
    rng = np.random.default_rng(8)
    engine = univariate(4)
    coefficients = rng.normal(size=5) + 1j * rng.normal(size=5)
    rates = -np.array([0.0, 1.5, 1.0, 2.5, 0.0])
    r = 9.0
    found = tracked(engine, way, roots(coefficients * np.exp(r * rates)), coefficients, rates, start=r, kind="toric")
    assert (found.status == REACHED).all()
    assert difference(found.x, roots(coefficients)) < 1e-12


@pytest.mark.parametrize("way", WAYS)
def test_paths_pause_at_the_stop_and_go_on_from_there(magnets, expected, way):
    engine, starts, base, direction = magnets
    first = tracked(engine, way, starts, base, direction, stop=0.3)
    paused = first.status == PAUSED
    assert paused.any() and np.all(first.r[paused] == 0.3)
    assert np.all((first.status == PAUSED) | (first.status == REACHED))
    rest = tracked(engine, way, first.x[paused], base, direction, start=0.3)
    assert np.abs(rest.x - expected.x[paused]).max() < 1e-12


@pytest.mark.parametrize("way", WAYS)
def test_an_end_away_from_zero_is_met_exactly(magnets, way):
    engine, starts, base, direction = magnets
    half = tracked(engine, way, starts, base, direction, end=0.1)
    assert np.all(half.r == 0.1) and (half.status == REACHED).all()
    rest = tracked(engine, way, half.x, base, direction, start=0.1)
    F = np.array(engine.program.replay(list(rest.x.T), list(base))["F"])
    assert np.abs(F).max() < 1e-13


@pytest.mark.parametrize("way", WAYS)
def test_every_end_has_its_status(way):
    # x² = p through its branch point; p x = 1 to its pole; and a limit on the ticks.
    square, pole = Builder(1, 1), Builder(1, 1)
    x = square.unknown(0)
    branch = engine_module.make_engine(
        square, [square.sub(square.square(x), square.parameter(0))], (np.array([[1.0]]), np.array([1.0]))
    )
    ends = tracked(branch, way, np.array([[1.0], [-1.0]]), np.array([-1.0]), np.array([2.0]))
    assert (ends.status == STALLED).all() and np.abs(ends.r - 0.5).max() < 1e-3
    product = pole.multiply(pole.unknown(0), pole.parameter(0))
    away = engine_module.make_engine(pole, [pole.sub(product, pole.one)], (np.array([[1.0]]), np.array([1.0])))
    settings = Settings(infinity=1e6)
    ends = tracked(away, way, np.array([[1.0]]), np.array([0.0]), np.array([1.0]), settings=settings)
    assert ends.status[0] == DIVERGED and 1e6 < abs(ends.x[0, 0]) < 1e9
    engine, *line = katsura(2)
    ends = tracked(engine, way, *line, settings=Settings(ticks=20))
    assert (ends.status == EXHAUSTED).all() and (ends.ticks == 20).all()


@pytest.mark.parametrize("way", WAYS)
def test_quality_tells_a_regular_end_from_a_double_root(way):
    engine = univariate(2)
    start = np.array([3 + 1j, 0.4, 1])
    double = np.array([1, -2, 1])  # (x - 1)²
    ends = tracked(engine, way, roots(start), double, start - double)
    regular = tracked(engine, way, roots(start), np.array([2, -3, 1]), start - np.array([2, -3, 1]))
    assert regular.quality.max() < 1e-14
    assert np.all((ends.status != REACHED) | (ends.quality > 1e-12))


@pytest.mark.parametrize("way", WAYS)
def test_no_paths_are_no_trouble(way):
    engine = univariate(2)
    ends = tracked(engine, way, np.zeros((0, 1)), np.ones(3), np.ones(3))
    assert ends.x.shape == (0, 1) and len(ends.status) == 0


def test_an_engine_travels_as_data(magnets, expected):
    engine, *line = magnets
    engine.prefer = "interpreted"
    data = pickle.dumps(engine)
    assert len(data) < 50_000
    assert np.array_equal(pickle.loads(data).track(*line).x, engine.track(*line).x)


def test_threads_share_an_engine(magnets):
    engine, starts, base, direction = magnets
    fresh = katsura(4)[0]
    fresh.prefer = "compiled"
    alone = tracked(engine, "compiled", starts, base, direction)
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda _: fresh.track(starts, base, direction), range(12)))
    assert all(np.array_equal(result.x, alone.x) for result in results)


def test_small_work_does_not_wait_for_the_kernel(magnets, monkeypatch):
    engine, *_ = magnets
    engine.prefer, engine.lanes = "auto", None
    monkeypatch.setattr(compiled, "kernel_is_loaded", lambda: False)
    monkeypatch.setattr(compiled, "kernel_is_cached", lambda: False)
    monkeypatch.setitem(engine_module._RENT, "seconds", 0.0)
    assert engine._choose(16, False) == "reference"
    choices = [engine._choose(16, False) for _ in range(400)]
    assert choices[-1] != "reference"  # in the end the kernel has paid
    monkeypatch.setattr(compiled, "kernel_is_cached", lambda: True)
    monkeypatch.setitem(engine_module._RENT, "seconds", 0.0)
    sooner = [engine._choose(16, False) for _ in range(400)]
    assert 0 < sooner.count("reference") < choices.count("reference") / 5


def test_machine_code_is_made_when_many_paths_pay_for_it(magnets, monkeypatch):
    engine, *_ = magnets
    engine.prefer = "auto"
    monkeypatch.setattr(compiled, "kernel_is_loaded", lambda: True)
    monkeypatch.setattr(compiled, "code_is_cached", lambda program, lanes=None: False)
    monkeypatch.setattr(engine, "_code_at_hand", None)
    monkeypatch.setattr(engine, "_path_ticks", 0)
    assert engine._choose(100, False) == "interpreted"
    assert engine._choose(100_000, False) == "compiled"


def test_a_system_too_dense_to_be_written_out_is_pivoted(expected, monkeypatch):
    monkeypatch.setattr(engine_module, "LONGEST_TICK", 100)
    engine, *line = katsura(4)
    found = tracked(engine, "compiled", *line)
    assert engine.tick is None and engine.used == "pivoted"
    assert np.abs(found.x - expected.x).max() < 1e-13
    precise = tracked(engine, "double-double", line[0][:2], *line[1:])
    assert engine.used == "multiprecision" and np.abs(precise.x - expected.x[:2]).max() < 1e-13


@pytest.mark.parametrize("way", WAYS)
def test_a_jacobian_without_pivots_makes_paths_fail_and_nothing_else(way):
    b = Builder(2, 1)
    square = b.sub(b.square(b.unknown(0)), b.parameter(0))
    engine = engine_module.make_engine(b, [square, b.multiply(b.unknown(0), square)], ([[1.0, 1.0]], [1.0]))
    found = tracked(engine, way, np.ones((3, 2)), np.array([2.0]), np.array([-1.0]))
    assert not np.any(found.status == REACHED)


@pytest.mark.parametrize(
    ("options", "words"),
    [({"kind": "spiral"}, "spiral"), ({"arithmetic": "quad"}, "quad"), ({"kind": "toric"}, "real")],
)
def test_wrong_options_are_named(magnets, options, words):
    engine, *line = magnets
    with pytest.raises(ValueError, match=words):
        engine.track(*line, **options)


def test_shapes_that_do_not_fit_are_refused(magnets):
    engine, starts, base, direction = magnets
    with pytest.raises(ValueError, match="5 unknowns"):
        engine.track(starts[:, :4], base, direction)
    with pytest.raises(ValueError, match=r"2 parameters.*\(2,\)"):
        engine.track(starts, np.ones(3), direction)
    with pytest.raises(ValueError, match=r"shape \(3, 2\) for 16 paths"):
        engine.track(starts, base, np.ones((3, 2)))


def test_a_long_queue_is_tracked_in_pieces(magnets, monkeypatch):
    engine, starts, base, direction = magnets
    many, lines = np.tile(starts, (3, 1)), np.tile(base, (48, 1))
    whole = tracked(engine, "interpreted", many, lines, direction)
    monkeypatch.setattr(compiled, "CHUNK", 7)
    pieces = tracked(engine, "interpreted", many, lines, direction)
    assert np.array_equal(whole.x, pieces.x) and np.array_equal(whole.ticks, pieces.ticks)
    assert np.array_equal(whole.quality, pieces.quality)
