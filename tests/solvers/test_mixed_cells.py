"""Mixed volumes against convex hulls and published numbers; every cell against the definition."""

from fractions import Fraction
from itertools import combinations, product

import numpy as np
import pytest
from scipy.spatial import ConvexHull, QhullError

from benchmarks.algebra import cyclic
from benchmarks.zoo import ZOO
from solvers.mixed_cells import TooManyCells, mixed_cells, mixed_volume
from solvers.supports import terms


def volume(points):
    try:
        return ConvexHull(points).volume
    except QhullError:
        return 0.0


def by_inclusion_and_exclusion(supports):
    """n! times the mixed volume of polytopes: alternating volumes of Minkowski sums."""
    n = len(supports)
    total = 0.0
    for size in range(1, n + 1):
        for chosen in combinations(supports, size):
            sums = np.array([sum(map(np.array, choice)) for choice in product(*chosen)], float)
            total += (-1) ** (n - size) * volume(np.unique(sums, axis=0))
    return round(total)


def random_supports(rng, n, points, span):
    return [rng.integers(0, span, size=(rng.integers(2, points + 1), n)) for _ in range(n)]


@pytest.mark.parametrize("n, points, span", [(2, 6, 5), (3, 5, 4)])
def test_mixed_volume_agrees_with_convex_hulls(n, points, span):
    rng = np.random.default_rng(8)
    for _ in range(25):
        supports = random_supports(rng, n, points, span)
        assert mixed_volume(supports) == by_inclusion_and_exclusion(supports)


def inequalities_hold(cells):
    """Each cell against its definition, in fractions: the edge is level, every other point lies above it."""
    import sympy

    n = len(cells.supports)
    for cell, size in zip(cells.edges, cells.volumes):
        pairs = [(int(a), int(b)) for a, b in cell]
        steps = sympy.Matrix([(s[b] - s[a]).tolist() for s, (a, b) in zip(cells.supports, pairs)])
        rise = sympy.Matrix([int(w[b] - w[a]) for w, (a, b) in zip(cells.liftings, pairs)])
        assert abs(steps.det()) == size
        normal = [Fraction(int(v.p), int(v.q)) for v in steps.LUsolve(-rise)]
        for s, w, (a, b) in zip(cells.supports, cells.liftings, pairs):
            level = [int(h) + sum(int(e) * v for e, v in zip(point, normal)) for point, h in zip(s, w)]
            assert level[a] == level[b] and a != b
            assert all(value > level[a] for k, value in enumerate(level) if k not in (a, b))
    assert len(np.unique(np.sort(cells.edges, axis=2).reshape(len(cells), 2 * n), axis=0)) == len(cells)


@pytest.mark.parametrize("compiled", [False, True])
def test_cells_satisfy_their_inequalities_and_are_distinct(compiled):
    rng = np.random.default_rng(9)
    for n in (2, 3, 4):
        cells = mixed_cells(random_supports(rng, n, 6, 5), compiled=compiled)
        inequalities_hold(cells)


def test_compiled_and_plain_find_the_same_cells():
    supports = terms(ZOO["cyclic5"].build()).supports
    plain, compiled = mixed_cells(supports, 3, compiled=False), mixed_cells(supports, 3, compiled=True)
    assert {tuple(c) for c in np.sort(plain.edges, axis=2).reshape(-1, 10).tolist()} == {
        tuple(c) for c in np.sort(compiled.edges, axis=2).reshape(-1, 10).tolist()
    }


PUBLISHED = [name for name, benchmark in ZOO.items() if benchmark.mixed_volume is not None]


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_mixed_volumes(name):
    benchmark = ZOO[name]
    assert mixed_volume(terms(benchmark.build()).supports) == benchmark.mixed_volume


@pytest.mark.parametrize("n", range(5, 11))
def test_katsura_has_two_roots_with_zeros_or_more(n):
    """2^n roots in all; the supports with the origin count those with zero coordinates as well."""
    supports = terms(ZOO[f"katsura{n}"].build()).supports
    origin = np.zeros((1, n + 1), np.int64)
    assert mixed_volume(supports) < mixed_volume([np.vstack([s, origin]) for s in supports]) == 2**n


@pytest.mark.slow
@pytest.mark.parametrize("n, volume", [(8, 2560), (9, 11016), (10, 35940)])
def test_larger_cyclic_systems(n, volume):
    assert mixed_volume(terms(cyclic(n)).supports) == volume


def test_every_lifting_gives_the_same_mixed_volume():
    supports = terms(ZOO["cyclic6"].build()).supports
    sizes = {(len(cells), cells.mixed_volume) for cells in (mixed_cells(supports, seed) for seed in range(20))}
    assert {volume for _, volume in sizes} == {156}
    assert len(sizes) > 1  # the subdivisions differ


@pytest.mark.parametrize("compiled", [False, True])
def test_large_exponents_do_not_overflow(compiled):
    rng = np.random.default_rng(10)
    small = random_supports(rng, 3, 5, 4)
    factor = 10**6 + 3
    assert mixed_volume(small) > 0
    large = mixed_cells([factor * s for s in small], compiled=compiled)
    assert large.mixed_volume == factor**3 * mixed_volume(small)


def test_shifted_supports_have_the_same_mixed_volume():
    rng = np.random.default_rng(11)
    supports = random_supports(rng, 3, 6, 4)
    assert mixed_volume([s - rng.integers(0, 9, size=3) for s in supports]) == mixed_volume(supports)


def test_degenerate_supports_have_no_cells():
    assert mixed_volume([[[1, 2]], [[0, 0], [1, 0]]]) == 0
    assert mixed_volume([[[0, 0], [1, 0]], [[0, 0], [3, 0]]]) == 0
    assert len(mixed_cells([np.zeros((0, 1), int)])) == 0


def test_wrong_shapes_are_refused():
    with pytest.raises(ValueError, match="2 columns"):
        mixed_volume([[[1, 2, 3]], [[0, 0, 0]]])
    with pytest.raises(ValueError, match="not integers"):
        mixed_volume([[[0.5], [1.0]]])


@pytest.mark.parametrize("compiled", [False, True])
def test_patience_has_an_end(compiled):
    supports = terms(ZOO["cyclic5"].build()).supports
    with pytest.raises(TooManyCells, match="more than 10 cells"):
        mixed_cells(supports, compiled=compiled, patience=10)
