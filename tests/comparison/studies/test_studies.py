"""Studies as a whole, with fake models: their files; rates and printed numbers that they share."""

import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import pandas as pd
import pytest
from scipy.stats import beta

from comparison.cli import main
from comparison.cli import study as reports
from comparison.execution.pool import kept_workers
from comparison.models import ROOT, EngineError
from comparison.report import svg
from comparison.scene import shipped_scenes
from comparison.studies import NAMES, SUCCESSORS, verdicts, write_study
from comparison.studies.paper import MAIN, PARTS
from comparison.studies.shared.published import published
from comparison.studies.shared.study import interval, share, upper_limit

STUDIES = ("extremes", "trust", "tradeoff", "truth", "verdicts")
OTHERS = [f"paper/{part}" for part in PARTS if part != MAIN]
RECORDS = ["verdicts.toml", "measured.toml"]


@pytest.fixture(scope="module")
def folder(fakes, tmp_path_factory):
    """Small studies of fake models, less the paper's own page, which takes as long as all others."""
    folder = tmp_path_factory.mktemp("studies")
    # Starts of processes would take most of the time; nothing that they import changes meanwhile.
    with pytest.MonkeyPatch.context() as monkeypatch, fakes(folder, monkeypatch), kept_workers():
        replace(verdicts.STUDY, small=["150rpm-0.2mm"]).write(folder / "verdicts", 2, None, small=True)
        for name in ("trust", "truth", "tradeoff", "extremes"):
            write_study(name, folder / name, 2, None, small=True)
        write_study(
            "paper", folder / "paper", 2, None, small=True, parts=[part for part in PARTS if part != MAIN]
        )
    return folder


def check(root, name):
    """Require that the page of a study, or of a part of the paper, is whole, and so are its files."""
    page, place = root / (f"{name}.md" if "/" in name else f"{name}/README.md"), root / name
    text = page.read_text("utf-8")
    assert not re.search(r"\{\w*\}|\bnan\b", text)
    prefix = f"{place.name}/" if "/" in name else ""
    links = set(re.findall(rf"\]\({prefix}([\w.-]+\.(?:svg|csv|json))\)", text))
    pictures = {file for file in links if file.endswith(".svg")}
    files = {path.name for path in place.iterdir() if path.suffix != ".md" and path.is_file()}
    assert links <= files <= {*links, *RECORDS}
    for picture in pictures:
        drawing = (place / picture).read_text("utf-8")
        assert drawing.count("<path") > 10
        assert any(colour in drawing for colour in (svg.FIRST, svg.SERIES[0], svg.SERIES[3], svg.OUTSIDE))


@pytest.mark.parametrize("name", [*STUDIES, *OTHERS])
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
    for name in (*STUDIES, *OTHERS, "paper"):
        check(Path("reports"), name)
    links = re.findall(r"^## \[.+\]\((.+)\)$", Path("reports", "README.md").read_text("utf-8"), re.MULTILINE)
    names = [f"{name}/README.md" for name in NAMES] + [f"{name}.md" for name in OTHERS]
    assert sorted(links) == sorted(names)
    readme = Path("README.md").read_text("utf-8")
    assert re.search(r"\| 150 rpm, 0.2 mm clearance \| \*\*agree\*\* \| \*\*agree\*\* \|", readme)
    assert "formerly" not in readme
    record = tomllib.loads(Path("reports", "verdicts", "verdicts.toml").read_text("utf-8"))
    assert f"Made on {record['made']['machine']}; {record['made']['date']}.\n" in readme
    assert list(record["scenes"]) == shipped_scenes()
    forms = pd.read_csv(Path("reports", "paper", "forms.csv"))
    medians = forms.groupby("id")["median"].transform("first")  # of the same draws
    assert forms["change"].to_numpy() == pytest.approx((forms["median"] - medians).to_numpy(), nan_ok=True)


def test_make_reports_keeps_pages_of_studies_without_their_engine(tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "reports", tmp_path / "reports", ignore=shutil.ignore_patterns("*.svg", "out"))
    shutil.copy(ROOT / "README.md", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(reports, "write_study", Mock(side_effect=EngineError("no heyoka")))
    reports.main(small=True)
    warning = "sixbar: warning: study {}: no heyoka; its page stays as it is"
    assert capsys.readouterr().err.splitlines() == [warning.format(name) for name in NAMES]
    index, readme = (Path(page).read_text("utf-8") for page in ("reports/README.md", "README.md"))
    assert readme == (ROOT / "README.md").read_text("utf-8")
    assert sorted(index.split("\n")) == sorted(
        (ROOT / "reports" / "README.md").read_text("utf-8").split("\n")
    )


def test_a_study_that_is_a_part_now_says_so(capsys):
    for name, successor in SUCCESSORS.items():
        assert main(["study", name, "--small", "--jobs", "1"]) == 2
        assert f": sixbar study {successor}\n" in capsys.readouterr().err


def test_rates_and_their_limits():
    # Of Clopper and Pearson: quantiles of the beta distribution.
    assert interval(3, 40) == pytest.approx((beta.ppf(0.025, 3, 38), beta.ppf(0.975, 4, 37)))
    assert (interval(0, 0), upper_limit(0, 0)) == ((0.0, 1.0), 1.0)
    assert [share(rate) for rate in (0.0123, 0.9951)] == ["1.2\u00a0%", "99.5\u00a0%"]


def test_figures_come_from_the_published_table_with_half_a_unit_of_their_last_digit():
    rows = {"F7-R-a": (-494.9, 0.05), "F7-T-d": (0.4112e-5, 0.5e-9), "F14a-x": (-0.2497e-3, 5e-8)}
    for row, (value, rounding) in rows.items():
        figure = published(row)
        assert (figure.value, figure.rounding) == (value, pytest.approx(rounding, rel=1e-12))
