"""Laser beams that spread: the light that a receiver gets, by place."""
