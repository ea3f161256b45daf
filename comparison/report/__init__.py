"""One self-contained HTML page that shows what comparisons found."""

from comparison.report.page import write_report

__all__ = ["write_report"]
