"""Linkages as JSON documents, for the run file: everything that `show`, `plot` and `export` need, and no code."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from mechanisms.linkage import Gear, Input, Linkage, PinSlot, Slider

__all__ = ["linkage_document", "linkage_from_document", "number_document"]


def number_document(value: Any) -> Any:
    """A number as JSON: a complex one as ``[re, im]``, a real one as it is."""
    if isinstance(value, complex) or getattr(getattr(value, "dtype", None), "kind", "") == "c":
        return [float(value.real), float(value.imag)]
    return float(value) if not isinstance(value, (bool, int, str)) else value


def linkage_document(linkage: Linkage) -> dict[str, Any]:
    """A linkage as JSON.

    Examples
    --------
    >>> bar = Linkage({"O": 0, "A": 1j}, {"ground": ["O"], "crank": ["O", "A"]}, inputs={"crank": Input("crank")})
    >>> linkage_from_document(linkage_document(bar)) == bar
    True
    """
    document: dict[str, Any] = {
        "points": {name: [z.real, z.imag] for name, z in linkage.points.items()},
        "links": {name: list(points) for name, points in linkage.links.items()},
        "bodies": {name: list(body) for name, body in linkage.bodies.items()},
        "inputs": {n: [i.link, i.relative_to, bool(i.translation)] for n, i in linkage.inputs.items()},
        "title": linkage.title,
        "length_unit": linkage.length_unit,
    }
    if linkage.sliders:
        document["sliders"] = [[s.link_a, s.link_b, *_pair(s.direction), _place(s.at)] for s in linkage.sliders]
    if linkage.slots:
        document["slots"] = [[s.link, s.point, *_pair(s.direction)] for s in linkage.slots]
    if linkage.gears:
        document["gears"] = [{k: str(c) for k, c in gear.coefficients.items()} for gear in linkage.gears]
    return document


def linkage_from_document(document: Mapping[str, Any]) -> Linkage:
    """A linkage from its document.

    Raises
    ------
    LinkageError, ValueError, TypeError, KeyError
        When the document describes none.
    """
    sliders = [Slider(a, b, complex(x, y), _placed(at)) for a, b, x, y, at in document.get("sliders", ())]
    slots = [PinSlot(link, point, complex(x, y)) for link, point, x, y in document.get("slots", ())]
    gears = [Gear({k: Fraction(str(c)) for k, c in gear.items()}) for gear in document.get("gears", ())]
    return Linkage(
        points={str(name): complex(*map(float, z)) for name, z in document["points"].items()},
        links={str(name): tuple(map(str, points)) for name, points in document["links"].items()},
        sliders=sliders,
        gears=gears,
        bodies={str(name): (str(link), str(point)) for name, (link, point) in document["bodies"].items()},
        inputs={str(n): Input(str(a), str(b), bool(t)) for n, (a, b, t) in document["inputs"].items()},
        title=str(document.get("title", "")),
        length_unit=str(document.get("length_unit", "")),
        slots=slots,
    )


def _pair(z: complex) -> list[float]:
    return [z.real, z.imag]


def _place(at: str | complex) -> str | list[float]:
    return at if isinstance(at, str) else _pair(at)


def _placed(at: str | Sequence[float]) -> str | complex:
    return at if isinstance(at, str) else complex(*map(float, at))
