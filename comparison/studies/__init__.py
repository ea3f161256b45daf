"""Multi-run studies: questions that one comparison cannot answer. Each writes its own folder.

A study is a package here, with a module `study` that holds its ``STUDY`` (`comparison.studies.shared.study`):
what it is asked with, small and full; what it measures, by `comparison.execution`, so that an interrupted
study resumes and a second call is quick; the template of its page and its figures.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

STUDIES = {
    "verdicts": "Verdicts of both models on every shipped scene, at two tiers.",
    "paper": "All numbers, figures and statements of the paper against both models; two hours on two cores.",
    "reliability": "Reliability of the paper's cases in both models.",
    "contact-laws": "The paper's contact laws, and the energy that one of them creates.",
    "crank-pin": "Clearance at the crank pin against its published peaks.",
    "identification": "Geometry and parameters identified from the paper's figures.",
    "ensembles": "Distributions of the motion in both models, where single runs are not predictable.",
    "nonlinear": "Whether the press is chaotic: Lyapunov exponents, sections, bifurcations.",
    "random-inputs": "Reliability with random inputs.",
    "detection": "Detection power and false-alarm rate of the verdict; an hour on two cores.",
    "campaign": "Random scenes in both models, and which model errs where they differ; an hour on two cores.",
    "tradeoff": "Speed against accuracy of every formulation and integrator; 6 to 15 minutes.",
    "extremes": "Both models at extreme parameters: limits, failures, messages; two hours on two cores.",
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
