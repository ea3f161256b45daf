"""Pages, each one self-contained HTML file: the report, several models, the press in motion, the gate.

The report has the verdict, the worst channel, an overview and the scenes.
"""

import base64
import hashlib
import re
import subprocess
from cmath import rect
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache, partial
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from itertools import count
from math import ceil, degrees, isnan, radians, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import numpy as np
from markupsafe import Markup

from comparison.execution.store import fetch, hash_of, keep
from comparison.files import write_text
from comparison.formatting import NO_BREAK, number, percent, pretty_unit, quantity
from comparison.metrics import WINDOW
from comparison.models import package_hash, platform_name
from comparison.regression.check import Check, Gate
from comparison.reliability.assessment import MARGIN
from comparison.report import svg, tables
from comparison.report.plots import FORCES, MOTION, displayed_channels, scene_plots, table_plots
from comparison.tables.channels import channels, has_load
from comparison.tables.table import Table, TableError
from comparison.tables.table_files import read
from comparison.verdict.results import ChannelComparison, SceneComparison, rank
from comparison.verdict.validate import Pair, Standing
from comparison.words import differences, verdicts
from comparison.words.differences import lead
from comparison.words.record import check_message, deviations, gate_counts, gate_notes, gate_summary, of_gate
from comparison.words.reliability import notes
from comparison.words.since import Since, sentences
from comparison.words.verdicts import SYMBOLS, standing

# ---- common parts of all pages: jinja's settings, style sheet, script and origin

ASSETS = Path(__file__).with_name("assets")
TEMPLATES = jinja2.Environment(
    loader=jinja2.FileSystemLoader(ASSETS),
    autoescape=True,
    undefined=jinja2.StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)
"""Templates escape HTML, and refuse a name without a value."""
TEMPLATES.globals |= {"symbols": SYMBOLS, "number": number, "percent": percent, "quantity": quantity}


def style() -> Markup:
    """Return the style sheet of all pages."""
    return Markup((ASSETS / "report.css").read_text("utf-8"))


def interactive_page(template: str, **values: Any) -> str:
    """Return a page with the script of the interactive plots, which admits no other script."""
    names = ("uplot/LICENSE", "uplot/uPlot.iife.min.js", "animation.js", "plots.js", "uplot/uPlot.min.css")
    licence, library, animation, plots, css = ((ASSETS / name).read_text("utf-8") for name in names)
    script = "\n".join([f"/* uPlot\n{licence}*/", library, animation, plots])
    return TEMPLATES.get_template(template).render(
        css=Markup(css + "\n") + style(),
        script=Markup(script),
        # The page's Content-Security-Policy admits the script by its hash.
        script_hash=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        **values,
    )


def origin() -> dict[str, str]:
    """Return the present time, the code version and the machine, for a report."""
    time = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return {"time": time, "code": code_version(Path(__file__)), "machine": platform_name()}


@cache
def code_version(file: Path) -> str:
    """Return the version and, in a checkout that tracks this file, the commit, with a note if modified."""
    try:
        release = f"sixbar-crossval {version('sixbar-crossval')}"
    except PackageNotFoundError:
        release = "sixbar-crossval"

    def git(*arguments: str) -> str:
        command = ["git", "-C", str(file.parent), *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True).stdout.strip()

    try:
        # An installed package may lie in another project's checkout, whose commit is not its own.
        git("ls-files", "--error-unmatch", file.name)
        commit = git("rev-parse", "--short=10", "HEAD")
        changes = git("status", "--porcelain", "--untracked-files=no", ":/")
    except (OSError, subprocess.SubprocessError):  # there is no git, or it fails
        return release
    return f"{release}, commit {commit}{' with modifications' if changes else ''}"


# ---- drawing of the press and of the slider in its guide, as SVG with the scene's dimensions
#
# The pages' script moves the same drawing through the run: it addresses the parts by their classes.

_SLIDER = (448.0, 172.0, 70.0, 118.0)  # centre (x, y), width and height of the enlarged slider
_GAP = 18.0  # width of the clearance in the drawing
_INSET = 7.0  # width of an enlarged clearance of a linkage
_LEFT, _TOP, _WIDTH, _HEIGHT = 16.0, 34.0, 300.0, 250.0  # drawing of the press


