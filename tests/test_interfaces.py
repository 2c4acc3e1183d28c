"""The words that scripts, notebooks and files rely on: commands, options, task keys, JSON keys, Python names.

What a result *is* is tested where it is made; here it is tested that it is found under the promised name.
"""

from __future__ import annotations

import inspect
import json
import math
import re
import runpy
import subprocess
import sys
import tomllib
from pathlib import Path

import click
import numpy as np
import pytest

from mechanisms import cli
from mechanisms.cli import main

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "examples"
EXAMPLE = EXAMPLES / "two_effectors_three_poses.toml"
README = (ROOT / "README.md").read_text(encoding="utf-8")

FAMILIES = {
    "watt2-two-effectors",
    "wanzer",
    "wanzer-modified",
    "four-bar-path",
    "four-bar-motion",
    "watt2-path",
    "robomech",
    "coupled-serial-chain",
}
PAPERS = ("kiper", "suarez", "watt2-24", "robomech", "krovi")
OPTIONS = {
    "families": {"--json"},
    "solve": {"--run", "--jobs", "--seed", "--backend", "--resume", "--no-catalogue", "--json"},
    "show": {"--json", "--sort", "--where", "--top", "--all"},
    "plot": {"-o"},
    "report": {"-o"},
    "export": {"-o"},
    "reproduce": {"--json"},
    "catalogue": set(),
}
VERDICT = {
    "same_circuit": bool,
    "same_branch": bool,
    "in_order": bool,
    "full_rotation": bool,
    "min_transmission_deg": (int, float),
}
REASONS = re.compile(r"complex|degenerate|circuit|branch|order|inexact|constraint:\w+")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.db"
    assert main(["solve", str(EXAMPLE), "--run", str(path), "--jobs", "1"]) == 0
    return str(path)


