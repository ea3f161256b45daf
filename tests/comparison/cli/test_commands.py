"""What commands do that the black-box tests of tests/cli cannot ask: faults, batches, changed scenes.

The models are fakes.
"""

import html
import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from comparison.accuracy import work_precision
from comparison.cli import main
from comparison.formatting import number
from comparison.models import MODELS
from comparison.scene import load_scene, parse_set
from comparison.verdict import confirmation
from comparison.verdict import validate as judge
from comparison.verdict.overall import Departure
from comparison.verdict.results import no_comparison
from comparison.verdict.validate import Validation

pytestmark = pytest.mark.usefixtures("fake_models", "wide")


def summary(folder="v"):
    return json.loads(Path(folder, "summary.json").read_text())["scenes"]


def validate(*arguments):
    """One worker: starting another costs more than the fakes' runs."""
    return main(["validate", "--jobs", "1", *arguments])


def last_page(capsys):
    return Path(capsys.readouterr().out.splitlines()[-1])


def commands(page):
    """Return the lines of a page that are commands."""
    plain = html.unescape(re.sub(r"<[^>]+>", "\n", page.read_text()))
    return [line.strip() for line in plain.splitlines() if line.strip().startswith("sixbar ")]


def run(path, *options):
    return main(["run", path, "--model", "exudyn", "--formulation", "tree", "--out", "a.csv", "-q", *options])


@pytest.mark.parametrize(("what", "code"), [("fail", 2), ("crash", 70)])
def test_where_no_run_reaches_an_accuracy_it_fails_as_a_single_one_does(
    scene_file, gravity, capsys, what, code
):
    assert run(scene_file("own", getattr(gravity, what)), "--accuracy", "1e-8") == code
    assert capsys.readouterr().err.count("\n") == 1
    left = ["a.partial.csv", "a.partial.events.csv", "a.partial.json"] if what == "fail" else []
    assert sorted(path.name for path in Path.cwd().iterdir()) == left


def test_without_time_nothing_is_known_of_settings_and_an_interrupt_prints_what_is(
    scene_file, monkeypatch, capsys
):
    assert main(["settings", scene_file("own"), "--seconds", "1e-9", "-q"]) == 0
    heading, _, *rows = capsys.readouterr().out.splitlines()
    assert heading == "no two runs have a result: errors are unknown"
    assert {row.split("  ")[-1].strip() for row in rows} == {"not begun"}

    def interrupted(attempt, tasks, *_, **__):
        for count, (name, task) in enumerate(tasks):
            if count == 5:
                raise KeyboardInterrupt
            yield name, attempt(task, lambda _: None)

    monkeypatch.setattr(work_precision, "work", interrupted)
    assert main(["settings", scene_file("own"), "-q"]) == 130
    out, err = capsys.readouterr()
    assert err == "sixbar: interrupted; the other settings were not measured\n"
    assert "1e-13" in out.split("not begun")[0]


# ---- validate


@pytest.mark.parametrize(("what", "count"), [("differ", 3), ("fail", 1), ("crash", 1)])
def test_each_command_of_the_report_repeats_the_changed_scene(what, count, gravity, scene_file, capsys):
    Path("my scenes").mkdir()
    path = shutil.copy(scene_file("own", extra="[drive]\ncycles = 1\n"), "my scenes")
    changes = [f"environment.gravity={getattr(gravity, what)}", "mechanism.rocker_pivot=[0.2568, 0.21]"]
    options = [word for change in changes for word in ("--set", change)]
    code = validate(path, "--quick", "-q", *options)
    asked = load_scene(path, parse_set(changes))
    own, *advice = dict.fromkeys(commands(last_page(capsys)))
    assert own == asked.command("validate", "--quick")
    assert len(advice) == count
    for command in advice:
        _, verb, source, *options = shlex.split(command)
        if verb == "compare":
            assert main([verb, source, *options]) in (1, 3)
            continue
        again = load_scene(source, parse_set(options[1 : options.index("--model") : 2]))
        for section in ("environment", "mechanism", "drive"):
            assert again.data[section] == asked.data[section]
        # The run that failed fails again; each other one is made.
        assert main([verb, source, *options, "-q"]) == (code if what != "differ" else 0)
    if what != "differ":
        assert capsys.readouterr().err.count("did not succeed") == 1


