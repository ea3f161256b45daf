"""Error bound and cost of every setting on every shipped scene, for ``accuracy/measured.toml``.

Errors: each formulation runs the first cycle at all its settings from several starts 10 nm apart, against the
reference at 1e-14 from the same start; the largest counts. Times: the least of some runs, after one that
compiles. Finished pieces are cached, so that a pass can be resumed; each pass replaces only its columns.

    python benchmarks/error_bounds.py --errors
    python benchmarks/error_bounds.py --seconds [--rounds 3] [--of minimal multiplier]
    python benchmarks/error_bounds.py --check
"""

import argparse
import json
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from math import ceil, floor, log10
from pathlib import Path
from typing import Any

import error_bound_runs as runs

import comparison
from comparison.accuracy.levels import NAMES, AccuracyError, solver_values
from comparison.accuracy.measured import SETTINGS, at, expected, physics
from comparison.execution.run import run_one
from comparison.execution.store import append_row, cache_folder, read_rows
from comparison.files import replacing
from comparison.models import fingerprint, formulations, key_of, model_of, platform_name
from comparison.scene import digest, load_scene, shipped_scenes

TABLE = Path(comparison.__file__).parent / "accuracy" / "measured.toml"
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
Table = dict[str, Any]
Piece = tuple[str, str, int]


def pieces(counts: dict[str, int]) -> list[Piece]:
    """List scene, formulation and start, cheap formulations first."""
    return [
        (name, formulation, number)
        for formulation, count in counts.items()
        for name in shipped_scenes()
        if formulation in formulations(load_scene(name).data)
        for number in range(count)
    ]


def finished(ledger: Path, todo: list[Piece], work: Callable[..., Table]) -> Iterator[tuple[Piece, Table]]:
    """Do each piece that is not cached, and cache it."""
    ledger.parent.mkdir(parents=True, exist_ok=True)
    cached, begun = read_rows(ledger), time.monotonic()
    models = fingerprint("reference") + fingerprint("exudyn")
    for count, (name, formulation, number) in enumerate(todo, 1):
        asked = [SETTINGS[formulation], runs.EXACT]
        key = digest([load_scene(name).hash, formulation, number, asked, models, platform_name()])
        row = cached.get(key) or append_row(ledger, key, work(name, formulation, number))
        print(f"{count}/{len(todo)} {time.monotonic() - begun:.0f} s: {name}, {formulation}", file=sys.stderr)
        yield (name, formulation, number), row


def measure_errors() -> None:
    table: dict[str, dict[str, list[Table]]] = {}
    begins = runs.starts(max(runs.STARTS.values()))

    def work(name: str, formulation: str, number: int) -> Table:
        return runs.errors(runs.moved(runs.first_cycle(name), begins[number]), formulation)

    for (name, formulation, _), row in finished(
        cache_folder() / "error-bounds.jsonl", pieces(runs.STARTS), work
    ):
        table.setdefault(name, {}).setdefault(formulation, []).append(row)
    old = tables()
    for name, found in table.items():
        finest = f"{SETTINGS['tree'][-1]:g}"
        unsure = rounded_up(max((row["errors"][finest] for row in found.get("tree", ())), default=ROUND_OFF))
        scene = runs.first_cycle(name)
        head = {"physics": physics(scene), "cycles": scene.data["drive"]["cycles"], "unsure": unsure}
        old[name] = old.get(name, {}) | head
        for formulation, rows in found.items():
            entry = old[name].setdefault(model_of(formulation), {}).setdefault(formulation, {})
            entry["unit"] = "step" if key_of(formulation).endswith("step") else "cycle"
            entry["rows"] = bounded(formulation, rows, unsure, entry.get("rows", []))
    write(old)


def bounded(formulation: str, found: list[Table], unsure: float, old: list[Table]) -> list[Table]:
    """Return a formulation's settings with the largest errors and the error bounds; the times stay."""
    times = {row["setting"]: row["seconds"] for row in old if "seconds" in row}
    rows: list[Table] = []
    floor_so_far = 0.0
    for setting in reversed(SETTINGS[formulation]):
        key = f"{setting:g}"
        row: Table = {"setting": setting}
        failed = [of["failed"][key] for of in found if key in of["failed"]]
        if failed:
            row["failed"] = failed[0]
        else:
            row["measured"] = two_digits(max(of["errors"][key] for of in found))
            # Where a coarser run happened to be closer by chance, its error bound is not below that of the
            # finer one.
            own = rounded_up(max(SAFETY * max(row["measured"], unsure), ROUND_OFF))
            row["error"] = floor_so_far = max(own, floor_so_far)
        rows.insert(0, row | ({"seconds": times[setting]} if setting in times else {}))
    return rows


