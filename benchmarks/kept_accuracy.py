"""Whether `--accuracy` is kept on random scenes: the hypercube of study extremes, or those of study trust.

Each scene runs by the reference and by Exudyn's tree, over part of a cycle, at every accuracy. The table is
judged on its predictable part by the strict run of the other model, by that of its own where the other has
none; once on all of that part, and once where the judge's own estimate is as small.
"Strict reaches": the estimate of the model's own strict run is as small on as many samples. Scenes that were
measured are cached, so that a pass can be resumed.

    python benchmarks/kept_accuracy.py [--scenes 200] [--seed 1] [--cycles 1] [--limit 20] [--trust]
"""

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from math import nan
from typing import Any

import numpy as np
import pandas as pd

from comparison.accuracy.levels import solver_values
from comparison.accuracy.refine import CHANNEL, ENOUGH, FLOOR, AccurateRun, Level, accurate_run, tried_level
from comparison.execution.run import Outcome, RunError, run_one
from comparison.execution.store import cache_folder, fetch_row, keep_row
from comparison.models import code_hash, fingerprint, platform_name
from comparison.scene import Scene, SceneError, digest, load_scene
from comparison.studies.extremes.cells import SAMPLES, hypercube
from comparison.studies.extremes.runs import BASE
from comparison.studies.trust.population import random_scene

MODELS = {"reference": "auto", "exudyn": "tree"}
ACCURACIES = (1e-6, 1e-8)
MOST = 3.0
"""Times the wanted error that a run may err by on its predictable part."""
LEAST_COVERAGE = 0.8
"""Of that of the strict runs."""
HOPELESS = 3
"""So many runs of a scene by a model that take too long: then no more are tried."""
Found = dict[str, Any]


class OutOfTime(BaseException):
    """Ends a run at its limit; no exception that a model might take for its own."""


def limited(model: str, limit: float) -> Callable[[Sequence[Scene]], list[Outcome]]:
    """Return what runs scenes by a model within a limit of processor time each, s; each once."""
    ran: dict[str, Outcome] = {}

    def attempt(scene: Scene) -> Outcome:
        begun = time.process_time()

        def progress(share: float) -> None:
            if share < 1.0 and time.process_time() - begun > limit:
                raise OutOfTime

        try:
            return Outcome("success", table=run_one(scene, model, progress))
        except RunError as error:
            return error.outcome
        except SceneError as error:
            return Outcome("bad input", str(error))
        except OutOfTime:
            return Outcome("late")

    def run(scenes: Sequence[Scene]) -> list[Outcome]:
        for scene in scenes:
            hopeless = sum(outcome.status == "late" for outcome in ran.values()) >= HOPELESS
            if scene.hash not in ran:
                ran[scene.hash] = Outcome("late") if hopeless else attempt(scene)
        return [ran[scene.hash] for scene in scenes]

    return run


def population(number: int, seed: int, *, trust: bool) -> Scene:
    """Return one of the random scenes; raises `SceneError` where there is no such scene."""
    if not trust:
        return hypercube(200, seed)[number].scene
    return random_scene(number, seed).with_values({"output.groups": [], "output.samples_per_cycle": SAMPLES})


def measure(drawn: Scene, cycles: float, limit: float) -> list[Found]:
    """Return a row a model and accuracy."""
    scenes = {
        model: drawn.with_values({"drive.cycles": cycles, f"solver.{model}.formulation": name})
        for model, name in MODELS.items()
    }
    run = {model: limited(model, limit) for model in MODELS}
    # Before the strict runs, of which more may take too long.
    ran = {
        (model, accuracy): attempt(scene, model, accuracy, run[model])
        for model, scene in scenes.items()
        for accuracy in ACCURACIES
    }
    strict = {
        model: tried_level(scene.with_values(solver_values(model, "strict", scene)), model, run[model], {})
        for model, scene in scenes.items()
    }
    rows = []
    for (model, accuracy), result in ran.items():
        row: Found = {"law": drawn.data["contact"]["law"], "model": model, "accuracy": accuracy}
        if isinstance(result, str):
            row |= {"kept": False, "limit": result, "result": False}
        else:
            (other,) = MODELS.keys() - {model}
            row |= {"kept": result.kept, "limit": result.limit, "result": True, "coverage": result.coverage}
            row |= {"runs": result.runs, "levels": len(result.tried)}
            row["strict"] = 0.0 if (best := strict[model].estimate) is None else best.coverage(accuracy)
            row |= judged(result, strict[other], strict[model])
        rows.append(row)
    return rows


