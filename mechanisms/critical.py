"""Every dead centre of an input: the critical-point systems, solved completely.

At a dead centre the linkage can move while its input stands still. With the input locked the linkage falls
into Assur groups, and it moves where one of them does: the differentiated loops of that group have a
solution other than zero with all earlier links at rest. With the rates of the group as unknowns (on a
random chart, one linear equation) this is a square polynomial system in the configuration of the group and
of the groups it stands on; its finite roots are all dead centres of the group, and each is completed by all
assemblies of the other groups. Double points of the configuration curve are among them, for every input.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.completions import completions
from mechanisms.curve import need_one_freedom
from mechanisms.linkage import GROUND, Input, Linkage
from mechanisms.polynomials import Structure, closure_polynomials, dimensions, generic, real_configurations
from mechanisms.transmission import assur_groups
from solvers.solutions import Ledger

if TYPE_CHECKING:
    from solvers.solutions import Solutions
    from solvers.system import System

#: Ratio of the least to the largest singular value of the closure's Jacobian below which a point is a
#: double point.
DOUBLE = 1e-7

_SYSTEMS: dict[Any, System | None] = {}
_GENERIC: dict[Any, Solutions | None] = {}


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
        Number of complex ones of all groups (each counted once, not once for each assembly of the other
        groups).
    ledger : Ledger
        Account of the solver's paths for the groups, added up.
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
    if isinstance(driven, str):
        driven = linkage.inputs[driven]
    linkage.check_input(driven)
    closure = Closure.of(linkage)
    need_one_freedom(closure)
    found: list[np.ndarray] = []
    complex_count, ledger = 0, Ledger()
    groups = assur_groups(linkage, driven)
    for number, group in enumerate(groups):
        part = _standing_on(linkage, groups, number, driven)
        later = {link for after in groups[number + 1 :] for link in after}
        solved = _solve_group(part, group, later, driven, seed)
        if solved is None:
            continue  # a driven link alone, which has no loop
        x, others, account = solved
        complex_count += others
        for name in ("tracked", "finite", "singular", "at_infinity", "failed", "excess"):
            setattr(ledger, name, getattr(ledger, name) + getattr(account, name))
        for row in x:
            if len(part.links) == len(linkage.links):
                found.append(row)
            else:
                turned = {link: float(a) for link, a in Closure.of(part).link_rotations(row).items()}
                found += list(completions(linkage, turned, seed))
    x = _distinct(np.array(found).reshape(-1, closure.size))
    gradient, unit = closure.gradient(driven)
    value = unit * (x @ gradient)
    if not driven.translation:
        value = np.angle(np.exp(1j * value))
    values = np.linalg.svd(closure.jacobian(x), compute_uv=False)
    double = values[:, -1] < DOUBLE * values[:, 0] if len(x) else np.zeros(0, dtype=bool)
    order = np.argsort(value, kind="stable")
    return DeadCentres(x[order], value[order], double[order], complex_count, ledger)


def _standing_on(linkage: Linkage, groups: tuple[tuple[str, ...], ...], number: int, driven: Input) -> Linkage:
    """The part of a linkage that a group needs: itself, the groups it is joined to before it, and theirs."""
    links = {GROUND, driven.link, driven.relative_to, *groups[number]}
    for late in range(number, -1, -1):
        if links & set(groups[late]):
            links |= set(groups[late])
            earlier = [link for group in groups[:late] for link in group]
            links |= {link for link in earlier if _joined(linkage, groups[late], link)}
    slides = [{s.link_a, s.link_b} for s in linkage.sliders]
    slides += [{s.link, *linkage.links_of(s.point)} for s in linkage.slots]
    if any(len(pair & links) > 1 for pair in slides) or linkage.gears:
        return linkage  # displacements of standing links are not taken over; solve it whole
    members = {name: points for name, points in linkage.links.items() if name in links}
    used = {point for points in members.values() for point in points}
    return Linkage({p: z for p, z in linkage.points.items() if p in used}, members)


def _joined(linkage: Linkage, group: tuple[str, ...], other: str) -> bool:
    if any({s.link_a, s.link_b} == {other, link} for s in linkage.sliders for link in group):
        return True
    for slot in linkage.slots:
        ends = {slot.link, *linkage.links_of(slot.point)}
        if other in ends and ends & set(group):
            return True
    return any(set(linkage.links[link]) & set(linkage.links[other]) for link in group)


def _solve_group(
    part: Linkage, group: tuple[str, ...], later: set[str], driven: Input, seed: int
) -> tuple[np.ndarray, int, Ledger] | None:
    """Return the real dead centres of one group, the number of complex ones, and the solver's account."""
    from solvers.solve import solve

    stages = {link: 2 if link in later else int(link in group) for link in part.links}

    def loops(of: Linkage) -> Closure:
        return Closure.in_stages(of, stages)

    closure = loops(part)
    if not (closure.loop_stage == 1).any():
        return None
    structure = Structure.of(part, driven, closure)
    moving = tuple(sorted({closure.class_of[link] for link in group} - {closure.class_of[GROUND]}))
    key = structure, moving
    if key not in _SYSTEMS:
        standing = {closure.class_of[link] for link in part.links if not stages[link]}
        gears = [max(stages[link] for link in gear.coefficients) == 1 for gear in part.gears]
        ours = [*(closure.loop_stage == 1), *gears]
        system = _SYSTEMS[key] = _system(structure, set(moving) - standing, _group_slides(part, stages), ours)
        _GENERIC[key] = generic(system, structure, part, loops=loops) if system else None
    system, start = _SYSTEMS[key], _GENERIC[key]
    if system is None or start is None or not len(start.points):
        return np.zeros((0, closure.size)), 0, start.ledger if start else Ledger()
    values = np.array(dimensions(structure, closure))
    solutions = solve(system, values, start=start, seed=seed, certificates=False)
    points = solutions.points
    if len(solutions.singular):  # a double point is a multiple root
        points = np.concatenate([points, np.asarray(solutions.singular).reshape(-1, points.shape[1])])
    r, kept = structure.rotations, len(structure.kept_slides())
    x, which = real_configurations(
        structure, closure, points[:, :r], points[:, r : 2 * r], points[:, 2 * r : 2 * r + kept]
    )
    return _distinct(x), len(points) - len(which), solutions.ledger


