# %% [markdown]
# # Reproduce a table
#
# A paper prints a table and the parameters behind it, and the two do not agree. Then the loads can
# be recovered from the table itself, and tested by what they predict. Here it is Table II of the
# paper, the direct path by perspective.
#
# **Before this lesson:** [Energy or battery?](A1_energy_or_battery.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - recover loads from results, and distinguish what was fitted from what was predicted;
# - show that a printed number cannot be right, whatever the loads;
# - say what a match is worth: to the printed digits, by construction, or by the fit.

# %%
import math
from fractions import Fraction

import numpy as np
import pandas as pd

import optuav
from optuav.paper.table2 import CONSISTENT, admitted, loads_exist

paper, recovered = optuav.load("paper"), optuav.load("paper-table2")
ledger = optuav.ledger("table2")
cells = [cell.statement.stated for cell in ledger.entries]  # Δ, T, η1, η2 and η3 of each row
perspectives = ("battery", "energy", "adjusted")
rows = [(deadline_s, name) for deadline_s in (800, 1200) for name in perspectives]
printed = {row: cells[5 * number : 5 * number + 5] for number, row in enumerate(rows)}
energy, battery = printed[1200, "energy"], printed[1200, "battery"]
pd.DataFrame(printed, index=["Δ [s]", "T [s]", "η1 [%]", "η2 [%]", "η3 [%]"]).T

# %% [markdown]
# ## The printed parameters do not give it
#
# optuav solves the same path, with the deadline and the slots of the paper.
#
# **Before you run:** the paper prints its parameters and its results. By how much may the two
# differ?

# %%
plan = optuav.solve(paper, "P3", slot_s=1.0, perspective="battery")
flights_s = {Fraction(mission) - Fraction(hover) for hover, mission, *_ in printed.values()}
(flight_s,) = map(float, flights_s)  # One flight time in all six rows
pd.DataFrame(
    {
        "by the parameters [s]": [plan.hover_time_s, plan.flight_time_s],
        "by the table [s]": [float(battery[0]), flight_s],
    },
    index=["hover", "flight"],
)

# %% [markdown]
# ## Loads from two rows
#
# On one path charge and energy left are straight lines in Δ. Two rows give slope and start: the net
# current and power of the hover, and the charge and energy of the flight.
#
# **Before you run:** 28.31 % of 72 000 A s are left after 697 s, and 5.09 % after 950 s. What
# current does the hover draw?

# %%
capacity_As, nominal_J = 72000.0, 799200.0


def line(number, whole):
    """What a second of hover and the flight draw, by the rows of 697 s and 950 s."""
    spent = {
        float(row[0]): whole * (1.0 - float(row[1 + number]) / 100.0) for row in (energy, battery)
    }
    (short_s, short), (long_s, long) = spent.items()
    rate = (long - short) / (long_s - short_s)
    return rate, short - rate * short_s


current_A, flight_As = line(1, capacity_As)
power_W, flight_J = line(2, nominal_J)
loads = recovered.flight
pd.DataFrame(
    {
        "hover, net": [current_A, power_W],
        "flight": [flight_As / flight_s, flight_J / flight_s],
        "hover of paper-table2, net": [
            loads.hover_current_A - loads.charge_current_A,
            loads.hover_power_W - loads.charge_power_W,
        ],
    },
    index=["current [A]", "power [W]"],
)

# %% [markdown]
# ## What follows from them
#
# The fit did not use that the hover ends after 697 and 950 s, and not a slot later. It follows, and
# so does the charge left at 741 s, the whole slots of the first row. The test is not a hard one:
# all three lie between or beside the two rows.

# %%
hovers_s = {
    row: optuav.solve(
        recovered.replace({"limits.deadline_s": row[0]}), "P3", perspective=row[1], slot_s=1.0
    ).hover_time_s
    for row in rows
}
pd.DataFrame({"Δ [s]": hovers_s, "printed [s]": {row: printed[row][0] for row in rows}}).round(2)

# %%
first = printed[800, "battery"]
whole_s = math.ceil(float(first[0]))
left = 100.0 * (1.0 - (flight_As + current_A * whole_s) / capacity_As)
pd.Series({"η1 after whole slots [%]": left, "printed [%]": first[2]}).to_frame("first row")

# %% [markdown]
# ## What cannot be
#
# The same line gives η2 at 740.65 s. And one flight cannot end with two values of η3. Rounding does
# not explain it: over all loads that give the other cells, a linear programme finds the least and
# the largest value of a cell.
#
# **Before you run:** the paper prints 5.01 % at 697 s and −25.58 % at 950 s. What must stand at
# 740.65 s?

# %%
low, high = admitted(2, 740.65)
pd.Series(
    {"least": low, "largest": high, "printed": first[3]}, name="η2 at 740.65 s [%]"
).to_frame()

# %%
doubtful = [(2, 740.65, "-12.79"), (3, 950.0, "11.71"), (3, 697.0, "33.17")]
pd.DataFrame(
    [(*cell, loads_exist((*CONSISTENT, cell))) for cell in doubtful],
    columns=["column η", "after [s]", "printed [%]", "some loads give it"],
)

# %% [markdown]
# As a picture: the line through two rows, and all printed cells of η2 as dots.

# %%
ends_s = np.array([650.0, 1000.0])
left_percent = 100.0 * (1.0 - (flight_J + power_W * ends_s) / nominal_J)
ax = optuav.plots.curves(
    [optuav.plots.Line("η2 by the loads", ends_s, left_percent)],
    title="The energy left, as printed and as it must be",
    x_label="hover time Δ [s]",
    y_label="η2 at the end [%]",
)
ax.plot(
    [float(row[0]) for row in printed.values()], [float(row[3]) for row in printed.values()], "ko"
)
ax

# %% [markdown]
# ## What a match is worth
#
# The ledger has the numbers of the paper. For Table II it says what the fit used, what follows from
# it, and what contradicts the rest. η3 is nearly η1 by construction, since $E_1$ and $E_2$ are the
# capacity at the voltages of the same loads, so its cells test little. The charges of the first and
# the third row are those after 741 s, as above: η2 is −0.31 % there.
#
# **Before you run:** Table II has 30 cells. How many of them are a test of the loads, and not a
# part of the fit?

# %%
ledger

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("A2.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Weights with which q and r drop out: the differences of the times. Which sides of the cells are
# needed depends on whether the second one is too high or too low.
first_s, second_s, third_s = (task[f"{name}_s"] for name in ("first", "second", "third"))
line = task["first"] + (task["third"] - task["first"]) * (second_s - first_s) / (third_s - first_s)
outer, inner = ("at least", "at most") if task["second"] > line else ("at most", "at least")
answer_1 = {
    f"first, {outer}": third_s - second_s,
    f"second, {inner}": third_s - first_s,
    f"third, {outer}": second_s - first_s,
}
### END SOLUTION

# %%
grade = exercises.check("A2.1", answer_1, student)
print(grade)
