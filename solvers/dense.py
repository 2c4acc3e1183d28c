"""Supports so dense that the mixed volume is the total degree: then no mixed cell need be looked for.

Equations with generic coefficients have as many roots as their total degree, the product of their degrees, unless some
are at infinity: common zeros of their terms of highest degree, forms in as many unknowns as there are equations. Where
just the unknowns of a set S differ from zero, those forms count of which a term holds no other unknown. If they are
at least as many as S has members, then generic ones have no common zero there, for their Newton polytopes lie in a
space of one dimension less (Bernshtein, Functional Analysis and its Applications 9, 183-185, 1975, theorem B). The
mixed volume with constants in all equations bounds the number of finite roots (Li and Wang 1996), and the total degree
bounds it: if there are no roots at infinity all three agree.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

#: Unknowns up to which all sets of them are looked at: some milliseconds.
FEW_UNKNOWNS = 14


def reaches_total_degree(supports: Sequence[np.ndarray]) -> bool:
    """Whether it is plain that the mixed volume, with constants, is the total degree.

    Parameters
    ----------
    supports : sequence of n integer arrays, each of shape (terms, n)
        Exponents of n equations in n unknowns.

    Returns
    -------
    bool
        True is proved; False says nothing.

    Examples
    --------
    >>> circle, line = np.array([[2, 0], [0, 2], [0, 0]]), np.array([[1, 0], [0, 1]])
    >>> reaches_total_degree([circle, line]), reaches_total_degree([circle, np.array([[1, 1], [0, 0]])])
    (True, True)
    >>> reaches_total_degree([np.array([[1, 1], [0, 0]])] * 2)  # at infinity x y = 0 has roots with y = 0
    False
    """
    n = len(supports)
    if not 0 < n <= FEW_UNKNOWNS or not all(map(len, supports)):
        return False
    bits = 1 << np.arange(n)
    holds = np.zeros((n, 1 << n), bool)  # whether a term of highest degree has no unknowns but those of a set
    for row, support in zip(holds, supports):
        degrees = support.sum(axis=1)
        row[(support[degrees == degrees.max()] > 0) @ bits] = True
    for bit in bits.tolist():
        pairs = holds.reshape(n, -1, 2, bit)
        pairs[:, :, 1] |= pairs[:, :, 0]
    members = (np.arange(1 << n)[:, None] & bits > 0).sum(axis=1)
    return bool((holds.sum(axis=0) >= members).all())
