"""The paper against both models: every printed figure, every figure, every statement."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from comparison.execution.run import Progress
from comparison.files import replacing
from comparison.report import svg
from comparison.studies.paper import figures, portraits, text
from comparison.studies.paper.claims import judge_all
from comparison.studies.paper.rows import all_rows
from comparison.studies.paper.runs import simulate
from comparison.studies.paper.tolerances import implied
from comparison.studies.shared.page import single_page


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run the paper's conditions by both models, and write README.md, figures and a page with all of it."""
    runs = simulate(n_jobs, on_progress)
    with svg.style():
        figures.draw(runs, folder)
        portraits.draw(runs, folder)
    rows, claims = all_rows(runs), judge_all(runs)
    template = files("comparison.studies.paper").joinpath("paper.md").read_text("utf-8")
    parts = (
        text.of_rows(rows)
        | text.of_first_turn(runs)
        | text.of_claims(claims)
        | text.of_tolerances(implied(runs))
        | text.of_runs()
    )
    with replacing(folder / "README.md") as part:
        part.write_text(template.format(**parts), "utf-8")
    single_page(folder / "README.md", folder / "report.html")
