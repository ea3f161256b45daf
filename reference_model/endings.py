"""How a run ended: its status and, after a failure, what to try.

What to try is what was seen to help (tests/contract/test_remedies.py, the study extremes), or nothing.
"""

from reference_model import integrate
from reference_model.parameters import SCIPY_METHODS, Parameters

JAMMING = 1.0
"""Coefficient of friction up to which runs were seen to end."""
_FAILURES = {
    integrate.STEP_TOO_SMALL: ("step-too-small", "steps are below the round-off of time"),
    integrate.NOT_FINITE: (
        "non-finite",
        "the motion left the range of the linkage: check clearance and start",
    ),
    integrate.CHATTER: ("chatter", "contacts open and close at one instant without end"),
    integrate.STEP_LIMIT: ("work-limit", "shorten drive.cycles to less than was reached"),
}


def ending(code: int, p: Parameters) -> tuple[str, str]:
    """Return the status of a run and what to try where that is not "success"."""
    status, remedy = _FAILURES.get(code, ("success", ""))
    if status != "success" and p.friction_coefficient > JAMMING:
        # Where such a run ends, and with which status, rounding decides.
        return status, "lower friction.coefficient to 1 or less: above it a slider can jam in its guide"
    if status == "work-limit" and p.method in SCIPY_METHODS:
        remedy += "; or take solver.reference.method = 'dop853'"
    elif status == "work-limit":
        # Damping over the frozen impact speed: of depths that no such impact reaches, it is stiff.
        remedy += "; where a corner stays pressed deep into a wall, take solver.reference.method = 'LSODA'"
    return status, remedy
