"""What the commands of the command line do, as lines of text."""
