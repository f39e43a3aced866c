"""The table of colours and line styles: each has one meaning in all pictures, pages and themes."""

from collections.abc import Mapping
from typing import NamedTuple


class Look(NamedTuple):
    """Colours of a role on light and on dark ground, and its line."""

    light: str
    dark: str
    width: float = 0.0  # Width of the line in a page [px]; 0 for a role without one
    dash: tuple[float, ...] = ()  # Lengths of dashes and gaps [px]; empty for a solid line
    rounded: bool = False  # Whether its dashes have round ends


def _same(colour: str) -> Look:
    """A fill that is the same in both themes."""
    return Look(colour, colour)


LOOKS: Mapping[str, Look] = {
    # Limits: no two differ only in colour.
    "charge": Look("#5B2FA8", "#B58CFF", 2.25, (10.0, 4.0)),
    "deadline": Look("#17191C", "#F1F3F5", 2.25, (14.0, 4.0, 2.0, 4.0)),
    "dry": Look("#BF4200", "#FF8B4D", 2.75),
    "overfull": Look("#00769E", "#37C6E8", 3.0, (1.0, 5.0), rounded=True),
    "bounds": Look("#868D96", "#868E98", 1.0, (3.0, 3.0)),
    # Verdict and sight
    "flies": Look("#00694D", "#3CCB9F"),
    "laser": Look("#A8407F", "#E59CC8", 2.25, (2.0, 3.0)),
    # Fills: wells, phases, optimum
    "available": _same("#75519C"),
    "bound": _same("#B9A6D3"),
    "flight": Look("#0072B2", "#007AC0", 2.75),
    "hover": _same("#009E73"),
    "rest": _same("#E69F00"),
    "optimum": _same("#F0E442"),
    # Words and edges on fills, and what surrounds lines
    "on-fill": _same("#1D1230"),
    "on-dark": _same("#FFFFFF"),
    "edge": _same("#17191C"),
    "casing": Look("#FFFFFF", "#9CCBEA"),
    "rim": Look("transparent", "#CDB9EA"),
    # Text and grounds
    "ink": Look("#17191C", "#F1F3F5"),
    "muted": Look("#565D66", "#A7AEB7"),
    "panel": Look("#FFFFFF", "#1B1E22"),
    "ground": Look("#F4F5F7", "#121417"),
    "line": Look("#D9DDE2", "#363B42"),
    "faint": Look("#ECEEF1", "#272B31"),
    "field": Look("#F4F5F7", "#25292F"),
}
"""Meaning of each colour and line, by name of its role."""

PHASES = {kind: LOOKS[kind].light for kind in ("flight", "hover", "rest")}
"""Fills of the phases by kind."""

SERIES = ("#56B4E9", "#CC79A7", "#7F7F7F", "#D9D9D9", "#404040")
"""Colours without a meaning: sky, pink, and greys, for the series of a chart."""


def colour(role: str) -> str:
    """The colour of a role in CSS, which follows the theme of the page."""
    light, dark, *_ = LOOKS[role]
    return light if light == dark else f"light-dark({light}, {dark})"


def variables(selector: str) -> str:
    """All colours as custom properties of CSS, by role: ``var(--charge)``."""
    rows = "\n".join(f"  --{role}: {colour(role)};" for role in LOOKS)
    return f"{selector} {{\n{rows}\n}}\n"
