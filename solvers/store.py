"""The run file: everything a run has found so far, in one SQLite database.

A run is appended to as its chunks of paths finish, each chunk in its own transaction, so that a run that is
stopped at any moment, by SIGKILL too, keeps whole chunks and can go on from there.  Arrays are stored as
their raw little-endian bytes beside a type and a shape, everything else as JSON: reading a run file never
runs code.

A `RunFile` is what ``solve(..., checkpoint=run)`` expects: ``chunks(stage)`` to ask what an earlier run had
finished, ``append(stage, number, arrays)`` to add to it.  The *stage* names one computation completely (a
digest of the system, its parameter values, the start system and the seed), so that chunks of different
problems never mix.
"""

from __future__ import annotations

import json
import math
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

__all__ = ["RunFile", "StoreError"]

#: Written into the header of the database ("ELNK"), so that another program's database is not taken for a
#: run.
APPLICATION_ID = 0x454C4E4B
#: Raised when a newer program writes what this one cannot read.
FORMAT_VERSION = 1
#: The only array types that are read; all little-endian whatever the machine.
ARRAY_TYPES = frozenset({"<f8", "<c16", "<i8", "<i4", "|i1", "|u1", "|b1"})
#: How long to wait for another process that is writing to the same file, in seconds.
LOCK_PATIENCE = 5.0

#: JSON documents by their ids.
Documents = Mapping[str, Any] | Iterable[tuple[str, Any]]

_SCHEMA = """
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE chunk (
    stage TEXT NOT NULL, number INTEGER NOT NULL, name TEXT NOT NULL,
    type TEXT NOT NULL, shape TEXT NOT NULL, data BLOB NOT NULL,
    PRIMARY KEY (stage, number, name)
);
CREATE TABLE document (
    kind TEXT NOT NULL, id TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (kind, id)
) WITHOUT ROWID;
"""


class StoreError(ValueError):
    """A run file that cannot be read or written; the message says why and what to do."""


