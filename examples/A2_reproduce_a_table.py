import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

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

import optuav
from optuav.paper.ledger import Verdict
from optuav.paper.table2 import CONSISTENT, admitted, loads_exist

paper, recovered = optuav.load("paper"), optuav.load("paper-table2")
found = optuav.ledger("table2")
stated = [cell.statement.stated for cell in found.entries]  # Δ, T, η1, η2 and η3 of each row
perspectives = ("battery", "energy", "adjusted")
rows = [(deadline_s, name) for deadline_s in (800, 1200) for name in perspectives]
printed = {row: stated[5 * number : 5 * number + 5] for number, row in enumerate(rows)}
energy, battery = printed[1200, "energy"], printed[1200, "battery"]

# %% [markdown]
# ## The printed parameters do not give it
#
# The same path, deadline and slots as in the paper.
#
# **Before you run:** the paper prints its parameters and its results. By how much may the two
# differ?

# %%
plan = optuav.solve(paper, "P3", slot_s=1.0, perspective="battery")
flights_s = {Fraction(mission) - Fraction(hover) for hover, mission, *_ in printed.values()}
(flight_s,) = map(float, flights_s)  # one flight time in all six rows
print(f"hover {plan.hover_time_s:.0f} s, printed {battery[0]} s")
print(f"flight {plan.flight_time_s:.2f} s, by the table {flight_s:.2f} s")

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
print(f"net hover current {current_A:.2f} A, flight {flight_As / flight_s:.1f} A")
print(f"net hover power {power_W:.1f} W, flight {flight_J / flight_s:.0f} W")
ours = recovered.flight
print(f"paper-table2: {ours.hover_current_A - ours.charge_current_A:.2f} A net in hover", end=", ")
print(f"{ours.hover_power_W - ours.charge_power_W:.1f} W")

# %% [markdown]
# ## What follows from them
#
# The fit did not use that the hover ends after 697 and 950 s, and not a slot later. It follows, and
# so does the charge left at 741 s, the whole slots of the first row. The test is not a hard one:
# all three lie between or beside the two rows.

# %%
for (deadline_s, perspective), row in printed.items():
    asked = recovered.replace({"limits.deadline_s": deadline_s})
    plan = optuav.solve(asked, "P3", perspective=perspective, slot_s=1.0)
    print(f"{deadline_s} s, {perspective:9} Δ = {plan.hover_time_s:.2f} s, printed {row[0]} s")
first = printed[800, "battery"]
whole_s = math.ceil(float(first[0]))
left = 100.0 * (1.0 - (flight_As + current_A * whole_s) / capacity_As)
print(f"left after {whole_s} s: {left:.2f} %, printed {first[2]} %")

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
print(f"η2 at {first[0]} s: {low:.2f} to {high:.2f} %, printed {first[3]} %")
for cell in ((2, 740.65, "-12.79"), (3, 950.0, "11.71"), (3, 697.0, "33.17")):
    column, hover_s, value = cell
    verdict = "possible" if loads_exist((*CONSISTENT, cell)) else "no loads give it"
    print(f"η{column} = {value} % after {hover_s} s: {verdict}")

# %% [markdown]
# As a picture: the line through two rows, and all printed cells of η2 as dots.

# %%
hovers_s = np.array([650.0, 1000.0])
left_percent = 100.0 * (1.0 - (flight_J + power_W * hovers_s) / nominal_J)
ax = optuav.plots.curves(
    [optuav.plots.Line("η2 by the loads", hovers_s, left_percent)],
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
# The ledger has the numbers of the paper. For Table II it says what was used in the fit, what
# follows from it, and what contradicts the rest. η3 is nearly η1 by construction, since $E_1$ and
# $E_2$ are the capacity at the voltages of the same loads, so its cells test little. The charges of
# the first and the third row are those after 741 s, as above: η2 is −0.31 % there.
#
# **Before you run:** Table II has 30 cells. How many of them are a test of the loads, and not a
# part of the fit?

# %%
print(found.summary)
verdicts = [cell.verdict for cell in found.table2]
for verdict in Verdict:
    print(f"{verdict.value}: {verdicts.count(verdict)}")

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
