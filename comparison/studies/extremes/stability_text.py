"""What the fixed steps do to contacts, in words and tables."""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, pi

import numpy as np

from comparison.formatting import MISSING, number, quantity, table
from comparison.scene import load_scene
from comparison.studies.extremes.fixed_steps import METHODS, SPECTRAL_RADIUS, rebounds, spectral_radius
from comparison.studies.extremes.impact import restitution
from comparison.studies.extremes.stability import LOOSE, MODULI, STEPS, Cell, Found, Hit
from comparison.tables.arrays import Array

ALL_PHASES = np.linspace(0.005, 1.0, 200)
PER_CONTACT = (100.0, 30.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5, 0.1, 0.01)
"""Steps in an exact contact."""
WRONG = 0.1
"""Beyond it a cell of the map is told to be wrong."""


def text(found: Found) -> str:
    """Return the tables and what they say."""
    return "\n\n".join(
        (_linear(), _one_hit(), _five_bodies(found.hits), _events(found.hits), _map(found.cells))
    )


def growth(of: Array) -> float:
    """Return the geometric mean of rebounds: what a long row of hits at random phases grows by, each."""
    return exp(float(np.mean(np.log(of))))


def _linear() -> str:
    frequencies = (0.1, 1.0, 10.0, 100.0, 1e4)
    rows = [
        [name, *(f"{spectral_radius(method, wh):.6f}" for wh in frequencies)]
        for name, method in METHODS.items()
    ]
    return (
        "Spectral radius of one step on q'' + w² q = 0:\n\n"
        + table(("method", *(f"w h = {wh:g}" for wh in frequencies)), rows)
        + f"\n\nNowhere above 1, and {SPECTRAL_RADIUS:g} at infinity for generalized-alpha: neither method "
        "has a boundary while a contact lasts."
    )


def _one_hit() -> str:
    rows = []
    for name, method in METHODS.items():
        for count in PER_CONTACT:
            of = rebounds(method, pi / count, ALL_PHASES)
            rows.append(
                [
                    name,
                    f"{count:g}",
                    number(pi / count),
                    *(f"{v:.4f}" for v in (of.min(), of.mean(), of.max(), growth(of))),
                ]
            )
    headings = ("method", "steps per contact", "w h", "least", "mean", "largest", "growth per hit")
    e = restitution(load_scene("150rpm-0.2mm").data["contact"]["restitution"])
    bounds = [
        f"{name}: {number(_least_steps(name, 1.0), 2)} without loss in the law, "
        f"{number(_least_steps(name, 1 / e), 2)} with the scene's restitution of {number(e, 4)}"
        for name in METHODS
    ]
    worst = {name: rebounds(method, 1e4, ALL_PHASES).max() for name, method in METHODS.items()}
    return (
        "One mass hits a wall with a linear spring that should return all of its speed (recurrence of each "
        f"method, {len(ALL_PHASES)} phases of the touch within a step):\n\n{table(headings, rows)}\n\nIn the "
        "limit of a rigid wall a step that starts just before the touch is thrown back with up to "
        + ", ".join(f"{number(value)} ({name})" for name, value in worst.items())
        + " times its speed, where the trapezoidal rule's 3 can be had by hand: a step that ends on the "
        "wall gives v1 = −v0 and an acceleration of −4 v0/h, half of which the next step still applies. The "
        "boundary of stability is where the geometric mean exceeds 1 (times what the law takes): fewer "
        f"steps per contact than {'; '.join(bounds)}."
    )


def _least_steps(name: str, allowed: float) -> float:
    """Return the steps per contact below which the growth per hit exceeds what is allowed."""
    counts = np.geomspace(0.05, 20.0, 500)
    grows = np.array(
        [growth(rebounds(METHODS[name], pi / n, ALL_PHASES)) > allowed * (1 + 1e-3) for n in counts]
    )
    return float(counts[np.flatnonzero(grows)[-1]])