def two_digits(value: float) -> float:
    return float(f"{value:.2g}")


def rounded_up(value: float) -> float:
    """Round up to two digits."""
    digit = floor(log10(value)) - 1
    return float(f"{ceil(value / 10.0**digit * (1 - 1e-12))}e{digit}")


def measure_seconds(formulations: list[str], rounds: int) -> None:
    todo = pieces(dict.fromkeys(formulations, 1))
    for name, formulation, _ in todo:
        short = runs.first_cycle(name).with_values({"drive.cycles": 0.02})
        run_one(at(short, formulation, SETTINGS[formulation][0]), model_of(formulation))
    ledger = cache_folder() / f"error-bounds-seconds-{rounds}.jsonl"
    old = tables()
    for (name, formulation, _), found in finished(
        ledger, todo, lambda name, formulation, _: runs.seconds(load_scene(name), formulation, rounds)
    ):
        entry = old[name][model_of(formulation)][formulation]
        entry["start"] = two_digits(found["start"])
        for row in entry["rows"]:
            if (rate := found["seconds"].get(f"{row['setting']:g}")) is not None:
                row["seconds"] = float(f"{rate:.3g}")
    write(old)
    ledger.unlink()  # the next pass measures again


def check() -> int:
    """Print how many times its estimate each run takes; 1 if any is outside a factor of 2."""
    outside = 0
    for name in shipped_scenes():
        for formulation in ("minimal", "tree", "full"):
            scene, model = load_scene(name), model_of(formulation)
            if formulation not in formulations(scene.data):
                continue
            scene = scene.with_values({f"solver.{model}.formulation": formulation})
            run_one(scene.with_values({"drive.cycles": 0.02}), model)
            for accuracy in (*NAMES, 1e-6, 1e-8):
                try:
                    values = solver_values(model, accuracy, scene)
                except AccuracyError as refused:
                    print(f"{name:<16} {formulation:<8} {accuracy!s:<9} {refused}")
                    continue
                chosen = scene.with_values(values)
                estimate = expected(chosen, model).seconds
                ratio = runs.least(chosen, model, 3 if estimate < 1 else 1) / estimate
                outside += not 0.5 <= ratio <= 2
                setting = ", ".join(f"{value:g}" for value in values.values())
                which = f"{name:<16} {formulation:<8} {accuracy!s:<9} {setting:<8}"
                print(f"{which} {estimate:8.2g} s x {ratio:.2f}", flush=True)
    print(f"{outside} outside a factor of 2")
    return int(outside > 0)


def tables() -> dict[str, Table]:
    return tomllib.loads(TABLE.read_text("utf-8")) if TABLE.exists() else {}


def write(table: dict[str, Table]) -> None:
    """Write the file with a head that says what its numbers are."""
    lines = [HEAD.format(machine=platform_name())]
    for name, scene in sorted(table.items()):
        lines.append(f'\n["{name}"]')
        lines += [f"{key} = {_toml(value)}" for key, value in scene.items() if not isinstance(value, dict)]
        for model in ("reference", "exudyn"):
            for formulation, entry in scene.get(model, {}).items():
                lines.append(f'\n["{name}".{model}.{formulation}]')
                lines += [f"{key} = {_toml(value)}" for key, value in entry.items() if key != "rows"]
                rows = (", ".join(f"{key} = {_toml(v)}" for key, v in row.items()) for row in entry["rows"])
                lines += ["rows = [", *(f"    {{ {row} }}," for row in rows), "]"]
    with replacing(TABLE) as part:
        part.write_text("\n".join(lines) + "\n", "utf-8")


def _toml(value: object) -> str:
    return json.dumps(value) if isinstance(value, str) else f"{value:g}"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    group = parser.add_mutually_exclusive_group(required=True)
    for what in ("errors", "seconds", "check"):
        group.add_argument(f"--{what}", action="store_true")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument(
        "--of", nargs="+", choices=[*runs.STARTS], default=[*runs.STARTS], help="of --seconds"
    )
    options = parser.parse_args()
    if options.check:
        return check()
    if options.errors:
        measure_errors()
    else:
        measure_seconds(options.of, options.rounds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
