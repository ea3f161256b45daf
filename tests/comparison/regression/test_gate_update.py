"""Baselines made, refused and renewed."""

from __future__ import annotations

import json
import re
import tomllib
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pytest
from gate_command import edit, gate

from comparison.accuracy.levels import thresholds_record
from comparison.execution.run import VIOLATED
from comparison.regression import record
from comparison.regression.baseline import read
from comparison.scene import shipped_scenes

pytestmark = pytest.mark.usefixtures("elsewhere", "wide")


NONE = [
    ("^platform = .*", "", "platform is missing"),
    (r"^\[scenes(.|\n)*", "", "scenes is missing"),
    ("^platform = ", "platform ", "is not TOML text: "),
    ("^platform", "colour = 1\nplatform", "colour is not"),
    ("contacts = 1", "contacts = -1", "scenes.own.reference.tight.counters.contacts = -1 must be "),
    (r"slider_x = \[\n  \[[^]]*\]", "slider_x = [\n  [0.1, nan, 1.0]", "slider_x.0.1 = nan must be finite"),
    (r"slider_x = \[\n  \[[^]]*\]", "slider_x = [\n  [0.1, 0.2, 0]", "slider_x.0.2 = 0 must be > 0"),
    (r"reference.tight\]", "reference.loose]", "= 'loose' must be 'standard' or 'tight'"),
]


@pytest.mark.parametrize(("pattern", "by", "message"), NONE)
def test_a_baseline_that_is_none_is_one_line_and_exit_code_2(made, capsys, pattern, by, message):
    assert made.exists()
    edit(pattern, by)
    assert gate() == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("sixbar: sixbar-baseline.toml: ")
    assert message in err
    assert err.count("\n") == 1
    assert not Path("reports").exists()


@pytest.mark.parametrize(
    ("pattern", "by", "message"),
    [
        ("steps = 5", "steps = 6", "was changed since: its checksum does not match"),
        ("^checksum.*\n", "", "has no checksum"),
    ],
)
def test_a_baseline_that_is_not_as_it_was_written_is_refused(made, capsys, pattern, by, message):
    text, count = re.subn(pattern, by, made.read_text(), count=1, flags=re.MULTILINE)
    assert count == 1
    made.write_text(text)
    for arguments in ([], ["--update"]):
        assert gate(*arguments) == 2
        assert capsys.readouterr().err.startswith(f"sixbar: sixbar-baseline.toml: {message}")
    assert made.read_text() == text


def test_the_layout_of_a_baseline_does_not_count_nor_does_making_it_again_change_it(made):
    text = made.read_text()
    made.write_bytes(text.replace("\n", "\r\n").encode() + b"# checked\r\n")
    assert gate() == 0
    assert gate("--update") == 0
    assert made.read_text() == text


def test_a_scene_that_is_gone_is_dropped_by_an_update(made, scene_file, capsys):
    assert gate(scene_file("another"), "--update") == 0
    Path("own.toml").unlink()
    assert gate("--update") == 0
    assert list(tomllib.loads(made.read_text())["scenes"]) == ["another"]
    assert "scene 'own' of the old baseline no longer exists" in capsys.readouterr().err


def test_a_scene_is_found_from_the_folder_of_the_baseline(scene_file):
    assert gate(scene_file("own"), "--baseline", "deep/base.toml", "--update") == 0
    assert tomllib.loads(Path("deep/base.toml").read_text())["scenes"]["own"]["source"] == "../own.toml"
    assert gate("--baseline", "deep/base.toml") == 0


def test_an_update_that_fails_leaves_the_baseline_alone(made, scene_file, gravity, capsys):
    before = made.read_text()
    scene_file("own", gravity.refuse)
    assert gate("--update") == 2
    assert "scene 'own': contact.law = 'foundation' is not simulated yet" in capsys.readouterr().err
    assert made.read_text() == before


def rates(changes: dict[str, object] | None = None) -> None:
    record.RATES.parent.mkdir(parents=True, exist_ok=True)
    measured = {
        "false_alarms": {"count": 0, "runs": 300, "upper95": 0.00994},
        "detected": {"tight": {"faults": 25, "detected": 24, "interval_95": [0.8046, 0.9989]}},
        "thresholds": thresholds_record(),
    }
    record.RATES.write_text(json.dumps(measured | (changes or {})))


def test_thresholds_change_only_together_with_rates_measured_anew(made, monkeypatch, capsys):
    rates()
    assert gate("--update") == 0
    detection = tomllib.loads(made.read_text())["detection"]
    assert detection["false_alarms"] == {"count": 0, "runs": 300, "upper95": 0.00994}
    assert detection["detected"]["tight"]["interval_95"] == [0.8046, 0.9989]
    record.RATES.unlink()
    assert gate("--update") == 0  # the thresholds are the same: so are the rates
    assert tomllib.loads(made.read_text())["detection"] == detection
    changed = thresholds_record() | {"k": 3.0}
    for module in ("check", "record"):
        monkeypatch.setattr(f"comparison.regression.{module}.thresholds_record", lambda: changed)
    capsys.readouterr()
    assert gate() == 1
    assert "thresholds.toml is not what the baseline was made with" in capsys.readouterr().out
    assert gate("--update") == 2
    assert "is required, with newly measured rates" in capsys.readouterr().err
    rates()
    assert gate("--update") == 2
    assert "measured with other thresholds" in capsys.readouterr().err
    rates({"thresholds": changed})
    assert gate("--update") == 0
    assert gate() == 0


@pytest.mark.usefixtures("made")
def test_rates_that_are_none_are_refused(capsys):
    rates({"detected": {"count": "many"}})
    assert gate("--update") == 2
    assert "detection.json: detected.count" in capsys.readouterr().err
    for text in ("{", "[" * 100_000):
        record.RATES.write_text(text)
        assert gate("--update") == 2
        assert "detection.json: is " in capsys.readouterr().err


def test_a_coarser_run_may_violate_an_invariant_as_it_may_in_a_comparison(scene_file, monkeypatch, capsys):
    """What it gets wrong widens the thresholds; the gated run itself must hold its invariants."""
    scene_file("own")
    run_all = record.run_all

    def violating(*kinds: int):
        def run(jobs, *more):
            outcomes = run_all(jobs, *more)
            for kind in kinds:  # of the first family: base, finer, coarser
                outcomes[kind] = replace(
                    outcomes[kind], status=VIOLATED, table=None, partial=outcomes[kind].table
                )
            return outcomes

        return run

    monkeypatch.setattr(record, "run_all", violating(2))
    assert gate("own.toml", "--update") == 0
    monkeypatch.setattr(record, "run_all", violating(0))
    assert gate("own.toml", "--update") != 0
    assert VIOLATED in capsys.readouterr().err


def test_the_baseline_of_this_project_holds_every_shipped_scene_and_is_small():
    path = Path(str(files("comparison"))).parent / "sixbar-baseline.toml"
    baseline = read(path)
    assert list(baseline.scenes) == shipped_scenes()
    assert baseline.thresholds == thresholds_record()
    assert {len(scene.runs) for scene in baseline.scenes.values()} == {2, 3}
    assert path.stat().st_size < 150_000  # a reader's patience with a difference of two versions
