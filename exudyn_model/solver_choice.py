"""Formulation, method and settings of a scene's ``[solver.exudyn]``, defaults filled in.

``formulation`` "full" has all five bodies, "native" the same with Exudyn's own contact object at the slider,
"tree" only what the drive leaves free: rod 4 and slider, or, where the crank pin has clearance, all bodies
but the crank; "auto", the same as leaving it out, is "tree" wherever that gives what is asked for and no
implicit method is named, else "full". ``method`` "auto", the same as leaving it out, is the usual one of the
formulation, or "trapezoidal-index2" where the groups "joints" or "energy" are asked for: they need the
constraints' multipliers, and those of "generalized-alpha", whose constraints are at position level, carry the
Newton iteration's error divided by the square of the step. They are not given out.
"""

from collections.abc import Mapping
from typing import Any

# Usual settings of each formulation: step in s; what the tolerance means, see `parameters.Integration`
_USUAL: dict[str, dict[str, Any]] = {
    "full": {"method": "generalized-alpha", "step": 2e-6, "tolerance": 1e-7},
    "native": {"method": "generalized-alpha", "step": 2e-6, "tolerance": 1e-7},
    "tree": {"method": "dopri5", "step": 1e-4, "tolerance": 1e-10},
}

_IMPLICIT = ("generalized-alpha", "trapezoidal-index2")
_METHODS = {"full": _IMPLICIT, "native": _IMPLICIT, "tree": ("dopri5",)}


def choose_solver(scene: Mapping[str, Any]) -> dict[str, Any]:
    """Return formulation, method, step and tolerance.

    Raises
    ------
    ValueError
        In one line, for what does not fit together.
    """
    given = dict(scene["solver"]["exudyn"])
    formulation = given.pop("formulation", "auto")
    if formulation not in ("auto", *_USUAL):
        raise ValueError(
            f"solver.exudyn.formulation = {formulation!r} must be one of 'auto', 'full', 'native' and 'tree'"
        )
    forces = [group for group in scene["output"]["groups"] if group in ("joints", "energy")]
    if formulation == "auto":
        free = "clearance" in (scene["joints"]["slider"], scene["joints"]["crank_pin"])
        explicit = given.get("method", "auto") in ("auto", *_METHODS["tree"])
        formulation = "tree" if free and explicit and not forces else "full"
    usual = dict(_USUAL[formulation])
    if forces and "trapezoidal-index2" in _METHODS[formulation]:
        usual["method"] = "trapezoidal-index2"
    if given.get("method") == "auto":
        del given["method"]
    chosen = {"formulation": formulation} | usual | given
    if chosen["method"] not in _METHODS[formulation]:
        raise ValueError(
            f"solver.exudyn.method = {chosen['method']!r} does not integrate solver.exudyn.formulation = "
            f"{formulation!r}; use {usual['method']!r}"
        )
    if forces and chosen["method"] != "trapezoidal-index2":
        raise ValueError(
            f"output.groups = {forces[0]!r} is not given by solver.exudyn.method = {chosen['method']!r}; use "
            "'trapezoidal-index2' (formulation 'full')"
        )
    if scene["joints"]["slider"] != "clearance" and (
        formulation == "native" or (formulation == "tree" and scene["joints"]["crank_pin"] != "clearance")
    ):
        raise ValueError(
            f"joints.slider = {scene['joints']['slider']!r} leaves solver.exudyn.formulation = "
            f"{formulation!r} nothing free; use 'full'"
        )
    if formulation == "native":
        for key, value, known in (
            ("joints.crank_pin", scene["joints"]["crank_pin"], "ideal"),
            ("contact.law", scene["contact"]["law"], "hertz-corners"),
            ("contact.impact_speed", scene["contact"].get("impact_speed", "frozen"), "frozen"),
        ):
            if value != known:
                raise ValueError(
                    f"{key} = {value!r} has no contact object for solver.exudyn.formulation = 'native'; "
                    "use 'full'"
                )
    for key in ("step", "tolerance"):
        if not chosen[key] > 0:
            raise ValueError(f"solver.exudyn.{key} = {chosen[key]} must be positive")
    return chosen
