# %% [markdown]
# # When the battery runs dry
#
# The paper's best plan keeps 5 % of the charge to the end, and yet nobody can fly it.
#
# **Before this lesson:** [A first mission](01_first_mission.py),
# [Two wells](03_two_wells.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - say when and why a plan with charge left cannot be flown;
# - find the longest hover that a battery can deliver, and compare it with the promised one;
# - read from shadow prices which battery would help.

# %%
import pandas as pd

import optuav
from optuav.exercises.helpers import movies
from optuav.judge import Stop

mission = optuav.load("paper")
promised = {name: optuav.solve(mission, name, perspective="battery") for name in ("P3", "P1")}
movies.flight(promised["P1"])

# %% [markdown]
# That is the paper's best plan. The drone turns orange-red when it breaks a limit for the first
# time, and at the end its available well is empty.
#
# ## Dry, with charge left
#
# Only the available well feeds the rotors. Simulate the direct plan as well, and look at both wells
# at the moment when the available one is empty.
#
# **Before you run:** the best plan rests for minutes, and falls with 13 377 A s still bound. The
# direct plan never rests. Does it fall with less charge in the battery, about as much, or more?

# %%
optuav.plots.wells([promised["P3"]])

# %% [markdown]
# About as much. All of it is bound, and bound charge hardly changes within ten minutes, whatever
# the plan. The replay lists each limit that the plan breaks, and when.

# %%
falls = optuav.replay(promised["P3"])
falls

# %% [markdown]
# ## With the wells of a lithium cell
#
# Two wells are a picture. In a lithium cell the voltage drops under load below what the motors need
# while charge is left. Wells that reproduce published cells to some per cent are quicker: ω = 0.2,
# and they level within 30 s (`optuav new --battery lipo`).
#
# **Before you run:** fly the paper's best plan with such wells. Does it fall earlier, later, or not
# at all?

# %%
lipo = mission.replace({"battery.available_fraction": 0.2, "battery.flow_rate_per_s": 0.16 / 30})
later = optuav.solve(lipo, perspective="battery")  # Coulombs know of no wells: the same plan
promised["P1"].runs_dry_s, later.runs_dry_s

# %% [markdown]
# Half a minute later. In published models of three cells it falls at 1157, 1172 and 1159 s, at
# 3.0 V. So the moment depends on the wells, and the fall does not.
#
# ## Why does it not flow over?
#
# Charge does flow over, but no faster than $k_F B$, the flow from a full well into an empty one.
# The hover takes many times that current, net of what the laser gives. So charge stays in the bound
# well, and would flow over only during a rest.
#
# **Before you run:** compute $k_F B$ with $k_F = 4.5 \cdot 10^{-5}$ 1/s and $B$ = 72 000 A s. By
# which factor does the hover exceed it?

# %%
battery = mission.battery
most_A = battery.flow_rate_per_s * battery.packs * battery.capacity_As
hover_A = -next(phase.current_A for phase in promised["P3"].phases if phase.kind == "hover")
most_A, hover_A, hover_A / most_A

# %% [markdown]
# ## Past full as well
#
# A rest *before* the hover does not help. (P4) has a rest on one building, in one of two orders:
# *rest first*, before the hover, or *hover first*, with the rest on the way home. In the paper's
# best plan the rest comes first, on b1, when the well is still nearly full. The plan relies on
# charge that does not fit into the well, and it runs dry as well.

# %%
optuav.replay(promised["P1"])

# %% [markdown]
# ## What can be flown
#
# The perspective `available` adds $0 \le y_1 \le \omega B$ at every moment.
#
# **Before you run:** the plan that flies rests *after* the hover, as you saw in the first lesson.
# How can a rest lengthen a hover that is over by then?

# %%
flown = {name: optuav.solve(mission, name, perspective="available") for name in ("P3", "P1")}
flown["P1"]

# %% [markdown]
# The rest refills the well for the flight home. So the hover need not leave that charge, and may
# empty the well. The picture has all four plans, two promised and two that can be flown.

# %%
optuav.plots.wells([promised["P3"], flown["P3"], promised["P1"], flown["P1"]])

# %% [markdown]
# The judge simulates each plan again, with no code of a solver. The direct hover loses two minutes,
# and the best plan too.

# %%
perspectives = {"battery": promised, "available": flown}
verdicts = pd.DataFrame(
    [
        (name, perspective, optuav.audit(plan).flyable, plan.hover_time_s)
        for perspective, plans in perspectives.items()
        for name, plan in plans.items()
    ],
    columns=["problem", "perspective", "flies", "hover [s]"],
)
verdicts.round(2)

# %% [markdown]
# You write an itinerary of your own as stops in order: place, rest or hover, and seconds. The audit
# simulates it, and says which limits it breaks.
#
# **Before you run:** this is the direct flight, with a hover 3 s longer than the best. When does it
# run dry?

# %%
longer = optuav.Itinerary(mission, (Stop("hover", "hover", flown["P3"].hover_time_s + 3.0),))
optuav.audit(longer)

# %% [markdown]
# ## Which battery would help?
#
# A shadow price is the hover time that one more unit of a number gives. The table has five numbers
# of the battery and the mission, and the hover that one percent more of each gives.
#
# **Before you run:** which of the five give no hover at all, and which one gives the most?

# %%
program = optuav.formulate(mission, "P1", perspective="available")
values, prices = program.parts[0].model.row(0), program.shadow_prices()
names = ("capacity_As", "available_fraction", "flow_rate_per_s", "deadline_s", "min_soc")
percent_s = {name: 0.01 * values[name] * prices[name].more for name in names if name in prices}
pd.Series(percent_s, name="hover per percent [s]").round(3).to_frame()

# %% [markdown]
# The deadline and the charge to be kept have the price 0. The size of the available well matters
# most, and a larger battery has a larger one. Little flows into it within ten minutes.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("04.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Fly a rest that is too long, and see when so much is missing; it begins at the end of a leg.
import numpy as np

from optuav.judge import Stop

stops = Stop("b1", "rest", 300.0), Stop("hover", "hover", 60.0)
flight = optuav.replay(optuav.Itinerary(task.mission, stops))
rest, wells_As = flight.phases[1], flight.trace.available_As[:, 0]
during = (flight.trace.time_s >= rest.start_s) & (flight.trace.time_s <= rest.end_s)
missing_As = wells_As[0] - wells_As
time_s = np.interp(-task["room_As"], -missing_As[during], flight.trace.time_s[during])
letter = next(key for key, reason in task.reasons.items() if "Full" in reason)
answer_1 = letter, time_s - rest.start_s
### END SOLUTION

# %%
grade = exercises.check("04.1", answer_1, student)
print(grade)

# %%
task = exercises.task("04.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# Hover until the well is nearly empty, then rest on b10 for the flight home. The hover is shortened
# until the audit agrees.
hover_s = 900.0
while True:
    stops = Stop("hover", "hover", hover_s), Stop("b10", "rest", task["rest_s"])
    answer_2 = optuav.Itinerary(task.mission, stops)
    if optuav.audit(answer_2):
        break
    hover_s -= 1.0
### END SOLUTION

# %%
grade = exercises.check("04.2", answer_2, student)
print(grade)
