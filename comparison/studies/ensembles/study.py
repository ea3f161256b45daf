"""Both models as distributions, on the part of the time where single runs say nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from comparison.accuracy.thresholds import thresholds
from comparison.accuracy.tiers import tight
from comparison.execution.run import Job, Progress, run_all, successful
from comparison.files import replacing
from comparison.formatting import number, quantity, table
from comparison.scene import Scene, load_scene
from comparison.studies.ensembles.figures import draw
from comparison.studies.ensembles.statistics import RATE, Distance, ask, distances
from comparison.tables.arrays import Array
from comparison.tables.channels import channels
from comparison.tables.table import Table

SCENE = "150rpm-0.2mm"
MEMBERS = 64
CYCLES = 4
FIRST_TURN = 1
SPREAD = 0.01
"""Of the clearance: starts are drawn evenly from so much to either side. After a turn it is forgotten."""
ASKED = ("slider_x", "slider_angle", "slider_vx", "slider_vy", "slider_omega")
INSTANTS = 40
"""A turn, in which the channels are asked."""
SAMPLES = 200
MODELS = ("reference", "exudyn")


@dataclass(frozen=True)
class Question:
    """Two ensembles that are held against each other."""

    words: str
    expected: str
    a: tuple[str, int, str]
    b: tuple[str, int, str]
    """Model, seed, and what is changed in it (a key of `CHANGES`)."""


CHANGES: dict[str, dict[str, object]] = {
    "": {},
    "restitution": {"contact.restitution": 0.891},
    "friction": {"friction.coefficient": 0.1515},
    "more restitution": {"contact.restitution": 0.855},
}
QUESTIONS = (
    Question("reference against Exudyn", "the question", ("reference", 1, ""), ("exudyn", 2, "")),
    Question("reference against itself, other starts", "nothing", ("reference", 1, ""), ("reference", 3, "")),
    Question(
        "restitution 1 % lower in one", "a difference", ("reference", 1, ""), ("reference", 4, "restitution")
    ),
    Question(
        "restitution 5 % lower in one",
        "a difference",
        ("reference", 1, ""),
        ("reference", 5, "more restitution"),
    ),
    Question(
        "friction 1 % higher in one", "a difference", ("reference", 1, ""), ("reference", 6, "friction")
    ),
)


def member(which: tuple[str, int, str], k: int) -> Job:
    """Return the k-th run of an ensemble: every seed draws starts of its own."""
    model, seed, change = which
    scene = load_scene(SCENE, {"drive.cycles": float(CYCLES), "output.samples_per_cycle": SAMPLES})
    clearance, usual = scene.data["clearance"]["slider"], scene.data["initial"]["slider_offset"]
    moved = SPREAD * clearance * np.random.default_rng([seed, k]).uniform(-1.0, 1.0)
    drawn = scene.with_values({"initial.slider_offset": float(usual + moved)} | CHANGES[change])
    closer = tight(drawn, MODELS)
    if closer is None:
        raise ValueError("the models of this study have a tight tier")
    return Job(closer, model)


def write(folder: Path, n_jobs: int, on_progress: Progress | None) -> None:
    """Run the ensembles, ask, and write README.md and the figure."""
    ensembles = list(dict.fromkeys(which for question in QUESTIONS for which in (question.a, question.b)))
    jobs = [member(which, k) for which in ensembles for k in range(MEMBERS)]
    tables = map(successful, run_all(jobs, n_jobs, on_progress), jobs)
    runs = {which: list(islice(tables, MEMBERS)) for which in ensembles}
    scene = member(ensembles[0], 0).scene
    answers = {question: _answer(runs[question.a], runs[question.b], scene) for question in QUESTIONS}
    x, y = runs[QUESTIONS[0].a], runs[QUESTIONS[0].b]
    predictable = thresholds().alpha * scene.data["clearance"]["slider"]
    draw(folder, x[0].time / scene.period, _bands(x), _bands(y), predictable)
    with replacing(folder / "README.md") as part:
        part.write_text(text(answers), "utf-8")


def _answer(a: Sequence[Table], b: Sequence[Table], scene: Scene) -> list[Distance]:
    turn = np.arange(INSTANTS) / INSTANTS
    instants = scene.period * np.concatenate([turn + k for k in range(FIRST_TURN, CYCLES)])
    alpha = thresholds().alpha
    known = channels()
    floors = {name: (alpha * known[name].scale_value(scene.data, 0.0), known[name].unit) for name in ASKED}
    asked = ask(a, b, instants=instants, floors=floors, period=scene.period, first_turn=FIRST_TURN)
    return distances(asked)


def _bands(runs: Sequence[Table]) -> Array:
    """Return the 5, 50 and 95 % quantiles of x over the runs, m, shape (3, n)."""
    offset = np.array([table.values("slider_x") for table in runs])
    return np.asarray(np.quantile(offset, (0.05, 0.5, 0.95), axis=0))


def text(answers: dict[Question, list[Distance]]) -> str:
    """Return the study's README."""
    rows = [
        [
            question.words,
            question.expected,
            str(len(tests)),
            str(sum(test.p <= RATE for test in tests)),
            f"**{sum(test.found for test in tests)}**",
            f"{min(test.adjusted for test in tests):.2g}",
            _most(tests),
        ]
        for question, tests in answers.items()
    ]
    headings = (
        "ensembles",
        "expected",
        "tests",
        f"p <= {RATE:g} by itself",
        "found",
        "smallest adjusted p",
        "largest distance",
    )
    main = answers[QUESTIONS[0]]
    contacts = [test for test in main if "contact" in test.quantity]
    listed = table(
        ("quantity", "where", "largest distance of distributions", "Wasserstein", "adjusted p"),
        [
            [
                test.quantity,
                test.where,
                f"{test.statistic:.2f}",
                quantity(test.wasserstein, test.unit) if test.unit else number(test.wasserstein),
                f"{test.adjusted:.2g}",
            ]
            for test in sorted(contacts, key=lambda test: test.adjusted)[:15]
        ],
    )
    found = sum(test.found for test in main)
    said = (
        "No difference between the two models was found."
        if not found
        else f"{found} of {len(main)} quantities differ between the two models."
    )
    return f"""# Both models as distributions

Where neighbouring runs part, one run of either model says nothing about the other. Here {MEMBERS} runs of
each start from offsets drawn evenly within {SPREAD:.0%} of the clearance to either side, independently for
every ensemble, and last {CYCLES} turns of the scene {SCENE} at the settings of the tight tier. From the
second turn on three kinds of numbers are compared: the slider's motion at {INSTANTS} angles a turn where an
ensemble spreads by more than what counts as predictable, the contacts that begin in each turn at each corner,
and quantiles of depth, force and speed of each run's own contacts. One number a run: the runs are
independent, so the two-sample test of Kolmogorov and Smirnov applies; its p-values are adjusted after
Benjamini and Yekutieli so that of all that is called found at most {RATE:.0%} is expected to be false.

**{said}** The other lines show what the method sees and what not.

{table(headings, rows)}

![Slider x of both ensembles: medians, and the width of the range of nine tenths of the runs](slider_x.svg)

The contacts of both models, the least probable first:

{listed}
"""


def _most(tests: Sequence[Distance]) -> str:
    worst = min(tests, key=lambda test: test.p)
    return f"{worst.statistic:.2f} ({worst.quantity}, {worst.where})"
