"""Exercises of lessons A1 and A2: joules or coulombs, and a table that contradicts itself."""

import optuav
from optuav.exercises.answers import figure
from optuav.exercises.exercise import Task, decimals, programme
from optuav.exercises.prove import prove
from optuav.exercises.witness import Conditions, Witness, within
from optuav.modelling import Model


@Witness(
    "A1.1",
    "In `paper-table2`, hovering draws {flight.hover_current_A} A, and flying draws "
    "{flight.flight_power_W} W. The perspective energy stops the direct hover (P3) long before "
    "battery does. Why? Answer with the letter and the power of the hover [W], "
    "`flight.hover_power_W`, with which both stop it at the same time, within 0.5 s, as "
    "('a', 900.0).",
    {
        "flight.hover_current_A": decimals(68.0, 90.0, 0.5),
        "flight.flight_power_W": range(1250, 1551, 10),
    },
    "paper-table2",
    reasons={
        "A coulomb drawn above the nominal voltage costs more joules than it counts for when full.": "",
        "The battery loses energy in its resistance.": "neither perspective has a resistance",
        "The wells keep part of the energy bound.": "neither perspective looks at the wells",
        "The laser returns no energy in that perspective.": "it returns power times time in both",
    },
    form=figure("W", 300.0, 1400.0),
)
def _volts(task: Task, power_W: float) -> Conditions:
    mission = task.mission.replace({"flight.hover_power_W": power_W})
    energy_s, battery_s = (
        float(optuav.solve(mission, "P3", perspective=perspective).objective or 0.0)
        for perspective in ("energy", "battery")
    )
    hint = "less power lets energy hover longer"
    yield within(energy_s, battery_s, 0.5, "s", "by energy the hover", hint)


PRINTED = {
    "first_s": range(600, 701),
    "second_s": range(720, 821),
    "third_s": range(900, 1001),
    "first": decimals(26.0, 31.0, 0.01),
    "third": decimals(4.0, 8.0, 0.01),
    "off": (*decimals(-1.5, -0.3, 0.01), *decimals(0.3, 1.5, 0.01)),
    "second": lambda drawn: round(
        drawn["first"]
        + (drawn["third"] - drawn["first"])
        * (drawn["second_s"] - drawn["first_s"])
        / (drawn["third_s"] - drawn["first_s"])
        + drawn["off"],
        2,
    ),
}
"""Three cells of one path, of which the second is off the line through the others."""


@prove(
    "A2.1",
    "A table prints the charge that is left after hovers of {first_s} s, {second_s} s and "
    "{third_s} s on one path: {first:.2f} %, {second:.2f} % and {third:.2f} %, rounded to two "
    "decimals. Prove that no flight and no current give all three: multipliers by label, so that "
    "the sum is false. The flight takes q %, and a second of hover r %.",
    PRINTED,
    conflict=True,
)
def _cells(task: Task) -> Model:
    goal = {"flight_percent": ("q", "%", 1.0), "rate_percent_per_s": ("r", "%/s", 0.0)}
    rows = dict[str, tuple[dict[str, float], float]]()
    for name in ("first", "second", "third"):
        drawn, hover_s = 100.0 - task[name], float(task[f"{name}_s"])
        for words, sign in (("at most", 1.0), ("at least", -1.0)):
            coefficients = {"flight_percent": sign, "rate_percent_per_s": sign * hover_s}
            rows[f"{name}, {words}"] = coefficients, round(sign * drawn + 0.005, 3)
    return programme("a flight and a current that give the table", goal, rows)
