"""Why a run did not converge, as far as the runs themselves tell."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from comparison.execution.ledger import Row
from comparison.execution.quality_checks import FEW_STEPS
from comparison.formatting import number, quantity
from comparison.studies.extremes.cells import LITERAL_LAW, NEWTON
from comparison.studies.extremes.closer import HAIR
from comparison.studies.extremes.gather import Found
from comparison.studies.extremes.outcomes import Class, Closer, Verdict

SCATTER = 10.0
"""Errors of single runs scatter by so much about what their setting promises (`benchmarks/promises.py`)."""
UNEXPLAINED = "not explained"
GAIN = 2.0
"""By which a finer setting, of a tenth of the tolerance or half the step, must err less at least."""
SLIGHTLY = 1.25
"""A smaller ratio explains nothing and is not told."""
TOGETHER = 0.02
"""Turns within which formulations leave the exact motion at one instant."""
USUAL_NEWTON = 1e-7
"""Newton's tolerance of the five bodies where a scene says nothing."""
JAM = "friction this large lets a corner dig itself into its wall"


@dataclass(frozen=True)
class Base:
    """What a cell's numbers are compared with.

    Attributes
    ----------
    promised
        The cell that changes nothing under hertz-corners: what promises are made for.
    law
        The same under the cell's own law.
    """

    promised: Found
    law: Found


def reason(found: Found, way: str, base: Base) -> str:
    """Return the reason of a run's class in words; nothing for one that converged."""
    verdict, row = found.verdicts[way], found.rows[way]
    if verdict.kind is Class.CONVERGED:
        return ""
    if verdict.kind is Class.REFUSED:
        return _without_scene(row["message"])
    if verdict.kind in (Class.STOPPED, Class.CRASHED, Class.NONSENSE):
        return _ended(row) + (f"; {JAM}" if may_jam(found) else "")
    if verdict.kind is Class.UNCONFIRMED:
        return "; ".join(f"{name}: {_ended(of)}" for name, of in found.tight.items())
    return _why_degraded(found, way, base)


def may_jam(found: Found) -> bool:
    """Return whether friction can turn a corner into its wall more than the wall turns it out.

    A force N on a corner at (r_x, r_y) from the centre, with friction c_f N along the wall, turns the slider
    by N (r_y - c_f r_x) / J5: inwards where c_f > r_y / r_x, length over width. What rod 4 lets the centre
    yield counts little beside it. The drive goes on all the same (Painleve's paradox).
    """
    data = found.cell.scene.data
    slider = data["mechanism"]["slider"]
    return bool(data["friction"]["coefficient"] > slider["length"] / slider["width"])


def _why_degraded(found: Found, way: str, base: Base) -> str:
    verdict, row = found.verdicts[way], found.rows[way]
    if found.cell.law == LITERAL_LAW:
        return "the literal switch creates energy: no run converges (study contact-laws)"
    if not isfinite(verdict.promise):
        return "nothing is promised at so coarse a setting"
    if found.cell.axis == NEWTON and float(found.cell.label) > USUAL_NEWTON:
        return "Newton's iteration ends with an error of its own"
    steps, usual = row.get("resolution"), base.law.rows.get(way, {}).get("resolution")
    if steps is not None and steps < FEW_STEPS:
        return f"a contact lasts {number(steps, 2)} steps"
    told, expected = [], verdict.promise
    own = base.promised.verdicts.get(way)
    if own is not None and own.error > own.promise:
        expected *= own.error / own.promise
        told.append(f"errs {number(own.error / own.promise, 2)} times as promised in the base scene too")
    magnified = found.magnification / base.promised.magnification
    if magnified > SLIGHTLY:
        expected *= magnified
        told.append(f"the scene magnifies {number(magnified, 2)} times as much as the base scene")
    if steps is not None and usual is not None and steps * SLIGHTLY < usual:
        # Of second order in the step over the contact's duration.
        expected *= (usual / steps) ** 2
        told.append(f"{number(steps, 2)} steps a contact, {number(usual, 2)} in the base scene")
    if verdict.error <= SCATTER * expected:
        return "; ".join(told) or f"within the {SCATTER:g} times by which single runs scatter"
    apart = _apart(found)
    if apart > verdict.promise:
        return "; ".join([*told, f"the strict runs are {quantity(apart, 'm', 2)} apart themselves"])
    together = [
        name
        for name, of in found.verdicts.items()
        if name != way and of.kind is Class.DEGRADED and abs(of.lasted - verdict.lasted) <= TOGETHER
    ]
    if together:
        told.append(
            f"leaves the exact motion at {number(verdict.lasted, 2)} of the turn, where "
            f"{' and '.join(together)} leave it too: it magnifies more there than near starts show"
        )
        return "; ".join(told)
    return "; ".join([*told, _closer(found.closer.get(way), verdict) or UNEXPLAINED])


def _closer(look: Closer | None, verdict: Verdict) -> str:
    """Return what a closer look says of the error; nothing where it does not account for it either."""
    if look is None:
        return ""
    if look.apart >= verdict.error / SCATTER:
        hair, apart = quantity(HAIR, "m", 1), quantity(look.apart, "m", 2)
        return f"two starts {hair} apart part by {apart}: no setting resolves what decides there"
    if look.finer is None:
        return ""
    if look.finer.kind is Class.STOPPED:
        return f"at the edge of stopping: at the next finer setting {look.status}"
    if look.finer.error <= verdict.error / GAIN:
        error = quantity(look.finer.error, "m", 2)
        return f"too coarse a setting for this scene: at the next finer one {error}"
    return ""


def _apart(found: Found) -> float:
    """Return how far the runs that count as exact are from one another, m; nan with less than two."""
    runs = [np.asarray(of["x"]) for of in found.tight.values() if of["status"] == "success"]
    return float(np.ptp(runs, axis=0).max()) if len(runs) > 1 else float("nan")


def _ended(row: Row) -> str:
    """Return how a run ended; of the time that it was given, how much."""
    message = str(row["message"])
    return (
        f"{row['status']}, {message}" if message.startswith(("broken off", "not started")) else row["status"]
    )


def _without_scene(message: str) -> str:
    return message.partition("': ")[2] if message.startswith("scene '") else message
