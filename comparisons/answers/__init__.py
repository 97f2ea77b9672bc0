"""What the longer commands answer, as lines of text."""
