"""Reports of comparisons: a self-contained HTML page, JUnit XML, Markdown, terminal text."""

from comparison.report.page import write_report

__all__ = ["write_report"]
