"""Error bound and cost of every setting on every shipped scene, for ``comparison/accuracy/measured.toml``.

Errors: each formulation runs the first cycle at all its settings from several starts 10 nm apart, against the
reference at 1e-14 from the same start; the largest counts. Times: the least of some runs, after one that
compiles. Finished pieces are cached, so that a pass can be resumed; each pass replaces only its columns.

    python benchmarks/error_bounds.py --errors
    python benchmarks/error_bounds.py --seconds [--rounds 3] [--of minimal multiplier]
"""

import argparse
import json
import shutil
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import suppress
from math import ceil, floor, inf, log10
from pathlib import Path
from typing import Any

import numpy as np

import comparison
from comparison.accuracy.levels import SETTINGS, at, physics
from comparison.execution.run import RunError, run_one
from comparison.execution.store import cache_folder, fetch_row, keep_row
from comparison.files import replacing
from comparison.models import fingerprint, formulations, key_of, model_of, platform_name
from comparison.scene import Scene, digest, load_scene, shipped_scenes

TABLE = Path(comparison.__file__).parent / "accuracy" / "measured.toml"
STARTS = {"minimal": 60, "multiplier": 10, "tree": 20, "full": 2}
"""As many as a few minutes allow: a cycle takes the reference 10 ms, the five bodies up to 30 s."""
APART = 1e-8
"""m; between starts: far below what is known of any press, far above every error bound a start could hide."""
EXACT = 1e-14
"""Tolerance of the reference's run that counts as exact."""
MOST_STEPS = 400_000
"""A run of more is not timed: a step of it takes as long as one of the next coarser setting."""
CLOCK_TICK = 1e-6
"""s, by which a run takes longer than its start at least: of the closed form that difference is noise."""
SAFETY = 3.0
"""Single runs scatter by a factor of 3, at most 10; the largest of many starts has most of that in it.

Of 3500 runs of the reference from starts halfway between these, 3 were outside, by factors of 6, 6 and 33.
"""
ROUND_OFF = 1e-15
"""m; some units in the last place of x, which is about -0.5 m: no error bound is below it."""
HEAD = """\
# Error bound and cost of every setting on the shipped scenes. Written by benchmarks/error_bounds.py.
#
# A scene: `physics`, the hash of what errors depend on besides the setting; `cycles` of the crank over which
# errors were measured; `unsure`, the distance of the other model's most accurate run from the one that counts
# as exact (m): nothing closer is confirmed.
# A row: `measured`, the largest error of slider_x (m) over these cycles, of starts 10 nm apart; `error`, the
# error bound (m): three times that, for other starts, at least three times `unsure`, rounded up, of a coarser
# setting no less than of a finer one; `seconds`, processor time of each `unit`, after `start` (s); of steps
# finer than those timed, that of the finest timed one.
# A start may happen to graze a wall, where errors jump: one of some thousand reference runs is outside.
# Measured on {machine}."""
Found = dict[str, Any]
Piece = tuple[str, str, int]


def first_cycle(scene: Scene) -> Scene:
    return scene.with_values({"drive.cycles": min(1.0, scene.data["drive"]["cycles"])})


def stepped(formulation: str) -> bool:
    return key_of(formulation).endswith("step")


def finished(name: str, counts: dict[str, int], work: Callable[..., Found]) -> Iterator[tuple[Piece, Found]]:
    """Do each piece (scene, formulation, start) that is not cached; cheap formulations first."""
    todo = [
        (scene, formulation, number)
        for formulation, count in counts.items()
        for scene in shipped_scenes()
        if formulation in formulations(load_scene(scene).data)
        for number in range(count)
    ]
    folder, begun = cache_folder() / f"rows-{name}", time.monotonic()
    models = fingerprint("reference") + fingerprint("exudyn")
    for count, (scene, formulation, number) in enumerate(todo, 1):
        asked = [SETTINGS[formulation], EXACT]
        key = digest([load_scene(scene).hash, formulation, number, asked, models, platform_name()])
        row = fetch_row(folder, key) or keep_row(folder, key, work(load_scene(scene), formulation, number))
        print(
            f"{count}/{len(todo)} {time.monotonic() - begun:.0f} s: {scene}, {formulation}", file=sys.stderr
        )
        yield (scene, formulation, number), row


def errors(scene: Scene, formulation: str, number: int) -> Found:
    """Return the error (m) of each setting from a start: 0, 1, -1, 2, -2 ... times 10 nm."""
    metres = (number + 1) // 2 * (1 if number % 2 else -1) * APART
    offset = scene.data["initial"]["slider_offset"] + metres
    scene = first_cycle(scene).with_values({"initial.slider_offset": offset})

    def x(formulation: str, setting: float) -> np.ndarray:
        return run_one(at(scene, formulation, setting), model_of(formulation)).values("slider_x")

    exact = x("minimal", EXACT)
    result: Found = {"errors": {}, "failed": {}}
    for setting in SETTINGS[formulation]:
        try:
            result["errors"][f"{setting:g}"] = float(np.abs(x(formulation, setting) - exact).max())
        except RunError as failure:
            result["failed"][f"{setting:g}"] = str(failure)
    return result


