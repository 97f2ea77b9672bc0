"""The text of shaders: without its directives, as a syntax tree, and rewritten."""
