"""Benchmarks: both sides in one process run, ratios of medians, and how cost grows."""
