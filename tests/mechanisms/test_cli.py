"""The command as a stranger meets it: what goes to which stream, with which exit code, in how many lines."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from mechanisms import cli
from mechanisms.cli import main

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = str(EXAMPLES / "two_effectors_three_poses.toml")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "run.db"
    assert main(["solve", EXAMPLE, "--run", str(path)]) == 0
    return str(path)


@pytest.fixture
def call(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "160")  # whatever terminal the tests run in: narrow tables leave columns out

    def called(*arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        code = main(list(arguments))
        out, err = capsys.readouterr()
        return code, out, err

    return called


def test_solve_prints_funnel_then_table(call):
    code, out, err = call("solve", EXAMPLE)
    assert code == 0
    lines = out.splitlines()
    assert lines[0] == "Two objects, three poses, one crank"
    assert "paths: 8 tracked = 8 finite + 0 singular + 0 at infinity + 0 failed" in out
    assert "8 of 8 certified, 6 certified real; complete" in out
    assert out.index("complex roots") < out.index("accepted designs") < out.index("transm.")
    assert "accepted" in out and "a dead centre lies between poses" in out
    assert "deriving the equations" in err and "--run RUN.db" in err


def test_solve_json_is_json_alone(call):
    code, out, _ = call("solve", EXAMPLE, "--json")
    document = json.loads(out)
    assert code == 0 and document["roots"]["count"] == 8 and len(document["designs"]) == 8
    assert document["task"]["free"]["eta3_deg"] == -31.70257


def test_task_from_standard_input(monkeypatch, call):
    from types import SimpleNamespace

    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=open(EXAMPLE, "rb")))
    code, out, _ = call("solve", "-", "--json")
    assert code == 0 and json.loads(out)["roots"]["count"] == 8


def test_same_seed_same_answer_whatever_the_jobs(call):
    answers = [call("solve", EXAMPLE, "--json", "--jobs", jobs)[1] for jobs in ("1", "2", "1")]
    assert answers[0] == answers[1] == answers[2]


def test_no_design_is_an_answer(call, tmp_path):
    text = Path(EXAMPLE).read_text() + "\n[constraints]\nmin_transmission_deg = 80\n"
    (tmp_path / "t.toml").write_text(text)
    code, out, _ = call("solve", str(tmp_path / "t.toml"))
    assert code == 0 and "−1 min_transmission_deg" in out and "0  accepted designs" in out


def test_show(call, run):
    code, out, _ = call("show", run)
    assert code == 0 and "one crank" in out and out.count("\n D0") == 3
    code, out, _ = call("show", run, "--all")
    assert out.count("\n D0") == 8 and "trivial: beta = 0, the crank stands still" in out
    code, out, _ = call("show", run, "--top", "1")
    assert out.count("\n D0") == 1 and "… and 2 more" in out
    code, out, _ = call("show", run, "--json", "--where", "min_transmission_deg > 26 and accepted = true")
    assert [d["accepted"] for d in json.loads(out)["designs"]] == [True]
    code, out, _ = call("show", run, "--json", "--sort", "link_ratio", "--where", "link_ratio < 100")
    ratios = [d["link_ratio"] for d in json.loads(out)["designs"]]
    assert code == 0 and ratios == sorted(ratios) and len(ratios) == 3


def test_show_one_design_in_full(call, run):
    best = json.loads(call("show", run, "--json")[1])["designs"][0]["id"]
    for name in (best, best.lower(), best[1:].lstrip("0")):
        code, out, _ = call("show", run, name)
        assert code == 0 and "-49.0570791" in out and "crank (decides)" in out and "O1-A1" in out
    assert json.loads(call("show", run, best, "--json")[1])["id"] == best


def test_families(call):
    code, out, _ = call("families")
    assert code == 0 and "watt2-two-effectors" in out and "Kiper" in out
    rows = {row["name"]: row for row in json.loads(call("families", "--json")[1])}
    assert rows["watt2-two-effectors"]["pose_counts"] == [2, 3]


def test_plot_report_export(call, run, tmp_path):
    best = json.loads(call("show", run, "--json")[1])["designs"][0]["id"]
    for kind in ("svg", "html"):
        path = tmp_path / f"d.{kind}"
        code, out, err = call("plot", run, best, "-o", str(path))
        assert (code, out) == (0, "") and err == f"wrote {path}\n" and path.stat().st_size > 1000
    assert call("report", run, "-o", str(tmp_path / "r.html"))[0] == 0
    for kind in ("dxf", "svg", "csv", "json"):
        assert call("export", run, best, "-o", str(tmp_path / f"e.{kind}"))[0] == 0


def test_reproduce(call):
    code, out, _ = call("reproduce", "kiper", "--json")
    verdicts = {item["verdict"] for item in json.loads(out)["kiper"]}
    assert code == 0 and "differs" not in verdicts and "misprint" in verdicts


def changed(tmp_path: Path, old: str, new: str) -> str:
    text = Path(EXAMPLE).read_text()
    assert old in text
    (tmp_path / "bad.toml").write_text(text.replace(old, new, 1))
    return str(tmp_path / "bad.toml")


WRONG_TASKS = {
    "broken TOML": ("[free]", "[free"),
    "unknown mechanism": ("watt2-two-effectors", "watt3-two-effectors"),
    "unknown key": ("length_unit", "length_units"),
    "missing angle unit": ("eta2_deg", "eta2"),
    "NaN": ("x = 15.0", "x = nan"),
    "text for a number": ("x = 15.0", 'x = "15.0"'),
    "two poses alike": ("x = 15.0, y = 5.0, angle_deg = -45.0", "x = 0.0, y = 0.0, angle_deg = 0.0"),
    "two poses against three": ("{x = 15.0, y = 5.0, angle_deg = -45.0},", ""),
}


@pytest.mark.parametrize(("old", "new"), WRONG_TASKS.values(), ids=WRONG_TASKS)
def test_a_wrong_task_is_one_clear_line_and_exit_code_2(call, tmp_path, old, new):
    code, out, err = call("solve", changed(tmp_path, old, new))
    assert code == 2 and out == "" and err.count("\n") == 1 and err.startswith("error: ")
    assert "bad.toml" in err and "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["solve", "none.toml"], "there is no task file none.toml"),
        (["solve"], "Missing argument"),
        (["solve", EXAMPLE, "--jobs", "0"], "--jobs: 0 workers cannot work; give 1 or more"),
        (["solve", EXAMPLE, "--jobs", "two"], "--jobs"),
        (["solve", EXAMPLE, "--seed", "-1"], "--seed: -1 is no seed"),
        (["solve", EXAMPLE, "--backend", "thread"], "did you mean threads?"),
        (["solve", EXAMPLE, "--resume"], "name the run"),
        (["solve", EXAMPLE, "--run", "no/such/folder/r.db"], "does not exist"),
        (["solv", EXAMPLE], "there is no command 'solv'; did you mean solve?"),
        (["solve", EXAMPLE, "--sed", "1"], "--sed"),
        (["show", "none.db"], "there is no run file none.db"),
        (["show", EXAMPLE], "is not a run file"),
        (["show", "RUN", "D099"], "has no design 'D099'; there are D001 to D008"),
        (["show", "RUN", "../../etc"], "has no design"),
        (["show", "RUN", "--top", "0"], "--top"),
        (["show", "RUN", "--sort", "transmission"], "--sort: no design has 'transmission'"),
        (["show", "RUN", "--where", "os.system('x')"], "--where: cannot read"),
        (["plot", "RUN", "D099"], "has no design"),
        (["plot", "RUN", "BEST", "-o", "a.stl"], "use .svg, .png, .pdf, .gif, .html"),
        (["plot", "RUN", "BEST", "-o", "no/such/a.svg"], "does not exist"),
        (["plot", "RUN", "BEST", "--input", "crnk"], "did you mean crank?"),
        (["plot", "RUN", "TRIVIAL"], "is no linkage (degenerate)"),
        (["export", "RUN", "BEST", "-o", "a.step"], "use .dxf, .svg, .csv, .json"),
        (["report", "RUN", "-o", "a.pdf"], "use .html"),
        (["reproduce", "kipper"], "there is no paper 'kipper'; did you mean kiper?"),
        (["--frobnicate"], "--frobnicate"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_wrong_options_are_one_clear_line_and_exit_code_2(call, run, arguments, words):
    designs = json.loads(call("show", run, "--json")[1])["designs"]
    names = {
        "RUN": run,
        "BEST": designs[0]["id"],
        "TRIVIAL": next(d["id"] for d in designs if "degenerate" in d["reasons"]),
    }
    code, out, err = call(*(names.get(word, word) for word in arguments))
    assert code == 2 and out == "" and words in err
    assert err.count("\n") == 1 and err.startswith("error: ") and "Traceback" not in err


def test_a_run_is_not_overwritten(call, run):
    before = Path(run).read_bytes()
    code, _, err = call("solve", EXAMPLE, "--run", run)
    assert code == 2 and "exists already; add --resume" in err
    code, _, err = call("solve", str(EXAMPLES / "two_effectors_two_poses.toml"), "--run", run, "--resume")
    assert code == 2 and "is the run of another task" in err
    assert Path(run).read_bytes() == before


def test_a_finished_run_may_be_resumed(call, run, tmp_path):
    copy = tmp_path / "copy.db"
    copy.write_bytes(Path(run).read_bytes())
    code, out, _ = call("solve", EXAMPLE, "--run", str(copy), "--resume", "--json")
    assert code == 0 and json.loads(out) == json.loads(call("show", run, "--json")[1])


def test_a_run_that_was_not_finished_is_said_to_be_so(call, run, tmp_path):
    copy = tmp_path / "copy.db"
    copy.write_bytes(Path(run).read_bytes())
    connection = sqlite3.connect(copy)
    connection.execute("UPDATE meta SET value = '\"running\"' WHERE key = 'state'")
    connection.commit()
    connection.close()
    code, _, err = call("show", str(copy))
    assert code == 2 and "was not finished" in err and "--resume" in err


def test_an_interruption_keeps_what_was_found(call, run, tmp_path, monkeypatch):
    """Ctrl-C while designs are judged: the roots are kept, the exit code is 3, and the run can be resumed."""
    from mechanisms import synthesize as module_function
    from mechanisms.designs import design_from_candidate

    assert callable(module_function)
    calls = []

    def interrupted(number, *rest):
        calls.append(number)
        if number == 5:
            raise KeyboardInterrupt
        return design_from_candidate(number, *rest)

    monkeypatch.setattr(sys.modules["mechanisms.synthesize"], "design_from_candidate", interrupted)
    path = tmp_path / "stopped.db"
    code, out, err = call("solve", EXAMPLE, "--run", str(path))
    assert code == 3 and "add --resume to go on" in err and "8  complex roots" in out
    monkeypatch.undo()
    assert call("show", str(path))[0] == 0
    code, out, _ = call("solve", EXAMPLE, "--run", str(path), "--resume", "--json")
    assert code == 0 and json.loads(out) == json.loads(call("show", run, "--json")[1])


def test_control_c_of_the_whole_command(tmp_path):
    """A real SIGINT to a real process, at whatever it is doing."""
    path = tmp_path / "run.db"
    command = [sys.executable, "-m", "mechanisms.cli", "solve", EXAMPLE, "--run", str(path)]
    text = Path(EXAMPLE).read_text().split("[free]")[0] + "[solve]\nsamples = 1048576\n"
    (tmp_path / "long.toml").write_text(text)
    command[4] = str(tmp_path / "long.toml")
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ)
    assert child.stderr is not None
    for line in child.stderr:
        if line.startswith("building linkages"):
            break
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    out, err = child.communicate(timeout=60)
    assert child.returncode == 3, err
    assert "Traceback" not in err and "stopped" in err and "complex roots" in out


def test_control_c_that_a_callback_swallows_is_still_a_stop(call, monkeypatch):
    """A compiler's callback drops the interruption and then fails for lack of what it was to bring."""

    def compiling(run):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        raise RuntimeError("no compiled object yet")

    before = signal.getsignal(signal.SIGINT)
    monkeypatch.setattr(cli, "_load", compiling)
    code, out, err = call("show", "x.db")
    assert (code, out, err.strip()) == (3, "", "stopped")
    assert signal.getsignal(signal.SIGINT) is before