def attempt(scene: Scene, model: str, accuracy: float, run: Any) -> AccurateRun | str:
    """Return the run, or the status of one that did not succeed."""
    try:
        return accurate_run(scene, model, accuracy, run=run)
    except RunError as error:
        return error.outcome.status
    except SceneError:
        return "bad input"


def judged(result: AccurateRun, other: Level, own: Level) -> Found:
    """Return the largest error on the predictable part over the wanted one, and by whom it is judged."""
    judge = other if other.table is not None else own
    if judge.table is None or result.estimate is None or result.wanted is None:
        return {"judge": "", "error": nan, "sure_error": nan}
    error = np.abs(result.table.values(CHANNEL) - judge.table.values(CHANNEL)) / result.wanted
    predictable = result.estimate.u <= result.wanted
    sure = predictable & (judge.estimate is not None and judge.estimate.u <= result.wanted)
    return {
        "judge": "other" if judge is other else "own",
        "error": float(error[predictable].max(initial=0.0)),
        "sure_error": float(error[sure].max(initial=0.0)),
    }


def summary(rows: pd.DataFrame) -> str:
    """Return counts by model and accuracy, and why an accuracy was not reachable or there is no result."""
    kept, result = rows["kept"].astype(bool), rows["result"].astype(bool)
    strict = rows["strict"].fillna(0.0)
    by = [rows["model"], rows["accuracy"]]
    counts = {
        "runs": True,
        "no result": ~result,
        "kept": kept,
        "not reachable": result & ~kept,
        "of these strict reaches it": result & ~kept & (strict >= FLOOR),
        f"kept: error above {MOST:g}": kept & (rows["error"] > MOST),
        "where the judge is sure": kept & (rows["sure_error"] > MOST),
        "strict reaches it in part": result & (strict > 0),
        f"there coverage below {LEAST_COVERAGE:g} of strict's": rows["coverage"] < LEAST_COVERAGE * strict,
    }
    numbers = pd.DataFrame(counts).groupby(by).sum()
    numbers["largest error, judge sure"] = rows["sure_error"].where(kept).groupby(by).max()
    reasons = rows["limit"].where(~kept).groupby(by).value_counts()
    return f"{numbers.T.to_string(float_format='{:g}'.format)}\n\n{reasons.to_string()}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cycles", type=float, default=1.0)
    parser.add_argument("--limit", type=float, default=20.0, help="processor time of a run, s")
    parser.add_argument("--trust", action="store_true", help="scenes of study trust")
    asked = parser.parse_args()
    folder, rows = cache_folder() / "rows-kept-accuracy", []
    code = [code_hash(accurate_run.__module__), *map(fingerprint, MODELS), platform_name()]
    for model, name in MODELS.items():  # compile
        run_one(load_scene(BASE, {"drive.cycles": 0.02, f"solver.{model}.formulation": name}), model)
    for number in range(asked.scenes):
        key = digest([asked.trust, number, asked.seed, asked.cycles, asked.limit, ACCURACIES, *code])
        if (row := fetch_row(folder, key)) is None:
            try:
                drawn = population(number, asked.seed, trust=asked.trust)
                result = measure(drawn, asked.cycles, asked.limit)
            except SceneError:
                result = []  # there is no such scene
            row = keep_row(folder, key, {"rows": result})
            print(f"{number}: {time.process_time():.0f} s", file=sys.stderr, flush=True)
        rows += [{"scene": number, **each} for each in row["rows"]]
    frame = pd.DataFrame(rows)
    floors = f"enough is {ENOUGH:g}, floor {FLOOR:g}"
    print(f"{frame['scene'].nunique()} scenes, {asked.cycles:g} cycles, {floors}\n\n{summary(frame)}")
    worst = frame[frame["error"] > MOST]
    if len(worst):
        print("\n" + worst.to_string())


if __name__ == "__main__":
    main()
