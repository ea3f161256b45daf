"""`sixbar validate`: verdicts, exit codes, files. The models are those of `presses`."""

import html
import re
import shlex
from pathlib import Path

import pytest

PAIR = ["--models", "alpha,beta", "--jobs", "1"]
OUT = [*PAIR, "--out", "v"]
REASONS = {
    "fail": "newton-failed; try a smaller step",
    "refuse": "contact.law = 'hertz-corners' is not simulated yet",
    "nan": "slider_vy is nan in data row 8",
    "short": "0.394",  # s of 0.4
    "lacks": "slider_omega is missing",
    "arrays": "extrema or provenance: Object of type ndarray is not JSON serializable",
    "nothing": "columns must be a dict, not NoneType",
    "bug": "RuntimeError: index out of range",
}
VERDICTS = {"good": "agree", "vague": "indeterminate", "apart": "differ"}


@pytest.fixture(scope="module")
def report(make):
    """A report of scenes with all verdicts, and with runs that fail in several ways.

    One agrees, one has a coarse method, one a fault of a thousandth of the clearance.
    """
    sixbar = make()
    sixbar.write("v/tables/nan-beta.csv", "of an earlier call")
    settings = {"good": "", "vague": "tolerance = 1e-2", "apart": 'does = "differ"'}
    failures = [sixbar.press(does, beta=f'does = "{does}"') for does in REASONS]
    scenes = [sixbar.press(name, beta=beta) for name, beta in settings.items()]
    return sixbar, sixbar("validate", *failures, *scenes, "-v", *OUT, code=70)


def test_of_several_verdicts_the_worst_one_is_the_exit_code(report):
    """From the worst they are 70, 2, 1, 3, 0; indeterminate may be allowed. The runs are the report's."""
    sixbar, _ = report
    for command, code in (
        ("vague.toml -q", 3),
        ("vague.toml --allow-indeterminate", 0),
        ("good.toml --until 0.4", 0),
        ("good.toml --until 0.5", 3),  # its runs end before
        ("vague.toml apart.toml fail.toml", 2),
        ("vague.toml apart.toml", 1),
    ):
        process = sixbar("validate", *command.split(), *PAIR, "--out", "w", code=code)
        assert sixbar.json("w/summary.json")["exit_code"] == code
        assert (process.err, len(process.lines)) == ("", 2) or "-q" not in command
    assert [tag for tag, _ in sixbar.junit("w/junit.xml").values()].count("skipped") >= 3


def test_what_is_written_of_scenes_that_are_compared(report):
    sixbar, process = report
    assert process.lines[0].startswith("apart: ")  # the cause of the difference
    assert process.lines[-1] == "v/report.html"
    assert all(line.startswith("sixbar: ") for line in process.err.splitlines())  # progress
    assert "\x1b" not in process.out + process.err  # no colours in a pipe
    files = {path.name for path in (sixbar.folder / "v").iterdir() if "traceback" not in path.name}
    assert files == {"report.html", "summary.json", "junit.xml", "summary.md", "tables"}
    summary, cases = sixbar.json("v/summary.json"), sixbar.junit("v/junit.xml")
    assert (summary["exit_code"], summary["not_compared"]) == (70, [])
    names = " ".join(f"{name}.toml" for name in (*REASONS, *VERDICTS))
    assert summary["command"] == f"sixbar validate {names} --models alpha,beta"
    assert f"Made by: {summary['command']}" in sixbar.text("v/summary.md")
    by_name = {scene["name"]: scene for scene in summary["scenes"]}
    for name, verdict in VERDICTS.items():
        assert (by_name[name]["verdict"], by_name[name]["tier"]) == (verdict, "standard")
        assert [name, "standard", verdict] in [line.split()[:3] for line in process.lines]
        assert f"| {name} | standard | {verdict}" in sixbar.text("v/summary.md").replace("*", "")
    good = by_name["good"]
    assert set(good["provenance"]) >= {"alpha", "alpha finer", "alpha coarser", "alpha perturbed"}
    channel = good["channels"]["slider_x"]
    assert (channel["verdict"], channel["unit"], channel["explained"]) == ("agree", "m", 1.0)
    assert channel["ratio"] <= good["ratio"] <= 1
    assert {name.split()[-1] for suite, name in cases if suite == "good"} >= set(good["channels"])
    assert {tag for (suite, _), (tag, _) in cases.items() if suite == "good"} == {""}
    page = sixbar.text("v/report.html")
    assert "http://" not in re.sub(r"http://www\.w3\.org/\S+", "", page)  # needs no network


