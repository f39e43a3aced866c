"""Make the page with stored answers that the site embeds: ``python docs/make_explorer.py FILE``.

It is one file, which works without a server: the explorer's own page, and its answers at the stops
of two sliders.
"""

from __future__ import annotations

import html
import json
import sys
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

import optuav
from optuav.explorer.answers import answers
from optuav.explorer.presets import presets
from optuav.explorer.static import script, style
from optuav.mission.keys import stated_value

MISSION = "paper"
PERSPECTIVES = ("available", "battery")
OPENS = "A plan that falls"  # Preset
STOPS: dict[str, tuple[int, ...]] = {
    "limits.deadline_s": (200, 400, 600, 650, 654, 700, 800, 900, 1000, 1200, 1400, 1700, 2000),
    "battery.capacity_As": (21_600, 28_800, 36_000, 43_200, 50_400),
}
"""Where the sliders stand, in order; the mission's own values are among them. Judged by charge, the
plan flies up to 653 s and falls from 654 s on."""
AXES_S = [2000, 1200]  # Of the plane, rest and hover: no stored answer has others
EVERY, WHOLE = 2, 999  # Of the plane every second sample, in numbers of three digits
PAGE = """<!doctype html>
<html lang="en" class="optuav-page">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<main id="explorer"></main>
<script type="module">
{code}
</script>
</body>
</html>
"""


def page() -> str:
    """The page as one text."""
    mission, stored, keys = optuav.load(MISSION), dict[str, Any](), list[Any]()
    for perspective, *values in product(PERSPECTIVES, *STOPS.values()):
        changes = dict(zip(STOPS, values, strict=True))
        state = {"perspective": perspective, "changes": changes, "axes": AXES_S}
        answer = answers(mission, state)
        stored[json.dumps([perspective, *values], separators=(",", ":"))] = _brief(answer)
        keys = [control for control in answer["controls"] if control["key"] in STOPS]
    for key in keys:
        key["value"] = int(stated_value(mission, key["key"]))
    opens = next(each["state"] for each in presets(mission) if each["words"] == OPENS)
    data = f"const keys = {_json(keys)}, answers = {_json(stored)}, opens = {_json(opens)};"
    code = "\n".join([script(), data, (Path(__file__).parent / "stored.js").read_text("utf-8")])
    title = html.escape(f"optuav: {mission.name} with sliders")
    return PAGE.format(title=title, style=style(), code=code)


def _json(data: Any) -> str:
    """Data as a script may hold it: nothing in it ends the script."""
    short = json.dumps(data, ensure_ascii=False, separators=(",", ":"))
    return short.replace("<", "\\u003c")


def _brief(answer: dict[str, Any]) -> dict[str, Any]:
    """An answer with the controls that have stops, and a plane of fewer samples."""
    controls = [control for control in answer["controls"] if control["key"] in STOPS]
    for control in controls:
        stops = STOPS[control["key"]]
        control |= {"low": stops[0], "high": stops[-1], "stops": [*stops]}
    plane, count = answer["plane"], answer["plane"]["samples"]
    for limit in plane["limits"]:
        excess = np.reshape(limit["excess"], (count, count))[::EVERY, ::EVERY]
        most = max(1, int(np.abs(excess).max()))
        limit["excess"] = np.rint(excess * (WHOLE / most)).astype(int).ravel().tolist()
    options = {"perspective": PERSPECTIVES}
    plane = {**plane, "samples": len(range(0, count, EVERY)), "round_s": AXES_S}
    begins = [preset for preset in answer["presets"] if "changes" not in preset["state"]][:2]
    stored = {"stored": True, "controls": controls, "options": options, "presets": begins}
    stored |= {"repairable": False, "pictures": []}  # Both are computed while they are seen
    return {**answer, **stored, "plane": plane}


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(page(), "utf-8")
