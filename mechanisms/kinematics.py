"""Velocities and accelerations of a linkage, and what its input must push: virtual work.

Differentiating the closure equations f(x) = 0 once and twice gives linear systems with one matrix,

    f'(x) ẋ = 0,  g·ẋ = rate        f'(x) ẍ = −f''(x)[ẋ, ẋ],  g·ẍ = acceleration,

where g·x is the input. The input torque T balances loads and springs when for the motion of unit input rate
T + Σ F·v + Σ M ω − dU = 0.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechanisms.closure import Closure
from mechanisms.curve import need_one_freedom
from mechanisms.linkage import Input, Linkage, LinkageError


@dataclass(frozen=True)
class State:
    """How a linkage moves at one configuration, or at many: leading axes of x lead every array.

    Attributes
    ----------
    rotation, angular_velocity, angular_acceleration : dict of str to float array
        Of each moving link: radians, per time, per time squared.
    position, velocity, acceleration : dict of str to complex array
        Of each point, in the length unit.
    """

    rotation: dict[str, Any]
    angular_velocity: dict[str, Any]
    angular_acceleration: dict[str, Any]
    position: dict[str, Any]
    velocity: dict[str, Any]
    acceleration: dict[str, Any]


@dataclass(frozen=True)
class Force:
    """A force (complex: x + iy, world axes) on a point."""

    point: str
    value: complex


@dataclass(frozen=True)
class Torque:
    """A torque on a link, anticlockwise positive."""

    link: str
    value: float


@dataclass(frozen=True)
class TorsionSpring:
    """A spring between two links: energy ½ stiffness (rotation of link − of relative_to − relaxed)².

    Rotations are from the reference, so ``relaxed`` = 0 is a spring without load there; radians.
    """

    link: str
    relative_to: str
    stiffness: float
    relaxed: float = 0.0


@dataclass(frozen=True)
class LineSpring:
    """A spring between two points: energy ½ stiffness (distance − relaxed)²."""

    first: str
    second: str
    stiffness: float
    relaxed: float


Load = Force | Torque | TorsionSpring | LineSpring


def move(linkage: Linkage, driven: Input | str, x: np.ndarray, rate: Any = 1.0, acceleration: Any = 0.0) -> State:
    """Return velocities and accelerations at configurations.

    Parameters
    ----------
    linkage : Linkage
        With one degree of freedom.
    driven : Input or str
    x : (…, n) float array
        Configurations that close the loops.
    rate, acceleration : float or array
        Of the input: radians (or length) per time, per time squared.

    Returns
    -------
    State

    Raises
    ------
    LinkageError
        At a dead centre of the input, where its rate decides nothing.

    Examples
    --------
    >>> four_bar = Linkage({"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...                    {"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"})
    >>> state = move(four_bar, Input("crank"), np.zeros(3))
    >>> complex(state.velocity["B"])
    (-1+0j)
    >>> round(float(state.angular_velocity["follower"]), 6)
    0.428571
    """
    closure = Closure.of(linkage)
    v, a = rates(linkage, driven, x, rate, acceleration)
    position, velocity, second = _points(closure, np.asarray(x, dtype=float), v, a)
    return State(
        closure.link_rotations(np.asarray(x, dtype=float)),
        closure.link_rotations(v),
        closure.link_rotations(a),
        position,
        velocity,
        second,
    )


def rates(
    linkage: Linkage, driven: Input | str, x: np.ndarray, rate: Any = 1.0, acceleration: Any = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return ẋ and ẍ (…, n) of configurations; arguments as for :func:`move`."""
    if isinstance(driven, str):
        driven = linkage.inputs[driven]
    linkage.check_input(driven)
    closure = Closure.of(linkage)
    need_one_freedom(closure)
    x = np.asarray(x, dtype=float)
    g, unit = closure.gradient(driven)
    jacobian = closure.jacobian(x)
    matrix = np.concatenate([jacobian, np.broadcast_to(g, (*x.shape[:-1], 1, len(g)))], axis=-2)
    zero = np.zeros((*x.shape[:-1], closure.equations))
    try:
        v = _solve(matrix, zero, np.asarray(rate) / unit)
        a = _solve(matrix, -closure.curvature(x, v), np.asarray(acceleration) / unit)
    except np.linalg.LinAlgError:
        v = np.full(x.shape, np.inf)
    # At a dead centre rounding leaves a tiny pivot: rates beyond 1/√eps mean nothing in double precision.
    if not np.abs(v).max(initial=0.0) < 6.7e7 * max(1.0, float(np.abs(rate).max() if np.ndim(rate) else abs(rate))):
        raise LinkageError(f"the input {driven.link!r} is at a dead centre: its rate does not decide the motion")
    return v, a


def input_load(linkage: Linkage, driven: Input | str, x: np.ndarray, loads: Iterable[Load]) -> np.ndarray:
    """Return the torque (for a translation: the force) that the input must exert for equilibrium.

    Parameters
    ----------
    linkage : Linkage
    driven : Input or str
    x : (…, n) float array
    loads : iterable of Force, Torque, TorsionSpring, LineSpring

    Returns
    -------
    (…) float array
        Positive when the input pushes the way it is counted; force × length (or force) units of the loads.

    Examples
    --------
    A weight of 2 at the end of a crank of length 3 that stands level:

    >>> crank = Linkage({"A": 0, "P": 3}, {"ground": "A", "crank": "AP"})
    >>> float(input_load(crank, Input("crank"), np.zeros(1), [Force("P", -2j)]))
    6.0
    """
    loads = list(loads)
    _check_loads(linkage, loads)
    state = move(linkage, driven, x)
    total: Any = np.zeros(np.shape(x)[:-1])
    for load in loads:
        if isinstance(load, Force):
            total = total - (np.conj(load.value) * state.velocity[load.point]).real
        elif isinstance(load, Torque):
            total = total - load.value * state.angular_velocity[load.link]
        else:
            total = total + _stretch(load, state) * _stretch_rate(load, state) * load.stiffness
    return total


def spring_energy(linkage: Linkage, x: np.ndarray, loads: Iterable[Load]) -> np.ndarray:
    """Return the energy stored in the springs among the loads at configurations (…, n)."""
    loads = list(loads)
    _check_loads(linkage, loads)
    closure = Closure.of(linkage)
    rotation, position = closure.link_rotations(np.asarray(x)), closure.points_at(np.asarray(x))
    still = State(rotation, {}, {}, position, {}, {})
    springs = [load for load in loads if isinstance(load, (TorsionSpring, LineSpring))]
    total: Any = np.zeros(np.shape(x)[:-1])
    for spring in springs:
        total = total + 0.5 * spring.stiffness * _stretch(spring, still) ** 2
    return total


def _stretch(spring: TorsionSpring | LineSpring, state: State) -> Any:
    if isinstance(spring, TorsionSpring):
        return _turned(state.rotation, spring.link) - _turned(state.rotation, spring.relative_to) - spring.relaxed
    return np.abs(state.position[spring.first] - state.position[spring.second]) - spring.relaxed


def _stretch_rate(spring: TorsionSpring | LineSpring, state: State) -> Any:
    if isinstance(spring, TorsionSpring):
        speed = state.angular_velocity
        return _turned(speed, spring.link) - _turned(speed, spring.relative_to)
    gap = state.position[spring.first] - state.position[spring.second]
    rate = state.velocity[spring.first] - state.velocity[spring.second]
    return (np.conj(gap) * rate).real / np.maximum(np.abs(gap), 1e-300)


def _turned(values: dict[str, Any], link: str) -> Any:
    return values.get(link, 0.0)  # the ground does not turn


def _check_loads(linkage: Linkage, loads: Iterable[Load]) -> None:
    for load in loads:
        points = {Force: ("point",), LineSpring: ("first", "second")}.get(type(load), ())
        links = {Torque: ("link",), TorsionSpring: ("link", "relative_to")}.get(type(load), ())
        for name, known in [(getattr(load, p), linkage.points) for p in points] + [
            (getattr(load, k), linkage.links) for k in links
        ]:
            if name not in known:
                raise LinkageError(f"the load {load!r} names {name!r}, which the linkage does not have")


def _solve(matrix: np.ndarray, top: np.ndarray, last: Any) -> np.ndarray:
    last = np.broadcast_to(last, top.shape[:-1])[..., None]
    return np.linalg.solve(matrix, np.concatenate([top, last], axis=-1)[..., None])[..., 0]


def _points(
    closure: Closure, x: np.ndarray, v: np.ndarray, a: np.ndarray
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Positions and their two derivatives: places are linear in u = e^{iq} and in p = s e^{iq}."""
    r = closure.rotations
    ground = np.zeros((*x.shape[:-1], 1))
    q, w, b = (np.concatenate([z[..., :r], ground], axis=-1) for z in (x, v, a))
    u = np.exp(1j * q)
    du = 1j * w * u
    ddu = (1j * b - w**2) * u
    s, ds, dds = x[..., r:], v[..., r:], a[..., r:]
    k = closure.slide_class
    p = [s * u[..., k], ds * u[..., k] + s * du[..., k], dds * u[..., k] + 2 * ds * du[..., k] + s * ddu[..., k]]
    rows = [closure.class_of[link] for link in closure.links]
    result: list[dict[str, Any]] = []
    for order, (turn, slide) in enumerate(zip((u, du, ddu), p)):
        shift = turn[..., :-1] @ closure.place.T + slide @ closure.place_slides.T
        if order == 0:
            shift = shift + closure.place_constant
        result.append(
            {
                name: closure.scale * (shift[..., link] + turn[..., rows[link]] * home)
                for name, (link, home) in closure.points.items()
            }
        )
    return result[0], result[1], result[2]
