"""Studies as a whole, with fake models: what they write, that they resume, and how they show what failed."""

import re
import shutil
import sys
import tomllib
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import fake_model
import numpy as np
import pandas as pd
import pytest

from comparison.accuracy.uncertainty import Runs
from comparison.cli import main, reports
from comparison.execution.pool import kept_workers
from comparison.models import GROUP, platform_name
from comparison.report import svg
from comparison.scene import load_scene, shipped_scenes
from comparison.studies import MOVED, NAMES
from comparison.studies.paper import MAIN, PARTS
from comparison.studies.verdicts import study as verdicts
from comparison.verdict.compare import compare

OTHER_FILES = {
    "extremes": "cells.csv",
    "paper": "printed.csv judged.csv instants.csv forms.csv solver.csv statements.csv criteria.csv",
    "paper/identification": "arrangements.csv peaks.csv",
    "paper/laws": "runs.csv",
    "paper/nonlinear": "exponents.csv",
    "paper/reliability": "differences.csv",
    "trust": "trust.csv trust.json",
    "tradeoff": "settings.csv measured.toml",
    "truth": "truth.csv",
    "verdicts": "verdicts.toml",
}
"""Study, or paper and its part -> its files beside page and pictures."""
UNLINKED = ["verdicts.toml", "measured.toml"]


@pytest.fixture(scope="module")
def fakes(fakes):
    """Fake models, and a fake truth engine beside them."""

    @contextmanager
    def all_fakes(folder, monkeypatch):
        with fakes(folder, monkeypatch) as log:
            package, info = (folder / "fakes" / name for name in ("truth_press", "truth_press.dist-info"))
            for each in (package, info):
                each.mkdir(exist_ok=True)
            shutil.copy(fake_model.__file__, package / "__init__.py")
            (info / "METADATA").write_text("Metadata-Version: 2.1\nName: truth_press\nVersion: 1\n")
            (info / "entry_points.txt").write_text(f"[{GROUP}]\ntruth = truth_press:simulate\n")
            monkeypatch.delitem(sys.modules, "truth_press", raising=False)
            yield log
            sys.modules.pop("truth_press", None)

    return all_fakes


@pytest.fixture(scope="module")
def folder(fakes, tmp_path_factory):
    """Where `make reports` wrote all studies of fake models, small."""
    folder = tmp_path_factory.mktemp("studies")
    (folder / "README.md").write_text(f"before {reports.BEGIN} formerly {reports.END} after", "utf-8")
    (folder / "comparison" / "verdict").mkdir(parents=True)
    # Most of the time processes would start; nothing that they import changes meanwhile.
    with pytest.MonkeyPatch.context() as monkeypatch, fakes(folder, monkeypatch), kept_workers():
        monkeypatch.chdir(folder)
        reports.main(small=True)
    return folder


@pytest.mark.parametrize("name", OTHER_FILES)
def test_a_study_writes_page_figures_and_tables_and_a_second_call_runs_nothing(
    name, folder, fakes, monkeypatch, capsys
):
    study, _, part = name.partition("/")
    page = folder / "reports" / (f"{name}.md" if part else f"{name}/README.md")
    text = page.read_text("utf-8")
    assert not re.search(r"\{\w*\}|\bnan\b", text)
    beside = f"{part}/" if part else ""
    linked = set(re.findall(rf"\]\({beside}([\w.-]+\.(?:svg|csv|json|html))\)", text))
    pictures = {file for file in linked if file.endswith(".svg")}
    written = {path.name: path for path in (folder / "reports" / name).iterdir() if path.suffix != ".md"}
    for path in [path for path in written.values() if path.is_dir()]:
        assert f"paper/{path.name}" in OTHER_FILES
        del written[path.name]
    assert written.keys() == {*OTHER_FILES[name].split(), *pictures}
    assert written.keys() - linked <= set(UNLINKED)
    for picture in pictures:
        drawn = written[picture].read_text("utf-8")
        assert drawn.count("<path") > 10
        assert any(colour in drawn for colour in (svg.FIRST, svg.SERIES[0], svg.SERIES[3], svg.OUTSIDE))
    if name == "verdicts":  # which has the day, and takes longest
        return
    monkeypatch.setattr(svg, "write_svg", lambda _, path: path.touch())  # the same results: drawn once
    with fakes(folder, monkeypatch) as log:
        monkeypatch.chdir(folder)
        runs = log.read_text()
        assert runs.count("\n") > 1000
        chosen = ["--part", part or MAIN] if study == "paper" else []
        assert main(["study", study, "--small", *chosen]) == 0
        assert log.read_text() == runs
    again = Path("reports/out", f"{name}.md" if part else f"{name}/README.md")
    assert capsys.readouterr().out == f"{again}\n"
    assert again.read_bytes() == page.read_bytes()
    for path in written.values():
        same = folder / "reports" / "out" / name / path.name
        assert path.suffix == ".svg" or path.read_bytes() == same.read_bytes()


