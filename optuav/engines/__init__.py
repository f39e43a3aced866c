"""Engines: each takes a declared model as it stands and returns a `Solution`."""
