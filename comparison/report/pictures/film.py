"""Animation of the press and of the magnified slider as a GIF, or as MP4 where ffmpeg is installed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from comparison.files import replacing
from comparison.report import svg
from comparison.report.pictures.drawing import GAP, SLIDER, corners, press_box
from comparison.report.pictures.motion import Motion
from comparison.tables.table import TableError

FORMATS = (".gif", ".mp4")
PICTURES_A_SECOND = 25
SECONDS = 12.0
"""Length of a film at most; a longer one takes minutes to draw."""


def check_film(path: Path) -> None:
    """Refuse a film that cannot be written here.

    Raises
    ------
    TableError
        If it is MP4 and there is no ffmpeg.
    """
    if path.suffix.lower() == ".mp4" and not FFMpegWriter.isAvailable():
        raise TableError(f"{path}: MP4 needs ffmpeg, which is not installed; .gif and .html need nothing")


def write_film(motion: Motion, path: Path, on_progress: Callable[[float], None]) -> Path:
    """Write the film, see `check_film`, and report the finished share, 0 to 1."""
    check_film(path)
    gif = path.suffix.lower() == ".gif"
    writer: AbstractMovieWriter = (PillowWriter if gif else FFMpegWriter)(fps=PICTURES_A_SECOND)
    frames = np.unique(
        np.linspace(0, len(motion.time) - 1, int(SECONDS * PICTURES_A_SECOND)).round().astype(int)
    )
    colours = svg.light_colours()
    path.parent.mkdir(parents=True, exist_ok=True)
    with svg.style(colours), replacing(path) as part:
        named = part.with_suffix(path.suffix)  # the writers choose the format by the ending
        figure = Figure(figsize=(7.2, 4.0), dpi=100, facecolor="white", layout="constrained")
        press, guide = figure.subplots(1, 2)
        for axes in (press, guide):
            axes.set_aspect("equal")
            axes.set_axis_off()
        box, wall = press_box(motion), SLIDER[0] / 2 + (GAP if motion.clearance else 0.0)
        press.set(xlim=(box.left, box.left + box.width), ylim=(box.bottom, box.bottom + box.height))
        guide.set(xlim=(-wall - 25, wall + 25), ylim=(-110, 110))
        for side in (-1.0, 1.0):
            guide.axvspan(side * wall, side * (wall + 25), color=colours[svg.SHADE], lw=0)
        (chain,) = press.plot([], [], "o-", color=colours[svg.INK], lw=2, ms=4)
        (rocker,) = press.plot([], [], "-", color=colours[svg.INK], lw=2)
        (slider,) = press.plot([], [], "s", color=colours[svg.LIMIT], ms=9)
        outlines = {label: corners(motion, label) for label in motion.sliders}
        lines = [
            guide.plot([], [], label="table", **(line | {"color": colours[str(line["color"])]}))[0]
            for _, line in zip(outlines, svg.MODEL_LINES, strict=False)
        ]
        press.set_title("press", fontsize=9)
        guide.set_title("slider, displacement magnified", fontsize=9)
        legend = guide.legend(handles=lines, loc="lower center", bbox_to_anchor=(0.5, -0.08), ncols=2)
        svg.name_curves(legend, list(outlines))
        clock = figure.text(0.02, 0.02, "")
        try:
            with writer.saving(figure, str(named), dpi=100):
                for count, frame in enumerate(frames):
                    at = {name: points[frame] for name, points in motion.links.items()}
                    chain.set_data(*np.array([at[name] for name in "OABCF"]).T)
                    rocker.set_data(*np.array([at[name] for name in "HBC"]).T)
                    slider.set_data([at["F"][0]], [at["F"][1]])
                    for line, outline in zip(lines, outlines.values(), strict=True):
                        line.set_data(*outline[frame][[0, 1, 2, 3, 0]].T)
                    clock.set_text(f"{motion.time[frame]:.4f} s, crank cycle {motion.cycle[frame]:.3f}")
                    writer.grab_frame()
                    on_progress((count + 1) / len(frames))
            named.replace(part)
        finally:
            named.unlink(missing_ok=True)
    return path
