"""Arguments and options shared by several commands."""

from pathlib import Path
from typing import Annotated, Any

import typer

REPORTS = Path("reports/out")
"""Default parent folder of reports."""
MAIN = "150rpm-0.2mm"
"""The paper's central case."""


def option(metavar: str | None, text: str, *names: str, **more: Any) -> Any:
    """Return an option by what its value is called, its help, and its names where they are not its own."""
    return typer.Option(*names, metavar=metavar, help=text, **more)


def scene_names() -> list[str]:
    """Return the names of the shipped scenes, for the shell's completion."""
    from comparison.scene import shipped_scenes

    return shipped_scenes()


def check_positive(name: str, value: float | None) -> None:
    """Refuse a number that is not positive and finite."""
    if value is not None and not 0 < value < float("inf"):
        raise typer.BadParameter(f"{name} {value:g} must be a positive number")


def to_write(path: Path, ends: str) -> Path:
    """Return the path of a file that can be written; refuse another ending than these, ".svg or .png"."""
    from comparison.files import check_file

    if path.suffix.lower() not in ends.replace(" or", ",").split(", "):
        raise typer.BadParameter(f"{path}: the name must end in {ends}")
    return check_file(path)


def check_unique(names: list[str], where: str) -> None:
    """Refuse two scenes of one name."""
    from comparison.scene import SceneError

    if twice := next((name for name in names if names.count(name) > 1), None):
        raise SceneError(f"scene {twice!r}: two scenes have this name; names in a {where} must be unique")


# Hidden: typer shows its type beside it. What it is stands in the text of each command.
_SCENE = typer.Argument(metavar="SCENE", hidden=True, autocompletion=scene_names)
SceneName = Annotated[str, _SCENE]
SceneNames = Annotated[list[str] | None, _SCENE]
OfScene = Annotated[
    str | None,
    option(
        "SCENE", "Scene of the tables; by default the one recorded beside them.", autocompletion=scene_names
    ),
]
Model = Annotated[
    str,
    option(
        "NAME",
        "Model: reference, exudyn, or one of another package.",
        autocompletion=lambda: ["reference", "exudyn"],
    ),
]
Models = Annotated[
    str, option("NAME,NAME[,...]", "Two or more models: reference, exudyn, or those of installed packages.")
]
Overrides = Annotated[
    list[str] | None, option("KEY=VALUE", "Change a scene key, e.g. drive.speed_rpm=210.", "--set")
]
MappingFile = Annotated[
    Path | None, option("FILE", "TOML file that assigns another program's columns to channels.")
]
AtEvents = Annotated[str | None, option("left|right|both", "Which rows of a repeated time count.")]
Finer = Annotated[Path | None, option("FILE", "The run at a finer setting.")]
Accuracy = Annotated[
    str | None, option("NAME|METRES", "draft, standard, strict, or the wanted error of slider_x in metres.")
]
AllowIndeterminate = Annotated[
    bool, option(None, "Exit with 0 where the verdict is indeterminate.", "--allow-indeterminate")
]
Jobs = Annotated[int | None, option("N", "Number of parallel runs; one per processor by default.", min=1)]
OutFolder = Annotated[Path | None, option("FOLDER", "Folder of the report; below reports/out by default.")]
Verbose = Annotated[bool, option(None, "Also print the reason of every verdict.", "--verbose", "-v")]
Quick = Annotated[
    bool, option(None, f"Standard tier only; of the shipped scenes only the main one, {MAIN}.", "--quick")
]
Quiet = Annotated[bool, option(None, "No progress; only the last lines of the result.", "--quiet", "-q")]
NoProgress = Annotated[bool, option(None, "No progress.", "--quiet", "-q")]
AsJson = Annotated[bool, option(None, "Print all numbers as JSON instead of lines.", "--json")]
