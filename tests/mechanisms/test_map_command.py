"""``everylinkage map``: files written, and refusals of one line."""

from __future__ import annotations

import pytest

from mechanisms.cli import main

FOUR = "examples/four_bar_four_poses.toml"


def test_a_map_is_written_with_the_pair_picked(tmp_path, capsys):
    path = tmp_path / "map.svg"
    assert main(["map", FOUR, "-o", str(path), "--pick", "79", "65"]) == 0
    assert "13 % of the pairs" in capsys.readouterr().err
    assert path.read_text(encoding="utf-8").startswith("<?xml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["examples/four_bar_five_poses.toml"], "four poses"),
        ([FOUR, "-o", "map.gif"], "cannot draw .gif"),
        ([FOUR, "-o", "nowhere/map.svg"], "there is no folder nowhere"),
        ([FOUR, "--pick", "79", "250"], "there is no dyad 250"),
    ],
)
def test_what_has_no_map_is_refused_in_one_line(arguments, words, capsys, tmp_path, monkeypatch):
    assert main(["map", *arguments]) == 2
    captured = capsys.readouterr()
    assert words in captured.err
    assert "Traceback" not in captured.err
    assert captured.out == ""
