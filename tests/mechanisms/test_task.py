"""Reading tasks: what is right comes back unchanged, what is wrong is refused in one clear sentence."""

from __future__ import annotations

import copy
import io
import math
import re
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mechanisms import Pose, Task, TaskError
from mechanisms.taskfile import read_toml

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = EXAMPLES / "two_effectors_three_poses.toml"


def mapping() -> dict:
    return tomllib.loads(EXAMPLE.read_text())


def changed(path: str, value) -> dict:
    """The example with one entry changed; the path is separated by dots, numbers are list indices."""
    task = mapping()
    place = task
    *parents, last = [int(key) if key.isdigit() else key for key in path.split(".")]
    for key in parents:
        place = place.setdefault(key, {}) if isinstance(place, dict) else place[key]
    if value is None:
        del place[last]
    else:
        place[last] = value
    return task


def refusal(task: dict) -> str:
    with pytest.raises(TaskError) as caught:
        Task.from_dict(task, where="task.toml")
    message = str(caught.value)
    assert message.startswith("task.toml: ") and "\n" not in message and len(message) < 400
    return message


def test_the_example_reads_as_written():
    task = Task.from_file(EXAMPLE)
    assert task.mechanism == "watt2-two-effectors" and task.length_unit == "mm" and task.seed == 1
    assert task.poses["P"] == (Pose.of(0, 0), Pose.of(15, 5, -45), Pose.of(25, 10, -30))
    assert task.poses["Q"][2].point == 75 + 20j
    assert task.free["eta3"] == pytest.approx(math.radians(-31.70257))


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("two_effectors*.toml")), ids=lambda p: p.name)
def test_a_task_and_its_mapping_are_the_same(path):
    task = Task.from_file(path)
    again = Task.from_dict(task.to_dict())
    assert again == task and again.to_dict() == task.to_dict()


def test_poses_from_csv_are_those_of_a_list(tmp_path):
    (tmp_path / "p.csv").write_text("x,y,angle_deg\n0,0,0\n\n15, 5, -45\n25,1e1,-30\n")
    task = changed("effectors.P", {"poses_csv": "p.csv"})
    text = EXAMPLE.read_text()
    head, tail = text.split("[effectors.P]")
    body = '[effectors.P]\nposes_csv = "p.csv"\n[effectors.Q]' + tail.split("[effectors.Q]")[1]
    (tmp_path / "t.toml").write_text(head + body)
    assert Task.from_file(tmp_path / "t.toml").poses == Task.from_file(EXAMPLE).poses
    assert "cannot read" in refusal(task)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("x;y;angle_deg\n0;0;0\n", "header x,y,angle_deg"),
        ("x,y\n0,0\n", "header x,y,angle_deg"),
        ("x,y,angle_deg\n0,0\n", "line 2: 2 values"),
        ("x,y,angle_deg\n0,zero,0\n", "line 2: 'zero' is not a number"),
        ("x,y,angle_deg\n0,nan,0\n", "line 2: nan is not a finite number"),
        ("", "header"),
    ],
)
def test_bad_csv_is_refused_with_its_line(tmp_path, content, words):
    (tmp_path / "p.csv").write_text(content)
    text = EXAMPLE.read_text()
    head, tail = text.split("[effectors.P]")
    body = '[effectors.P]\nposes_csv = "p.csv"\n[effectors.Q]' + tail.split("[effectors.Q]")[1]
    (tmp_path / "t.toml").write_text(head + body)
    with pytest.raises(TaskError, match=re.escape(words)):
        Task.from_file(tmp_path / "t.toml")


def test_standard_input(monkeypatch):
    monkeypatch.setattr(sys, "stdin", SimpleNamespace(buffer=io.BytesIO(EXAMPLE.read_bytes())))
    task = Task.from_file("-")
    assert task == Task.from_file(EXAMPLE) and task.where == "standard input"