def test_an_indeterminate_scene_is_looked_at_again_at_finer_settings(scene_file, capsys):
    path = scene_file("coarse", extra="[solver.exudyn]\nstep = 1e-3\n")
    assert validate(path, "--set", "drive.cycles=1", "--quick", "-q") == 3
    finer = load_scene(path, {"drive.cycles": 1}).command("validate", "--quick", "--accuracy", "strict")
    assert finer in commands(last_page(capsys))
    assert validate(*shlex.split(finer)[2:], "-q") == 0


def test_one_ratio_on_the_console_in_the_report_and_in_the_files(scene_file, gravity, capsys):
    """The rule's: what 99 % of the judged samples stay within. The maximum is called so."""
    for name, value in (("good", gravity.normal), ("bad", gravity.differ)):
        validate(scene_file(name, value), "--quick", "--out", name)
        out = capsys.readouterr().out
        heading, line, *_ = out[out.index("scene  tier") :].splitlines()  # after the cause, if there is one
        start = heading.index("|E|/2u (99%)")
        shown = line[start : start + 12].strip()
        (scene,) = summary(name)
        assert number(scene["ratio"], 2) == shown
        assert (scene["ratio"] <= 1) == (scene["verdict"] == "agree")
        assert max(each["ratio"] or 0.0 for each in scene["channels"].values()) == scene["ratio"]
        assert f"{scene['decisive_channel']}, |E|/2u (99%) = {shown}: " in scene["reason"]
        page = Path(name, "report.html").read_text()
        assert f"<b>{shown}</b>" in page


@pytest.mark.parametrize(
    ("options", "said"),
    [([], True), (["--accuracy", "draft"], False), (["--models", "exudyn,reference"], False)],
)
def test_it_says_last_where_a_verdict_is_not_the_one_on_record(options, said, capsys, monkeypatch):
    """Of the scenes as they are shipped at their own settings: with others verdicts may well be others."""
    departed = Departure("ideal", "tight", "agree", "differ")
    monkeypatch.setattr("comparison.verdict.validate.departures", lambda *_: [departed])
    assert validate("ideal", "--out", "v", *options) == 0
    *_, before, page = capsys.readouterr().out.splitlines()
    assert Path(page).is_file()
    assert ("ideal, tight: agree, not differ" in before) == said


def test_a_fault_in_one_scene_costs_that_scene_alone(scene_file, monkeypatch, capsys):
    usual = judge.validate

    def faulty(scenes, **options):
        if any(scene.name == "two" for scene in scenes):
            raise ZeroDivisionError("a\nb")
        return usual(scenes, **options)

    monkeypatch.setattr(judge, "validate", faulty)
    files = [scene_file(name) for name in ("one", "two", "three")]
    assert validate(*files, "--quick", "--out", "v", "--jobs", "8") == 70
    assert [scene["verdict"] for scene in summary()] == ["agree", "cannot compare", "agree"]
    reason = "scene 'two': internal error: ZeroDivisionError: a b at test_commands"
    assert summary()[1]["reason"].startswith(reason)
    assert "internal error" in Path("v/report.html").read_text()
    assert "three  standard  agree" in capsys.readouterr().out