def _group_slides(part: Linkage, stages: Mapping[str, int]) -> set[int]:
    """Numbers of the displacements that belong to the group."""
    ends = [(s.link_a, s.link_b) for s in part.sliders]
    ends += [(s.link, part.links_of(s.point)[0]) for s in part.slots]
    return {j for j, pair in enumerate(ends) if max(stages[link] for link in pair) == 1}


def _distinct(x: np.ndarray) -> np.ndarray:
    kept: list[np.ndarray] = []
    for row in x:
        if not any(np.abs(np.exp(1j * row) - np.exp(1j * other)).max() < 1e-7 for other in kept):
            kept.append(row)
    return np.array(kept).reshape(-1, x.shape[1])


def _system(structure: Structure, moving: set[int], slides: set[int], ours: list[bool]) -> System | None:
    """Closure polynomials with those of a group differentiated; only its members have rates. None: never dead."""
    import sympy as sp

    from solvers.system import System

    poly = closure_polynomials(structure)
    link, base = structure.driven
    r = structure.rotations
    omega = [sp.Symbol(f"o{k}") if k in moving else sp.Integer(0) for k in range(r)] + [sp.Integer(0)]
    sigma = {j: sp.Symbol(f"t{j}") if j in slides else sp.Integer(0) for j in poly.s}
    # The input stands still: its rate is that of the link it is driven against, or zero.
    if base < 0:
        sigma[link] = sp.Integer(0)
    elif link < r:
        omega[link] = omega[base]
    else:
        omega[base] = sp.Integer(0)
    rates = list(dict.fromkeys(rate for rate in [*omega, *sigma.values()] if rate != 0))
    moved = []
    of_group = [e for loop, mine in zip(poly.loops, ours) if mine for e in loop]
    of_group += [e for e, mine in zip(poly.gears, ours[len(poly.loops) :]) if mine]
    for equation in of_group:
        # d/dt, divided by i: dz = i ω z, dw = −i ω w, ds = i σ with a σ that is imaginary for a real
        # motion.
        total = sum(sp.diff(equation, poly.z[k]) * omega[k] * poly.z[k] for k in range(r))
        total -= sum(sp.diff(equation, poly.w[k]) * omega[k] * poly.w[k] for k in range(r))
        total += sum(sp.diff(equation, s) * sigma[j] for j, s in poly.s.items())
        moved.append(total)
    places = {*poly.z[:r], *poly.w[:r], *poly.s.values()}
    if not any(equation.free_symbols & places for equation in moved):
        return None  # the group moves alike everywhere (two crossed sliders): it is dead nowhere
    # Any chart that no real direction misses; fixed numbers, for the same roots in every run.
    rng = np.random.default_rng(7)
    chart = sum(complex(*rng.normal(size=2)) * rate for rate in rates) - 1
    equations = [*poly.equations, *(poly.z[k] * poly.w[k] - 1 for k in range(r)), *moved, chart]
    groups: list[list[Any]] = [poly.z[:r], poly.w[:r]]
    groups += [list(poly.s.values())] if poly.s else []
    groups.append(rates)
    return System(equations, [u for group in groups for u in group], poly.parameters, groups=groups)
