"""Multi-run studies: questions that one comparison cannot answer. Each writes its own folder.

A study is a module here, or a package with a module `study`, that holds its ``STUDY``
(`comparison.studies.shared.study`): its extent, small and full; its measurement by `comparison.execution`, so
that an interrupted study resumes and a second call is quick; the template of its page and its figures.
"""

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path

from comparison.studies.paper import MAIN, PARTS

STUDIES = {
    "verdicts": "Verdicts of both models on every shipped scene, at two tiers.",
    "paper": "The paper: its numbers and statements against both models, and parts on what they need; hours.",
    "trust": "The verdict under test: false alarms on random scenes, seeded faults; hours.",
    "truth": "The uncertainties under test: both models against a trajectory in 34 digits; an hour.",
    "foreign": "The verdict on pairs of solvers of other systems, against truth in 34 digits; ten minutes.",
    "tradeoff": "Speed against accuracy of every formulation and integrator; 6 to 15 minutes.",
    "extremes": "Both models at extreme parameters: verdicts, failures, messages; two hours on two cores.",
}
"""Study -> its subject, in one line."""
NAMES = tuple(STUDIES)
SUCCESSORS = {
    "as-published": "paper --part main",
    "identification": "paper --part identification",
    "nonlinear": "paper --part nonlinear",
    "reliability": "paper --part reliability",
    "random-inputs": "paper --part main",
    "crank-pin": "paper --part main",
    "contact-laws": "paper --part laws",
    "detection": "trust",
    "campaign": "trust",
    "ensembles": "trust",
}
"""Former study -> study, or part of one, that it has become."""


def write_study(
    name: str,
    folder: Path,
    n_jobs: int,
    on_progress: Callable[[float], None] | None,
    *,
    small: bool = False,
    parts: Sequence[str] = (),
) -> list[Path]:
    """Write the folder of a study; return the paths of its pages.

    Parameters
    ----------
    name
        One of `NAMES`.
    folder, n_jobs, on_progress, small
        Output folder, worker processes, progress from 0 to 1, and True for few and short runs.
    parts
        Of the study paper: those of `comparison.studies.paper.PARTS` to write, by default all.
    """
    from comparison.studies.shared.study import part

    package = import_module(f"comparison.studies.{name}")
    names = list(parts) or (list(PARTS) if name == "paper" else [MAIN])
    pages = []
    for n, each in enumerate(names):
        module = "study" if each == MAIN else each.replace("-", "_")
        study = getattr(package, "STUDY", None) or import_module(f"{package.__name__}.{module}").STUDY
        progress = part(on_progress, n / len(names), (n + 1) / len(names))
        pages.append(study.write(folder, n_jobs, progress, small=small))
    return pages
