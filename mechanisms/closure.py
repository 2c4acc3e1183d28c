"""Closure equations of a linkage, read once from its graph, as plain arrays.

A spanning tree of the link graph places every link; each joint left over closes one loop. With the rotations
q_k of the links and the displacements s_j of sliders and pins, loop l reads

    c_l + Σ_k A_lk e^{i q_k} + Σ_j B_lj s_j e^{i q_{k(j)}} = 0,

linear in the unit vectors e^{iq} and in the products s e^{iq}. Everything that moves a linkage (tracing,
velocities, the polynomial system) works on A, B, c and k(j), never on the graph again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from mechanisms.linkage import GROUND, Input, Linkage, LinkageError


@dataclass(frozen=True)
class Closure:
    """The loop equations of one linkage; lengths are divided by ``scale``.

    A configuration is a real vector x of length n: first the rotations (radians) of the ``rotations``
    classes of links that turn together, then the displacements (over ``scale``) of sliders, then of pins in
    slots.

    Attributes
    ----------
    class_of : dict of str to int
        Link to the index of its rotation; links that do not turn have the index ``rotations``.
    matrix : (loops, rotations) complex array
        A of the module's formula.
    slides : (loops, slides) complex array
        B of the module's formula.
    slide_class : (slides,) int array
        k(j) of the module's formula.
    constant : (loops,) complex array
        c of the module's formula.
    gears : (gears, rotations) float array
        Whole coefficients without a common divisor; each row times the rotations is a multiple of 2π.
    place, place_slides, place_constant : complex arrays
        The same three for the translation of each link (rows in the order of ``links``).
    points : dict of str to (int, complex)
        Point to the index of a link that carries it, and its place on it over ``scale``.
    slide_links : tuple of (str, str)
        The two links of each slider.
    cycles : (loops, joints) float array
        Which joints each loop passes, with sign and the square root of a weight.
    loop_stage : (loops,) int array
        Stage at which the loop closed, when the links were joined in stages.
    joint_stage : (joints,) int array
        Stage of the later of the two things that the joint joins.

    Examples
    --------
    >>> from mechanisms.linkage import Linkage, Slider
    >>> slider_crank = Linkage(
    ...     points={"A": 0, "B": 1j, "C": 2},
    ...     links={"ground": "A", "crank": "AB", "rod": "BC", "block": "C"},
    ...     sliders=[Slider("ground", "block", 1, "C")],
    ... )
    >>> closure = Closure.of(slider_crank)
    >>> closure.size, closure.equations
    (3, 2)
    >>> bool(abs(closure.residual(closure.reference())).max() < 1e-15)
    True
    """

    links: tuple[str, ...]
    class_of: Mapping[str, int]
    matrix: np.ndarray
    slides: np.ndarray
    slide_class: np.ndarray
    constant: np.ndarray
    gears: np.ndarray
    place: np.ndarray
    place_slides: np.ndarray
    place_constant: np.ndarray
    points: Mapping[str, tuple[int, complex]]
    scale: float
    slide_links: tuple[tuple[str, str], ...]
    cycles: np.ndarray
    loop_stage: np.ndarray
    joint_stage: np.ndarray

    @classmethod
    def of(cls, linkage: Linkage) -> Closure:
        """Return the closure equations of a linkage (kept with it, so that they are derived once)."""
        known = linkage.__dict__.get("_closure")
        if known is None:
            known = cls.in_stages(linkage)
            linkage.__dict__["_closure"] = known
        return known

    @classmethod
    def in_stages(cls, linkage: Linkage, stages: Mapping[str, int] | None = None) -> Closure:
        """Return equations whose loops of stage i hold links of stages up to i only."""
        from mechanisms.loops import derive

        return derive(linkage, stages)

    @property
    def rotations(self) -> int:
        """Number of independent rotations in a configuration."""
        return self.matrix.shape[1]

    @property
    def size(self) -> int:
        """Length n of a configuration."""
        return self.matrix.shape[1] + self.slides.shape[1]

    @property
    def equations(self) -> int:
        """Number of real equations."""
        return 2 * self.matrix.shape[0] + self.gears.shape[0]

    def reference(self) -> np.ndarray:
        """Return the reference configuration, all zero."""
        return np.zeros(self.size)

    def residual(self, x: np.ndarray) -> np.ndarray:
        """Return the (…, equations) residuals: loops as Re, Im over ``scale``; gears in radians, wrapped."""
        e, s = self._turned(x)
        loops = self.constant + e[..., :-1] @ self.matrix.T + (s * e[..., self.slide_class]) @ self.slides.T
        gear = x[..., : self.rotations] @ self.gears.T
        return np.concatenate([_interleave(loops), gear - 2 * np.pi * np.round(gear / (2 * np.pi))], axis=-1)

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return the (…, equations, size) derivative of the residual."""
        e, s = self._turned(x)
        turned = self.matrix * (1j * e[..., None, :-1])
        slid = self.slides * e[..., None, self.slide_class]
        for j, k in enumerate(self.slide_class):
            if k < self.rotations:
                turned[..., k] += 1j * slid[..., j] * s[..., None, j]
        loops = np.concatenate([turned, slid], axis=-1)
        rows = np.stack([loops.real, loops.imag], axis=-2)
        rows = rows.reshape(*rows.shape[:-3], 2 * len(self.matrix), self.size)
        gear = np.concatenate([self.gears, np.zeros((len(self.gears), self.slides.shape[1]))], axis=1)
        return np.concatenate([rows, np.broadcast_to(gear, (*rows.shape[:-2], *gear.shape))], axis=-2)

    def curvature(self, x: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the (…, equations) second derivative of the residual along v twice: f''(x)[v, v]."""
        e, s = self._turned(x)
        w = np.concatenate([v[..., : self.rotations], np.zeros((*v.shape[:-1], 1))], axis=-1)
        vs = v[..., self.rotations :]
        ws = w[..., self.slide_class]
        turned = -(w[..., :-1] ** 2) * e[..., :-1]
        slid = e[..., self.slide_class] * (2j * vs * ws - s * ws**2)
        loops = turned @ self.matrix.T + slid @ self.slides.T
        return np.concatenate([_interleave(loops), np.zeros((*loops.shape[:-1], len(self.gears)))], axis=-1)

    def gradient(self, driven: Input) -> tuple[np.ndarray, float]:
        """Return (g, unit) such that unit · g·x is the input's value: radians, or the task's length unit."""
        g = np.zeros(self.size)
        if driven.translation:
            for j, (a, b) in enumerate(self.slide_links):
                if {a, b} == {driven.link, driven.relative_to}:
                    g[self.rotations + j] = 1.0 if b == driven.link else -1.0
                    return g, self.scale
            raise LinkageError(f"no slider joins {driven.link!r} and {driven.relative_to!r}")
        padded = np.zeros(self.rotations + 1)
        padded[self.class_of[driven.link]] += 1.0
        padded[self.class_of[driven.relative_to]] -= 1.0
        g[: self.rotations] = padded[:-1]
        if not g.any():
            raise LinkageError(f"link {driven.link!r} never turns against {driven.relative_to!r}; drive another one")
        return g, 1.0

    def configuration(self, rotations: Mapping[str, Any]) -> np.ndarray:
        """Return the configuration (…, size) of given link rotations; displacements by least squares."""
        unknown = [name for name in rotations if name not in self.class_of]
        if unknown:
            raise LinkageError(f"pose names a link that is not there: {', '.join(map(repr, unknown))}")
        values: dict[int, np.ndarray] = {}
        for link, angle in rotations.items():
            values.setdefault(self.class_of[link], np.asarray(angle, dtype=float))
        missing = [k for k in range(self.rotations) if k not in values]
        if missing:
            names = [link for link in self.links if self.class_of[link] in missing]
            raise LinkageError(f"pose gives no rotation of {', '.join(map(repr, names))}; give one for each link")
        shape = np.broadcast_shapes((), *(values[k].shape for k in range(self.rotations)))
        x = np.zeros((*shape, self.size))
        for k in range(self.rotations):
            x[..., k] = values[k]
        return self.with_displacements(x) if self.slides.shape[1] else x

    def with_displacements(self, x: np.ndarray) -> np.ndarray:
        """Return x with the displacements that close the loops best (least squares) for its rotations."""
        e, _ = self._turned(x)
        loops = self.constant + e[..., :-1] @ self.matrix.T
        slid = self.slides * e[..., None, self.slide_class]
        rows = np.stack([slid.real, slid.imag], axis=-2)
        rows = rows.reshape(*rows.shape[:-3], 2 * len(self.matrix), self.slides.shape[1])
        best = (np.linalg.pinv(rows) @ -_interleave(loops)[..., None])[..., 0]
        return np.concatenate([x[..., : self.rotations], best], axis=-1)

    def link_rotations(self, x: np.ndarray) -> dict[str, Any]:
        """Return the rotation of every moving link at a configuration (…, size)."""
        padded = np.concatenate([x[..., : self.rotations], np.zeros((*x.shape[:-1], 1))], axis=-1)
        return {link: padded[..., self.class_of[link]] for link in self.links if link != GROUND}

    def positions(self, rotations: Mapping[str, Any]) -> dict[str, Any]:
        """Return the positions of all points for given link rotations; see :meth:`Linkage.positions`."""
        return self.points_at(self.configuration(rotations))

    def points_at(self, x: np.ndarray) -> dict[str, Any]:
        """Return the positions (length unit) of all points at a configuration (…, size)."""
        e, s = self._turned(x)
        shift = self.place_constant + e[..., :-1] @ self.place.T
        shift = shift + (s * e[..., self.slide_class]) @ self.place_slides.T
        rows = [self.class_of[link] for link in self.links]
        return {
            name: self.scale * (shift[..., link] + e[..., rows[link]] * home)
            for name, (link, home) in self.points.items()
        }

    def _turned(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        q = np.concatenate([x[..., : self.rotations], np.zeros((*x.shape[:-1], 1))], axis=-1)
        return np.exp(1j * q), x[..., self.rotations :]


def _interleave(z: np.ndarray) -> np.ndarray:
    return np.stack([z.real, z.imag], axis=-1).reshape(*z.shape[:-1], 2 * z.shape[-1])
