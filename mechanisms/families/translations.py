"""Parallel poses: what carries a body that never turns.

Every point of such a body moves alike, z ↦ z + p_j, so that the positions alone decide which dyads there are:

- **RR** where they lie on a circle: three always do, four or five only by choice.  Every crank then has one and the
  same vector, and two of them make a **parallelogram**, whose pivots are free in the whole plane.  It folds flat
  twice in a turn; there it may go on as a crossed linkage instead (a change point), so that all poses must lie on
  one side of it.
- **PP**, two crossed slides in series, always.  They keep the body parallel and leave it two freedoms; one crank
  takes one of them away: a **Scotch yoke** whose block is the body.  It has no change point.
- **a slide** where the positions lie on a line: the body is the slide of a slider-crank.

Positions on neither have no linkage of four links and one drive: each second dyad would be one of the above.  Two
poses leave the circle free; arcs to either side are tried.
"""

from __future__ import annotations

import cmath
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate
from mechanisms.families.dyad_pairs import pair_candidate
from mechanisms.families.dyad_pools import sampled_pool, third_point
from mechanisms.families.motion_dyads import MotionDyad, Poses, tidy
from mechanisms.families.pair_search import search_candidates
from mechanisms.families.regions import Region
from mechanisms.linkage import GROUND, Input, Linkage, Slider

__all__ = ["circle_of", "line_of", "translation_candidates"]

#: Positions are on a circle or a line when they miss it by less than this part of its radius or of their distance.
ON_CURVE = 1e-9
#: With two poses the arc between them is free; links that swing by this much keep the transmission above 60 degrees.
SWING = math.radians(60)
#: The crank that drives a slide: its stroke over the travel, and its rod over the crank. A rod three times as long
#: never leans by more than 20 degrees.
STROKE, ROD = 1.1, 3.0

#: Crank over coupler, or coupler over crank, beyond which a parallelogram is only kept for want of others.
LINK_RATIO = 4.0

Regions = tuple[tuple[Region, Region], tuple[Region, Region]]


def circle_of(poses: Poses) -> tuple[complex, float] | None:
    """Centre and radius of the circle through the positions of three or more poses; None if there is none.

    Examples
    --------
    >>> circle_of(Poses.of([(3, 0, 10), (0, 3, 10), (-3, 0, 10), (0, -3, 10)]))
    (0j, 3.0)
    """
    centre = complex(third_point(Poses(poses.points[:3], poses.angles[:3]), poses.points[0])[0])
    radii = np.abs(poses.points - centre)
    if not cmath.isfinite(centre) or float(np.ptp(radii)) > ON_CURVE * float(radii.max()):
        return None
    return tidy(centre, poses.size), float(radii[0])


def line_of(poses: Poses) -> complex | None:
    """Direction of the line through all positions; None if there is none.

    Examples
    --------
    >>> line_of(Poses.of([(0, 0, 10), (0, 3, 10), (0, 1, 10)]))
    1j
    """
    away = poses.moves[int(np.abs(poses.moves).argmax())]
    line = complex(away / abs(away))
    return line if float(np.abs((poses.moves * line.conjugate()).imag).max()) < ON_CURVE * poses.size else None


def translation_candidates(
    poses: Poses,
    regions: Regions,
    constraints: Mapping[str, Any],
    samples: int,
    seed: int = 0,
    title: str = "",
    length_unit: str = "",
) -> Iterator[Candidate]:
    """Linkages that carry a body through parallel poses without turning it.

    Parameters
    ----------
    poses : Poses
        Two to five, on a circle or a line; two are on many.
    regions : pairs of Region
        Where the fixed and the moving pivot of either dyad may be.
    constraints : mapping
        The task's.
    samples : int
        Pivots tried for each dyad that is not given.
    """
    for guide in _guides(poses):
        yield from _parallelograms(poses, guide, regions, constraints, samples, seed, title, length_unit)
    for guide in _guides(poses):
        yield _yoke(poses, guide, regions[0], title, length_unit)
    if (line := line_of(poses)) is not None:
        for side in (1, -1) if regions[0][0].point is None else (1,):
            yield _driven_slide(poses, line, side, regions, title, length_unit)


def _guides(poses: Poses) -> list[Poses]:
    """Three parallel poses on each circle that is to be tried; none on a line."""
    if len(poses) > 2:
        three = Poses(poses.points[:3], np.zeros(3))
        return [three] if circle_of(poses) is not None else []
    first, last = poses.points
    sagitta = 0.5 * (last - first) * math.tan(SWING / 4)
    return [Poses(np.array([first, (first + last) / 2 + side * sagitta, last]), np.zeros(3)) for side in (1j, -1j)]