def test_a_study_that_is_a_part_now_says_so_and_a_part_that_is_none_is_refused(capsys):
    for name, words in MOVED.items():
        assert main(["study", name, "--small", "--jobs", "1"]) == 2
        assert f": sixbar study {words}\n" in capsys.readouterr().err
        study, _, part = words.partition(" --part ")
        assert study in NAMES
        assert part in ("", *PARTS)
    assert main(["study", "paper", "--part", "nonlinera"]) == 2
    assert "'nonlinera'" in capsys.readouterr().err


def test_all_studies_their_list_and_the_table_of_the_readme(folder):
    listed = (folder / "reports" / "README.md").read_text("utf-8")
    links = re.findall(r"^## \[.+\]\((.+)\)$", listed, re.MULTILINE)
    parts = [f"paper/{part}.md" for part in PARTS if part != MAIN]
    assert sorted(links) == sorted([f"{name}/README.md" for name in NAMES] + parts)
    for section in listed.split("\n## ")[1:]:
        _, finding, *pictures = section.strip().split("\n\n")
        assert finding.endswith(".")
        assert all((folder / "reports" / re.findall(r"\]\((.+)\)$", each)[0]).is_file() for each in pictures)
    readme = (folder / "README.md").read_text("utf-8")
    assert re.search(r"\| 150 rpm, 0.2 mm clearance \| \*\*agree\*\* \| \*\*agree\*\* \|", readme)
    assert "formerly" not in readme
    # Machine, versions and date stand below the table, and with the verdicts on record.
    recorded = tomllib.loads((folder / "comparison" / "verdict" / "verdicts.toml").read_text("utf-8"))
    made = f"Made on {recorded['made']['machine']}; {recorded['made']['date']}.\n"
    assert made in readme
    assert platform_name() in made
    assert f"numpy {np.__version__}" in made
    known = recorded["scenes"]["150rpm-0.2mm"]
    assert known == {"hash": load_scene("150rpm-0.2mm").hash, "standard": "agree", "tight": "agree"}
    assert list(recorded["scenes"]) == shipped_scenes()


def test_a_line_of_the_verdicts_tells_both_tiers_and_what_is_missing(scene, make_table):
    def compared(tier, apart):
        sides = [
            Runs(*(make_table(part * error) for part in (1, 0.25, 4, 4, 4))) for error in (1e-8, 1e-8 + apart)
        ]
        return compare(*sides, scene=scene, labels=("reference", "exudyn"), tier=tier)

    usual = compared("standard", 1e-6)
    line = verdicts.row(replace(usual, tight=compared("tight", 1e-7)))
    assert line["tight tier"] == line["standard tier"] == "**agree**"
    # 1e-7 (1 + cos) sin of a clearance of 0.2 mm, at most 1.3 where the angle is 60 degrees.
    assert line[f"{verdicts.X}, tight"] == "2.6e-11 m"
    assert line[verdicts.X] == "2.6e-10 m"
    assert line["samples predictable"] == "100\u00a0%"
    refused = replace(usual, verdict="cannot compare", channels={}, attribution=None)
    for tight, verdict in ((None, "not run"), (refused, "**cannot compare**")):
        shown = verdicts.row(replace(usual, tight=tight))
        assert [value for name, value in shown.items() if "tight" in name] == [verdict, *["n/a"] * 3]
    # What the mark of a larger difference means stands below the table where there is one: two errors of
    # some 1e-5 of the clearance of 2e-4 m.
    far = replace(usual, tight=compared("tight", 1e-5))
    for comparison, marked in ((replace(usual, tight=None), False), (far, True)):
        results = verdicts.Results([comparison], {"machine": "a machine", "date": "2030-01-01"})
        text = verdicts.STUDY.text(results)
        assert ("† above 1e-09 m" in text) == marked
        assert text.endswith("\nMade on a machine; 2030-01-01.\n")
        assert text.count("†") == 2 * marked


def test_extremes_have_every_comparison_in_a_class(folder):
    rows = pd.read_csv(folder / "reports" / "extremes" / "cells.csv")
    # The fakes differ by what their settings say, and refuse nothing.
    assert set(rows["class"]) <= {"agree", "indeterminate", "refused"}
    assert (rows["axis"] == "hypercube").sum() == 5 * 2
