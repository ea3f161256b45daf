"""Options shared by several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

REPORTS = Path("reports/out")
"""Default parent folder of reports."""

Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a scene key, e.g. drive.speed_rpm=210."),
]
Accuracy = Annotated[
    str | None,
    typer.Option(
        metavar="NAME|METRES",
        help="draft, standard, strict, or an error bound of slider_x in metres over the first cycle.",
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
