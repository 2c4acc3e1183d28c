"""The one model of a planar linkage: links, pins, sliders, slots, gears.

A linkage is described standing in its reference configuration (pose 0), in world coordinates. Every motion is
measured from there: a configuration says by how much each link has turned.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import get_close_matches
from fractions import Fraction
from numbers import Rational
from typing import Any

GROUND = "ground"


class LinkageError(ValueError):
    """The description of a linkage does not make sense; the message says where and what to do."""


@dataclass(frozen=True)
class Slider:
    """A prismatic joint: ``link_b`` slides on ``link_a`` and does not turn against it.

    Parameters
    ----------
    link_a, link_b : str
        The two links. A positive displacement moves ``link_b`` along ``direction`` as ``link_a`` carries it.
    direction : complex
        Direction of sliding in the reference configuration, of any length; kept as a unit vector.
    at : str or complex
        Where the joint is drawn: a point's name or a place at the reference. It does not change the motion.
    """

    link_a: str
    link_b: str
    direction: complex
    at: str | complex = 0j

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit(self.direction, f"slider {self.link_a}/{self.link_b}"))


@dataclass(frozen=True)
class PinSlot:
    """A pin in a straight slot: ``point`` slides along a line of ``link`` and may turn.

    Parameters
    ----------
    link : str
        The link that has the slot.
    point : str
        The pin: a named point of another link. The slot's line passes through its reference position.
    direction : complex
        Direction of the slot in the reference configuration, of any length; kept as a unit vector.
    """

    link: str
    point: str
    direction: complex

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", _unit(self.direction, f"slot of {self.link} for {self.point}"))


@dataclass(frozen=True)
class Gear:
    """A gear coupling: the sum of coefficient × rotation over some links stays what it is at the reference.

    Rotations are measured from the reference, so the sum is zero (modulo whole teeth, that is modulo full
    turns of the common period). Coefficients are rational: whole numbers or :class:`fractions.Fraction`.

    Examples
    --------
    A link ``b`` that turns at −3/2 the speed of ``a`` (both against the ground):

    >>> Gear({"b": 1, "a": Fraction(3, 2)}).whole_numbers()
    {'b': 2, 'a': 3}
    """

    coefficients: Mapping[str, Rational]

    def __post_init__(self) -> None:
        kept: dict[str, Fraction] = {}
        for link, value in dict(self.coefficients).items():
            if isinstance(value, bool) or not isinstance(value, Rational):
                raise LinkageError(
                    f"gear on link {link!r}: the coefficient {value!r} is not a rational number; "
                    f"give an int or a fractions.Fraction"
                )
            if value != 0:
                kept[link] = Fraction(value)
        if not kept:
            raise LinkageError("a gear needs at least one link with a coefficient that is not zero")
        object.__setattr__(self, "coefficients", kept)

    def whole_numbers(self) -> dict[str, int]:
        """Return the same relation with whole coefficients that have no common divisor."""
        denominator = math.lcm(*(c.denominator for c in self.coefficients.values()))
        whole = {link: int(Fraction(c) * denominator) for link, c in self.coefficients.items()}
        divisor = math.gcd(*whole.values())
        return {link: c // divisor for link, c in whole.items()}


@dataclass(frozen=True)
class Input:
    """What is driven: a link against another one.

    Parameters
    ----------
    link : str
        The driven link.
    relative_to : str
        The link that carries the motor, usually the ground.
    translation : bool
        False for a rotation (radians), true for the displacement of their slider (length).
    """

    link: str
    relative_to: str = GROUND
    translation: bool = False


@dataclass(frozen=True)
class Linkage:
    """A planar linkage at its reference configuration.

    Parameters
    ----------
    points : mapping of str to complex
        World position of every named point at the reference.
    links : mapping of str to sequence of str
        Link name to the names of its points; ``"ground"`` is the frame. A point named in k links is k − 1
        revolute joints. The order is the order in which the link is drawn.
    sliders : sequence of Slider
    slots : sequence of PinSlot
    gears : sequence of Gear
    bodies : mapping of str to (str, str)
        Body of interest to (link, point) that carries the task's pose.
    inputs : mapping of str to Input
        What may be driven, by name.
    title, length_unit : str
        Labels carried into drawings and files.

    Raises
    ------
    LinkageError
        When a name is unknown, a number is not finite, or a link hangs in the air.

    Examples
    --------
    >>> four_bar = Linkage(
    ...     points={"A": 0, "B": 1j, "C": 3 + 2j, "D": 4},
    ...     links={"ground": "AD", "crank": "AB", "coupler": "BC", "follower": "CD"},
    ...     inputs={"crank": Input("crank")},
    ... )
    >>> four_bar
    Linkage(4 links, 4 points, 4 revolute joints, 1 degree of freedom)
    >>> round(four_bar.length("crank", "A", "B"), 3)
    1.0
    """

    points: Mapping[str, complex]
    links: Mapping[str, Sequence[str]]
    sliders: Sequence[Slider] = ()
    gears: Sequence[Gear] = ()
    bodies: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    inputs: Mapping[str, Input] = field(default_factory=dict)
    title: str = ""
    length_unit: str = ""
    slots: Sequence[PinSlot] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "points", {name: _finite(z, f"point {name}") for name, z in dict(self.points).items()})
        put(self, "links", {name: tuple(points) for name, points in dict(self.links).items()})
        for name in ("sliders", "gears", "slots"):
            put(self, name, tuple(getattr(self, name)))
        put(self, "bodies", {name: tuple(value) for name, value in dict(self.bodies).items()})
        put(self, "inputs", dict(self.inputs))
        self._check_names()
        self._check_joined()

    def __repr__(self) -> str:
        joints = [_count(len(self.revolute_joints()), "revolute joint")]
        joints += [_count(len(self.sliders), "slider")] if self.sliders else []
        joints += [_count(len(self.slots), "slot")] if self.slots else []
        joints += [_count(len(self.gears), "gear")] if self.gears else []
        freedom = self.degrees_of_freedom
        return (
            f"Linkage({_count(len(self.links), 'link')}, {_count(len(self.points), 'point')}, "
            f"{', '.join(joints)}, {freedom} {'degree' if freedom == 1 else 'degrees'} of freedom)"
        )

    @property
    def moving_links(self) -> tuple[str, ...]:
        """Names of the links other than the ground, in the order given."""
        return tuple(name for name in self.links if name != GROUND)

    @property
    def degrees_of_freedom(self) -> int:
        """Mobility by Grübler's count: 3 per moving link, −2 per pin or slider, −1 per slot or gear."""
        lower = len(self.revolute_joints()) + len(self.sliders)
        return 3 * (len(self.links) - 1) - 2 * lower - len(self.slots) - len(self.gears)

    def revolute_joints(self) -> list[tuple[str, str, str]]:
        """Return the pins as (link, link, point); a point of k links gives k − 1 of them, a star."""
        joints = []
        for point in self.points:
            owners = self.links_of(point)
            joints += [(owners[0], other, point) for other in owners[1:]]
        return joints

    def links_of(self, point: str) -> list[str]:
        """Return the links that carry a point, in the order of ``links``."""
        return [name for name, members in self.links.items() if point in members]

    def length(self, link: str, first: str, second: str) -> float:
        """Return the distance of two points of a link."""
        for point in (first, second):
            if point not in self.links[link]:
                raise LinkageError(f"link {link!r} has no point {point!r}; it has {', '.join(self.links[link])}")
        return abs(self.points[first] - self.points[second])

    def positions(self, rotations: Mapping[str, Any]) -> dict[str, Any]:
        """Return the positions of all points when the links have turned.

        Parameters
        ----------
        rotations : mapping of str to float or array
            Rotation of each moving link from the reference, radians; arrays of one shape give whole motions.

        Returns
        -------
        dict of str to complex or complex array
            Position of every point. Displacements of sliders and pins follow from the closure of the loops.
        """
        from mechanisms.closure import Closure

        return Closure.of(self).positions(rotations)

    def _check_names(self) -> None:
        if GROUND not in self.links:
            raise LinkageError(f'a linkage needs a link named "{GROUND}", the frame; there is {_names(self.links)}')
        for link, members in self.links.items():
            if not members and not self._slides(link):
                raise LinkageError(f"link {link!r} has no point; name at least one point of it")
            if len(set(members)) != len(members):
                raise LinkageError(f"link {link!r} names a point twice: {', '.join(members)}")
            for point in members:
                _known(point, self.points, f"link {link!r}: point")
        for slider in self.sliders:
            for link in (slider.link_a, slider.link_b):
                _known(link, self.links, "slider: link")
            if slider.link_a == slider.link_b:
                raise LinkageError(f"slider: link {slider.link_a!r} cannot slide on itself")
            if isinstance(slider.at, str):
                _known(slider.at, self.points, "slider: point")
        for slot in self.slots:
            _known(slot.link, self.links, "slot: link")
            _known(slot.point, self.points, "slot: point")
            if slot.point in self.links[slot.link]:
                raise LinkageError(f"slot: the pin {slot.point!r} is fixed to the link {slot.link!r} it slides on")
        for gear in self.gears:
            for link in gear.coefficients:
                _known(link, self.links, "gear: link")
        for body, value in self.bodies.items():
            if len(value) != 2:
                raise LinkageError(f"body {body!r} must be given as (link, point), not {value!r}")
            _known(value[0], self.links, f"body {body!r}: link")
            if value[1] not in self.links[value[0]]:
                raise LinkageError(f"body {body!r}: the link {value[0]!r} has no point {value[1]!r}")
        for name, driven in self.inputs.items():
            self.check_input(driven, name)

    def check_input(self, driven: Input, name: str = "") -> None:
        """Raise LinkageError unless the input names two different links (and a slider, for a translation)."""
        for link in (driven.link, driven.relative_to):
            _known(link, self.links, f"input {name!r}: link")
        if driven.link == driven.relative_to:
            raise LinkageError(f"input {name!r}: link {driven.link!r} cannot be driven against itself")
        if driven.translation and not any(
            {s.link_a, s.link_b} == {driven.link, driven.relative_to} for s in self.sliders
        ):
            raise LinkageError(
                f"input {name!r} is a translation, but no slider joins {driven.link!r} and {driven.relative_to!r}"
            )

    def _slides(self, link: str) -> bool:
        return any(link in (s.link_a, s.link_b) for s in self.sliders)

    def _check_joined(self) -> None:
        reached, waiting = {GROUND}, [GROUND]
        neighbours: dict[str, set[str]] = {link: set() for link in self.links}
        pairs = [(a, b) for a, b, _ in self.revolute_joints()] + [(s.link_a, s.link_b) for s in self.sliders]
        pairs += [(slot.link, owner) for slot in self.slots for owner in self.links_of(slot.point)[:1]]
        for a, b in pairs:
            neighbours[a].add(b)
            neighbours[b].add(a)
        while waiting:
            for link in neighbours[waiting.pop()] - reached:
                reached.add(link)
                waiting.append(link)
        loose = [link for link in self.links if link not in reached]
        if loose:
            raise LinkageError(f"no chain of joints leads from the ground to {_names(loose)}; join it by a point")
        for point in self.points:
            if not self.links_of(point):
                raise LinkageError(f"point {point!r} belongs to no link; name it in a link or leave it out")


def _count(number: int, word: str) -> str:
    return f"{number} {word}" + ("" if number == 1 else "s")


def _names(names: Iterable[str]) -> str:
    return ", ".join(repr(name) for name in names) or "none"


def _known(name: str, known: Mapping[str, Any], where: str) -> None:
    if name in known:
        return
    near = get_close_matches(str(name), list(known), n=1)
    hint = f"did you mean {near[0]!r}?" if near else f"known are {_names(known)}"
    raise LinkageError(f"{where} {name!r} is not known; {hint}")


def _finite(value: complex, where: str) -> complex:
    try:
        number = complex(value)
    except (TypeError, ValueError):
        raise LinkageError(f"{where}: {value!r} is not a number") from None
    if not cmath.isfinite(number):
        raise LinkageError(f"{where}: {value!r} is not finite")
    return number


def _unit(value: complex, where: str) -> complex:
    number = _finite(value, where)
    if number == 0:
        raise LinkageError(f"{where}: the direction is zero; give a direction such as 1 or 1j")
    return number / abs(number)
