"""Arguments and options shared by several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

REPORTS = Path("reports/out")
"""Default parent folder of reports."""


def scene_names() -> list[str]:
    """Return the names of the shipped scenes, for the shell's completion."""
    from comparison.scene import shipped_scenes

    return shipped_scenes()


def _model_names() -> list[str]:
    return ["reference", "exudyn"]


SceneName = Annotated[
    str,
    typer.Argument(help="A shipped scene or the path of a TOML file.", autocompletion=scene_names),
]
SceneNames = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SCENE]...",
        help="Shipped names or TOML files.",
        show_default="all",
        autocompletion=scene_names,
    ),
]
Model = Annotated[
    str,
    typer.Option(
        metavar="NAME",
        help="Model: reference, exudyn, or one of another package.",
        autocompletion=_model_names,
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a scene key, e.g. drive.speed_rpm=210."),
]
Accuracy = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|METRES",
        help="draft, standard, strict, or the wanted error of slider_x in metres.",
    ),
]
AllowIndeterminate = Annotated[
    bool, typer.Option("--allow-indeterminate", help="Exit with 0 where the verdict is indeterminate.")
]
Jobs = Annotated[int | None, typer.Option(min=1, help="Number of parallel runs.", show_default="CPUs")]
OutFolder = Annotated[Path | None, typer.Option(help="Folder of the report.", show_default="reports/out/...")]
Models = Annotated[
    str,
    typer.Option(
        metavar="NAME,NAME[,...]",
        help="Two or more models: reference, exudyn, or those of installed packages.",
    ),
]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Also print the reason of every verdict.")]
Quick = Annotated[
    bool,
    typer.Option(
        "--quick", help="Standard tier only; of the shipped scenes only the main one, 150rpm-0.2mm."
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress; only the last lines of the result.")]
NoProgress = Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")]
AsJson = Annotated[bool, typer.Option("--json", help="As JSON, with all numbers.")]