@pytest.fixture
def call(capsys):
    def called(*arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return code, out, err

    return called


def strict(text: str):
    """JSON as the standard has it: no NaN, no Infinity, no name twice in one object."""

    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    def once(pairs):
        names = [name for name, _ in pairs]
        assert len(names) == len(set(names)), names
        return dict(pairs)

    return json.loads(text, parse_constant=refuse, object_pairs_hook=once)


def whole(value) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def number(value) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def check_document(document, task) -> None:
    """Everything that the JSON of `solve` and `show` promises."""
    assert {"task", "mechanism", "seed", "version", "ledger", "roots", "funnel", "designs"} <= set(document)
    assert document["mechanism"] == task["mechanism"] == document["task"]["mechanism"]
    assert whole(document["seed"]) and isinstance(document["version"], str)
    ledger = document["ledger"]
    assert set(ledger) >= {"tracked", "finite", "singular", "at_infinity", "failed"}
    assert all(whole(value) for value in ledger.values())
    assert ledger["tracked"] == sum(ledger[k] for k in ("finite", "singular", "at_infinity", "failed"))
    roots = document["roots"]
    assert all(whole(roots[key]) for key in ("count", "real", "certified", "certified_real"))
    assert roots["count"] >= roots["real"] >= roots["certified_real"] and roots["certified"] <= roots["count"]
    assert roots["complete"] in (True, False, None) and isinstance(roots["evidence"], str) and roots["evidence"]
    for stage in document["funnel"]:
        assert set(stage) == {"stage", "left", "removed"} and isinstance(stage["stage"], str) and whole(stage["left"])
        assert all(REASONS.fullmatch(code) and whole(count) for code, count in stage["removed"].items())
    assert len({design["id"] for design in document["designs"]}) == len(document["designs"])
    for design in document["designs"]:
        check_design(design)


def check_design(design) -> None:
    assert re.fullmatch(r"D\d{3,}", design["id"]) and (design["root"] is None or whole(design["root"]))
    assert design["accepted"] is (not design["reasons"])
    assert all(REASONS.fullmatch(reason) for reason in design["reasons"])
    for value in design["parameters"].values():
        assert number(value) or (len(value) == 2 and all(map(number, value)))
    assert all(number(length) and length >= 0 for length in design["links"].values())
    assert all(len(place) == 2 and all(map(number, place)) for place in design["pivots"].values())
    for key in ("worst_pose_error", "worst_angle_error_deg"):
        assert number(design[key]) or (design[key] is None and (design["reasons"] or key.startswith("worst_angle")))
    for verdict in design["motion"].values():
        for key, kind in VERDICT.items():
            assert isinstance(verdict[key], kind), (key, verdict[key])


# -- the command ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", OPTIONS)
def test_every_command_has_its_options(name):
    command = cli.cli.commands[name]
    known = {word for item in command.params for word in (*item.opts, *item.secondary_opts)}
    assert OPTIONS[name] <= known


def test_the_catalogue_has_its_sub_commands():
    group = cli.cli.commands["catalogue"]
    assert isinstance(group, click.Group) and set(group.commands) >= {"list", "verify", "build"}


def test_exit_codes():
    assert (cli.OK, cli.FAILED, cli.WRONG, cli.STOPPED) == (0, 1, 2, 3)


def test_backends():
    from solvers import parallel

    assert set(cli.BACKENDS) == {"processes", "threads", "dask", "ray"} == set(parallel.BACKENDS)


def test_a_backend_that_is_not_installed_is_named(call, monkeypatch):
    monkeypatch.setattr(cli, "find_spec", lambda name: None)
    for backend in ("dask", "ray"):
        code, out, err = call("solve", EXAMPLE, "--backend", backend)
        assert (code, out) == (2, "") and "everylinkage[cluster]" in err and err.count("\n") == 1


def test_families_by_name(call):
    rows = strict(call("families", "--json")[1])
    assert FAMILIES <= {row["name"] for row in rows}
    for row in rows:
        assert {"name", "unknowns", "roots", "source"} <= set(row) and (row["pose_counts"] or row["point_counts"])
    text = call("families")[1]
    assert all(name in text for name in FAMILIES)


def test_papers_by_name():
    from mechanisms.reproduce import PAPERS as known

    assert tuple(known) == PAPERS


@pytest.mark.parametrize("options", [(), ("--backend", "processes", "--jobs", "2"), ("--no-catalogue",)], ids=str)
def test_json_of_solve(call, run, options):
    code, out, err = call("solve", EXAMPLE, "--json", *options)
    document = strict(out)
    assert code == 0 and "deriving the equations" in err  # progress, on the other stream
    check_document(document, tomllib.loads(EXAMPLE.read_text()))
    assert document == strict(call("show", run, "--json")[1])


def test_json_of_show_narrowed_down(call, run):
    for options in (("--where", "link_ratio > 10"), ("--sort", "min_transmission_deg"), ("--top", "2"), ("--all",)):
        document = strict(call("show", run, "--json", *options)[1])
        check_document(document, tomllib.loads(EXAMPLE.read_text()))
        assert document["designs"]


@pytest.mark.parametrize("name", ["feeder_three_poses", "four_bar_three_poses", "two_effectors_two_poses"])
def test_json_of_tasks_without_a_list_of_roots(call, name):
    path = EXAMPLES / f"{name}.toml"
    code, out, _ = call("solve", path, "--json", "--jobs", "1")
    document = strict(out)
    check_document(document, tomllib.loads(path.read_text()))
    assert code == 0 and any(design["accepted"] for design in document["designs"])


def test_the_seed_of_the_command_goes_before_that_of_the_file(call):
    assert strict(call("solve", EXAMPLE, "--json", "--seed", "7")[1])["seed"] == 7


def test_no_catalogue_reaches_the_family(monkeypatch):
    asked = []

    def recorded(*arguments, **options):
        asked.append(options)
        raise KeyboardInterrupt

    monkeypatch.setattr(sys.modules["mechanisms.synthesize"], "synthesize", recorded)
    for options in ([], ["--no-catalogue"]):
        assert main(["solve", str(EXAMPLE), *options]) == 3
    assert [options["catalogue"] for options in asked] == [True, False]


def test_every_output_format(call, run, tmp_path):
    best = strict(call("show", run, "--json")[1])["designs"][0]["id"]
    starts = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF", "html": b"<!DOCTYPE html>"}
    for ending, start in starts.items():
        path = tmp_path / f"plot.{ending}"
        assert call("plot", run, best, "-o", path)[0] == 0
        assert path.read_bytes().lower().startswith(start.lower()), ending
    for ending in ("dxf", "svg", "csv", "json"):
        path = tmp_path / f"export.{ending}"
        assert call("export", run, best, "-o", path)[0] == 0 and path.stat().st_size > 100
    check_design(strict((tmp_path / "export.json").read_text()))
    assert call("report", run, "-o", tmp_path / "gallery.html")[0] == 0
    page = (tmp_path / "gallery.html").read_text()
    assert not re.search(r"""(src|href)\s*=\s*["']?\s*(https?:)?//""", page)  # one page, complete in itself


def test_an_output_that_cannot_be_written_is_one_line(call, run, tmp_path):
    (tmp_path / "folder.svg").mkdir()
    for command in ("plot", "export"):
        code, out, err = call(command, run, "D003", "-o", tmp_path / "folder.svg")
        assert (code, out) == (2, "") and err.startswith("error: ") and err.count("\n") == 1


def test_a_folder_is_no_run_file(call, tmp_path):
    for arguments in (("show", tmp_path), ("solve", EXAMPLE, "--run", tmp_path)):
        code, _, err = call(*arguments)
        assert code == 2 and "is a folder" in err and err.count("\n") == 1


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE meta SET value = '{}' WHERE key = 'roots'",
        "UPDATE meta SET value = '[1]' WHERE key = 'ledger'",
        "UPDATE meta SET value = '[{}]' WHERE key = 'funnel'",
        "UPDATE meta SET value = '[1, 2' WHERE key = 'funnel'",
        "UPDATE meta SET value = '{\"mechanism\": 1}' WHERE key = 'task'",
        "UPDATE document SET body = '{}'",
        "UPDATE document SET body = '[]'",
        "DELETE FROM meta",
    ],
)
def test_a_damaged_run_file_is_one_line(call, run, tmp_path, change):
    import sqlite3

    path = tmp_path / "damaged.db"
    path.write_bytes(Path(run).read_bytes())
    connection = sqlite3.connect(path)
    connection.execute(change)
    connection.commit()
    connection.close()
    for command in (("show", path), ("plot", path, "D003", "-o", tmp_path / "x.svg")):
        code, out, err = call(*command)
        assert (code, out) == (2, "") and err.count("\n") == 1 and str(path) in err


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no such device here")
def test_a_file_without_end_is_refused(call, tmp_path):
    (tmp_path / "t.toml").write_text('mechanism = "four-bar-motion"\nposes_csv = "/dev/zero"\n')
    for path in ("/dev/zero", tmp_path / "t.toml"):
        code, out, err = call("solve", path)
        assert (code, out) == (2, "") and "more than" in err and err.count("\n") == 1


