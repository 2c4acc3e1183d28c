"""Every dead centre of an input: the critical-point system, solved completely.

At a dead centre the linkage can move while its input stands still: the differentiated closure equations
have a solution other than zero with the input's rate zero. With the rates as unknowns (on a random chart,
one linear equation) this is a square polynomial system, and its finite roots are all dead centres, real and
complex. Double points of the configuration curve are among them, for every input.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.curve import need_one_freedom
from mechanisms.linkage import Input, Linkage
from mechanisms.polynomials import Structure, closure_polynomials, dimensions, generic, real_configurations

if TYPE_CHECKING:
    from solvers.solutions import Ledger, Solutions
    from solvers.system import System

#: Ratio of the least to the largest singular value of the closure's Jacobian below which a point is a
#: double point.
DOUBLE = 1e-7

_SYSTEMS: dict[Structure, System] = {}
_GENERIC: dict[Structure, Solutions] = {}


@dataclass(frozen=True, eq=False)
class DeadCentres:
    """All dead centres of an input.

    Attributes
    ----------
    x : (k, n) float array
        The real ones, sorted by the input.
    value : (k,) float array
        The input there, from the reference, in (−π, π] for a rotation; or length.
    double : (k,) bool array
        Whether the configuration curve has a double point there, at which every input is dead.
    complex_count : int
        Number of complex ones.
    ledger : Ledger
        Account of the solver's paths.
    """

    x: np.ndarray
    value: np.ndarray
    double: np.ndarray
    complex_count: int
    ledger: Ledger

    def __repr__(self) -> str:
        doubles = f", {int(self.double.sum())} of them double points" if self.double.any() else ""
        return f"DeadCentres({len(self.x)} real{doubles}, {self.complex_count} complex)"


def dead_centres(linkage: Linkage, driven: Input | str, seed: int = 0) -> DeadCentres:
    """Return every dead centre of an input.

    Parameters
    ----------
    linkage : Linkage
        With one degree of freedom.
    driven : Input or str
    seed : int
        Of the solver's random choices.

    Returns
    -------
    DeadCentres

    Examples
    --------
    The follower of a crank-rocker has four, where crank and coupler are in line (two on each circuit):

    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> dead_centres(four_bar, Input("follower"))
    DeadCentres(4 real, 0 complex)
    """
    from solvers.solve import solve

    if isinstance(driven, str):
        driven = linkage.inputs[driven]
    linkage.check_input(driven)
    closure = Closure.of(linkage)
    need_one_freedom(closure)
    structure = Structure.of(linkage, driven)
    system = _system(structure)
    if structure not in _GENERIC:
        _GENERIC[structure] = generic(system, structure, linkage, more=0)
    solutions = solve(
        system,
        np.array(dimensions(structure, closure)),
        start=_GENERIC[structure],
        seed=seed,
        certificates=False,
    )
    points = solutions.points
    if len(solutions.singular):  # a double point is a multiple root
        points = np.concatenate([points, np.asarray(solutions.singular).reshape(-1, points.shape[1])])
    r, kept = structure.rotations, len(structure.kept_slides())
    x, which = real_configurations(
        structure, closure, points[:, :r], points[:, r : 2 * r], points[:, 2 * r : 2 * r + kept]
    )
    x = _distinct(x)
    gradient, unit = closure.gradient(driven)
    value = unit * (x @ gradient)
    if not driven.translation:
        value = np.angle(np.exp(1j * value))
    values = np.linalg.svd(closure.jacobian(x), compute_uv=False)
    double = values[:, -1] < DOUBLE * values[:, 0] if len(x) else np.zeros(0, dtype=bool)
    order = np.argsort(value, kind="stable")
    return DeadCentres(x[order], value[order], double[order], len(points) - len(which), solutions.ledger)


def _distinct(x: np.ndarray) -> np.ndarray:
    kept: list[np.ndarray] = []
    for row in x:
        if not any(np.abs(np.exp(1j * row) - np.exp(1j * other)).max() < 1e-7 for other in kept):
            kept.append(row)
    return np.array(kept).reshape(-1, x.shape[1])


def _system(structure: Structure) -> System:
    if structure in _SYSTEMS:
        return _SYSTEMS[structure]
    import sympy as sp

    from solvers.system import System

    poly = closure_polynomials(structure)
    link, base = structure.driven
    r = structure.rotations
    omega = [*sp.symbols(f"o:{r}"), sp.Integer(0)]
    sigma = {j: sp.Symbol(f"t{j}") for j in poly.s}
    rates = [*omega[:-1], *sigma.values()]
    # The input stands still: its rate is replaced by that of the link it is driven against, or is zero.
    if base < 0:
        rates.remove(sigma[link])
        sigma[link] = sp.Integer(0)
    elif link < r:
        rates.remove(omega[link])
        omega[link] = omega[base]
    else:
        rates.remove(omega[base])
        omega[base] = sp.Integer(0)
    moved = []
    for loop in poly.loops:
        # d/dt, divided by i: dz = i ω z, dw = −i ω w, ds = i σ with a σ that is imaginary for a real
        # motion.
        total = sum(sp.diff(loop, poly.z[k]) * omega[k] * poly.z[k] for k in range(r))
        total -= sum(sp.diff(loop, poly.w[k]) * omega[k] * poly.w[k] for k in range(r))
        total += sum(sp.diff(loop, s) * sigma[j] for j, s in poly.s.items())
        moved.append(total)
    # Any chart that no real direction misses; fixed numbers, for the same roots in every session.
    rng = np.random.default_rng(7)
    chart = sum(complex(*rng.normal(size=2)) * rate for rate in rates) - 1
    equations = [*poly.loops, *(poly.z[k] * poly.w[k] - 1 for k in range(r)), *moved, chart]
    groups: list[list[Any]] = [poly.z[:r], poly.w[:r]]
    groups += [list(poly.s.values())] if poly.s else []
    groups.append(rates)
    unknowns = [symbol for group in groups for symbol in group]
    _SYSTEMS[structure] = System(equations, unknowns, poly.parameters, groups=groups)
    return _SYSTEMS[structure]
