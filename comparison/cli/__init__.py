"""The command line `sixbar`: one module a command."""

from comparison.cli.main import main

__all__ = ["main"]
