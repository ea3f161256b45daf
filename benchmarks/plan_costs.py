"""What a crank turn costs in every formulation: the numbers behind `sixbar plan`, `comparison/costs.toml`.

Each formulation runs its scene at its standard setting, once to compile, then `--rounds` times, all of them
in turn; the least processor time counts. Of two lengths of run the difference is what a turn costs (in fixed
steps: a step), and the rest what a start costs.

    python benchmarks/plan_costs.py [--rounds 5] [--write]
"""

import argparse
import time
from pathlib import Path

import comparison
from comparison.machine import platform_name
from comparison.scene import Scene, load_scene
from exudyn_model import simulate as exudyn
from reference_model import simulate as reference

MODELS = {"reference": reference, "exudyn": exudyn}
PIN = {"joints.crank_pin": "clearance", "joints.slider": "ideal"}
BOTH = {"joints.crank_pin": "clearance"}
IDEAL = {"joints.slider": "ideal"}
GROUPS = {"output.groups": ["accelerations", "corners"]}
# Model, name in the table, changes of the scene, turns of the short and the long run, order of the method.
CASES = (
    ("reference", "ideal", IDEAL, 20.0, 200.0, 0),
    ("reference", "slider", {}, 1.0, 4.0, 8),
    ("reference", "crank_pin", PIN, 0.2, 1.0, 8),
    ("reference", "crank_pin+slider", BOTH, 0.2, 1.0, 8),
    ("reference", "multiplier", {"solver.reference.formulation": "multiplier"}, 0.5, 2.0, 8),
    ("exudyn", "tree slider", {"solver.exudyn.formulation": "tree"}, 1.0, 2.0, 5),
    ("exudyn", "tree crank_pin", {**PIN, "solver.exudyn.formulation": "tree"}, 0.1, 0.4, 5),
    ("exudyn", "tree crank_pin+slider", {**BOTH, "solver.exudyn.formulation": "tree"}, 0.1, 0.4, 5),
    ("exudyn", "full", {}, 0.02, 0.2, 0),
    ("exudyn", "native", {"solver.exudyn.formulation": "native"}, 0.02, 0.2, 0),
)


def scene(changes: dict, turns: float) -> Scene:
    return load_scene("150rpm-0.2mm", GROUPS | changes | {"drive.cycles": turns})


def seconds(model: str, of: Scene) -> float:
    before = time.process_time()
    result = MODELS[model](of.data)
    assert result.status == "success", result.remedy
    return time.process_time() - before


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--write", action="store_true", help="replace comparison/costs.toml")
    options = parser.parse_args()
    pairs = [[scene(changes, turns) for turns in (short, long)] for _, _, changes, short, long, _ in CASES]
    for (model, *_), (short, _) in zip(CASES, pairs, strict=True):
        seconds(model, short)
    least = [[float("inf")] * 2 for _ in CASES]
    for _ in range(options.rounds):
        for n, ((model, *_), pair) in enumerate(zip(CASES, pairs, strict=True)):
            least[n] = [min(old, seconds(model, of)) for old, of in zip(least[n], pair, strict=True)]
    lines = [
        "# Processor time of a run, s: `start`, and `seconds` for each crank turn of the scene 150rpm-0.2mm",
        "# at `tolerance`, or for each step where there is a `step`. Written by",
        f"# benchmarks/plan_costs.py --write on {platform_name()}.",
    ]
    for (model, name, _, short, long, order), pair, (few, many) in zip(CASES, pairs, least, strict=True):
        settings = pair[0].data["solver"][model]
        per_turn = (many - few) / (long - short)
        start = max(0.0, few - per_turn * short)
        if model == "exudyn" and not order:
            per_turn *= settings["step"] / pair[0].period
            how = [f"step = {settings['step']:g}"]
        else:
            how = [f"tolerance = {settings['tolerance']:g}", f"order = {order}"] if order else []
        lines += [f'\n[{model}."{name}"]', f"start = {start:.2g}", f"seconds = {per_turn:.3g}", *how]
    text = "\n".join(lines) + "\n"
    print(text)
    if options.write:
        (Path(comparison.__file__).parent / "costs.toml").write_text(text, "utf-8")


if __name__ == "__main__":
    main()
