"""The run file: what is appended is there after a kill, and nothing in a strange file is believed."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys

import numpy as np
import pytest

from solvers.store import RunFile, StoreError


def test_arrays_come_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(0)
    arrays = {
        "z": rng.normal(size=(3, 2)) + 1j * rng.normal(size=(3, 2)),
        "n": np.arange(4),
        "flag": np.array([True, False]),
        "empty": np.zeros((0, 5)),
        "scalar": np.array(2.5),
    }
    with RunFile.create(tmp_path / "a.db", {"seed": 3}) as run:
        run.append("s", 7, arrays)
    with RunFile.open(tmp_path / "a.db") as run:
        (number,) = run.chunks("s")
        assert number == 7 and run.chunks("other") == {} and run.stages() == {"s": 1}
        for name, array in arrays.items():
            back = run.chunks("s")[7][name]
            assert back.shape == array.shape and back.tobytes() == array.tobytes()


def test_big_endian_arrays_are_stored_little_endian(tmp_path):
    with RunFile.create(tmp_path / "a.db", {}) as run:
        run.append("s", 0, {"x": np.array([1.0, 2.0], dtype=">f8")})
        assert run.chunks("s")[0]["x"].tolist() == [1.0, 2.0]


def test_objects_are_never_stored(tmp_path):
    with RunFile.create(tmp_path / "a.db", {}) as run, pytest.raises(TypeError, match="not stored"):
        run.append("s", 0, {"x": np.array([object()])})


def test_documents_and_meta(tmp_path):
    with RunFile.create(tmp_path / "a.db", {"task": {"a": [1, 2]}}) as run:
        run.put("design", {"D2": {"x": 2}, "D1": {"x": 1}})
        run.put("design", {"D2": {"x": 3}})
        run.update({"done": True})
        assert dict(run.documents("design")) == {"D1": {"x": 1}, "D2": {"x": 3}}
        run.replace("design", {"D9": 1})
        assert dict(run.documents("design")) == {"D9": 1}
        assert run.meta == {"task": {"a": [1, 2]}, "done": True}


def test_a_run_is_not_overwritten_unless_asked(tmp_path):
    path = tmp_path / "a.db"
    RunFile.create(path, {"n": 1}).close()
    with pytest.raises(StoreError, match="exists already"):
        RunFile.create(path, {})
    RunFile.create(path, {"n": 2}, overwrite=True).close()
    with RunFile.open(path) as run:
        assert run.meta == {"n": 2}


@pytest.mark.parametrize(
    "content", [b"not a database, whatever its name says" * 50, b"SQLite format 3\0" * 9]
)
def test_what_is_no_run_file_is_refused_and_left_alone(tmp_path, content):
    path = tmp_path / "precious.txt"
    path.write_bytes(content)
    for attempt in (lambda: RunFile.open(path), lambda: RunFile.create(path, {}, overwrite=True)):
        with pytest.raises(StoreError, match="not a run file"):
            attempt()
    assert path.read_bytes() == content


def test_another_programs_database_is_refused(tmp_path):
    path = tmp_path / "other.db"
    connection = sqlite3.connect(path)
    connection.execute("CREATE TABLE meta (key, value)")
    connection.commit()
    connection.close()
    with pytest.raises(StoreError, match="not a run file of this program"):
        RunFile.open(path)


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE chunk SET shape = '[3]'",
        "UPDATE chunk SET shape = '[-1, -2]'",
        "UPDATE chunk SET shape = 'nonsense'",
        "UPDATE chunk SET type = '|O'",
        "UPDATE chunk SET data = 'text'",
        "UPDATE chunk SET shape = '[9999999999999]'",
    ],
)
def test_a_tampered_array_is_refused(tmp_path, change):
    path = tmp_path / "a.db"
    with RunFile.create(path, {}) as run:
        run.append("s", 0, {"x": np.array([1.0, 2.0])})
    connection = sqlite3.connect(path)
    connection.execute(change)
    connection.commit()
    connection.close()
    with RunFile.open(path) as run, pytest.raises(StoreError, match="damaged"):
        run.chunks("s")


def test_a_missing_file_and_a_missing_folder(tmp_path):
    with pytest.raises(StoreError, match="no run file"):
        RunFile.open(tmp_path / "none.db")
    with pytest.raises(StoreError, match="does not exist"):
        RunFile.create(tmp_path / "no" / "a.db", {})
    assert not (tmp_path / "none.db").exists()


def test_what_was_appended_survives_sigkill(tmp_path):
    path = tmp_path / "killed.db"
    program = (
        "import sys, numpy as np; from solvers.store import RunFile\n"
        "run = RunFile.create(sys.argv[1], {})\n"
        "for n in range(10**6):\n"
        "    run.append('s', n, {'x': np.full(3, n)})\n"
        "    if n == 20: print('go', flush=True)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program, str(path)], stdout=subprocess.PIPE)
    assert child.stdout is not None and child.stdout.readline() == b"go\n"
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    with RunFile.open(path, write=True) as run:
        chunks = run.chunks("s")
        assert len(chunks) >= 21
        assert all(chunk["x"].tolist() == [n] * 3 for n, chunk in chunks.items())
        run.append("s", len(chunks), {"x": np.zeros(1)})


def test_chunks_can_be_read_one_by_one(tmp_path):
    with RunFile.create(tmp_path / "run.db", {}) as run:
        for number in (3, 0, 7):
            run.append("stage", number, {"x": np.full(2, number), "y": np.ones((1, 2))})
        run.append("other", 1, {"x": np.zeros(1)})
        assert run.numbers("stage") == [0, 3, 7] and run.numbers("none") == []
        assert run.chunk("stage", 3)["x"].tolist() == [3, 3] and set(run.chunk("stage", 3)) == {"x", "y"}
        with pytest.raises(KeyError):
            run.chunk("stage", 1)
