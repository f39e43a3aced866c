"""Laser beams that spread: the light that a receiver gets, by place."""

from optuav.physics import lazy_submodules

__getattr__ = lazy_submodules(__name__)