def test_a_difference_is_confirmed_and_stands_everywhere_in_one_sentence(report):
    sixbar, process = report
    scene = sixbar.json("v/summary.json")["scenes"][-1]
    assert scene["confirmation"]["outcome"] == "confirmed"
    sentence = scene["confirmation"]["sentence"]
    failures = [message for tag, message in sixbar.junit("v/junit.xml").values() if tag == "failure"]
    assert len(failures) >= 2
    assert any(sentence in message for message in failures)
    assert all(sentence in text for text in (process.out, sixbar.text("v/summary.md")))
    assert sentence.replace("'", "&#39;") in sixbar.text("v/report.html")
    # A thousandth of the clearance of 0.2 mm; numerical errors are 1e-4 of that.
    assert scene["channels"]["slider_x"]["max_difference"] == pytest.approx(2e-7, rel=1e-2)
    assert scene["channels"]["slider_x"]["outside"] > 0


def test_what_has_moved_since_an_earlier_report_is_named(sixbar):
    options = [*OUT, "--quick", "--since", "v"]
    sixbar.refusal(["validate", sixbar.press("one"), *options], "v: No such file")
    sixbar("validate", "one.toml", *OUT, "--quick")
    assert "nothing has moved" in sixbar("validate", "one.toml", *options).out
    time = sixbar.json("v/summary.json")["made"]["time"]
    path = sixbar.press("one", "[friction]\ncoefficient = 0.12\n", beta='does = "differ"')
    process = sixbar("validate", path, sixbar.press("two"), *options, "--json", code=1)
    assert f"Since v/summary.json, {time}" in process.err
    assert "friction.coefficient 0.15, now 0.12" in process.err
    assert "Not in the earlier report: two." in process.err
    page = sixbar.text("v/report.html").partition('id="since"')[2]
    for text in (process.err, page):
        assert "agree → differ" in text
    # Each channel that differs now, with its number then and now.
    first, _, second = f"{sixbar.numbers['scenes'][0]['channels']['slider_x']['ratio']:.1e}"[:3]
    cells = rf"<td>agree → differ</td><td>[\d.]+ → {first}\.?{second}"
    assert re.search(f"one, standard, slider_x</th>{cells}", page)
    sixbar.refusal(["validate", sixbar.press("three"), *options], "v/summary.json", "no scene 'three'")
    sixbar.write("v/summary.json", '{"scenes": [1]}')
    sixbar.refusal(["validate", path, *options], "v/summary.json", "not the results of a report")


@pytest.mark.parametrize("does", REASONS)
def test_a_scene_that_fails_leaves_the_others_compared_and_reported(does, report):
    sixbar, process = report
    (scene,) = (scene for scene in sixbar.json("v/summary.json")["scenes"] if scene["name"] == does)
    assert scene["verdict"] == "cannot compare"
    assert scene["reason"].startswith(f"scene '{does}': ")
    assert REASONS[does] in scene["reason"]
    assert "\n" not in scene["reason"]
    rows = [line.split()[:4] for line in process.lines if line.startswith(f"{does} ")]
    assert rows == [[does, "standard", "cannot", "compare"]]
    ((tag, message),) = [end for (suite, _), end in sixbar.junit("v/junit.xml").items() if suite == does]
    assert (tag, REASONS[does] in message) == ("error", True)
    # Part of a table and the traceback of a model are kept and named.
    run = f"{does}.standard-beta-base"
    files = {f"v/tables/{run}.partial.csv": ("fail",), f"v/{run}.traceback.txt": ("bug",)}
    for path, causes in files.items():
        assert (sixbar.folder / path).exists() == (path in process.out) == (does in causes)
    # A table of an earlier call would appear to belong to this report.
    assert not (sixbar.folder / f"v/tables/{does}-beta.csv").exists()


def test_each_command_of_a_report_repeats_the_changed_scene(sixbar):
    """The scene's name, and so its folder, differs from the file's."""
    sixbar.press("my scenes/own", beta='does = "differ"')
    base = ["my scenes/own.toml", "--set", "drive.speed_rpm=140", "--set", "drive.cycles=0.5"]
    options = ["--quick", "--models", "alpha,beta"]
    path = sixbar("validate", *base, *options, "--jobs", "1", code=1).lines[-1]
    (folder,) = (folder.name for folder in (sixbar.folder / "reports/out").iterdir())
    assert path == f"reports/out/{folder}/report.html"
    summary = sixbar.json(f"reports/out/{folder}/summary.json")
    (scene,) = summary["scenes"]
    assert (scene["name"], folder[:4]) == (folder, "own+")
    settings = scene["provenance"]["beta"]["scene"]
    assert settings["drive"] == {"speed_rpm": 140, "cycles": 0.5}
    lines = map(str.strip, html.unescape(re.sub("<[^>]+>", "\n", sixbar.text(path))).splitlines())
    first, *advice = dict.fromkeys(line for line in lines if line.startswith("sixbar "))
    assert (
        first == scene["command"] == summary["command"] == shlex.join(["sixbar", "validate", *base, *options])
    )
    assert [line.split()[1] for line in advice] == ["run", "run", "compare"]
    for command in advice:
        verb, *arguments = shlex.split(command)[1:]
        output = sixbar(verb, *arguments, code=3 if verb == "compare" else 0).lines[-1]
        if verb == "run":
            repetition = sixbar.json(output.replace(".csv", ".json"))["scene"]
            assert all(repetition[part] == settings[part] for part in ("drive", "mechanism", "contact"))


