"""The offline report: pictures as PNG files, and one HTML page that shows them beside every number of a run."""

from comparisons.report.page import write_report
from comparisons.report.pictures import write_pictures

__all__ = ["write_pictures", "write_report"]
