"""Hovering as a service: endless cycles, and fleets that take turns."""