def _five_bodies(hits: Sequence[Hit]) -> str:
    rows = []
    for name in METHODS:
        for step in sorted({hit.step for hit in hits}):
            mine = [hit for hit in hits if hit.method == name and hit.step == step]
            ran = [hit for hit in mine if hit.status == "success"]
            failed = sorted({hit.wh for hit in mine if hit.status != "success"})
            rows.append(
                [
                    name,
                    quantity(step, "s"),
                    f"{number(min(hit.wh for hit in mine))} … {number(max(hit.wh for hit in mine))}",
                    str(len(mine)),
                    number(max((abs(hit.rebound - hit.theory) for hit in ran), default=float("nan")), 2),
                    number(max((hit.rebound for hit in ran), default=float("nan"))),
                    f"{len(mine) - len(ran)}, w h from {number(failed[0])}" if failed else "none",
                ]
            )
    headings = (
        "method", "step", "w h", "hits", "largest difference from one mass", "largest rebound", "failed",
    )  # fmt: skip
    gone = [hit for hit in hits if hit.status != "success"]
    kinds = ", ".join(sorted({hit.status for hit in gone})) or "none"
    helped = {
        name: (
            sum(hit.loosened == "success" for hit in gone if hit.method == name),
            sum(hit.method == name for hit in gone),
        )
        for name in METHODS
    }
    return (
        "The same with Exudyn's five bodies: press at rest, slider upright, both corners hit at once, "
        "exponent 1, restitution 1, no friction, no gravity; the rebound is the slider's speed after "
        f"it:\n\n{table(headings, rows)}\n\nWhat five bodies and their constraints do is what one mass does. "
        f"{len(gone)} of {len(hits)} hits stopped ({kinds}). With solver.exudyn.tolerance = {LOOSE:g} "
        + " and ".join(f"{some} of {every} of {name}" for name, (some, every) in helped.items())
        + " succeed. The tolerance of index 2, proportional to the step, falls below what K makes of the "
        "round-off of positions. Generalized-alpha stops along a line w h = const: the first iterations, "
        "with the Jacobian of free flight that knows nothing of so stiff a wall, throw rod 4 round by "
        "thousands of turns, and what is found there is no position of the press."
    )


def _events(hits: Sequence[Hit]) -> str:
    """Hold the table of contacts against the motion."""
    rows = []
    ran = [hit for hit in hits if hit.status == "success"]
    for low, high in ((20.0, 400.0), (10.0, 20.0), (5.0, 10.0), (2.0, 5.0), (0.5, 2.0), (0.0, 0.5)):
        part = [hit for hit in ran if low <= pi / hit.wh < high]
        if part:
            rows.append(
                [
                    f"{low:g} … {high:g}",
                    number(max(abs(hit.rebound - 1) for hit in part), 2),
                    number(max(abs(hit.impulse - hit.rebound) for hit in part), 2),
                    number(max(abs(hit.speed - 1) for hit in part), 2),
                ]
            )
    headings = (
        "steps per contact", "rebound less 1", "table's impulse / (m v) less (1 + rebound)",
        "table's speed / v less 1",
    )  # fmt: skip
    return (
        "The table of contacts is not to be trusted where a contact takes few steps: it integrates the "
        "force from the located touch to the located end, and takes the speed of the touch from the step in "
        "which the wall has already worked. Largest sizes over both methods:\n\n" + table(headings, rows)
    )


def _map(cells: Sequence[Cell]) -> str:
    parts = []
    for name in METHODS:
        rows = []
        for young in reversed(MODULI):
            row = [cell for cell in cells if cell.method == name and cell.modulus == young]
            rows.append([f"{young:.0e}", *map(_told, row)])
        parts.append(f"{name}:\n\n{table(('modulus (Pa)', *(quantity(step, 's') for step in STEPS)), rows)}")
    failed = [cell for cell in cells if cell.status != "success"]
    ran = [cell for cell in cells if cell.status == "success"]
    wrong = [cell for cell in ran if abs(cell.wrong) > WRONG]
    fastest = max(ran, key=lambda cell: cell.speed)
    return "\n\n".join(
        (
            "A quarter of a turn of the central case with Hertz' law, restitution and friction. "
            "Trapezoidal-index2: energy from nowhere in what was lost to damping and friction; "
            "generalized-alpha, which gives no energies: the deepest dip less the reference's, in the "
            "reference's. In brackets steps per contact.",
            *parts,
            f"{len(failed)} of {len(cells)} runs stopped, none above {number(most(failed), 2)} steps per "
            f"contact; {len(wrong)} finished more than {WRONG:.0%} wrong, and none of either kind above "
            f"{number(most([*failed, *wrong]), 2)} steps per contact: the boundary is a line T_c / h = "
            f"const, over {len(MODULI) - 1} decades of the modulus. Success is no proof there: the worst of "
            f"the finished runs ({fastest.method}, {quantity(fastest.step, 's')}, {fastest.modulus:.0e} Pa, "
            f"{number(fastest.steps_per_contact, 2)} steps per contact) has the slider at "
            f"{number(fastest.speed, 2)} times its true largest speed.",
        )
    )


def most(cells: Sequence[Cell]) -> float:
    """Return the largest number of steps per contact of cells."""
    return max((cell.steps_per_contact for cell in cells), default=float("nan"))


def _told(cell: Cell) -> str:
    if cell.status == "success":
        return f"{number(cell.wrong, 2)} ({number(cell.steps_per_contact, 2)})"
    until = MISSING if np.isnan(cell.until) else quantity(cell.until, "s", 2)
    return f"{cell.status} at {until} ({number(cell.steps_per_contact, 2)})"
