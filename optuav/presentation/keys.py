"""Keys of missions as words with units, for axes of pictures."""

import re

UNSAID = ("limits", "route")  # Tables whose names add nothing to those of their keys
OWN = ("device", "rest", "flight", "hover", "charge", "cruise", "climb", "descent")
"""First words of keys that say without their table what is meant."""
SPELLED = {
    "min": "least",
    "max": "largest",
    "soc": "state of charge",
    "snr": "SNR",
    "dc": "DC",
    "m2": "beam quality M²",
    "cn2": "Cₙ²",
    "parasite": "parasite power",
    "rice": "Rice",
    "start": "initial",
}
"""Abbreviations in keys, and the words for them."""
AXES = "xyz"
OF_DEVICE = {"position_m": "device {}", "hover_m": "hover point of {}"}
"""Words for a place of one of several devices."""
SUPERSCRIPTS = str.maketrans("23", "²³")


def words_of(key: str, unit: str) -> str:
    """A dotted key as words, such as ``battery capacity`` of ``battery.capacity_As``."""
    table, _, name = key.partition(".")
    name, _, axis = name.rpartition("[") if name.endswith("]") else (name, "", "")
    if table == "devices":
        device, _, place = name.rpartition(".")
        return f"{OF_DEVICE[place].format(device)} {AXES[int(axis[0])]}"
    parts = name.split("_")
    ends = (re.sub(r"\W", "", unit), "per" + re.sub(r"\W", "", unit.removeprefix("1/")))
    for count in range(len(parts) - 1, 0, -1):  # Without its unit
        if "".join(parts[-count:]) in ends:
            parts = parts[:-count]
            break
    if axis and parts == ["hover"]:
        parts = ["hover", "point"]
    before = [] if table in UNSAID or parts[0] in OWN or table in parts else [table]
    words = [SPELLED.get(part, part) for part in before + parts]
    return " ".join([*words, *(AXES[int(axis[0])] if axis else "")])


def unit_of(unit: str) -> str:
    """A unit as it is printed in brackets: m², not m2, and - for a ratio."""
    return {"1": "-", "ohm": "Ω"}.get(unit, re.sub(r"(?<=[a-z])[23]", _raised, unit))


def _raised(found: re.Match[str]) -> str:
    return found[0].translate(SUPERSCRIPTS)


def axis_of(key: str, unit: str) -> str:
    """A dotted key as the label of an axis, such as ``battery capacity [A s]``."""
    return f"{words_of(key, unit)} [{unit_of(unit)}]"
