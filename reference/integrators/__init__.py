"""Integrators of our own, compiled by Dr.Jit. Importing one imports Dr.Jit."""
