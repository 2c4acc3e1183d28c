"""The shipped generic solutions: counts that others have found, and files that are checked before they are used."""

import json
import shutil

import numpy as np
import pytest

from mechanisms.catalogue import build, generic, load, names, recipe, verify
from mechanisms.catalogue.entries import FOLDER, CatalogueError

ALL = names()


@pytest.mark.parametrize("name", ALL)
def test_every_entry_holds_distinct_roots(name):
    """Residuals here, with the system's own evaluation; restored turns included."""
    solutions = load(name)
    manifest = json.loads(next(FOLDER.glob(name.replace(":", "-").replace(",", "+") + ".json")).read_text())
    assert len(solutions) == manifest["count"] and manifest["complete"] is True
    assert manifest["certified_distinct"] == manifest["count"]
    F, _ = recipe(name).system.evaluate(solutions.points, solutions.parameters)
    size = np.abs(solutions.points).max(axis=1)
    assert (np.abs(F).max(axis=1) < 1e-9 * np.maximum(size, 1) ** 3).all()
    rounded = np.unique(np.round(solutions.points[:, : recipe(name).kept], 7), axis=0)
    assert len(rounded) == len(solutions)


def test_nine_points_have_the_published_count():
    assert len(load("four-bar-path:9")) == 8652


@pytest.mark.parametrize("name", ["trammel:5", "trammel:7"])
def test_verify_passes(name):
    checks = verify(name)
    assert [check for check, passed, _ in checks if not passed] == []
    assert {"files", "roots", "certificate", "trace test"} <= {check for check, _, _ in checks}


def test_another_seed_finds_as_many_roots(tmp_path):
    manifest = build("trammel:5", seed=77, folder=tmp_path)
    assert manifest["count"] == len(load("trammel:5")) and manifest["complete"]
    assert len(load("trammel:5", tmp_path)) == manifest["count"]
    assert not np.allclose(load("trammel:5", tmp_path).parameters, load("trammel:5").parameters)


@pytest.fixture
def copied(tmp_path):
    for path in FOLDER.glob("trammel-5.*"):
        shutil.copy(path, tmp_path)
    return tmp_path


def test_changed_arrays_are_refused(copied):
    data = bytearray((copied / "trammel-5.npz").read_bytes())
    data[-40] ^= 1
    (copied / "trammel-5.npz").write_bytes(bytes(data))
    with pytest.raises(CatalogueError, match="not the file that its manifest describes"):
        load("trammel:5", copied)
    assert verify("trammel:5", copied)[0][1] is False


def test_points_that_are_no_roots_are_refused(copied):
    """A manifest that fits its file proves nothing about the numbers in it."""
    import hashlib

    with np.load(copied / "trammel-5.npz", allow_pickle=False) as file:
        points, parameters = file["points"], file["parameters"]
    points[3] += 0.2
    np.savez(copied / "trammel-5.npz", points=points, parameters=parameters)
    manifest = json.loads((copied / "trammel-5.json").read_text())
    manifest["sha256"] = hashlib.sha256((copied / "trammel-5.npz").read_bytes()).hexdigest()
    (copied / "trammel-5.json").write_text(json.dumps(manifest))
    checks = {name: passed for name, passed, _ in verify("trammel:5", copied)}
    assert checks["files"] and not checks["roots"]


def test_pickled_arrays_are_not_loaded(copied):
    import hashlib

    np.savez(copied / "trammel-5.npz", points=np.array([{"a": 1}], object), parameters=np.zeros(3))
    manifest = json.loads((copied / "trammel-5.json").read_text())
    manifest["sha256"] = hashlib.sha256((copied / "trammel-5.npz").read_bytes()).hexdigest()
    (copied / "trammel-5.json").write_text(json.dumps(manifest))
    with pytest.raises(CatalogueError, match="plain arrays"):
        load("trammel:5", copied)


@pytest.mark.parametrize("name", ["nonsense", "trammel:9", "trammel:7:quadratic", "four-bar-path:8:e,g", "trammel"])
def test_unknown_names_are_explained(name):
    with pytest.raises(CatalogueError, match="no problem"):
        generic(name)
    if name != "trammel":
        with pytest.raises(CatalogueError, match="nothing called"):
            names(name)


def test_missing_entry_says_how_to_make_it(tmp_path):
    with pytest.raises(CatalogueError, match="catalogue build trammel:7"):
        load("trammel:7", tmp_path)
