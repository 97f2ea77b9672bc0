"""The offline report: pictures as PNG files, an overview, and a page for each check with every number of it."""

from comparisons.report.page import write_report
from comparisons.report.pictures import write_pictures

__all__ = ["write_pictures", "write_report"]
