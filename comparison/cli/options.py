"""Arguments and options shared by several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

REPORTS = Path("reports/out")
"""Default parent folder of reports."""
MAIN = "150rpm-0.2mm"
"""The paper's central case."""


def scene_names() -> list[str]:
    """Return the names of the shipped scenes, for the shell's completion."""
    from comparison.scene import shipped_scenes

    return shipped_scenes()


def _model_names() -> list[str]:
    return ["reference", "exudyn"]


SceneName = Annotated[
    str,
    # Hidden: typer shows its type beside it. What it is stands in the text of each command.
    typer.Argument(metavar="SCENE", hidden=True, autocompletion=scene_names),
]
SceneNames = Annotated[
    list[str] | None,
    typer.Argument(metavar="SCENE", hidden=True, autocompletion=scene_names),
]
OfScene = Annotated[
    str | None,
    typer.Option(
        metavar="SCENE",
        help="Scene of the tables; by default the one recorded beside them.",
        show_default=False,
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
Models = Annotated[
    str,
    typer.Option(
        metavar="NAME,NAME[,...]",
        help="Two or more models: reference, exudyn, or those of installed packages.",
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
Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N", min=1, help="Number of parallel runs; one per processor by default.", show_default=False
    ),
]
OutFolder = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER", help="Folder of the report; below reports/out by default.", show_default=False
    ),
]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Also print the reason of every verdict.")]
Quick = Annotated[
    bool,
    typer.Option("--quick", help=f"Standard tier only; of the shipped scenes only the main one, {MAIN}."),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress; only the last lines of the result.")]
NoProgress = Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print all numbers as JSON instead of lines.")]
