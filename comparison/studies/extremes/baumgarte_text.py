"""What the runs with Baumgarte's alpha and beta say."""

from __future__ import annotations

from collections.abc import Sequence

from comparison.formatting import MISSING, number, quantity, table
from comparison.studies.extremes.baumgarte import (
    GAINS,
    MAPPED,
    SCENES,
    TOLERANCES,
    TURNS,
    USUAL,
    Run,
    pick,
    scene,
)
from comparison.studies.extremes.explicit import limit, longest_step
from comparison.studies.shared.rates import rate

NO_WORSE = 3.0
"""A drift within this factor of the least counts as the least: both are round-off."""


def text(found: Sequence[Run]) -> str:
    """Return the tables and what they say."""
    S, imaginary = limit(-1.0), limit(1j)
    return "\n\n".join(
        (
            "DOP853 multiplies an error of rate l by R(l h) in a step h. Its |R| stays below 1 up to S = "
            f"{number(S, 4)} along the negative real axis (alpha = beta: a double root −alpha) and up to "
            f"{number(imaginary, 3)} along the imaginary one (alpha = 0: roots ± i beta). The step is free "
            "up to a fiftieth of a turn: where alpha is large, the error control finds the step that "
            "stability allows by failing beyond it.",
            *(_steps(found, tolerance) for tolerance in TOLERANCES),
            _reached(found),
            *(_map(found, name) for name in SCENES),
            _grown(found),
            _choice(found),
        )
    )


def _steps(found: Sequence[Run], tolerance: float) -> str:
    rows = []
    for gain in GAINS:
        cells = [quantity(longest_step(gain, gain), "s") if gain else "∞"]
        for name in SCENES:
            for run in pick(found, scene=name, alpha=gain, beta=gain, tolerance=tolerance, turns=1.0):
                told = f"{run.steps:,}" if run.status == "success" else f"{run.steps:,}: {run.status}"
                cells += [told, f"{run.rejected:,}", quantity(run.mean_step, "s")]
                cells += [
                    number(run.mean_step * gain),
                    quantity(run.position, "m"),
                    quantity(run.velocity, "m/s"),
                ]
        rows.append([f"{gain:g}", *cells])
    parts = ("steps", "rejected", "mean step h", "h alpha", "largest Φ", "largest Φ'")
    headings = ["alpha = beta (1/s)", "S / alpha", *(f"{name}: {part}" for name in SCENES for part in parts)]
    return f"Tolerance {tolerance:g}, one turn:\n\n{table(headings, rows)}"


def _reached(found: Sequence[Run]) -> str:
    """Say how much of S the mean step uses at the largest alpha."""
    shares = [
        f"{number(run.mean_step * run.alpha / limit(-1.0), 2)} at {run.tolerance:g}"
        for run in found
        if run.alpha == run.beta == GAINS[-1] and run.scene == next(iter(SCENES)) and run.turns == 1.0
    ]
    return (
        f"At alpha = {GAINS[-1]:g}/s and an ideal slider the mean step is, in S / alpha, "
        f"{', '.join(shares)}. So the theory's line is the bound, met where the tolerance is loose; a tight "
        "one sees the stiff error equation before it becomes unstable, and takes shorter steps."
    )


def _map(found: Sequence[Run], name: str) -> str:
    rows = []
    for alpha in GAINS:
        runs = pick(found, scene=name, alpha=alpha, tolerance=MAPPED, turns=1.0)
        cells = [
            f"{quantity(run.position, 'm', 2)}, {quantity(run.velocity, 'm/s', 2)}"
            if run.status == "success"
            else run.status
            for run in runs
        ]
        rows.append([f"{alpha:g}", *cells])
    headings = ["alpha (1/s)", *(f"beta = {beta:g}" for beta in GAINS)]
    return f"Largest Φ and Φ' over one turn, {name}, tolerance {MAPPED:g}:\n\n{table(headings, rows)}"


def _grown(found: Sequence[Run]) -> str:
    rows = []
    for name in SCENES:
        for gain in (0.0, USUAL):
            runs = pick(found, scene=name, alpha=gain, beta=gain, tolerance=MAPPED)
            for unit, part in (("m", "position"), ("m/s", "velocity")):
                values = [getattr(run, part) for run in runs]
                slope = rate([run.turns for run in runs], values)
                rows.append(
                    [name, f"{gain:g}", part, *(quantity(value, unit) for value in values), number(slope, 2)]
                )
    headings = [
        "scene",
        "alpha = beta",
        "drift of",
        *(f"{t:g} turns" for t in TURNS),
        "grows as turns to the",
    ]
    return (
        f"Drift over many turns at tolerance {MAPPED:g}; a constant push on Φ'' would let Φ' grow with the "
        f"first power and Φ with the second, a random one with 1/2 and 3/2:\n\n{table(headings, rows)}"
    )


def _choice(found: Sequence[Run]) -> str:
    """Say which gains left the least drift, from the measurement."""
    told = []
    for name in SCENES:
        for tolerance in TOLERANCES:
            runs = [
                run
                for run in pick(found, scene=name, tolerance=tolerance, turns=1.0)
                if run.alpha == run.beta and run.status == "success"
            ]
            least = min(run.position for run in runs)
            good = [run for run in runs if run.position <= NO_WORSE * least]
            worst = max(runs, key=lambda run: run.position)
            largest = max(
                (run for run in good if run.alpha <= 100.0), key=lambda run: run.alpha, default=None
            )
            told.append(
                [
                    name,
                    f"{tolerance:g}",
                    MISSING if largest is None else f"{largest.alpha:g}",
                    quantity(least, "m"),
                    f"{worst.alpha:g} ({quantity(worst.position, 'm')})",
                    f"{worst.steps / runs[0].steps:.1f}",
                ]
            )
    headings = (
        "scene", "tolerance", f"largest gain up to 100/s within {NO_WORSE:g} of the least drift",
        "least drift", "worst gain", "its steps against none",
    )  # fmt: skip
    loose = max(
        (run for run in found if run.turns == 1.0 and run.alpha >= 1e3),
        key=lambda run: run.position / run.tolerance,
    )
    # The reference's largest step is a fiftieth of a turn.
    fine = 0.1 * 50.0 / scene(next(iter(SCENES)), 0.0, 0.0, MAPPED, 1.0).period
    return (
        f"{table(headings, told)}\n\nA large gain does not help, likely since the stages inside a step are "
        "of low order, what they miss of Φ is fed back multiplied by alpha and beta squared, and where the "
        "step is at the bound of stability the error of the constraints is as large as the error control "
        f"lets it be, or larger: up to {number(loose.position / loose.tolerance, 2)} tolerances (alpha = "
        f"{loose.alpha:g}/s, beta = {loose.beta:g}/s, {loose.scene}). A good choice is a tenth of the "
        f"reciprocal of the largest step, alpha = beta = {number(fine, 2)}/s here: the scene's default of "
        f"{USUAL:g}/s costs no step, and after {TURNS[-1]:g} turns the drift is the one in the table above "
        "instead of growing without end."
    )