def _parallelograms(
    poses: Poses, guide: Poses, regions: Regions, constraints: Mapping[str, Any], samples: int, seed: int, *names: str
) -> Iterator[Candidate]:
    pools = [sampled_pool(guide, samples, *pair, seed=seed + k) for k, pair in enumerate(regions)]
    given = any(region.given for pair in regions for region in pair)
    wanted = {"max_link_ratio": LINK_RATIO, **constraints}
    yield from search_candidates(poses, pools[0], pools[1] if given else pools[0], wanted, *names)


def _yoke(poses: Poses, guide: Poses, regions: tuple[Region, Region], title: str, length_unit: str) -> Candidate:
    """The body as the block of a Scotch yoke: its crank where it is given, else at the reference point."""
    fixed, moving = (region.point for region in regions)
    arm = complex(poses.points[0] - third_point(guide, poses.points[0])[0])
    if moving is None:
        moving = complex(poses.points[0]) if fixed is None else fixed + arm
    crank = MotionDyad("RR", moving - arm, moving)
    # the yoke slides along the middle of the way, so that it goes on and not back, and the block across it
    along = complex(poses.points[-1] - poses.points[0])
    along = along / abs(along)
    return pair_candidate(poses, crank, MotionDyad("PP", along, 1j * along), title, length_unit)


def _driven_slide(
    poses: Poses, line: complex, side: int, regions: Regions, title: str, length_unit: str
) -> Candidate:
    """The body as the slide of a slider-crank, whose pin A2 stands at the reference point unless it is given."""
    (fixed, _), (_, moving) = regions
    pin = complex(poses.points[0]) if moving.point is None else moving.point
    places = poses.carry(pin)
    along = (poses.moves * line.conjugate()).real
    crank = STROKE * float(np.ptp(along)) / 2
    middle = pin + line * float(along.max() + along.min()) / 2
    pivot = middle - side * ROD * crank * line if fixed.point is None else fixed.point
    rod = abs(middle - pivot)
    distance = np.abs(places - pivot)
    cosine = (crank**2 + distance**2 - rod**2) / (2 * crank * np.maximum(distance, 1e-300))
    what = {"kind": "slide driven by a crank"}
    if np.abs(cosine).max() > 1:
        words = f"a crank of {crank:g} at O1 does not reach the pin A2 in every pose"
        return Candidate(None, {"O1": pivot, "A2": pin}, reasons=("degenerate",), note=words, extra=what)
    turns = _in_order(np.angle((places - pivot) / (places[0] - pivot)), np.arccos(cosine))
    knee = pivot + (places[0] - pivot) / distance[0] * crank * cmath.exp(1j * turns[0])
    cranks = turns - turns[0]
    rods = np.angle((places - pivot - (knee - pivot) * np.exp(1j * cranks)) / (pin - knee))
    body = {} if pin == poses.points[0] else {"P": complex(poses.points[0])}
    linkage = Linkage(
        points={"O1": pivot, "A1": knee, "A2": pin, **body},
        links={GROUND: ["O1"], "crank": ["O1", "A1"], "rod": ["A1", "A2"], "follower": ["A2", *body]},
        sliders=[Slider(GROUND, "follower", line, at="A2")],
        bodies={BODY: ("follower", "P" if body else "A2")},
        inputs={"crank": Input("crank"), "follower": Input("follower", translation=True)},
        title=title,
        length_unit=length_unit,
    )
    positions = [{"crank": float(a), "rod": float(b), "follower": 0.0} for a, b in zip(cranks, rods)]
    words = "the body is the slide of a slider-crank"
    return Candidate(None, {"O1": pivot, "A1": knee, "A2": pin}, linkage, positions, note=words, extra=what)


def _in_order(base: NDArray[np.float64], opening: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles base ± opening, the sign chosen for each so that they follow each other one way round, if they can."""
    best, shortest = base + opening, math.inf
    for signs in itertools.product((1, -1), repeat=len(base) - 1):
        angles = base + np.array([1, *signs]) * opening
        for way in (1, -1):
            turned = (way * (angles - angles[0])) % (2 * np.pi)
            if np.all(np.diff(turned) > 0) and turned[-1] < shortest:
                best, shortest = angles, float(turned[-1])
    return best
