"""Numerical stability: where shader functions and techniques break."""