# -- task files -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.toml")), ids=lambda path: path.stem)
def test_every_example_is_a_task(path):
    from mechanisms import Task

    task = Task.from_file(path)
    assert Task.from_dict(task.to_dict()) == task
    strict(json.dumps(task.to_dict(), allow_nan=False))


def test_there_is_an_example_of_every_family():
    asked = {tomllib.loads(path.read_text())["mechanism"] for path in EXAMPLES.glob("*.toml")}
    assert asked >= FAMILIES


def test_constraints_and_free_choices_by_their_names():
    from mechanisms import Task

    text = EXAMPLE.read_text().split("[solve]")[0]
    text += "[constraints]\npivots_in = {x = [-100, 100], y = [-100, 100]}\n"
    text += "min_transmission_deg = 30.0\nmax_link_ratio = 6.0\n[solve]\nseed = 1\n"
    task = Task.from_toml(text)
    assert set(task.constraints) == {"pivots_in", "min_transmission_deg", "max_link_ratio"} and task.seed == 1


def test_poses_may_stand_in_a_csv_file(tmp_path):
    from mechanisms import Task

    (tmp_path / "poses.csv").write_text("x,y,angle_deg\n0,0,0\n1,2,30\n2,2,60\n")
    (tmp_path / "t.toml").write_text('mechanism = "four-bar-motion"\nposes_csv = "poses.csv"\n')
    (poses,) = Task.from_file(tmp_path / "t.toml").poses.values()
    assert poses[1].point == 1 + 2j and math.isclose(poses[1].angle, math.radians(30))


# -- Python ---------------------------------------------------------------------------------------------------------


def parameters(function) -> dict[str, object]:
    return {name: item.default for name, item in inspect.signature(function).parameters.items()}


def test_signatures():
    from mechanisms import Task, synthesize
    from solvers import System, certify, monodromy, solve

    assert parameters(System) == {
        "equations": inspect.Parameter.empty,
        "unknowns": inspect.Parameter.empty,
        "parameters": (),
        "groups": None,
    }
    begins = {
        solve: [("system", inspect.Parameter.empty), ("parameters", None), ("start", "auto"), ("jobs", 1), ("seed", 0)],
        monodromy: [("system", inspect.Parameter.empty), ("seed", 0), ("symmetry", ()), ("start", None)],
        certify: [("system", inspect.Parameter.empty), ("solutions", inspect.Parameter.empty)],
    }
    for function, wanted in begins.items():
        assert list(parameters(function).items())[: len(wanted)] == wanted
    assert {"task", "jobs"} <= set(parameters(synthesize)) and callable(Task.from_file)


