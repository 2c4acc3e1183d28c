"""Reading, checking and making catalogue entries."""

from __future__ import annotations

import hashlib
import io
import json
import platform
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mechanisms.catalogue.recipes import MADE_FROM, SHIPPED, Recipe, recipe

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["CatalogueError", "build", "generic", "load", "names", "verify"]

FOLDER = Path(__file__).parent
FORMAT = 1
#: Restored roots are refined by Newton's method; a step that is still larger than this, relative, is no rounding.
STEP = 1e-9
#: Restored columns are exact to rounding times their condition; two steps square that away.
NEWTON_STEPS = 3
#: The seed of entries that are built unless another is asked for.
SEED = 20180827
#: Slices on which the trace test is tried before it counts as failed: it may fail by its own losses, never pass by
#: them.
TRACE_ATTEMPTS = 12

Progress = Callable[[str, int, int], None]


class CatalogueError(ValueError):
    """An entry is missing, damaged, or not what its manifest says; the message says which and what to do."""


def names(family: str = "") -> tuple[str, ...]:
    """The shipped entries, of one family or all of them.

    Parameters
    ----------
    family : str
        The beginning of the name, ``"trammel"``; everything by default.

    Raises
    ------
    CatalogueError
        When there is nothing of that name.

    Examples
    --------
    >>> names("trammel")
    ('trammel:7', 'trammel:6', 'trammel:5')
    """
    found = tuple(name for name in SHIPPED if not family or name == family or name.split(":")[0] == family)
    if not found:
        raise CatalogueError(f"the catalogue has nothing called {family!r}; there are {', '.join(SHIPPED)}")
    return found


@lru_cache(maxsize=8)
def load(name: str, folder: Path = FOLDER) -> Solutions:
    """The generic solutions that are shipped under a name.

    Raises
    ------
    CatalogueError
        When the files are missing or damaged.

    Examples
    --------
    >>> len(load("trammel:7"))
    560
    """
    manifest, points, parameters = _read(name, folder)
    made_from = _recipe(name)
    return _solutions(made_from, points, parameters, manifest)


def generic(name: str, shipped: bool = True, progress: Progress | None = None) -> Solutions:
    """Generic solutions: the shipped ones if there are any and they are wanted, else new ones by monodromy.

    Raises
    ------
    CatalogueError
        When the name means nothing, or a shipped entry is damaged.
    """
    if shipped and name in SHIPPED and _paths(name, FOLDER)[1].exists():
        return load(name)
    return _fresh(name, SEED)