def joints(mechanism: Mapping[str, Any], crank_angle_deg: float) -> dict[str, complex] | None:
    """Return positions (m): the crank's O and A, the rocker's B, pivot H and tip C, the slider's F.

    None if the mechanism cannot be assembled. Only drawings use them: they are exact to a tenth of a
    millimetre, as they neglect the clearances.
    """
    crank, rod2, rocker, rod4 = (mechanism[name] for name in ("crank", "rod2", "rocker", "rod4"))
    A, H = rect(crank["length"], radians(crank_angle_deg)), complex(*mechanism["rocker_pivot"])
    # B is where circles about A and H cross.
    distance = abs(H - A)
    projection = (distance**2 + rod2["length"] ** 2 - rocker["centroid"] ** 2) / (2 * distance)
    square = rod2["length"] ** 2 - projection**2
    if square < 0.0:
        return None
    B = A + (H - A) / distance * complex(projection, mechanism["rocker_branch"] * sqrt(square))
    C = H + rocker["length"] / rocker["centroid"] * (B - H)
    drop_square = rod4["length"] ** 2 - (mechanism["guide_x"] - C.real) ** 2
    if drop_square < 0.0:
        return None
    F = complex(mechanism["guide_x"], C.imag + mechanism["slider_branch"] * sqrt(drop_square))
    return {"O": 0j, "A": A, "B": B, "H": H, "C": C, "F": F}


