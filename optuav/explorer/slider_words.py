"""Keys of the mission in the words and units of the sliders."""

from __future__ import annotations

import math
import re

from optuav.diagnosis import Repair
from optuav.diagnosis.in_words import PARAMETER_NOUNS
from optuav.explorer.state import Control, controls
from optuav.mission import Mission
from optuav.mission.keys import range_of, stated_value
from optuav.presentation.numbers import figure, significant, with_unit

DIGITS = 3  # Significant digits of a value in the unit of a slider


def by_key(mission: Mission) -> dict[str, Control]:
    """The sliders by the key that each sets, a component as ``wind.force_N[2]``."""
    sliders = controls(mission)
    return {e.key if e.axis is None else f"{e.key}[{e.axis}]": e for e in sliders}


def in_slider_words(text: str, mission: Mission) -> str:
    """A text with labels, values and units of the sliders in place of their keys."""
    for key, slider in by_key(mission).items():
        value = float(stated_value(mission, key) or 0.0) / slider.scale
        read = with_unit(value, slider.unit)
        name = _lower(slider.label)
        text = re.sub(
            rf"{re.escape(key)} = [-−\d.e+]+( {slider.unit})?", f"the {name} of {read}", text
        )
        text = text.replace(key, f"{name}: {read}")
    return text


def repair_row(repair: Repair, slider: Control | None) -> tuple[str, str]:
    """A change and the present value, in the words and the unit of the slider if there is one."""
    value, now = repair.value, repair.now
    if not isinstance(value, int | float) or not isinstance(now, int | float):
        return repair.row
    if repair.comparison == "==":
        return repair.row
    limits, up = range_of(repair.key), repair.comparison == ">="
    noun, unit, scale = (
        PARAMETER_NOUNS.get(repair.key, repair.key),
        limits.unit if limits else "",
        1.0,
    )
    if slider:
        noun, unit, scale = _lower(slider.label), slider.unit, slider.scale
    nearest = _figure(value, scale, up)
    words = f"{noun} {'≥' if up else '≤'} {nearest}"
    if repair.up_to is not None:
        ends = nearest, _figure(repair.up_to, scale, not up)
        low, high = ends if up else ends[::-1]
        words = f"{low} ≤ {noun} ≤ {high}"
    return _with_unit(words, unit), _with_unit(f"now {figure(now / scale)}", unit)


def _figure(value: float, scale: float, up: bool) -> str:
    """A value in a unit of some scale, its new digits rounded up or down."""
    return figure(value if scale == 1.0 else _rounded(significant(value / scale, 12), up))


def _with_unit(words: str, unit: str) -> str:
    return words if unit in ("1", "-", "") else f"{words} {unit}"


def _rounded(value: float, up: bool) -> float:
    """A value with `DIGITS` digits, rounded up or down to the feasible side."""
    unit = 10.0 ** (math.floor(math.log10(abs(value))) - DIGITS + 1) if value else 1.0
    steps = significant(value / unit, 12)
    return significant((math.ceil(steps) if up else math.floor(steps)) * unit, 12)


def _lower(label: str) -> str:
    return label[0].lower() + label[1:]
