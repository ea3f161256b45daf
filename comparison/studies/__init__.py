"""What the code says about questions that one comparison cannot answer: each study writes its own folder.

A study is a package here, with a module `study` that holds its ``STUDY`` (`comparison.studies.shared.study`):
what it is asked with, small and full; what it measures, by `comparison.execution`, so that an interrupted
study resumes and a second call is quick; the template of its page and its figures.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

STUDIES = {
    "verdicts": "Verdicts of both models on every shipped scene, at two tiers.",
    "paper": "The paper, figure by figure: what it printed beside what both models give.",
    "reliability": "Reliability of the paper's cases by both models.",
    "contact-laws": "Three contact laws, and where they differ.",
    "crank-pin": "Clearance at the crank pin as well.",
    "identification": "Which geometry and parameters the paper's figures are of.",
    "ensembles": "Both models as distributions, where single runs cannot be predicted.",
    "nonlinear": "Whether the press is chaotic: exponents, sections, bifurcations.",
    "random-inputs": "Reliability where the inputs are random.",
    "detection": "False alarms of the verdict, and which errors in a model it finds; an hour on two cores.",
    "campaign": "Random scenes through both models, and who errs where they differ; an hour on two cores.",
    "tradeoff": "Speed against accuracy of every formulation and integrator; 6 minutes.",
    "extremes": "Where the models break down, and how they tell; half an hour on two cores.",
}
"""What each one is about."""
NAMES = tuple(STUDIES)


def write_study(
    name: str, folder: Path, n_jobs: int, on_progress: Callable[[float], None] | None, *, small: bool = False
) -> Path:
    """Let a study write its folder; parameters and result of `comparison.studies.shared.study.Study.write`.

    Parameters
    ----------
    name
        One of `NAMES`.
    folder, n_jobs, on_progress, small
        Where to, worker processes, progress from 0 to 1, and whether with few and short runs.
    """
    module = import_module(f"comparison.studies.{name.replace('-', '_')}.study")
    path: Path = module.STUDY.write(folder, n_jobs, on_progress, small=small)
    return path