BAD = [
    (
        "mechanism",
        "watt2-two-efectors",
        "there is no mechanism 'watt2-two-efectors'; did you mean watt2-two-effectors?",
    ),
    ("mechanism", None, "mechanism: missing; name one of"),
    ("mechanism", 7, "mechanism: 7 is not a text"),
    ("titel", "x", "titel: unknown key; did you mean title?"),
    ("title", "a\nb", "control characters"),
    ("constraint", {}, "did you mean constraints?"),
    ("poses", [], "moves 2 bodies; write [effectors.P] and [effectors.Q]"),
    ("effectors", None, "effectors: missing"),
    ("effectors", 3, "effectors: 3 is not a table"),
    ("effectors.R", {}, "effectors.R: unknown key"),
    ("effectors.Q", None, "Q is missing"),
    ("effectors.P.pose", [], "did you mean poses?"),
    ("effectors.P.poses", "many", "is not a list"),
    (
        "effectors.P.poses",
        [],
        "effectors.P.poses: missing; write poses = [{x = 0.0, y = 0.0, angle_deg = 0.0}, …]",
    ),
    ("effectors.P.poses.1", 3, "effectors.P.poses[1]: 3 is not a table"),
    ("effectors.P.poses.1.x", float("nan"), "effectors.P.poses[1].x: nan is not a finite number"),
    ("effectors.P.poses.1.x", float("inf"), "is not a finite number"),
    ("effectors.P.poses.1.x", 10**400, "is not a finite number"),
    ("effectors.P.poses.1.x", "15", "'15' is text where a number is needed; write it without quotes"),
    ("effectors.P.poses.1.x", True, "True is not a number"),
    ("effectors.P.poses.1.y", None, "effectors.P.poses[1]: y is missing"),
    (
        "effectors.P.poses.1.angle",
        30,
        "effectors.P.poses[1].angle: an angle needs its unit; did you mean angle_deg",
    ),
    ("effectors.P.poses.1.angle_rad", 0.3, "did you mean angle_deg (in degrees)?"),
    ("effectors.P.poses.1.angle_deg", None, "angle_deg is missing"),
    ("effectors.P.poses.1", {"x": 0, "y": 0.0, "angle_deg": 360}, "pose 0 and pose 1 are the same"),
    ("effectors.P.points", [{"x": 1, "y": 2}], "is synthesised for poses, not for points"),
    ("effectors.P.poses_csv", "a.csv", "give either poses or poses_csv, not both"),
    ("free.eta2", -15.0, "free.eta2: an angle needs its unit; did you mean eta2_deg (in degrees)?"),
    ("free.eta4_deg", -15.0, "free.eta4_deg: unknown key; did you mean"),
    ("free.eta2_deg", "-15", "is text where a number is needed"),
    ("free.eta2_deg", [1.0], "is not a range; write [lowest, highest]"),
    ("free.eta2_deg", [3.0, 1.0], "the range [3, 1] is empty"),
    ("free", [1], "free: [1] is not a table; write [free]"),
    ("constraints.min_transmission", 30, "did you mean min_transmission_deg (in degrees)?"),
    ("constraints.min_transmission_deg", 100, "100 is out of range; it lies between 0 and 90"),
    ("constraints.max_link_ratio", 0.5, "out of range"),
    ("constraints.pivots_in", {"z": [0, 1]}, "constraints.pivots_in.z: unknown key"),
    ("constraints.pivots_in", {"x": [0, 1, 2]}, "is not a range"),
    ("constraints.pivots_in", {}, "an empty box"),
    ("constraints.full_rotation", 1, "neither true nor false"),
    ("constraints.input", "crnk", "has no input 'crnk'; did you mean crank?"),
    ("solve.seed", -1, "is not a whole number from 0"),
    ("solve.seed", 1.5, "is not a whole number"),
    ("solve.sed", 1, "did you mean seed?"),
    ("solve.start", "total", "there is no start system"),
    ("solve.samples", 1, "is not a whole number from 16"),
    ("solve.\n\x1b[31m", 1, "solve.??[31m: unknown key"),
]


@pytest.mark.parametrize(("path", "value", "words"), BAD, ids=[f"{path}={value!r:.20}" for path, value, _ in BAD])
def test_what_is_wrong_is_said(path, value, words):
    assert words in refusal(changed(path, value))


def test_numbers_of_poses_must_agree():
    task = mapping()
    del task["effectors"]["Q"]["poses"][2]
    message = refusal(task)
    assert "P has 3 and Q has 2 poses" in message and "numbers must agree" in message


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"mechanism = ", "is not valid TOML"),
        (b"\xff\xfe\x00m", "is not UTF-8 text"),
        (b"a = 1\na = 2", "is not valid TOML"),
        (b"a = " + b"[" * 5000, "is not valid TOML"),
        (b"x" * 5_000_000, "is no task file"),
    ],
)
def test_broken_files(data, words):
    with pytest.raises(TaskError, match=words):
        read_toml(data, "task.toml")


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(TaskError, match="there is no task file"):
        Task.from_file(tmp_path / "none.toml")
    with pytest.raises(TaskError, match="is a folder"):
        Task.from_file(tmp_path)


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=12),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=12), inner, max_size=4),
    max_leaves=12,
)
PLACES = [path for path, _, _ in BAD if path not in ("effectors.Q",)] + [
    "effectors.Q",
    "solve",
    "constraints",
    "title",
]


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.sampled_from(PLACES), JSON)
def test_fuzzed_values_are_read_or_refused_and_never_evaluated(path, value):
    try:
        task = changed(path, value if value is not None else "none")
    except (KeyError, TypeError, IndexError):
        return
    before = copy.deepcopy(task)
    try:
        read = Task.from_dict(task)
    except TaskError as error:
        assert "\n" not in str(error)
    else:
        assert Task.from_dict(read.to_dict()) == read
    assert repr(task) == repr(before)


@settings(max_examples=300, deadline=None)
@given(st.binary(max_size=200) | st.text(max_size=200).map(str.encode))
def test_fuzzed_files_are_read_or_refused(data):
    try:
        Task.from_dict(read_toml(data, "task.toml"))
    except TaskError as error:
        assert "\n" not in str(error)


@settings(max_examples=150, deadline=None)
@given(st.data())
def test_fuzzed_text_of_the_example(data):
    """The example with a piece cut out, doubled or replaced is read or refused, and nothing else happens."""
    text = EXAMPLE.read_text()
    a, b = sorted((data.draw(st.integers(0, len(text))), data.draw(st.integers(0, len(text)))))
    middle = data.draw(
        st.sampled_from(["", text[a:b] * 2, "nan", "'", "[", "__import__('os')", "1e999", "-", "\n"])
    )
    try:
        Task.from_toml(text[:a] + middle + text[b:])
    except TaskError as error:
        assert "\n" not in str(error)
