"""Why a run did not converge, as far as the runs themselves tell."""

from __future__ import annotations

from math import isfinite

import numpy as np

from comparison.doubts import FEW_STEPS
from comparison.report.quantity import number, quantity
from comparison.studies.extremes.cells import LITERAL_LAW
from comparison.studies.extremes.gather import Found
from comparison.studies.extremes.outcomes import Class

SCATTER = 10.0
"""Errors of single runs scatter by so much about what their setting promises (`comparison/measured.toml`)."""
UNEXPLAINED = "not explained"
JAM = "friction this large lets a corner dig itself into its wall"


def reason(found: Found, way: str, base: Found) -> str:
    """Return the reason of a run's class in words; nothing for one that converged.

    Parameters
    ----------
    found, way
        The cell and the name of the way that ran it.
    base
        The cell that changes nothing, by the same law: what magnifications and steps are compared with.
    """
    verdict, row = found.verdicts[way], found.rows[way]
    if verdict.kind is Class.CONVERGED:
        return ""
    if verdict.kind in (Class.REFUSED, Class.STOPPED, Class.CRASHED, Class.NONSENSE):
        jam = f"; {JAM}" if verdict.kind is Class.STOPPED and _may_jam(found) else ""
        return _status(row["status"], row["message"]) + jam
    if verdict.kind is Class.UNCONFIRMED:
        return "; ".join(
            f"{name}: {_status(of['status'], of['message'])}" for name, of in found.tight.items()
        )
    return _why_degraded(found, way, base)


def _may_jam(found: Found) -> bool:
    """Return whether friction can turn a corner into its wall more than the wall turns it out.

    A force N on a corner at (r_x, r_y) from the centre, with friction c_f N along the wall, turns the slider
    by N (r_y - c_f r_x) / J5: inwards where c_f > r_y / r_x, length over width. What rod 4 lets the centre
    yield counts little beside it. The drive goes on all the same (Painleve's paradox).
    """
    data = found.cell.scene.data
    slider = data["mechanism"]["slider"]
    return bool(data["friction"]["coefficient"] > slider["length"] / slider["width"])


def _why_degraded(found: Found, way: str, base: Found) -> str:
    verdict, row = found.verdicts[way], found.rows[way]
    if found.cell.law == LITERAL_LAW:
        return "the literal switch creates energy: no run converges (study contact-laws)"
    if not isfinite(verdict.promise):
        return "nothing is promised at so coarse a setting"
    told, expected = [], verdict.promise
    magnified = found.magnification / base.magnification
    if magnified > 1.0:
        expected *= magnified
        told.append(f"the scene magnifies {number(magnified, 2)} times as much as the base scene")
    steps, usual = row.get("resolution"), base.rows.get(way, {}).get("resolution")
    if steps is not None and usual is not None and steps < usual:
        # Of second order in the step over the contact's duration.
        expected *= (usual / steps) ** 2
        told.append(f"{number(steps, 2)} steps a contact, {number(usual, 2)} in the base scene")
    if steps is not None and steps < FEW_STEPS:
        return f"a contact lasts {number(steps, 2)} steps"
    apart = _apart(found)
    if verdict.error <= SCATTER * expected:
        return "; ".join(told) or f"within the {SCATTER:g} times by which single runs scatter"
    if apart > verdict.promise:
        told.append(f"the strict runs are {quantity(apart, 'm', 2)} apart themselves")
        return "; ".join(told)
    return "; ".join([*told, UNEXPLAINED])


def _apart(found: Found) -> float:
    """Return how far the runs that count as exact are from one another, m; nan with less than two."""
    runs = [np.asarray(of["x"]) for of in found.tight.values() if of["status"] == "success"]
    return float(np.ptp(runs, axis=0).max()) if len(runs) > 1 else float("nan")


def _status(status: str, message: str) -> str:
    """Return status and message in a short line, without the scene's name."""
    message = message.partition("': ")[2] if message.startswith("scene '") else message
    return f"{status}: {message}" if message else status