@pytest.fixture
def count_runs(sixbar):
    log = Path(sixbar.environment["PRESSES_LOG"])

    def count(*arguments):
        log.write_text("")
        sixbar("validate", *arguments, *OUT, "-q", "--quick")
        return len(log.read_text().splitlines())

    return count


def test_finished_runs_are_kept_but_for_a_change_of_the_physics_and_what_failed(sixbar, count_runs):
    """A failed run may succeed at the next call; here it is of the ideal mechanism, for the reliability."""
    path = sixbar.press("guided", beta='does = "free"')  # beta refuses a guide without clearance
    assert count_runs(path) > 10  # five of each model, and more
    sixbar.write(path, sixbar.text(path).replace("[scene]", '[scene]\ntitle = "B"'))
    assert count_runs(path) == 2
    (scene,) = sixbar.json("v/summary.json")["scenes"]
    assert (scene["title"], scene["reliability"]) == ("B", None)
    assert count_runs(path, "--set", "clearance.slider=3e-4") >= 10


def test_without_an_uncertainty_the_tolerance_of_the_scene_decides(sixbar):
    """An integer tolerance is not refined: TOML reads a whole number as an integer."""
    tolerance, exact, quick = "[compare]\ntolerance = 1e-9\n", "tolerance = 0", [*OUT, "--quick"]
    sixbar("validate", sixbar.press("one", tolerance, alpha=exact, beta=exact), *quick)
    path = sixbar.press("one", tolerance, alpha=exact, beta=f'{exact}\ndoes = "differ"')
    sixbar("validate", path, *quick, code=1)
    (scene,) = sixbar.json("v/summary.json")["scenes"]
    assert scene["confirmation"]["outcome"] == "unconfirmed"
    sixbar.refusal(["validate", path, *quick, "--accuracy", "1e-8"], "'1e-8'", "'alpha'")


def test_of_three_models_the_outlier_is_named(sixbar):
    """A model that fails leaves the others compared; one without an uncertainty leaves them undecided."""
    outcomes = {"odd": "outlier", "lost": "agree", "unsure": "undecided"}
    gammas = ('does = "differ"', 'does = "fail"', "tolerance = 0")
    paths = [sixbar.press(name, gamma=gamma) for name, gamma in zip(outcomes, gammas, strict=True)]
    three = ["--models", "alpha,beta,gamma", "--jobs", "1", "--quick", "--out", "v"]
    process = sixbar("validate", *paths, *three, code=2)
    summary = sixbar.json("v/summary.json")
    assert (summary["models"], summary["exit_code"]) == (["alpha", "beta", "gamma"], 2)
    assert {scene["name"]: scene["outcome"] for scene in summary["scenes"]} == outcomes
    assert [scene["outlier"] for scene in summary["scenes"]] == ["gamma", "", ""]
    pairs = {"alpha and beta": "agree", "alpha and gamma": "differ", "beta and gamma": "differ"}
    assert summary["scenes"][0]["verdicts"] == pairs
    assert process.lines[-1] == "v/report.html"
    for pair in ("alpha-beta", "alpha-gamma", "beta-gamma"):
        assert f'href="{pair}/report.html"' in sixbar.text("v/report.html")
        assert (sixbar.folder / "v" / pair / "report.html").is_file()


def test_both_models_agree_on_a_shipped_scene_at_both_tiers(sixbar):
    short = ["--set", "drive.cycles=0.02", "--accuracy", "draft"]
    process = sixbar("validate", "ideal", *short, "--jobs", "1", "--out", "v")
    assert [line.split()[1:3] for line in process.lines[1:3]] == [["standard", "agree"], ["tight", "agree"]]
    (scene,) = sixbar.json("v/summary.json")["scenes"]
    assert (scene["tight"]["tier"], "--accuracy draft" in scene["command"]) == ("tight", True)
    # Both follow one closed linkage: round-off of 0.2 m, and the tolerance of a method of Newton.
    assert scene["channels"]["slider_y"]["max_difference"] < 1e-10