def schematic(scene: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Draw the press of a scene at its start, with texts and the geometry that the script needs to move it.

    None without a scene, or if the press cannot be assembled.
    """
    if scene is None:
        return None
    mechanism, drive = scene["mechanism"], scene["drive"]
    start = joints(mechanism, mechanism["crank_angle_deg"])
    if start is None:
        return None
    clearance, pin = (
        float(scene["clearance"][joint]) if scene["joints"][joint] == "clearance" else 0.0
        for joint in ("slider", "crank_pin")
    )
    # The stroke is some four cranks long; the slider starts near its top.
    crank, width, length = (
        mechanism[part][key] for part, key in (("crank", "length"), ("slider", "width"), ("slider", "length"))
    )
    xs = [point.real for point in start.values()] + [-crank, crank]
    ys = [point.imag for point in start.values()] + [-crank, start["F"].imag - 5.5 * crank - length]
    scale = min(_WIDTH / (max(xs) - min(xs)), _HEIGHT / (max(ys) - min(ys)))
    origin = complex(_LEFT + 14 - scale * min(xs), _TOP + scale * max(ys))
    drawing = TEMPLATES.get_template("schematic.svg.j2").render(
        at={name: origin + scale * point.conjugate() for name, point in start.items()},
        half=0.5 * scale * width,
        tall=scale * length,
        top=_TOP,
        height=_HEIGHT,
        slider=_SLIDER,
        gap=_GAP,
        mechanism=mechanism,
        clearance=clearance,
        pin=pin,
        mm=_mm,
    )
    guide = f"clearance {_mm(clearance)} on each side" if clearance else "held by its guide"
    guide += f"; a workpiece below y = {_mm(scene['load']['surface'])}" if has_load(scene) else ""
    caption = f"Crank at {mechanism['crank_angle_deg']:g}° at the start, {drive['speed_rpm']:g} rpm; "
    caption += f"slider {_mm(width)} wide and {_mm(length)} long, {guide}"
    caption += f"; radial clearance at the crank pin A {_mm(pin)}." if pin else "."
    about = "Schematic of the six-bar press at the start, and its slider in the guide enlarged."
    return {
        "svg": Markup(drawing.replace("\n", "")),
        "caption": caption,
        "alt": f"{about} {caption}",
        "geometry": {
            "mechanism": mechanism,
            "speed": drive["speed_rpm"] * 6.0,
            "view": [scale, origin.real, origin.imag],
            # Pixels of the enlarged drawing per metre of clearance; 0 where the guide holds the slider.
            "magnified": _GAP / clearance if clearance else 0.0,
            "slider": list(_SLIDER),
        },
    }


def linkage_drawing(scene: SceneComparison) -> dict[str, Any] | None:
    """Draw a linkage at its start, from the motion of the first model; None without a linkage.

    Every body is drawn in its own frame, from the centroid: the script moves it as a whole.
    """
    if scene.run_scene is None or not scene.run_scene.is_linkage or not scene.channels:
        return None
    data = scene.run_scene.data
    joints = [*data["pin"].values(), *data["spring"].values()]
    fixed = [complex(*joint["point"]) for joint in joints if joint["joins"][0] == "frame"]
    outlines, motion, start = {"frame": fixed}, [np.array(fixed)], {"frame": [0.0, 0.0, 0.0]}
    # Points of the bodies in their own frames, from the centroid; "BODY." is their origin.
    body_points = {"frame.": 0j}
    for name, body in data["body"].items():
        centroid = complex(*body["centroid"])
        outlines[name] = [complex(*point) - centroid for point in body["points"].values()]
        body_points |= dict(zip([f"{name}.{point}" for point in body["points"]], outlines[name], strict=True))
        body_points |= {f"{name}.": -centroid, f"{name}.centroid": 0j}
        x, y, angle = (scene.channels[f"{name}.{quantity}"].a for quantity in ("x", "y", "angle"))
        motion += [x + 1j * y + point * np.exp(1j * angle) for point in (0.0, *outlines[name])]
        start[name] = [float(x[0]), float(y[0]), float(angle[0])]
    track = np.concatenate(motion)
    width, height = (float(np.ptp(part)) or 1e-9 for part in (track.real, track.imag))
    scale = min(560.0 / width, 270.0 / height)
    left, top = 20.0 - scale * float(track.real.min()), 36.0 + scale * float(track.imag.max())
    guides: dict[str, list[tuple[complex, complex]]] = {name: [] for name in start}
    for guide in data["guide"].values():
        middle = complex(*guide["point"]) + body_points[f"{guide['on']}."]
        half = rect(max(width, height), radians(guide["direction_deg"]))
        guides[guide["on"]].append((middle - half, middle + half))
    springs = []
    for spring in data["spring"].values():
        ends = [(name, body_points.get(name, complex(*spring["point"]))) for name in spring["joins"]]
        springs.append([[name.partition(".")[0], point.real, point.imag] for name, point in ends])
    pins: dict[str, list[tuple[str, complex]]] = {name: [] for name in start}
    for name, pin in data["pin"].items():
        pins[pin["joins"][1].partition(".")[0]].append((name, body_points[pin["joins"][1]]))
    drawing = TEMPLATES.get_template("linkage.svg.j2").render(
        places=[(name, left + scale * x, top - scale * y, -degrees(t)) for name, (x, y, t) in start.items()],
        outlines=outlines,
        guides=guides,
        pins=pins,
        scale=scale,
        sliders={guide["body"] for guide in data["guide"].values()},
        springs=len(springs),
        insets=[*_insets(data, start)],
        height=330 + 120 * ceil(len(scene.run_scene.loose) / 5),
    )
    caption = f"{', '.join(data['body'])} at the start, from the run by {scene.labels[0]}."
    caption += " Below, its clearances enlarged." if scene.run_scene.loose else ""
    return {
        "svg": Markup(drawing.replace("\n", "")),
        "caption": caption,
        "alt": f"Drawing of the linkage: {caption}",
        "geometry": {"bodies": start, "springs": springs, "view": [scale, left, top]},
    }


def _insets(data: Mapping[str, Any], start: Mapping[str, Sequence[float]]) -> Iterator[dict[str, Any]]:
    """Yield places and shapes of the enlarged clearances of a linkage, px: each gap is equally wide."""
    for n, (name, joint) in enumerate(data.get("clearance", {}).items()):
        factor, offset, guide = _INSET / joint["size"], joint["offset"], data["guide"].get(name)
        inset = {"x": 60 + 120 * (n % 5), "y": 370 + 120 * (n // 5), "words": f"{name}: {_mm(joint['size'])}"}
        if guide is None:
            yield inset | {"shift": (factor * offset[0], -factor * offset[1]), "block": None}
            continue
        length, width, tilt = joint["length"], joint["width"], -factor * joint["tilt_deg"]
        scale = min(80.0 / length, 36.0 / width)  # of the block; displacements are magnified
        inset |= {"turned": -guide["direction_deg"] - degrees(start[guide["on"]][2]), "tilt": tilt / scale}
        yield inset | {"shift": -factor * offset, "block": (scale * length, scale * width), "gap": _INSET}


def _mm(metres: float) -> str:
    return f"{1e3 * metres:.6g}{NO_BREAK}mm"


# ---- the report

_BUILT_IN = {
    "reference": "a hand-written solver of the equations",
    "exudyn": "the same scenes, written independently as multibody models in Exudyn",
}
"""Label of a built-in model -> its description."""


def render(
    comparisons: Sequence[SceneComparison],
    *,
    title: str,
    command: str,
    missing: Sequence[str] = (),
    since: Since | None = None,
    origin: Mapping[str, str] | None = None,
) -> str:
    """Return the page of scenes, which ``command`` reproduces; equal arguments give identical text.

    ``missing`` are the names of requested scenes without a comparison: the page is incomplete. ``since`` has
    the moves since an earlier report.
    """
    # Equally severe scenes stay in their order.
    scenes = sorted(comparisons, key=lambda scene: -rank(scene.worst_verdict))
    keys = anchors([scene.name for scene in scenes])
    cells = [
        (scene, tier, f"{key}--{tier.tier}")
        for scene, key in zip(scenes, keys, strict=True)
        for tier in scene.tiers
    ]
    all_tiers = [tier for _, tier, _ in cells]
    channels = [channel for tier in all_tiers for channel in tier.channels.values()]
    of_tables = bool(scenes) and all(scene.run_scene is None and scene.failed_job is None for scene in scenes)
    if of_tables and len(scenes) == 1 and not all(label in title for label in scenes[0].labels):
        title = f"{' and '.join(scenes[0].labels)}: {title[0].lower()}{title[1:]}"
    # The limit that decides: "uncertainty", "tolerance" or "" (none).
    threshold = "tolerance" if any(channel.threshold is not None for channel in channels) else ""
    limits = [verdicts.threshold_name(channel) for channel in channels if channel.u is not None]

    def severity(figure: tuple[Any, SceneComparison, str, ChannelComparison]) -> tuple[int, bool, float]:
        return rank(figure[1].verdict), not isnan(figure[3].ratio), figure[3].ratio

    # The channel nearest to its limit, or farthest beyond it, of the tier with the worst verdict.
    figures = [(*cell, channel) for cell in cells if (channel := _main_channel(cell[1])) is not None]
    return interactive_page(
        "report.html.j2",
        title=title,
        command=command,
        origin=origin,
        scenes=scenes,
        keys=keys,
        cells=cells,
        missing=missing,
        since=since,
        since_sentences=sentences,
        incomplete=verdicts.incomplete(comparisons, missing),
        failing=[cell for cell in cells if rank(cell[1].verdict) > rank("agree")],
        worst=max(figures, key=severity, default=None),
        verdict_of_all=verdicts.overall_verdict(comparisons),
        headline=verdicts.headline(comparisons),
        lead=lead(scenes),
        tiers=list(dict.fromkeys(tier.tier for tier in all_tiers)),
        ratio=verdicts.ratio_name(comparisons),
        threshold="uncertainty" if limits else threshold,
        limit=limits[0] if limits else "",
        of_tables=of_tables,
        gated=any(channel.checks for channel in channels),
        models=_models(all_tiers),
        channel_names=list(dict.fromkeys(channel.channel for channel in channels)),
        reliability=any(tier.reliability for tier in all_tiers),
        margin=MARGIN,
        impact_window=WINDOW,
        definition=verdicts.definition(comparisons),
        ratio_of=lambda channel: "" if channel is None or isnan(channel.ratio) else number(channel.ratio, 2),
        percent_of=lambda share: "" if isnan(share) else percent(share),
        card_of=verdicts.card,
        channel_figure=lambda tier, channel, key: _drawing(
            tier, [channel.channel, key], partial(_figure, tier, channel, key)
        ),
        schematic=schematic,
        linkage_drawing=linkage_drawing,
        by_severity=lambda scene: sorted(scene.tiers, key=lambda tier: -rank(tier.verdict)),
        plots_of=lambda tiers: [
            (tier.tier, text) for tier in tiers if (text := _drawing(tier, [], partial(scene_plots, tier)))
        ],
        main_channel=_main_channel,
        displayed_channels=displayed_channels,
        sections=_sections,
        without_contact=_without_contact,
        tables=tables,
        verdicts=verdicts,
        differences=differences,
        notes=notes,
    )


def write_report(
    comparisons: Sequence[SceneComparison],
    path: Path,
    *,
    title: str,
    command: str,
    missing: Sequence[str] = (),
    since: Since | None = None,
) -> Path:
    """Write the page that `render` returns, with its origin; return its path."""
    options: dict[str, Any] = {"title": title, "command": command, "missing": missing, "since": since}
    html = render(comparisons, **options, origin=origin())
    write_text(html, path)
    return path


def anchors(names: Sequence[str]) -> list[str]:
    """Return the id of each scene's section: its name, if that is valid and unique.

    Ids of parts of a section have two hyphens; none of these has.
    """
    reservations, ids = {"overview", "since", "definition", "scope", "reproduce", "all-channels"}, []
    for name in names:
        stem = re.sub(r"[^A-Za-z0-9_.+=]+", "-", name).strip("-") or "scene"
        candidates = (f"{stem}-{n}" if n > 1 else stem for n in count(1))
        ids.append(next(each for each in candidates if each not in reservations))
        reservations.add(ids[-1])
    return ids


def _drawing(tier: SceneComparison, part: list[str], draw: Callable[[], str]) -> Markup:
    """Return a drawing; for models' runs it is stored, and read again for an equal comparison."""
    if tier.run_scene is None or not tier.channels:
        return Markup(draw())
    key = hash_of([tier.hash, *part, package_hash()])
    if (drawing := fetch(key)) is None:
        drawing = str(draw())
        keep(key, drawing)
    return Markup(drawing)


def _figure(tier: SceneComparison, channel: ChannelComparison, key: str) -> str:
    figures = import_module("comparison.report.figures")  # slow to import, and often not needed
    return str(figures.channel_figure(tier, channel, key))


def _main_channel(tier: SceneComparison) -> ChannelComparison | None:
    """Return the channel of a scene's figure: the one that decides, else the first excited one."""
    return tier.worst_channel or next(iter(tier.excited.values()), None)


def _without_contact(scene: SceneComparison) -> bool:
    return all(events is not None and events.empty for events in scene.events)


def _sections(scene: SceneComparison) -> list[tuple[str, str]]:
    """Return ids and names of the sections that a scene has."""
    touching = any(events is not None and len(events) for events in scene.events)
    sections = {
        "plots": ("Plots", any(map(displayed_channels, scene.tiers))),
        f"{scene.tier}-why": ("Why", True),
        f"{scene.tier}-channels": ("Channels", scene.excited),
        "contacts": ("Contacts", touching or _without_contact(scene)),
        "reliability": ("Reliability", any(tier.reliability for tier in scene.tiers)),
        "runs": ("Runs", any(tier.provenance for tier in scene.tiers)),
    }
    return [(id_, name) for id_, (name, content) in sections.items() if content]


def _models(tiers: Sequence[SceneComparison]) -> dict[str, str]:
    """Return description, formulations and versions of each label."""
    models = {}
    for label in dict.fromkeys(label for tier in tiers for label in tier.labels):
        runs = [tier.provenance[label] for tier in tiers if label in tier.provenance]
        formulations = dict.fromkeys(str(run["formulation"]) for run in runs if run.get("formulation"))
        versions: dict[str, str] = next((run["versions"] for run in runs if run.get("versions")), {})
        releases = [f"{name} {versions[name]}" for name in (label, "sixbar-crossval") if name in versions]
        parts = [_BUILT_IN.get(label, ""), "; ".join(formulations), ", ".join(releases)]
        models[label] = "; ".join(part for part in parts if part)
    return {label: words for label, words in models.items() if words}


# ---- several models against each other, and the press in motion

_MOST_MODELS = 3
"""Most models on common plots: no reader can follow more lines over each other."""


class Row(NamedTuple):
    """A scene at the standard tier, with its entry in the ``summary.json`` of every pair."""

    name: str
    title: str
    standing: Standing
    results: dict[Pair, dict[str, Any]]


def write_pairwise(rows: Sequence[Row], folder: Path, *, models: Sequence[str], command: str) -> Path:
    """Write ``report.html`` of several models beside the pairs' reports, from whose tables it draws."""
    html = interactive_page(
        "pairwise.html.j2",
        title=f"{len(models)} models against each other",
        models=models,
        rows=rows,
        lead=standing(rows[0].standing) if len(rows) == 1 else "",
        sentence=standing,
        keys=anchors([row.name for row in rows]),
        plots=[_plots(row, folder, models) for row in rows],
        command=command,
    )
    write_text(html, folder / "report.html")
    return folder / "report.html"


def _plots(row: Row, folder: Path, models: Sequence[str]) -> str:
    """Return the plots of a scene's base runs by several models; empty for fewer than two runs."""
    tables: dict[str, Table] = {}
    for model, pair in ((model, pair) for model in models for pair in row.results if model in pair):
        if model not in tables and len(tables) < _MOST_MODELS:
            with suppress(TableError):  # a run that did not succeed has no complete table
                tables[model] = read(folder / "-".join(pair) / "tables" / f"{row.name}-{model}.csv")
    if len(tables) < 2 or any(table.time.size < 2 for table in tables.values()):
        return ""
    scene = next(iter(tables.values())).scene
    names = [name for name in channels() if not name.startswith("corner_") or name.endswith("_normal")]
    return table_plots(tables, names, None if scene is None else scene.data)


def write_animation(
    tables: Mapping[str, Table], scene: Mapping[str, Any], path: Path, *, title: str, command: str
) -> Path:
    """Write the animation of one table, or of two over each other at the times of the first."""
    for label, table in tables.items():
        if missing := [name for name in MOTION if name not in table.channels]:
            needs = f"an animation needs {', '.join(MOTION)}"
            raise TableError(f"{label}: channel {missing[0]!r} is missing; {needs}")
        if table.time.size < 2:
            raise TableError(f"{label}: an animation needs two samples at least")
    mechanism, speed = scene["mechanism"], float(scene["drive"]["speed_rpm"])
    time = next(iter(tables.values())).time
    seconds = float(time[-1] - time[0])
    angles = np.sign(speed) * np.linspace(0, min(360.0, 6.0 * abs(speed) * seconds), 360)
    if any(joints(mechanism, mechanism["crank_angle_deg"] + angle) is None for angle in angles):
        raise TableError("the mechanism of this scene cannot be assembled at every crank angle")
    html = interactive_page(
        "animation.html.j2",
        title=title,
        labels=list(tables),
        seconds=seconds,
        cycles=seconds * abs(speed) / 60.0,
        schematic=schematic(scene),
        plots=table_plots(tables, (*MOTION, *FORCES), scene),
        command=command,
    )
    write_text(html, path)
    return path


# ---- the regression gate: changes since the baseline

_FIGURES = 12
"""Most figures, of the channels that deviate first."""


def write_gate(gate: Gate, path: Path, *, command: str, lead: Sequence[str]) -> Path:
    """Write the page of a gate, which ``command`` repeats; it begins with the lines of ``lead``."""
    checks = deviations(gate)
    html = interactive_page(
        "gate.html.j2",
        title="Has a model changed since its baseline?",
        verdict="differ" if gate.regressions else "agree",
        summary=gate_summary(gate),
        lead=lead,
        figures=[
            (check_message(check), _gate_figure(check, f"g{n}")) for n, check in enumerate(checks[:_FIGURES])
        ],
        rest=max(0, len(checks) - _FIGURES),
        cases=[case for case in of_gate(gate) if case.status in ("failed", "error")],
        counts=gate_counts(gate),
        notes=gate_notes(gate),
        origin=origin(),
        command=command,
    )
    write_text(html, path)
    return path


def _gate_figure(check: Check, key: str) -> Markup:
    """Draw the current curve with the baseline's checkpoints, and below it their distance and threshold."""
    from matplotlib.figure import Figure

    time, values = check.data["curve"]
    instants, before, threshold, now = check.data["rows"].T
    distance, unit = np.abs(now - before), pretty_unit(check.data["unit"])
    wide, thin = svg.MODEL_LINES
    with svg.style():
        figure = Figure(layout="constrained")
        figure.set_figheight(3.3)
        upper, lower = figure.subplots(2, 1, sharex=True)
        rows = svg.envelope(values)
        ring: dict[str, Any] = {"ls": "", "marker": "o", "ms": 6, "mfc": "none", "mew": 1.6}
        upper.plot(instants, before, color=wide["color"], label="baseline", zorder=3, **ring)
        upper.plot(time[rows], values[rows], label="now", **thin)
        upper.set_ylabel(f"{check.name}\n({unit})" if unit else check.name, parse_math=False)
        floor = min(threshold.min(), distance[distance > 0.0].min()) / 3
        lower.set_yscale("log", nonpositive="clip")
        lower.vlines(
            instants, floor, np.maximum(distance, floor), color=svg.DIFFERENCE, lw=2.4, label="|difference|"
        )
        lower.plot(instants, threshold, "_", color=svg.THRESHOLD, ms=14, mew=1.6, label="threshold")
        lower.set_ylim(floor, 4 * max(distance.max(), threshold.max()))
        lower.set_ylabel(f"|now − baseline|\n({unit})" if unit else "|now − baseline|", parse_math=False)
        lower.set_xlabel("time (s)", labelpad=2)
        lower.set_xlim(time[0], time[-1])
        for axes in (upper, lower):
            axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderaxespad=0.2)
        figure.align_ylabels([upper, lower])
        return Markup(svg.inline_svg(figure, key))  # matplotlib escapes the text in its drawings
