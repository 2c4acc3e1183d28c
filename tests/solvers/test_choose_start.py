"""The automatic choice: fewest paths, with a reason, and never a start that cannot be had."""

import numpy as np
import pytest
import sympy

from benchmarks.zoo import ZOO
from solvers.choose_start import choose_start
from solvers.supports import TooManyTerms
from solvers.system import System


@pytest.mark.parametrize(
    "name, start, paths",
    [
        ("quartics", "total-degree", 64),
        ("katsura5", "total-degree", 32),
        ("cyclic5", "polyhedral", 70),
        ("eco8", "polyhedral", 64),
        ("chandra8", "polyhedral", 128),
        ("noon4", "polyhedral", 73),
        ("d1", "polyhedral", 192),
        ("ipp2", "polyhedral", 288),
    ],
)
def test_published_systems(name, start, paths):
    choice = choose_start(ZOO[name].build())
    assert (choice.start, choice.paths) == (start, paths)
    assert choice.reason


@pytest.mark.parametrize("start", ["total-degree", "multihomogeneous", "polyhedral", "auto"])
def test_homotopy_has_as_many_paths_as_promised(start):
    system = ZOO["caprasse"].build()
    choice = choose_start(system, start=start)
    homotopy = choice.homotopy(system, np.zeros(0), seed=3)
    assert homotopy.starts.count == choice.paths
    assert homotopy.name.replace(" ", "-") == choice.start


def test_own_groups_are_used():
    x, y = sympy.symbols("x y")
    system = System([x * y - 1, x**2 * y + x - 3], [x, y], groups=[[x], [y]])
    choice = choose_start(system)
    assert (choice.start, choice.paths) == ("multihomogeneous", 3)


def test_equations_too_large_to_expand_are_kept_factored():
    unknowns = sympy.symbols("x0:8")
    rng = np.random.default_rng(2)
    rows = rng.integers(1, 9, size=(8, 9, 8)).tolist()
    system = System(
        [sympy.prod([sum(c * v for c, v in zip(f, unknowns)) - 1 for f in row]) - 1 for row in rows], unknowns
    )
    choice = choose_start(system)
    assert choice.start != "polyhedral"
    assert "terms" in choice.reason
    with pytest.raises(TooManyTerms):
        choose_start(System([sum(unknowns) ** 60] * 8, unknowns), start="polyhedral")


def test_unknown_start_is_named():
    with pytest.raises(ValueError, match="'newton' is unknown"):
        choose_start(ZOO["noon3"].build(), start="newton")


def test_a_structure_given_is_used():
    """Three bilinear equations in chains: fewer paths than any grouping of the unknowns allows."""
    x, y, z = sympy.symbols("x y z")
    system = System([x * y - 2 * y + 1, y * z - y - 3, z * x + z - 5], [x, y, z])
    structure = [[[x], [y]], [[y], [z]], [[z], [x]]]
    choice = choose_start(system, start=structure)
    assert (choice.start, choice.paths) == ("linear-product", 2)
    from solvers import solve

    with_structure, without = (
        solve(system, start=s, certificates=False).points for s in (structure, "total-degree")
    )
    assert len(with_structure) == len(without)
    assert np.abs(np.sort_complex(with_structure[:, 0]) - np.sort_complex(without[:, 0])).max() < 1e-10
    with pytest.raises(ValueError, match="list of sets"):
        choose_start(system, start=[[["x"]]])