def test_solutions_by_their_names():
    from sympy import Float, Rational, symbols

    from solvers import Solutions, System, certify, monodromy, solve

    x, y, a = symbols("x y a")
    system = System([Rational(1, 2) * x**2 - Float(0.5) * a, 2.5 * (y - x)], [x, y], parameters=[a])
    solutions = solve(system, parameters=[4])
    assert isinstance(solutions, Solutions) and solutions.points.shape == (2, 2)
    assert solutions.points.dtype == np.complex128 and sorted(solutions.points[:, 0].real.round(9)) == [-2, 2]
    assert solutions.real.tolist() == [True, True] and list(solutions.parameters) == [4]
    ledger = solutions.ledger
    assert ledger.tracked == ledger.finite + ledger.singular + ledger.at_infinity + ledger.failed == 2
    proof = certify(system, solutions)
    assert proof.count == 2 and proof.distinct == 2 and list(proof.real) == [True, True]
    moved = solve(system, parameters={a: 9}, start=solutions)
    assert sorted(moved.points[:, 0].real.round(9)) == [-3, 3]
    family = monodromy(system, seed=0)
    assert len(family.points) == 2 and isinstance(family.evidence, str) and family.evidence


def test_coefficients_of_any_kind():
    from sympy import I, Rational, symbols

    from solvers import System, solve

    x, a = symbols("x a")
    solutions = solve(System([(1 + 2j) * x**2 / a + 3 * I - Rational(1, 3) + 0.25], [x], [a]), parameters=[0.5 - 1j])
    expected = np.sqrt((0.5 - 1j) * (1 / 3 - 0.25 - 3j) / (1 + 2j))
    assert np.allclose(np.sort_complex(solutions.points[:, 0]), np.sort_complex([expected, -expected]))


@pytest.mark.parametrize("start", ["auto", "total-degree", "multihomogeneous", "polyhedral"])
def test_starts_by_their_names_and_singular_ends(start):
    from sympy import symbols

    from solvers import System, solve

    x, y = symbols("x y")
    solutions = solve(System([(x - 1) ** 2 * (x + 2), y - x], [x, y]), start=start)
    assert np.allclose(solutions.points, [[-2, -2]])
    assert np.allclose(solutions.singular, [[1, 1]], atol=1e-6) and list(solutions.singular.multiplicity) == [2]


def test_results_by_their_names(tmp_path):
    import matplotlib

    matplotlib.use("Agg")
    from mechanisms import Task, synthesize

    result = synthesize(Task.from_file(EXAMPLE), jobs=2)
    assert len(result.solutions.points) == 8 and result.funnel[0] == {"stage": "roots", "left": 8, "removed": {}}
    design = result.designs[0]
    assert design.accepted and design.linkage.degrees_of_freedom == 1
    verdict = design.motion("crank").as_dict()
    assert {key: verdict[key] for key in VERDICT} == {key: design.as_dict()["motion"]["crank"][key] for key in VERDICT}
    axes = design.plot(ax=None)
    assert axes is design.plot(ax=axes)
    result.save(tmp_path / "run.db")
    assert main(["show", str(tmp_path / "run.db"), design.id]) == 0


def test_import_leaves_what_is_heavy_alone():
    heavy = ("sympy", "numba", "llvmlite", "scipy", "matplotlib", "PIL", "mpmath", "flint", "joblib")
    program = f"import sys, mechanisms; print([name for name in {heavy!r} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# -- the README -----------------------------------------------------------------------------------------------------


def blocks(kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)```", README, flags=re.DOTALL)


def test_the_task_of_the_readme(call, tmp_path):
    (text,) = blocks("toml")
    (tmp_path / "task.toml").write_text(text)
    code, out, _ = call("solve", tmp_path / "task.toml", "--json")
    document = strict(out)
    check_document(document, tomllib.loads(text))
    assert code == 0 and document["roots"]["count"] == 8 and any(d["accepted"] for d in document["designs"])


def test_the_python_of_the_readme(tmp_path, monkeypatch):
    """Every block runs as printed, from the top of a checkout; only what it writes goes elsewhere."""
    import matplotlib

    matplotlib.use("Agg")
    (tmp_path / "examples").symlink_to(EXAMPLES)
    monkeypatch.chdir(tmp_path)
    for text in blocks("python"):
        (tmp_path / "block.py").write_text(text)
        runpy.run_path(str(tmp_path / "block.py"))
    assert (tmp_path / "run.db").exists()


def test_the_commands_of_the_readme_exist():
    words = re.findall(r"`everylinkage (\w+)([^`]*)`", README)
    assert {name for name, _ in words} >= {"families", "solve", "show", "plot", "report", "export", "reproduce"}
    for name, rest in words:
        command = cli.cli.commands[name]
        known = {word for item in command.params for word in item.opts}
        assert set(re.findall(r"(?<=\s)--?[a-z][\w-]*", rest)) <= known, (name, rest)


def test_the_readme_names_every_family():
    from mechanisms.families import names

    assert all(f"`{name}`" in README for name in names())
