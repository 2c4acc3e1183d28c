"""The sparse form of Eq. (19): the same roots as the tracked form, counted from nothing."""

import numpy as np
import pytest

from benchmarks.coupler_counts import CHOSEN, by_monodromy, from_nothing, in_common
from mechanisms.families.four_bar_curve import curve_columns, curve_instance, curve_system
from mechanisms.families.four_bar_sparse import as_curve_roots, sparse_blocks, sparse_columns, sparse_system
from solvers.choose_start import choose_start


@pytest.mark.parametrize(
    "points, chosen",
    [(6, CHOSEN[6]), (7, CHOSEN[7]), (8, CHOSEN[8]), (8, ("L_MR",)), (7, ("x_M", "e")), (7, ("L_NS", "f"))],
)
def test_both_forms_have_the_same_roots(points, chosen):
    """A root of one, written in the unknowns of the other by what these mean, solves it; the way back leads home."""
    root, parameters = curve_instance(points, chosen, np.random.default_rng(points))
    names = curve_columns(chosen)
    values = dict(zip(names, root)) | dict(zip(chosen, parameters[2 * points :]))
    sparse = root.copy()
    for k, name in enumerate(sparse_columns(chosen)):
        if name.startswith("h_"):
            x, y = (values[f"{axis}_{name[-1]}"] for axis in "xy")
            sparse[k] = values[f"k_{name[-1]}"] - x**2 - y**2
    turns, turned = root[len(names) :: 2], root[len(names) + 1 :: 2]
    sparse[len(names) :: 2], sparse[len(names) + 1 :: 2] = (turns + turned) / 2, (turns - turned) / 2j
    F, J = sparse_system(points, chosen).evaluate(sparse[None], parameters)
    assert np.abs(F).max() < 1e-11 and np.linalg.cond(J[0]) < 1e9
    back = as_curve_roots(sparse[None], chosen, parameters)
    assert np.abs(back - root).max() < 1e-11
    assert np.abs(curve_system(points, chosen).evaluate(back, parameters)[0]).max() < 1e-11


def test_mixed_volume_of_six_points():
    system = sparse_system(6, CHOSEN[6])
    values = np.random.default_rng(1).normal(size=(len(system.parameters), 2)) @ [1, 1j]
    assert choose_start(system, values, "polyhedral").paths == 4800


@pytest.mark.slow
@pytest.mark.parametrize(
    "points, route, count",
    [(6, "polyhedral", 1320), (6, "regeneration", 1320), (7, "polyhedral", 3200), (9, "regeneration", 8652)],
)
def test_every_path_from_nothing_ends_on_the_roots_that_monodromy_found(points, route, count):
    roots, account = from_nothing(points, 3, route=route)
    assert account.finite == len(roots) == count and account.failed == 0
    carried = by_monodromy(points, 3)
    assert len(carried) == in_common(carried, roots) == count


@pytest.mark.parametrize("chosen", [("L_MR",), ("e",)])
def test_choices_that_couple_the_dyads_are_refused(chosen):
    with pytest.raises(ValueError, match="needs g chosen"):
        sparse_blocks(8, chosen)