def build(
    name: str, seed: int = SEED, folder: Path | None = FOLDER, jobs: int = 1, progress: Progress | None = None
) -> dict[str, Any]:
    """Make an entry by monodromy, with trace test and certificate, and write its two files.

    Parameters
    ----------
    name : str
        Of any problem that a recipe exists for, shipped or not.
    folder : Path or None
        Where the files go; None writes nothing.

    Returns
    -------
    dict
        The manifest.
    """
    from solvers import certify

    made_from = _recipe(name)
    solutions = _search(made_from, seed, jobs, progress)
    certificate = certify(made_from.system, solutions)
    stored = _stored(made_from, solutions)
    manifest = {
        "format": FORMAT,
        "name": name,
        "title": made_from.title,
        "unknowns": [str(s) for s in made_from.system.unknowns],
        "kept": made_from.kept,
        "parameters": [str(s) for s in made_from.system.parameters],
        "count": len(solutions),
        "stored": len(stored),
        "known_count": made_from.count,
        "known_from": made_from.source,
        "complete": solutions.complete,
        "evidence": solutions.evidence,
        "certified": int(certificate.count),
        "certified_distinct": int(certificate.distinct),
        "seed": seed,
        "versions": _versions(),
    }
    if folder is not None:
        arrays, text = _paths(name, folder)
        data = _packed({"points": stored, "parameters": np.asarray(solutions.parameters)})
        manifest["sha256"] = hashlib.sha256(data).hexdigest()
        arrays.write_bytes(data)
        text.write_text(json.dumps(manifest, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    return manifest


def verify(name: str, folder: Path = FOLDER) -> list[tuple[str, bool, str]]:
    """Check a shipped entry: hash, size, that its points are roots, and that they are proved distinct.

    Returns
    -------
    list of (check, passed, detail)
    """
    try:
        manifest, points, parameters = _read(name, folder)
    except CatalogueError as error:
        return [("files", False, str(error))]
    from solvers import certify

    checks = [("files", True, f"sha256 {manifest['sha256'][:12]}…")]
    made_from = _recipe(name)
    try:
        solutions = _solutions(made_from, points, parameters, manifest)
    except CatalogueError as error:
        return [*checks, ("roots", False, str(error))]
    count = len(solutions)
    checks.append(("roots", count == manifest["count"], f"{count} of {manifest['count']}"))
    certificate = certify(made_from.system, solutions)
    checks.append(("certificate", certificate.distinct == count, f"{certificate.distinct} proved, distinct"))
    known = manifest["known_count"]
    if known is not None:
        checks.append(("count", count == known, f"{known} by another route: {manifest['known_from']}"))
    checks.append(("trace test", bool(manifest["complete"]), manifest["evidence"]))
    return checks


def _recipe(name: str) -> Recipe:
    try:
        return recipe(name)
    except (KeyError, ValueError, TypeError):
        known = ", ".join(SHIPPED)
        raise CatalogueError(
            f"there is no problem {name!r}; families are {', '.join(MADE_FROM)}, shipped are {known}"
        ) from None


@lru_cache(maxsize=8)
def _fresh(name: str, seed: int) -> Solutions:
    return _search(_recipe(name), seed, 1, None, trace=False)


def _search(made_from: Recipe, seed: int, jobs: int, progress: Progress | None, trace: bool = True) -> Solutions:
    """Monodromy; then the trace test, again with other slices where points of the auxiliary line were lost."""
    from solvers import monodromy

    solutions = monodromy(
        made_from.system,
        seed,
        made_from.symmetry,
        made_from.start(np.random.default_rng(seed)),
        jobs=jobs,
        trace=False,
        count=None if trace else made_from.count,
        progress=progress,
    )
    if not trace:
        return solutions
    from solvers.trace import trace_test

    for attempt in range(TRACE_ATTEMPTS):
        test = trace_test(
            made_from.system,
            solutions.parameters,
            solutions.points,
            seed=seed + attempt,
            jobs=jobs,
            progress=progress,
        )
        if test.passed:
            break
    verdict = "passed" if test.passed else "failed"
    solutions.complete = test.passed
    solutions.evidence += f", trace test {verdict} (residual {test.residual:.1e}, {test.points} points)"
    return solutions


def _stored(made_from: Recipe, solutions: Solutions) -> np.ndarray:
    """The columns that are kept, of one root of each orbit."""
    points = solutions.points
    if made_from.orbit is not None:
        from solvers.points import PointSet

        images = made_from.orbit(points, solutions.parameters)
        known = PointSet(points.shape[1])
        known.add(points)
        place = np.stack([known.find(image) for image in images])
        if (place < 0).any():
            raise CatalogueError(f"{made_from.name}: {int((place < 0).any(axis=0).sum())} orbits are not full")
        points = points[np.unique(place.min(axis=0))]
    return np.ascontiguousarray(points[:, : made_from.kept])


def _solutions(made_from: Recipe, kept: np.ndarray, parameters: np.ndarray, manifest: dict[str, Any]) -> Solutions:
    """Whole roots, refined."""
    from solvers.solutions import Ledger, Singular, Solutions

    points = made_from.restore(kept, parameters)
    if made_from.orbit is not None:
        points = np.concatenate(list(made_from.orbit(points, parameters)))
    for _ in range(NEWTON_STEPS):
        F, J = made_from.system.evaluate(points, parameters)
        step = np.linalg.solve(J, F[:, :, None])[:, :, 0]
        points = points - step
    if not np.all(np.abs(step).max(axis=1) <= STEP * np.maximum(np.abs(points).max(axis=1), 1.0)):
        raise CatalogueError(
            f"the catalogue entry {made_from.name} is damaged: some of its points are no roots; build it again"
        )
    unknowns = points.shape[1]
    none = np.zeros(0, np.int64)
    return Solutions(
        points=points,
        singular=Singular(np.zeros((0, unknowns), np.complex128), none, none, none),
        parameters=parameters,
        ledger=Ledger(tracked=len(points), finite=len(points)),
        unknowns=made_from.system.unknowns,
        paths=np.arange(len(points)),
        start="catalogue",
        evidence=str(manifest["evidence"]),
        complete=bool(manifest["complete"]),
    )


def _read(name: str, folder: Path) -> tuple[dict[str, Any], np.ndarray, np.ndarray]:
    arrays, text = _paths(name, folder)
    again = f"everylinkage catalogue build {name}"
    try:
        data, manifest = arrays.read_bytes(), json.loads(text.read_text(encoding="utf-8"))
    except OSError:
        raise CatalogueError(f"the catalogue has no entry {name}; make it with: {again}") from None
    except ValueError as error:
        raise CatalogueError(f"the manifest {text.name} is damaged ({error}); make it again: {again}") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT or manifest.get("name") != name:
        raise CatalogueError(f"the manifest {text.name} is not of format {FORMAT} for {name}; make it: {again}")
    if hashlib.sha256(data).hexdigest() != manifest.get("sha256"):
        raise CatalogueError(f"{arrays.name} is not the file that its manifest describes; make it again: {again}")
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            points, parameters = file["points"], file["parameters"]
    except (ValueError, KeyError, OSError) as error:
        raise CatalogueError(f"{arrays.name} does not hold plain arrays ({error}); make it again: {again}") from None
    made_from = _recipe(name)
    wanted = (manifest["stored"], made_from.kept)
    if points.shape != wanted or parameters.shape != (len(made_from.system.parameters),):
        raise CatalogueError(f"{arrays.name} has arrays of the wrong shape; make it again: {again}")
    return manifest, points.astype(np.complex128), parameters.astype(np.complex128)


def _packed(arrays: dict[str, np.ndarray]) -> bytes:
    memory = io.BytesIO()
    np.savez(memory, **arrays)  # type: ignore[arg-type]
    return memory.getvalue()


def _paths(name: str, folder: Path) -> tuple[Path, Path]:
    stem = name.replace(":", "-").replace(",", "+")
    return folder / f"{stem}.npz", folder / f"{stem}.json"


def _versions() -> dict[str, str]:
    import numba
    import scipy
    import sympy

    from mechanisms import __version__

    return {
        "everylinkage": __version__,
        "python": platform.python_version(),
        **{module.__name__: module.__version__ for module in (np, scipy, sympy, numba)},
    }
