"""Studies as a whole, with fake models: what they write, that they resume, and how they show what failed."""

import re
import shutil
import sys
import tomllib
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import fake_model
import pandas as pd
import pytest
from installed import write_package

from comparison.cli import main
from comparison.cli import study as reports
from comparison.execution.pool import kept_workers
from comparison.models import ROOT
from comparison.report import svg
from comparison.scene import shipped_scenes
from comparison.studies import MOVED, NAMES, verdicts, write_study
from comparison.studies.paper import MAIN, PARTS

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
            source = Path(fake_model.__file__).read_text("utf-8")
            write_package(folder / "fakes", "truth_press", source, {"truth": "truth_press:simulate"})
            monkeypatch.delitem(sys.modules, "truth_press", raising=False)
            yield log
            sys.modules.pop("truth_press", None)

    return all_fakes


@pytest.fixture(scope="module")
def folder(fakes, tmp_path_factory):
    """Small studies of fake models, less the paper's own page, which takes as long as all others."""
    folder = tmp_path_factory.mktemp("studies")
    # Most of the time processes would start; nothing that they import changes meanwhile.
    with pytest.MonkeyPatch.context() as monkeypatch, fakes(folder, monkeypatch), kept_workers():
        replace(verdicts.STUDY, small=["150rpm-0.2mm"]).write(folder / "verdicts", 2, None, small=True)
        for name in ("trust", "truth", "tradeoff", "extremes"):
            write_study(name, folder / name, 2, None, small=True)
        write_study(
            "paper", folder / "paper", 2, None, small=True, parts=[part for part in PARTS if part != MAIN]
        )
    return folder


def place(root, name):
    """Page and folder of a study, or of a part of the paper."""
    return root / (f"{name}.md" if "/" in name else f"{name}/README.md"), root / name


def check(root, name):
    """A page without a gap, and the files that it shows."""
    page, beside = place(root, name)
    text = page.read_text("utf-8")
    assert not re.search(r"\{\w*\}|\bnan\b", text)
    inside = f"{beside.name}/" if "/" in name else ""
    linked = set(re.findall(rf"\]\({inside}([\w.-]+\.(?:svg|csv|json|html))\)", text))
    pictures = {file for file in linked if file.endswith(".svg")}
    written = {path.name for path in beside.iterdir() if path.suffix != ".md" and path.is_file()}
    assert written == {*OTHER_FILES[name].split(), *pictures}
    assert written - linked <= set(UNLINKED)
    for picture in pictures:
        drawn = (beside / picture).read_text("utf-8")
        assert drawn.count("<path") > 10
        assert any(colour in drawn for colour in (svg.FIRST, svg.SERIES[0], svg.SERIES[3], svg.OUTSIDE))


@pytest.mark.parametrize("name", [name for name in OTHER_FILES if name != "paper"])
def test_a_study_writes_page_figures_and_tables(name, folder):
    check(folder, name)


@pytest.mark.slow
def test_make_reports_writes_all_studies_their_list_and_the_table_of_the_readme(fakes, tmp_path, monkeypatch):
    """Without heyoka a page stays as it was."""
    (tmp_path / "reports" / "foreign").mkdir(parents=True)
    shutil.copy(ROOT / "reports" / "foreign" / "README.md", tmp_path / "reports" / "foreign")
    (tmp_path / "README.md").write_text(f"before {reports.BEGIN} formerly {reports.END} after", "utf-8")
    monkeypatch.chdir(tmp_path)
    with fakes(tmp_path, monkeypatch), kept_workers():
        reports.main(small=True)
    for name in OTHER_FILES:
        check(Path("reports"), name)
    links = re.findall(r"^## \[.+\]\((.+)\)$", Path("reports", "README.md").read_text("utf-8"), re.MULTILINE)
    parts = [f"paper/{part}.md" for part in PARTS if part != MAIN]
    assert sorted(links) == sorted([f"{name}/README.md" for name in NAMES] + parts)
    readme = Path("README.md").read_text("utf-8")
    assert re.search(r"\| 150 rpm, 0.2 mm clearance \| \*\*agree\*\* \| \*\*agree\*\* \|", readme)
    assert "formerly" not in readme
    recorded = tomllib.loads(Path("reports", "verdicts", "verdicts.toml").read_text("utf-8"))
    assert f"Made on {recorded['made']['machine']}; {recorded['made']['date']}.\n" in readme
    assert list(recorded["scenes"]) == shipped_scenes()
    forms = pd.read_csv(Path("reports", "paper", "forms.csv"))
    shipped = forms.groupby("id")["median"].transform("first")  # of the same draws
    assert forms["change"].to_numpy() == pytest.approx((forms["median"] - shipped).to_numpy(), nan_ok=True)


@pytest.mark.parametrize("name", ["extremes", "paper/nonlinear", "trust"])
def test_a_second_call_runs_nothing_and_writes_the_same(name, folder, fakes, tmp_path, monkeypatch, capsys):
    study, _, part = name.partition("/")
    with fakes(folder, monkeypatch) as log:
        monkeypatch.chdir(tmp_path)
        runs = log.read_text()
        assert main(["study", study, "--small", *(["--part", part] if part else [])]) == 0
        assert log.read_text() == runs
    page, beside = place(folder, name)
    again, same = place(Path("reports", "out"), name)
    assert capsys.readouterr().out == f"{again}\n"
    assert again.read_bytes() == page.read_bytes()
    for path in same.iterdir():
        assert path.suffix not in (".csv", ".json") or path.read_bytes() == (beside / path.name).read_bytes()


@pytest.mark.parametrize("name", MOVED)
def test_a_study_that_is_a_part_now_says_so(name, capsys):
    assert main(["study", name, "--small", "--jobs", "1"]) == 2
    assert f": sixbar study {MOVED[name]}\n" in capsys.readouterr().err
    study, _, part = MOVED[name].partition(" --part ")
    assert study in NAMES
    assert part in ("", *PARTS)
