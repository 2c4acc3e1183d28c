"""Designs: measured against the task, kept in documents without loss, counted in a funnel that adds up."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace

import numpy as np
import pytest
from watt2_zoo import three_pose_task

from mechanisms import Linkage, Result, TaskError, synthesize
from mechanisms.designs import Design, funnel, measured_errors, rank
from mechanisms.documents import linkage_document, linkage_from_document
from mechanisms.linkage import Gear, Input, PinSlot, Slider
from solvers.store import RunFile, StoreError


@pytest.fixture(scope="module")
def result():
    return synthesize(three_pose_task(-31.70257), seed=1)


def test_json_has_the_promised_keys(result):
    document = json.loads(json.dumps(result.as_dict(), allow_nan=False))
    assert set(document) >= {"task", "mechanism", "seed", "version", "ledger", "roots", "funnel", "designs"}
    assert set(document["ledger"]) == {"tracked", "finite", "singular", "at_infinity", "failed"}
    assert set(document["roots"]) == {"count", "real", "certified", "certified_real", "complete", "evidence"}
    design = document["designs"][0]
    keys = {"id", "root", "accepted", "reasons", "parameters", "links", "pivots", "worst_pose_error"}
    assert set(design) >= keys | {"worst_angle_error_deg", "motion"}
    verdict = {"same_circuit", "same_branch", "in_order", "full_rotation", "min_transmission_deg"}
    assert set(design["motion"]) == {"crank", "P-rocker", "Q-rocker"}
    assert all(set(v) == verdict for v in design["motion"].values())
    assert design["parameters"]["W1"] == pytest.approx([-49.057079126, 83.162167651])


def test_a_design_survives_its_document(result):
    for design in result.designs:
        again = Design.from_document(json.loads(json.dumps(design.to_document(), allow_nan=False)))
        assert again.as_dict() == design.as_dict()
        assert again.linkage == design.linkage and list(again.poses) == list(design.poses)


def test_every_kind_of_joint_survives_its_document():
    linkage = Linkage(
        points={"O": 0, "A": 1j, "B": 2 + 1j, "C": 3, "P": 1 + 1j},
        links={"ground": ("O", "C"), "crank": ("O", "A"), "rod": ("A", "B", "P"), "block": ("B",), "arm": ("C",)},
        sliders=[Slider("ground", "block", 0.6 + 0.8j, "B")],
        slots=[PinSlot("arm", "P", 1j)],
        gears=[Gear({"crank": 2, "arm": -3})],
        bodies={"P": ("rod", "P")},
        inputs={"crank": Input("crank"), "push": Input("block", translation=True)},
        title="joints",
    )
    assert linkage_from_document(json.loads(json.dumps(linkage_document(linkage)))) == linkage


def test_a_run_file_gives_the_result_back(result, tmp_path):
    result.save(tmp_path / "run.db")
    again = Result.load(tmp_path / "run.db")
    assert again.as_dict() == result.as_dict()
    with RunFile.open(tmp_path / "run.db") as run:
        assert np.array_equal(run.chunks("roots")[0]["points"], result.solutions.points)


def test_a_damaged_run_file_is_refused(result, tmp_path):
    path = tmp_path / "run.db"
    result.save(path)
    with RunFile.open(path, write=True) as run:
        run.put("design", {"0": {"id": "D001"}})
    with pytest.raises(StoreError, match="is damaged"):
        Result.load(path)


def test_designs_are_in_the_run_file_as_they_are_judged(result, tmp_path, monkeypatch):
    """At every moment all whole batches are there; what a stopped run had judged is there in the end, ranked."""
    monkeypatch.setattr(sys.modules["mechanisms.synthesize"], "BATCH", 2)
    path, seen = tmp_path / "run.db", []

    def look(what, done, total):
        if what == "judging motion" and done == total:
            with RunFile.open(path) as run:
                seen.append(len(list(run.documents("design"))))
            if total >= 6:
                raise KeyboardInterrupt

    stopped = synthesize(three_pose_task(-31.70257), seed=1, run=path, progress=look)
    assert seen == [2, 4, 6] and stopped.state == "stopped"
    again = Result.load(path)
    assert again.as_dict() == stopped.as_dict() and len(again.designs) == 6
    whole = synthesize(three_pose_task(-31.70257), seed=1, run=path, resume=True)
    assert whole.as_dict() == result.as_dict()
    assert [d.id for d in Result.load(path).designs] == [d.id for d in rank(result.designs)]


def test_errors_are_measured_on_the_linkage_itself(result):
    design = result.accepted[0]
    assert design.worst_pose_error < 1e-10
    poses = [dict(pose) for pose in design.poses]
    poses[1]["P-coupler"] += 1e-3
    distance, angle = measured_errors(design.linkage, poses, result.task)
    assert angle == pytest.approx(1e-3, rel=1e-6) and distance > 1e-3
    shifted = three_pose_task(-31.70257).to_dict()
    shifted["effectors"]["Q"]["poses"][2]["x"] += 0.25
    distance, angle = measured_errors(design.linkage, design.poses, type(result.task).from_dict(shifted))
    assert distance == pytest.approx(0.25) and angle < 1e-9


def test_the_funnel_adds_up(result):
    for stage, after in zip(result.funnel, result.funnel[1:]):
        if after["stage"] not in ("designs", "accepted"):
            assert stage["left"] - sum(after["removed"].values()) == after["left"]
    assert result.funnel[-1]["left"] == len(result.accepted)


def test_constraints_have_their_own_lines_and_reasons(result):
    task = replace(
        result.task,
        constraints={"max_link_ratio": 20.0, "min_transmission_deg": 26.0, "pivots_in": {"x": (0.0, 100.0)}},
    )
    again = synthesize(task)
    reasons = {design.id: design.reasons for design in again.designs if design.linkage is not None}
    assert sorted(sum(reasons.values(), ())) == [
        "branch", "constraint:max_link_ratio", "constraint:min_transmission_deg",
        "constraint:min_transmission_deg",
        "constraint:pivots_in", "order",
    ]  # fmt: skip
    stages = [stage["stage"] for stage in again.funnel]
    order = ["constraint:max_link_ratio", "constraint:pivots_in", "one circuit", "constraint:min_transmission_deg"]
    assert [name for name in stages if name in order] == order


def test_any_input_accepts_what_works_with_one_of_them(result):
    task = replace(result.task, constraints={"input": "any"})
    again = synthesize(task)
    best = again.accepted[0]
    assert best.input == max(best.verdicts, key=lambda name: best.verdicts[name]["min_transmission_deg"])
    rocker = synthesize(replace(result.task, constraints={"input": "Q-rocker"}))
    assert all(design.input in ("Q-rocker", "") for design in rocker.designs)


def test_ranking():
    def made(name: str, reasons: tuple[str, ...], angle: float) -> Design:
        return Design(name, 0, reasons, verdicts={"c": {"min_transmission_deg": angle}}, input="c")

    designs = [
        made("D1", ("complex",), 0),
        made("D2", ("order",), 40),
        made("D3", (), 20),
        made("D4", (), 50),
    ]
    assert [design.id for design in rank(designs)] == ["D4", "D3", "D2", "D1"]


def test_funnel_of_a_task_without_polynomials():
    stages = funnel([Design("D001", None)], three_pose_task(), None)
    assert [stage["stage"] for stage in stages] == ["designs", "one circuit", "one branch", "in order", "accepted"]


def test_motion_of_a_design(result):
    design = result.accepted[0]
    assert design.motion("crank").reasons == ()
    assert design.motion().min_transmission_deg == pytest.approx(design.min_transmission_deg)
    with pytest.raises(ValueError, match="has no input"):
        design.motion("motor")
    hopeless = next(d for d in result.designs if d.linkage is None)
    with pytest.raises(ValueError, match="is no linkage"):
        hopeless.motion()


def test_fields_and_repr(result):
    design = result.accepted[0]
    fields = design.fields()
    assert fields["W1_x"] == pytest.approx(-49.057079126) and fields["O1_y"] == pytest.approx(-90.424814, abs=1e-6)
    assert math.isclose(fields["O1-A1"], abs(design.parameters["W1"]))
    assert repr(design) == f"Design({design.id}, accepted, transmission 27.6°)"
    assert repr(result) == "Result(watt2-two-effectors: 8 roots, 8 designs, 1 accepted)"


def test_bad_options_of_synthesize(result):
    with pytest.raises(TaskError, match="--jobs"):
        synthesize(result.task, jobs=0)
