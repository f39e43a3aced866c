"""Laser beams that spread: the light that a receiver gets, by place."""

from optuav.physics import late

__getattr__ = late(__name__)
