"""Command line `sixbar`: one module per command."""

from comparison.cli.main import main

__all__ = ["main"]
