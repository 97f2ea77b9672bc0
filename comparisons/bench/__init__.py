"""Run time against error: what a millisecond buys."""