def test_unexpected_errors_are_not_hidden(monkeypatch):
    monkeypatch.setattr(cli, "_load", lambda run: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["show", "x.db"])


def test_help_names_every_command():
    text = CliRunner().invoke(cli.cli, ["--help"]).output
    for name in ("families", "solve", "show", "plot", "report", "export", "reproduce"):
        assert name in text


def test_import_is_quick_and_loads_nothing_heavy():
    program = (
        "import sys, mechanisms, mechanisms.cli; "
        "print([m for m in ('sympy', 'scipy', 'numba', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_killed_run_resumes_with_the_same_answer(call, tmp_path):
    """SIGKILL while designs are searched: the tracked paths are in the file, and --resume ends the same."""
    text = Path(EXAMPLE).read_text().split("[free]")[0] + "[solve]\nseed = 4\nsamples = 65536\n"
    (tmp_path / "t.toml").write_text(text)
    path = tmp_path / "run.db"
    command = [sys.executable, "-m", "mechanisms.cli", "solve", str(tmp_path / "t.toml"), "--run", str(path)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    assert child.stderr is not None
    for line in child.stderr:
        if line.startswith("building linkages"):
            break
    child.kill()
    child.wait()
    assert call("show", str(path))[0] == 2
    connection = sqlite3.connect(path)
    assert connection.execute("SELECT COUNT(*) FROM chunk").fetchone()[0] > 0
    connection.close()
    code, resumed, _ = call("solve", str(tmp_path / "t.toml"), "--run", str(path), "--resume", "--json")
    assert code == 0
    fresh = call("solve", str(tmp_path / "t.toml"), "--json")[1]
    assert json.loads(resumed) == json.loads(fresh)
    assert json.loads(call("show", str(path), "--json")[1]) == json.loads(fresh)


def test_without_arguments_there_is_help(call):
    for arguments in ((), ("catalogue",)):
        code, out, err = call(*arguments)
        assert code == 0 and out.startswith("Usage: everylinkage") and err == ""


def test_catalogue_lists_and_verifies(call):
    entries = json.loads(call("catalogue", "list", "--json")[1])
    names = {entry["name"] for entry in entries}
    assert "trammel:5" in names
    code, out, _ = call("catalogue", "verify", "trammel:5", "--json")
    report = json.loads(out)["trammel:5"]
    assert code == 0 and all(check["passed"] for check in report)
    code, out, err = call("catalogue", "verify", "tramel")
    assert (
        code == 2 and err.startswith("error: the catalogue has nothing called 'tramel'") and err.count("\n") == 1
    )


def test_an_interruption_of_the_tracking_keeps_its_chunks(call, tmp_path, monkeypatch):
    """Ctrl-C while paths are tracked: exit code 3, an honest ledger, and a run that can be resumed."""
    import solvers.tracking as tracking

    def interrupted(*arguments):
        raise KeyboardInterrupt

    path = tmp_path / "stopped.db"
    with monkeypatch.context() as patch:
        patch.setattr(tracking, "_track_chunk", interrupted)
        code, out, err = call("solve", EXAMPLE, "--run", str(path), "--jobs", "1")
    assert code == 3 and "NOT complete: stopped" in out and "add --resume" in err
    code, out, _ = call("solve", EXAMPLE, "--run", str(path), "--resume", "--json")
    document = json.loads(out)
    assert code == 0 and document["state"] == "done" and document["roots"]["count"] == 8


@pytest.mark.parametrize("width", [60, 80, 100, 160])
def test_tables_fit_the_terminal(call, run, monkeypatch, width):
    monkeypatch.setenv("COLUMNS", str(width))
    out = call("show", run, "--all")[1]
    table = out[out.index("verdict") :]
    assert all(len(line) <= width for line in table.splitlines())
    assert "accepted" in table and "27.6" in table and "D008" in table


def test_what_concerns_the_whole_task_stands_below_the_table(tmp_path, capsys):
    rows = "{x=0,y=0,angle_deg=0},{x=30,y=40,angle_deg=20},{x=80,y=55,angle_deg=55}"
    free = "O1_x = 0\nO1_y = -40\nO2_x = 60\nO2_y = -40\ntolerance_x = [0.0, 0.01, 0.01]"
    path = tmp_path / "task.toml"
    path.write_text(
        f'mechanism = "four-bar-motion"\nposes = [{rows}]\n[free]\n{free}\n[constraints]\nmin_transmission_deg = 20\n'
    )
    assert main(["solve", str(path)]) == 0
    assert "none of 128 tasks within the tolerances" in capsys.readouterr().out