def measure_errors() -> None:
    table: dict[str, dict[str, list[Found]]] = {}
    for (name, formulation, _), row in finished("error-bounds", STARTS, errors):
        table.setdefault(name, {}).setdefault(formulation, []).append(row)
    old = tables()
    for name, result in table.items():
        finest = f"{SETTINGS['tree'][-1]:g}"
        unsure = rounded_up(max((row["errors"][finest] for row in result.get("tree", ())), default=ROUND_OFF))
        scene = first_cycle(load_scene(name))
        head = {"physics": physics(scene), "cycles": scene.data["drive"]["cycles"], "unsure": unsure}
        old[name] = old.get(name, {}) | head
        for formulation, rows in result.items():
            entry = old[name].setdefault(model_of(formulation), {}).setdefault(formulation, {})
            entry["unit"] = "step" if stepped(formulation) else "cycle"
            entry["rows"] = bounded(formulation, rows, unsure, entry.get("rows", []))
    write(old)


def bounded(formulation: str, results: list[Found], unsure: float, old: list[Found]) -> list[Found]:
    """Return a formulation's settings with the largest errors and the error bounds; the times stay."""
    times = {row["setting"]: {"seconds": row["seconds"]} for row in old if "seconds" in row}
    rows: list[Found] = []
    finer = 0.0
    for setting in reversed(SETTINGS[formulation]):
        key = f"{setting:g}"
        row: Found = {"setting": setting}
        if failed := [result["failed"][key] for result in results if key in result["failed"]]:
            row["failed"] = failed[0]
        else:
            row["measured"] = two_digits(max(result["errors"][key] for result in results))
            # Where a coarser run happened to be closer, its error bound is not below that of the finer one.
            finer = max(finer, rounded_up(max(SAFETY * max(row["measured"], unsure), ROUND_OFF)))
            row["error"] = finer
        rows.insert(0, row | times.get(setting, {}))
    return rows


def two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def rounded_up(value: float) -> float:
    """Round up to two digits."""
    digit = floor(log10(value)) - 1
    return float(f"{ceil(value / 10.0**digit * (1 - 1e-12))}e{digit}")


def seconds(scene: Scene, formulation: str, rounds: int) -> Found:
    """Return what a start costs and, at each setting, a cycle or a step, s."""
    model, of_steps = model_of(formulation), stepped(formulation)
    scene = first_cycle(scene) if of_steps else scene
    one_sample = scene.with_values({"drive.cycles": 1 / scene.data["output"]["samples_per_cycle"]})
    timed = {"start": at(one_sample, formulation, SETTINGS[formulation][0])}
    for setting in SETTINGS[formulation]:
        if not of_steps or scene.duration / setting <= MOST_STEPS:
            timed[f"{setting:g}"] = at(scene, formulation, setting)
    best: dict[str, float] = {}
    for _ in range(rounds):  # in turn: a machine may be slower for a minute
        for name, job in timed.items():
            with suppress(RunError):  # `failed` reports it
                before = time.process_time()
                run_one(job, model)
                best[name] = min(best.get(name, inf), time.process_time() - before)
    result: Found = {"start": best["start"], "seconds": {}}
    for setting in SETTINGS[formulation]:
        if (name := f"{setting:g}") in best:
            count = scene.duration / (setting if of_steps else scene.period)
            rate = max(best[name] - best["start"], CLOCK_TICK) / count
        elif name in timed:
            continue
        result["seconds"][name] = rate
    return result


def measure_seconds(of: list[str], rounds: int) -> None:
    def work(scene: Scene, formulation: str, _: int) -> Found:
        short = at(scene, formulation, SETTINGS[formulation][0]).with_values({"drive.cycles": 0.02})
        run_one(short, model_of(formulation))  # compiles
        return seconds(scene, formulation, rounds)

    ledger, old = f"error-bounds-seconds-{rounds}", tables()
    for (name, formulation, _), result in finished(ledger, dict.fromkeys(of, 1), work):
        entry = old[name][model_of(formulation)][formulation]
        entry["start"] = two_digits(result["start"])
        for row in entry["rows"]:
            if (rate := result["seconds"].get(f"{row['setting']:g}")) is not None:
                row["seconds"] = float(f"{rate:.3g}")
    write(old)
    shutil.rmtree(cache_folder() / f"rows-{ledger}")  # the next pass measures again


def tables() -> dict[str, Found]:
    return tomllib.loads(TABLE.read_text("utf-8")) if TABLE.exists() else {}


def write(table: dict[str, Found]) -> None:
    """Write the file with a head that says what its numbers are."""
    lines = [HEAD.format(machine=platform_name())]
    for name, scene in sorted(table.items()):
        lines += [f'\n["{name}"]', *_pairs(scene)]
        for model in ("reference", "exudyn"):
            for formulation, entry in scene.get(model, {}).items():
                lines += [f'\n["{name}".{model}.{formulation}]', *_pairs(entry), "rows = ["]
                lines += [*(f"    {{ {', '.join(_pairs(row))} }}," for row in entry["rows"]), "]"]
    with replacing(TABLE) as part:
        part.write_text("\n".join(lines) + "\n", "utf-8")


def _pairs(values: Found) -> list[str]:
    """Return the keys that are numbers or text as lines of TOML."""
    return [
        f"{key} = {json.dumps(value) if isinstance(value, str) else f'{value:g}'}"
        for key, value in values.items()
        if not isinstance(value, (dict, list))
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    group = parser.add_mutually_exclusive_group(required=True)
    group.add_argument("--errors", action="store_true")
    group.add_argument("--seconds", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--of", nargs="+", choices=[*STARTS], default=[*STARTS], help="of --seconds")
    options = parser.parse_args()
    if options.errors:
        measure_errors()
    else:
        measure_seconds(options.of, options.rounds)


if __name__ == "__main__":
    main()
