"""Turn a picture for dark pages: ``dark(content)``, a PNG for a PNG, a GIF for a GIF.

Light ink on the ground of the page, in the same hues; the colours of `optuav.looks` become those
that the table has for the dark.
"""

from __future__ import annotations

from io import BytesIO

import numpy as np
import numpy.typing as npt
from PIL import Image

from optuav.arrays import Floats
from optuav.looks import LOOKS, SERIES

GROUND = np.array([20.0, 24.0, 30.0])
"""Ground of the dark pages; white becomes it."""
TURN = np.array([[-0.574, 1.43, 0.144], [0.426, 0.43, 0.144], [0.426, 1.43, -0.856]])
"""Turns each hue by half a circle, which undoes what an inversion does to it."""
NEAR = 24.0
"""Distance within which a colour follows one of the table."""
ROLES = ("charge", "dry", "overfull", "flies", "laser", "available", "bound")
ROLES += ("flight", "hover", "rest", "optimum")


def _channels(colours: list[str]) -> Floats:
    return np.array([[*bytes.fromhex(colour[1:])] for colour in colours], float)


LIGHT = _channels([LOOKS[role].light for role in ROLES] + [*SERIES[:2]])
DARK = _channels([LOOKS[role].dark for role in ROLES] + [*SERIES[:2]])


def _turned(colours: Floats) -> Floats:
    inverted = np.clip((255.0 - colours) @ TURN.T, 0.0, 255.0)
    return 255.0 - (255.0 - inverted) * (255.0 - GROUND) / 255.0


def _nearness(colours: Floats) -> Floats:
    apart = np.linalg.norm(colours[:, None] - LIGHT, axis=-1)
    return np.asarray(np.exp(-((apart / NEAR) ** 2)))


SHIFTS = np.linalg.solve(_nearness(LIGHT), DARK - _turned(LIGHT))
"""What each colour of the table adds to its neighbourhood, so that it becomes its dark one."""


def _mapped(colours: Floats) -> npt.NDArray[np.uint8]:
    mapped = _turned(colours) + _nearness(colours) @ SHIFTS
    return np.asarray(np.rint(np.clip(mapped, 0.0, 255.0)), np.uint8)


def _movie(gif: bytearray) -> bytes:
    """A GIF in which each table of colours is mapped."""

    def passed(place: int, flags: int) -> int:
        end = place + 3 * 2 ** (1 + (flags & 7)) * (flags >> 7)
        table = np.frombuffer(gif[place:end], np.uint8).reshape(-1, 3)
        gif[place:end] = _mapped(table.astype(float)).tobytes()
        return end

    place = passed(13, gif[10])
    while (kind := gif[place : place + 1]) in (b"!", b","):  # An extension, or a frame
        place = place + 2 if kind == b"!" else passed(place + 10, gif[place + 9]) + 1
        while gif[place]:  # Length of a block; the last has none
            place += 1 + gif[place]
        place += 1
    return bytes(gif)


def dark(content: bytes) -> bytes:
    """A PNG or GIF for a dark page, from that for a light one."""
    if content.startswith(b"GIF"):
        return _movie(bytearray(content))
    picture = Image.open(BytesIO(content)).convert("RGBA")
    ground = Image.new("RGBA", picture.size, "white")
    pixels = np.asarray(Image.alpha_composite(ground, picture).convert("RGB"))
    codes = pixels.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    known, where = np.unique(codes, return_inverse=True)
    colours = np.stack([known >> 16, known >> 8 & 255, known & 255], -1).astype(float)
    written = BytesIO()
    Image.fromarray(_mapped(colours)[where.reshape(codes.shape)]).save(written, "png")
    return written.getvalue()
