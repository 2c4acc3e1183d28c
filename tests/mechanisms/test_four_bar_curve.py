"""Equations of coupler-curve synthesis: against Eq. (19), the published size of the system, and Roberts' theorem."""

import numpy as np
import pytest

from mechanisms.families.four_bar_curve import (
    NAMES,
    cognate,
    curve_columns,
    curve_instance,
    curve_mirror,
    curve_system,
    nine_point_instance,
    nine_point_mirror,
    nine_point_system,
    swap,
    swapped_curve,
)
from tests.mechanisms import suarez

CHOICES = [(8, ("g",)), (7, ("y_N", "g")), (6, ("y_M", "y_N", "g")), (8, ("L_MR",)), (7, ("x_M", "e"))]


@pytest.mark.parametrize("points, chosen", CHOICES)
def test_random_instances_are_regular_roots(points, chosen):
    point, parameters = curve_instance(points, chosen, np.random.default_rng(points))
    F, J = curve_system(points, chosen).evaluate(point[None], parameters)
    assert np.abs(F).max() < 1e-11 and np.linalg.cond(J[0]) < 1e9


@pytest.mark.parametrize("points, chosen", CHOICES)
def test_roots_satisfy_eq_19(points, chosen):
    """With the turns eliminated: the paper's own polynomial, at complex values too."""
    import sympy

    from mechanisms.families.wanzer_equations import coupler_curve_equation

    equation = coupler_curve_equation()
    residual = sympy.lambdify((*equation.unknowns, *equation.point), equation.equation, cse=True)
    point, parameters = curve_instance(points, chosen, np.random.default_rng(points))
    values = dict(zip(curve_columns(chosen), point)) | dict(zip(chosen, parameters[2 * points :]))
    e, f, g = values["e"], values["f"], values["g"]
    if "k_M" in values:
        values["L_MR"] = np.sqrt(values["k_M"] + e**2 + g**2)
    if "k_N" in values:
        values["L_NS"] = np.sqrt(values["k_N"] + f**2 + g**2)
    for a, ac in parameters[: 2 * points].reshape(-1, 2):
        x, y = (a + ac) / 2, (a - ac) / 2j
        here = residual(*(values[name] for name in NAMES), x, y)
        moved = residual(*(values[name] for name in NAMES), x + 1e-3, y)
        assert abs(here) < 1e-7 * abs(moved)


@pytest.mark.parametrize("table, count", [(suarez.TABLE_5, 6), (suarez.TABLE_6, 7), (suarez.TABLE_7, 8)])
def test_printed_four_bars_solve_the_system(table, count):
    """The turns follow from Eq. (19)'s linear equations; the printed digits leave a small residual."""
    chosen = suarez.CURVE_CHOICES[count]
    e, f, g = (table[name] for name in "efg")
    m, n = complex(table["x_M"], table["y_M"]), complex(table["x_N"], table["y_N"])
    k_m, k_n = table["L_MR"] ** 2 - e**2 - g**2, table["L_NS"] ** 2 - f**2 - g**2
    values = {**table, "k_M": k_m, "k_N": k_n}
    zeta, omega = complex(-e, -g), complex(f, -g)
    root = [values[name] for name in curve_columns(chosen)]
    places = suarez.A_POINTS[:count]
    for a in places:
        x, y = a - m, a - n
        rows = np.array([[x * np.conj(zeta), np.conj(x) * zeta], [y * np.conj(omega), np.conj(y) * omega]])
        tc, t = np.linalg.solve(rows, [k_m - abs(x) ** 2, k_n - abs(y) ** 2])
        root += [t, tc]
    parameters = [*np.stack([places, np.conj(places)], axis=1).ravel(), *(table[name] for name in chosen)]
    F, _ = curve_system(count, chosen).evaluate(np.array(root)[None], parameters)
    assert np.abs(F).max() < 3e-2 * max(1.0, abs(n) / 5)  # 1 − |T|² amplifies four decimals
    mirrored = curve_mirror(count, chosen).image(np.array(root)[None])
    assert np.abs(mirrored - root).max() < 1e-9


def test_swapping_dyads_keeps_the_curve_when_g_alone_is_chosen():
    point, parameters = curve_instance(8, ("g",), np.random.default_rng(2))
    exchange = swapped_curve(("g",))
    F, _ = curve_system(8, ("g",)).evaluate(exchange(point[None]), parameters)
    assert np.abs(F).max() < 1e-11 and np.abs(exchange(point) - point).max() > 0.1
    assert swapped_curve(("y_N", "g")) is None and swapped_curve(("y_M", "y_N", "g")) is None
    assert swapped_curve(("e",)) is None


def test_nine_point_system_has_the_published_shape():
    """Sixteen cubics and eight quadrics, 112 entries in the Jacobian."""
    system = nine_point_system()
    assert system.size == (24, 24) and sorted(system.degrees) == [2] * 8 + [3] * 16
    assert len(system.jacobian_program.pattern) == 112


def test_cognates_and_swap_generate_six_roots():
    """Roberts: three four-bars draw one curve; with the dyads' exchange the group has order six."""
    point, parameters = nine_point_instance(np.random.default_rng(4))
    system = nine_point_system()
    orbit = [point[None]]
    for _ in range(2):
        orbit.append(cognate(swap(orbit[-1]), parameters))
    orbit += [swap(root) for root in orbit]
    for root in orbit:
        F, _ = system.evaluate(root, parameters)
        assert np.abs(F).max() < 1e-10
    distances = [np.abs(a - b).max() for k, a in enumerate(orbit) for b in orbit[:k]]
    assert min(distances) > 1e-3
    assert np.abs(cognate(swap(orbit[2]), parameters) - point).max() < 1e-10
    assert np.abs(cognate(cognate(point[None], parameters), parameters) - point).max() < 1e-10


def test_cognate_is_the_published_formula():
    """Roberts in the vectors of Wampler, Morgan and Sommese: (x, a, y, b) → ((x−a)y/(x−y), (bx−ay)/(x−y), a−x, a).

    There a and b lead from A_0 to the fixed pivots, x and y to the moving ones.
    """
    point, parameters = nine_point_instance(np.random.default_rng(9))
    a, _, x, _, b, _, y, _ = point[:8]
    a, b = -a, -b
    wanted = {"x": (x - a) * y / (x - y), "a": (b * x - a * y) / (x - y), "y": a - x, "b": a}
    other = cognate(point[None], parameters)[0]
    found = {"a": -other[4], "x": other[6], "b": -other[0], "y": other[2]}
    assert all(abs(found[name] - wanted[name]) < 1e-10 for name in wanted)


def test_mirror_of_nine_points_keeps_real_roots():
    """A real four-bar: barred unknowns are conjugates."""
    rng = np.random.default_rng(12)
    design = rng.normal(size=4) + 1j * rng.normal(size=4)
    turns = np.exp(1j * rng.normal(size=8))
    root = np.stack([np.concatenate([design, turns]), np.concatenate([design, turns]).conj()], axis=1).ravel()
    assert np.array_equal(nine_point_mirror().image(root[None])[0], root)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize(
    "points, chosen, count",
    [(6, ("y_M", "y_N", "g"), 1320), (7, ("y_N", "g"), 3200), (8, ("g",), 8984)],
)
def test_every_seed_counts_as_many_four_bars(points, chosen, count, seed):
    from solvers import monodromy

    exchange = swapped_curve(chosen)
    start = curve_instance(points, chosen, np.random.default_rng([seed, points]))
    symmetry = () if exchange is None else (exchange,)
    assert len(monodromy(curve_system(points, chosen), seed, symmetry, start, trace=False)) == count
