"""The offline report: pictures as PNG files, and one HTML page that shows them beside every number of a run."""

from comparisons.report.page import write_report
from comparisons.report.pictures import display_of, write_pictures

__all__ = ["display_of", "write_pictures", "write_report"]