def test_as_many_scenes_at_a_time_as_keep_the_workers_busy_and_the_share_only_grows(monkeypatch):
    names = ["ideal", "wedge", "crank-pin", "69GPa", "surface"]
    sizes, shares = [], []

    def judged(batch, *, on_progress, tiers, **_):
        sizes.append((len(batch), len(tiers)))
        for share in (0.0, 1.0, 0.2):  # an ensemble starts anew
            on_progress(share)
        return [
            Validation(no_comparison(scene, "none", labels=MODELS, command="", tier="standard"))
            for scene in batch
        ]

    monkeypatch.setattr(judge, "validate", judged)
    monkeypatch.setattr("comparison.cli.console._silence", lambda share, _="": shares.append(share))
    assert validate(*names, "--set", "drive.cycles=1", "--jobs", "4", "-q", "--out", "v") == 2
    assert sizes == [(1, 1), (2, 2), (2, 2), (1, 2)]  # a first verdict at one tier
    assert [scene["name"] for scene in summary()] == [f"{name}+drive.cycles=1" for name in names]
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)


def confirmations(capsys):
    """The sentences on the console, of `--verbose`: a paragraph each."""
    sentences = re.findall(r"^ {4}confirmation +(.*)$", capsys.readouterr().out, re.MULTILINE)
    return [" ".join(text.split()) for text in sentences]


def test_an_uncertainty_that_was_too_small_by_chance_is_no_difference(scene_file, gravity, capsys):
    assert validate(scene_file("lucky", gravity.lucky), "--out", "v", "-v") == 0
    (scene,), page = summary(), Path("v/report.html").read_text()
    for tier, sentence in zip((scene, scene["tight"]), confirmations(capsys), strict=True):
        assert sentence.startswith("no difference of models, the uncertainty was underestimated by a ")
        assert (tier["verdict"], tier["confirmation"]["outcome"]) == ("agree", "underestimated")
        assert tier["confirmation"]["sentence"] == sentence
        assert sentence in page
    # At the tight tier u was some 1e-10 and the ensemble is 1e-5 wide.
    assert scene["tight"]["confirmation"]["suspicious"]
    assert f'<p class="warning"><b>{sentence}' in page
    assert "2 of these verdicts rest on a corrected uncertainty." in page


def test_an_ensemble_whose_runs_break_an_invariant_confirms_nothing(scene_file, gravity, monkeypatch, capsys):
    usual = confirmation.moved_starts

    def starts(scene, model, shift):
        bad = {"environment.gravity": gravity.violate}
        moved = usual(scene, model, shift)
        return [s.with_values(bad if model == "exudyn" and n >= 5 else {}) for n, s in enumerate(moved)]

    monkeypatch.setattr(confirmation, "moved_starts", starts)
    assert validate(scene_file("apart", gravity.differ), "--out", "v", "-v") == 1
    standard, tight = confirmations(capsys)
    # Five bodies at the standard tier have no ensemble of their own, the tree at the tight one has.
    assert "by 99 reference runs from moved starts: the exudyn run is outside those of reference" in standard
    assert "differ (unconfirmed, 5 runs) from" in tight
    assert tight.endswith("fewer than 19 runs from moved starts succeeded")


PAIRS = ["--models", "reference,exudyn,third", "--out", "all", "--quick"]


def test_each_model_runs_once_for_all_its_pairs_which_an_interruption_ends(
    fake_models, install, scene_file, monkeypatch, capsys
):
    """The third does what the fake reference does, under another name."""
    install("third_press", "from reference_model import simulate\n", {"third": "third_press:simulate"})
    scene = scene_file("same", extra="[solver.third]\ntolerance = 1e-9\n")
    assert validate(scene, "--models", "reference,exudyn", "--out", "two", "--quick") == 0
    before = fake_models.read_text().count("exudyn ")
    assert before > 3
    assert validate(scene, *PAIRS) == 0
    assert fake_models.read_text().count("exudyn ") == before
    assert summary("all")[0]["outcome"] == "agree"
    Path("all/summary.json").unlink()
    asked = []

    def interrupted(*_, models, **__):
        asked.append(models)
        raise KeyboardInterrupt

    monkeypatch.setattr(judge, "validate", interrupted)
    assert validate(scene, *PAIRS) == 130
    assert asked == [("reference", "exudyn")]
    assert not Path("all/summary.json").exists()
    assert capsys.readouterr().err.endswith("sixbar: interrupted; finished runs are cached\n")
