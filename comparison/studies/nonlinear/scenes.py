"""What the study nonlinear runs."""

from __future__ import annotations

from comparison.execution.run import Job
from comparison.scene import Scene, load_scene
from comparison.studies.nonlinear.chains import Chain

MAIN = "150rpm-0.2mm"
SCENES = (MAIN, "300rpm-0.2mm", "69GPa", "poisson-0.33", "90rpm-0.1mm", "90rpm-0.5mm")
TOLERANCE = {"reference": "solver.reference.tolerance", "exudyn": "solver.exudyn.tolerance"}
TOLERANCES = {"reference": (1e-9, 1e-10, 1e-11, 1e-12), "exudyn": (1e-8, 1e-9, 1e-10, 1e-11)}
USUAL = {"reference": 1e-12, "exudyn": 1e-10}
"""Of the models where only one setting is run."""
DISTANCES = {"reference": (1e-10, 1e-9, 1e-8, 1e-7, 1e-6), "exudyn": (1e-8, 1e-7)}
"""m."""
TURNS = {"reference": 40, "exudyn": 8}
"""Of a chain: Exudyn takes some 4 s a turn for its five runs of each of nine stages."""
LONG = {"reference": 600, "exudyn": 60}
"""Turns of a run for sections."""
LONG_MAIN = {"reference": 600, "exudyn": 110}
"""The same of the main scene: enough for the 0-1 test."""
ANGLES = 40
"""Samples a turn of such a run."""
SPEEDS = tuple(float(speed) for speed in range(60, 401, 10))
CLEARANCES = tuple(round(1e-5 * k, 6) for k in range(6, 61, 2))
BIFURCATION_TURNS = 60


def of_model(name: str, model: str, tolerance: float, values: dict[str, object] | None = None) -> Scene:
    """Return a scene at a tolerance of a model; Exudyn integrates rod 4 and slider alone."""
    fixed: dict[str, object] = {"solver.exudyn.formulation": "tree"} if model == "exudyn" else {}
    return load_scene(name, fixed | {TOLERANCE[model]: tolerance} | (values or {}))


def chain(name: str, model: str, tolerance: float) -> Chain:
    """Return the twins of a scene."""
    return Chain(of_model(name, model, tolerance), model, TURNS[model], DISTANCES[model])


def chains() -> dict[tuple[str, str, float], Chain]:
    """Return all twins: the reference at every tolerance, Exudyn at every one of the main scene."""
    which = [(name, "reference", tolerance) for name in SCENES for tolerance in TOLERANCES["reference"]]
    which += [(MAIN, "exudyn", tolerance) for tolerance in TOLERANCES["exudyn"]]
    which += [(name, "exudyn", USUAL["exudyn"]) for name in SCENES if name != MAIN]
    return {key: chain(*key) for key in which}


def long_run(name: str, model: str) -> Job:
    """Return a long run with the slider's state at `ANGLES` angles a turn."""
    values: dict[str, object] = {
        "drive.cycles": float((LONG_MAIN if name == MAIN else LONG)[model]),
        "output.groups": [],
        "output.samples_per_cycle": ANGLES,
    }
    return Job(of_model(name, model, USUAL[model], values), model)


def bifurcation(key: str, value: float) -> Job:
    """Return a run of the main scene with another speed or clearance."""
    values: dict[str, object] = {
        key: value,
        "drive.cycles": float(BIFURCATION_TURNS),
        "output.groups": [],
        "output.samples_per_cycle": ANGLES,
    }
    return Job(of_model(MAIN, "reference", 1e-10, values), "reference")
