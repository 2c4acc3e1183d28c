"""Chunks of paths on all cores: threads where the kernel runs without the interpreter's lock, or joblib's processes.

Chunks are cut by the number of paths alone and results are put together by chunk number, so the answer does not
depend on the number of workers. A chunk that is finished is handed over at once (to the run file, to the
progress line); an interruption loses only the chunks in flight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

BACKENDS = ("processes", "threads", "dask", "ray")
#: Paths in a chunk: enough to fill the lanes many times over, few enough that progress is seen.
LARGEST_CHUNK = 4096
SMALLEST_CHUNK = 256
#: Aim at this many chunks, so that two or four workers finish together and progress is seen.
CHUNKS = 8


class BackendError(ValueError):
    """The parallel backend asked for is not there; the message says what to install."""


def cut(count: int, smallest: int = SMALLEST_CHUNK) -> list[np.ndarray]:
    """The numbers 0 … count-1 in chunks.

    >>> [len(chunk) for chunk in cut(600)]
    [256, 256, 88]
    """
    size = int(np.clip(-(-count // CHUNKS), smallest, LARGEST_CHUNK))
    return [np.arange(k, min(k + size, count)) for k in range(0, count, size)]


def run(
    function: Callable[..., Any], tasks: Sequence[tuple[int, tuple[Any, ...]]], jobs: int, backend: str = "threads"
) -> Iterator[tuple[int, Any]]:
    """Yield (number, function(*arguments)) for each (number, arguments), as they finish.

    Raises
    ------
    BackendError
        Dask or Ray was asked for and is not installed.
    ValueError
        jobs is not a positive number, or the backend is unknown.
    """
    if jobs < 1:
        raise ValueError(f"the number of jobs must be at least 1, not {jobs}")
    if backend not in BACKENDS:
        raise ValueError(f"the backend {backend!r} is unknown; choose one of {', '.join(BACKENDS)}")
    if jobs == 1 or len(tasks) <= 1:
        for number, arguments in tasks:
            yield number, function(*arguments)
        return
    if backend == "threads":
        yield from _on_threads(function, tasks, jobs)
        return
    from joblib import Parallel, delayed

    with _backend(backend, jobs):
        options: dict[str, Any] = {"backend": "loky"} if backend == "processes" else {}
        workers = Parallel(n_jobs=jobs, return_as="generator_unordered", **options)
        yield from workers(delayed(_numbered)(function, number, arguments) for number, arguments in tasks)


def _numbered(function: Callable[..., Any], number: int, arguments: tuple[Any, ...]) -> tuple[int, Any]:
    return number, function(*arguments)


def _on_threads(
    function: Callable[..., Any], tasks: Sequence[tuple[int, tuple[Any, ...]]], jobs: int
) -> Iterator[tuple[int, Any]]:
    """joblib looks for finished chunks every ten milliseconds, which is longer than many chunks take; this waits."""
    from concurrent.futures import ThreadPoolExecutor, as_completed

    with ThreadPoolExecutor(min(jobs, len(tasks))) as pool:
        waiting = [pool.submit(_numbered, function, number, arguments) for number, arguments in tasks]
        try:
            for done in as_completed(waiting):
                yield done.result()
        finally:
            for future in waiting:  # after an error or an interruption those that have not begun never do
                future.cancel()


@contextmanager
def _backend(name: str, jobs: int) -> Iterator[None]:
    if name == "processes":
        yield
        return
    from joblib import parallel_config

    try:
        if name == "dask":
            from distributed import Client

            with Client(n_workers=jobs, threads_per_worker=1, dashboard_address=None), parallel_config("dask"):
                yield
        else:
            from ray.util.joblib import register_ray

            register_ray()
            with parallel_config("ray", n_jobs=jobs):
                yield
    except ImportError:
        raise BackendError(f"the backend {name!r} needs more packages: pip install 'everylinkage[cluster]'") from None
