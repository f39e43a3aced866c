"""Engines: each takes a declared model and returns a `Solution`."""
