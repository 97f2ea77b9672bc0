"""Metrics, verdicts, the suite, the report and the command line. Imports the other three packages."""