class RunFile:
    """A run file, opened.

    Use `RunFile.create` or `RunFile.open`, not the constructor; use as a context manager, or `close` it.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "run.db"
    >>> with RunFile.create(path, {"seed": 1}) as run:
    ...     run.append("stage", 0, {"x": np.array([1 + 2j])})
    >>> with RunFile.open(path) as run:
    ...     run.meta["seed"], run.chunks("stage")[0]["x"]
    (1, array([1.+2.j]))
    """

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection

    @classmethod
    def create(cls, path: str | Path, meta: Mapping[str, Any], overwrite: bool = False) -> Self:
        """Start a new run file.

        Parameters
        ----------
        path : path
            Where.
        meta : mapping of str to JSON values
            What the run is about: task, seed, version.
        overwrite : bool
            Whether an existing *run file* may be replaced.  Any other file is never touched.

        Raises
        ------
        StoreError
            When the file exists (and may not be replaced), is no run file, or cannot be written.
        """
        path = Path(path)
        if path.exists() and path.stat().st_size:
            if not overwrite:
                raise StoreError(f"{path} exists already; resume it, or choose another name")
            cls.open(path).close()  # refuses what is not a run file
            path.unlink()
        if not path.parent.is_dir():
            raise StoreError(f"cannot write {path}: the folder {path.parent} does not exist")
        try:
            connection = _connect(path, write=True)
            with connection:
                connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
                connection.execute(f"PRAGMA user_version = {FORMAT_VERSION}")
                connection.executescript(_SCHEMA)
        except sqlite3.Error as error:
            raise StoreError(f"cannot write {path}: {error}") from error
        run = cls(path, connection)
        run.update(meta)
        return run

    @classmethod
    def open(cls, path: str | Path, write: bool = False) -> Self:
        """Open an existing run file.

        Raises
        ------
        StoreError
            When there is none, or it is not a run file, or a newer version wrote it.
        """
        path = Path(path)
        if path.is_dir():
            raise StoreError(f"{path} is a folder; name a run file in it")
        if not path.is_file():
            raise StoreError(f"there is no run file {path}")
        try:
            connection = _connect(path, write)
            (application,) = connection.execute("PRAGMA application_id").fetchone()
            (version,) = connection.execute("PRAGMA user_version").fetchone()
            tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master")}
        except sqlite3.Error as error:
            raise StoreError(f"{path} is not a run file ({error})") from error
        if application != APPLICATION_ID or not {"meta", "chunk", "document"} <= tables:
            connection.close()
            raise StoreError(f"{path} is not a run file of this program")
        if version > FORMAT_VERSION:
            connection.close()
            raise StoreError(f"{path} was written by a newer version (format {version}); update this program")
        return cls(path, connection)

    # -- what the run is about

    @property
    def meta(self) -> dict[str, Any]:
        """All of the run's description."""
        rows = self._execute("SELECT key, value FROM meta ORDER BY key").fetchall()
        return {key: _from_json(value, self.path) for key, value in rows}

    def update(self, meta: Mapping[str, Any]) -> None:
        """Add to the run's description, or change it."""
        rows = [(key, json.dumps(value, allow_nan=False)) for key, value in meta.items()]
        with self._connection:
            self._connection.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", rows)

    # -- chunks of paths

    def append(self, stage: str, number: int, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Add one finished chunk, whole or not at all.

        Parameters
        ----------
        stage : str
            The computation it belongs to.
        number : int
            Its place in it; a chunk that is there already is replaced.
        arrays : mapping of str to array
            Its results.
        """
        rows = []
        for name, array in arrays.items():
            little = np.ascontiguousarray(array)
            shape = json.dumps(np.shape(array))
            little = little.astype(little.dtype.newbyteorder("<"), copy=False)
            kind = little.dtype.str
            if kind not in ARRAY_TYPES:
                raise TypeError(f"arrays of type {little.dtype} are not stored in run files")
            rows.append((stage, int(number), name, kind, shape, little.tobytes()))
        with self._connection:
            self._connection.execute("DELETE FROM chunk WHERE stage = ? AND number = ?", (stage, int(number)))
            self._connection.executemany("INSERT INTO chunk VALUES (?, ?, ?, ?, ?, ?)", rows)

    def chunks(self, stage: str) -> dict[int, dict[str, NDArray[Any]]]:
        """The finished chunks of a stage, by number."""
        query = "SELECT number, name, type, shape, data FROM chunk WHERE stage = ? ORDER BY number, name"
        found: dict[int, dict[str, NDArray[Any]]] = {}
        for number, name, kind, shape, data in self._execute(query, (stage,)):
            found.setdefault(number, {})[name] = _array(kind, shape, data, self.path)
        return found

    def chunk(self, stage: str, number: int) -> dict[str, NDArray[Any]]:
        """One finished chunk of a stage, where all of them together would not fit into memory.

        Raises
        ------
        KeyError
            There is none of that number.
        """
        query = "SELECT name, type, shape, data FROM chunk WHERE stage = ? AND number = ?"
        rows = self._execute(query, (stage, int(number))).fetchall()
        if not rows:
            raise KeyError(number)
        return {name: _array(kind, shape, data, self.path) for name, kind, shape, data in rows}

    def numbers(self, stage: str) -> list[int]:
        """The numbers of the finished chunks of a stage, in order."""
        query = "SELECT DISTINCT number FROM chunk WHERE stage = ? ORDER BY number"
        return [number for (number,) in self._execute(query, (stage,))]

    def stages(self) -> dict[str, int]:
        """The stages in the file and how many chunks each has."""
        query = "SELECT stage, COUNT(DISTINCT number) FROM chunk GROUP BY stage ORDER BY stage"
        return dict(self._execute(query).fetchall())

    # -- anything else

    def put(self, kind: str, documents: Documents) -> None:
        """Store JSON documents of one kind by their ids, replacing earlier ones of the same id.

        Parameters
        ----------
        kind : str
        documents : mapping, or iterable of (id, document)
            Of an iterable one document at a time is in memory.
        """
        with self._connection:
            self._insert(kind, documents)

    def replace(self, kind: str, documents: Documents) -> None:
        """Store JSON documents in place of all those of the kind, in one transaction; arguments as of `put`."""
        with self._connection:
            self._connection.execute("DELETE FROM document WHERE kind = ?", (kind,))
            self._insert(kind, documents)

    def _insert(self, kind: str, documents: Documents) -> None:
        pairs = documents.items() if isinstance(documents, Mapping) else documents
        rows = ((kind, name, json.dumps(body, allow_nan=False)) for name, body in pairs)
        self._connection.executemany("INSERT OR REPLACE INTO document VALUES (?, ?, ?)", rows)

    def documents(self, kind: str) -> Iterator[tuple[str, Any]]:
        """The documents of one kind, in the order of their ids, read one by one."""
        for name, body in self._execute("SELECT id, body FROM document WHERE kind = ? ORDER BY id", (kind,)):
            yield name, _from_json(body, self.path)

    # -- opening and closing

    def close(self) -> None:
        """Close the file; everything that was added is in it."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"RunFile({str(self.path)!r})"

    def _execute(self, query: str, values: tuple[Any, ...] = ()) -> sqlite3.Cursor:
        try:
            return self._connection.execute(query, values)
        except sqlite3.Error as error:
            raise StoreError(f"{self.path} is damaged ({error})") from error


def _connect(path: Path, write: bool) -> sqlite3.Connection:
    mode = "rwc" if write else "ro"
    # check_same_thread: results may be appended from the thread that collects them
    return sqlite3.connect(
        f"{path.absolute().as_uri()}?mode={mode}", uri=True, timeout=LOCK_PATIENCE, check_same_thread=False
    )


def _from_json(text: Any, path: Path) -> Any:
    try:
        return json.loads(text)
    except (TypeError, ValueError) as error:
        raise StoreError(f"{path} is damaged (unreadable JSON: {error})") from error


def _array(kind: Any, shape: Any, data: Any, path: Path) -> NDArray[Any]:
    """An array from its row; the row may come from a stranger, so nothing about it is believed."""
    dimensions = _from_json(shape, path)
    sound = (
        kind in ARRAY_TYPES
        and isinstance(dimensions, list)
        and all(type(n) is int and n >= 0 for n in dimensions)
        and isinstance(data, bytes)
        and math.prod(dimensions) * np.dtype(kind).itemsize == len(data)
    )
    if not sound:
        raise StoreError(f"{path} is damaged ({kind!r} and {shape!r} do not fit the bytes of an array)")
    array = np.frombuffer(data, dtype=kind).reshape(dimensions).copy()
    return array.astype(array.dtype.newbyteorder("="), copy=False)
