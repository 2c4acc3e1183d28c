"""Chunks: every path in one, and every result handed over once, whoever did the work."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solvers.parallel import BackendError, cut, run


@given(st.integers(0, 3_000_000))
def test_every_path_is_in_one_chunk(count):
    chunks = cut(count)
    assert sum(map(len, chunks)) == count
    assert all(len(chunk) for chunk in chunks)
    ends = [0, *np.cumsum([len(chunk) for chunk in chunks]).tolist()]
    assert all(chunk[0] == first and chunk[-1] == last - 1 for chunk, first, last in zip(chunks, ends, ends[1:]))


def square(k):
    return k * k


@pytest.mark.parametrize("jobs, backend", [(1, "threads"), (2, "threads"), (3, "threads"), (2, "processes")])
def test_every_result_comes_once(jobs, backend):
    tasks = [(k, (k,)) for k in range(12)]
    assert sorted(run(square, tasks, jobs, backend)) == [(k, k * k) for k in range(12)]


def fails(k):
    if k == 5:
        raise RuntimeError("number five")
    return k


@pytest.mark.parametrize("jobs", [1, 2])
def test_an_error_in_a_worker_is_not_swallowed(jobs):
    with pytest.raises(RuntimeError, match="number five"):
        list(run(fails, [(k, (k,)) for k in range(8)], jobs))


@pytest.mark.parametrize("jobs", [0, -1])
def test_no_workers(jobs):
    with pytest.raises(ValueError, match="at least 1"):
        list(run(square, [(0, (1,))], jobs))


def test_an_unknown_backend():
    with pytest.raises(ValueError, match="unknown; choose one of"):
        list(run(square, [(0, (1,))], 1, "pigeons"))


@pytest.mark.parametrize("backend", ["dask", "ray"])
def test_a_backend_that_is_not_installed_is_named(backend, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "distributed" if backend == "dask" else "ray.util.joblib", None)
    with pytest.raises(BackendError, match=r"everylinkage\[cluster\]"):
        list(run(square, [(0, (1,)), (1, (2,))], 2, backend))
