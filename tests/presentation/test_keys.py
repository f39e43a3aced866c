"""Keys as words: all of them, with their units, and no two alike."""

from __future__ import annotations

import re

import pytest

from optuav.mission.keys import numeric_keys
from optuav.presentation.keys import axis_of, words_of

ALIKE = ("battery.flow_rate_per_min", "flight.charge_current_A")  # One rate, one current


@pytest.mark.parametrize(
    ("key", "unit", "words"),
    [
        ("limits.deadline_s", "s", "deadline [s]"),
        ("battery.capacity_As", "A s", "battery capacity [A s]"),
        ("limits.min_soc", "1", "least state of charge [-]"),
        (
            "rotor.drag_coefficient_Nm_s2_rad2",
            "N m s2/rad2",
            "rotor drag coefficient [N m s²/rad²]",
        ),
        ("link.device_m[1]", "m", "device y [m]"),
        ("route.hover_m[0]", "m", "hover point x [m]"),
        ("devices.west.position_m[0]", "m", "device west x [m]"),
        ("devices.well_1[2].a.hover_m[1]", "m", "hover point of well_1[2].a y [m]"),
        ("laser.attenuation_per_km", "1/km", "laser attenuation [1/km]"),
        ("rotor.resistance_ohm", "ohm", "rotor resistance [Ω]"),
        ("flight.hover_power_W", "W", "hover power [W]"),
        ("flight.tip_speed_m_s", "m/s", "flight tip speed [m/s]"),
    ],
)
def test_a_key_is_read_as_words(key: str, unit: str, words: str) -> None:
    assert axis_of(key, unit) == words


def test_every_key_has_words_of_its_own_without_its_unit() -> None:
    words = {
        key: words_of(key, allowed.unit)
        for key, allowed in numeric_keys().items()
        if key not in ALIKE
    }
    assert len({*words.values()}) == len(words)
    for key, text in words.items():
        assert re.fullmatch(r"[\w² ₙ²M²]+", text), key
        assert "_" not in text
        assert not re.search(r" (m|s|W|J|V|A|As|rad|kg|km|nm|per|deg)( |$)", text), key
