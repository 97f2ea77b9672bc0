"""The commands of the command line: their options, and what they call. Importing them loads nothing heavy."""
