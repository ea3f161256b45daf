"""``sixbar settings``: within its time, interrupted, and what it recommends. The models are fakes."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from comparison.accuracy import work_precision
from comparison.cli import main
from comparison.tables.table_files import read

pytestmark = pytest.mark.usefixtures("fake_models", "wide")


def test_what_it_recommends_runs_and_keeps_its_error(scene_file, fake_model, capsys):
    path = scene_file("own")
    assert main(["settings", path, "--set", "drive.cycles=1", "--out", "deep/wp.svg", "-q"]) == 0
    *lines, picture = capsys.readouterr().out.splitlines()
    assert "errors of slider_x against reference minimal, tolerance 1e-13, where exudyn tree" in lines[0]
    assert Path(picture).read_text().startswith("<svg")
    pairs = [(line, lines[n + 1]) for n, line in enumerate(lines) if line.endswith("processor time:")]
    assert pairs
    for said, command in pairs:
        smallest = float(said.split(" m on ")[0].split(" to ")[-1])
        assert main([*shlex.split(command)[1:], "-q"]) == 0
        assert "--set drive.cycles=1 " in command
        table = read("own+drive.cycles=1.csv")
        right = fake_model.signals(table.provenance["scene"])["slider_x"]
        assert np.abs(table.values("slider_x") - right).max() <= smallest
        capsys.readouterr()


def test_without_time_nothing_is_known(scene_file, capsys):
    assert main(["settings", scene_file("own"), "--seconds", "1e-9", "-q"]) == 0
    heading, _, *rows = capsys.readouterr().out.splitlines()
    assert heading == "no two runs have a result: errors are unknown"
    assert {row.split("  ")[-1].strip() for row in rows} == {"not begun"}


def test_an_interrupt_prints_what_was_measured(scene_file, monkeypatch, capsys):
    def interrupted(attempt, tasks, *_, **__):
        for number, (name, task) in enumerate(tasks):
            if number == 5:
                raise KeyboardInterrupt
            yield name, attempt(task, lambda _: None)

    monkeypatch.setattr(work_precision, "work", interrupted)
    assert main(["settings", scene_file("own"), "-q"]) == 130
    out, err = capsys.readouterr()
    assert err == "sixbar: interrupted; the other settings were not measured\n"
    assert "sixbar run" in out
    assert out.count("reference minimal, tolerance") + out.count("exudyn") > 15
    assert "1e-13" in out.split("not begun")[0]
