"""Which roots are real linkages, when the unknowns are not the linkage's real coordinates.

Complex conjugation of a linkage acts on the unknowns by a `Mirror`.  Its fixed points among the roots are the real
designs.  The mirror maps roots to roots, so that a root whose image lies in the box in which it is the only
root is its own image: reality is proved, not guessed from small imaginary parts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["CONJUGATION", "UNIT_NUMBERS", "Mirror", "exchange", "proved_real", "real_roots"]

#: A refined root is real when its mirror image is this near; conjugate pairs lie far further apart, and a root
#: that is its own image to rounding misses it by 1e-12 or so.
REAL_TOLERANCE = 1e-8
#: Covers the roundings in the bounds of the proof, which are a dozen operations long.
ROUNDING = 1 + 1e-14


@dataclass(frozen=True)
class Mirror:
    """What conjugation of the linkage does to the unknowns.

    Parameters
    ----------
    image : callable
        ``image(points)``, rows of unknowns to rows of unknowns.
    stretch : callable
        ``stretch(points, radii)``: radii of discs that hold the images of discs about the points.
    balls : callable, optional
        The image of one point in ball arithmetic: a list of ``flint.acb`` to such a list.
    """

    image: Callable[[NDArray[Any]], NDArray[Any]]
    stretch: Callable[[NDArray[Any], NDArray[Any]], NDArray[Any]]
    balls: Callable[[Sequence[Any]], Sequence[Any]] | None = None


def _inverted_radius(points: NDArray[Any], radii: NDArray[Any]) -> NDArray[Any]:
    """1/z maps a disc that does not hold 0 into one of this radius about the image of its centre."""
    with np.errstate(divide="ignore", invalid="ignore"):
        size = np.abs(points)
        return np.where(size > radii, radii / (size * (size - radii)) * ROUNDING, np.inf)


#: Real coordinates: every unknown is conjugated.
CONJUGATION = Mirror(np.conjugate, lambda points, radii: radii, lambda z: [x.conjugate() for x in z])
#: Unit numbers e^{iθ}: real angles are where 1/conj(z) = z.
UNIT_NUMBERS = Mirror(
    lambda points: 1 / np.conjugate(points), _inverted_radius, lambda z: [1 / x.conjugate() for x in z]
)


def exchange(order: Sequence[int]) -> Mirror:
    """Isotropic pairs: every unknown is conjugated and takes the place of its partner.

    Unknowns after those of `order`, if there are any, are unit numbers: s becomes 1/conj(s).

    Parameters
    ----------
    order : sequence of int
        For each column the column of its partner (itself for a real unknown).

    Examples
    --------
    >>> exchange([1, 0]).image(np.array([[1 + 1j, 2j]])).tolist()
    [[-2j, (1-1j)]]
    >>> exchange([1, 0]).image(np.array([[1 + 1j, 2j, 0.5j]])).tolist()
    [[-2j, (1-1j), (-0+2j)]]
    """
    columns = list(order)
    first = len(columns)

    def image(points: NDArray[Any]) -> NDArray[Any]:
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.concatenate([np.conj(points[:, columns]), UNIT_NUMBERS.image(points[:, first:])], axis=1)

    def stretch(points: NDArray[Any], radii: NDArray[Any]) -> NDArray[Any]:
        turned = UNIT_NUMBERS.stretch(points[:, first:], radii[:, first:])
        return np.concatenate([radii[:, columns], turned], axis=1)

    def balls(z: Sequence[Any]) -> list[Any]:
        return [z[k].conjugate() for k in columns] + [1 / x.conjugate() for x in z[first:]]

    return Mirror(image, stretch, balls)


def real_roots(
    points: NDArray[Any], mirror: Mirror = CONJUGATION, tolerance: float = REAL_TOLERANCE
) -> NDArray[np.bool_]:
    """Which roots are real designs: those that the mirror maps to themselves.

    Parameters
    ----------
    points : (n, k) complex array
        All roots of the task, so that a root and a close neighbour that mirror each other are told apart.
    mirror : Mirror
        What conjugation does.
    tolerance : float
        How far a root may lie from its image, relative to the largest of its coordinates (at least 1).

    Returns
    -------
    (n,) bool array

    Examples
    --------
    >>> real_roots(np.array([[2.0 + 0j], [1j], [-1j]])).tolist()
    [True, False, False]
    >>> real_roots(np.array([[2.0 + 0j], [1j], [0.5 + 0j]]), UNIT_NUMBERS).tolist()
    [False, True, False]
    """
    from solvers.points import functional, keys_of, windows

    real = np.zeros(len(points), dtype=bool)
    if not len(points):
        return real
    images = mirror.image(points)
    scale = np.maximum(np.abs(points).max(axis=1, initial=1.0), 1.0)
    own = np.abs(images - points).max(axis=1, initial=0.0)
    near = np.flatnonzero(own <= tolerance * scale)
    key = functional(points.shape[1])
    keys = keys_of(points, key, 1.0)[1]
    order = np.argsort(keys)
    real[near] = True
    for rows, at in windows(keys[order], keys_of(images[near], key, 1.0)[1], 3 * own[near] / scale[near]):
        rows = near[rows]  # a neighbour that is nearer to the image than the root itself
        real[rows[np.abs(points[order[at]] - images[rows]).max(axis=1, initial=0.0) < own[rows]]] = False
    return real


def proved_real(certificate: Any, mirror: Mirror = CONJUGATION) -> NDArray[np.bool_]:
    """Which certified roots are proved to be real designs.

    Parameters
    ----------
    certificate : solvers.certify.Certificates
        With ``boxes.midpoints``, ``.radii`` and ``.unique``, each (n, k), and the boxes in Arb, ``exact``.
    mirror : Mirror
        It must map the roots of the very same system to roots: parameters that are conjugates of each other
        must be so exactly.

    Returns
    -------
    (n,) bool array
        False where there is no proof.
    """
    boxes = certificate.boxes
    middle, radii, unique = boxes.midpoints, boxes.radii, boxes.unique
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        distance = np.abs(mirror.image(middle) - middle) * ROUNDING + 4 * np.finfo(float).eps * np.abs(middle)
        inside = distance + mirror.stretch(middle, radii) <= unique
    proved = np.asarray(certificate.certified, dtype=bool) & inside.all(axis=1)
    for index, box in certificate.exact.items():  # their boxes are narrower than doubles can tell
        if mirror.balls is not None and not proved[index]:
            proved[index] = _own_image(box, mirror.balls)
    return proved


def _own_image(box: Any, balls: Callable[[Sequence[Any]], Sequence[Any]]) -> bool:
    """Whether the image of a root's box lies in the box in which it is the only root, in ball arithmetic."""
    from flint import ctx

    with ctx.workprec(box.bits):  # even a conjugate is rounded to the working precision
        images = balls(box.inclusion)
    return all(outer.contains(inner) for outer, inner in zip(box.unique, images))
