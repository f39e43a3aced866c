import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # When the battery runs dry
#
# The paper's best plan keeps 5 % of the charge to the end, and yet cannot be flown: the charge is
# in the well that the rotors cannot draw from.
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
import numpy as np

import optuav
from optuav.judge import Stop

mission = optuav.load("paper")
promised = {each: optuav.solve(mission, each, perspective="battery") for each in ("P3", "P1")}
for problem, plan in promised.items():
    print(f"{problem}, by {' → '.join(plan.route)}: hover {plan.hover_time_s:.2f} s")
    print(*(f"  {words}" for words in plan.warnings), sep="\n")

# %% [markdown]
# ## Dry, with charge left
#
# Only the available well feeds the rotors. Simulate the direct plan, and look at both wells at the
# moment when it is empty.
#
# **Before you run:** the plan keeps 3600 A s, 5 % of the charge, to the landing. Is more or less
# than that in the battery when the drone falls?

# %%
falls = optuav.replay(promised["P3"])
dry_s = falls.first_s("empty")
trace = falls.trace
if dry_s is None:
    print("This battery lasts: its available well is never empty.")
else:
    bound_As = float(np.interp(dry_s, trace.time_s, trace.bound_As[:, 0]))
    print(f"dry at {dry_s:.2f} s, with {bound_As:.0f} A s still bound")
    print(f"that is {trace.time_s[-1] - dry_s:.0f} s before the landing")

# %% [markdown]
# ## Why does it not flow over?
#
# It does, but no faster than $k_F B$, the flow from a full well into an empty one. The hover takes
# many times that, net of what the laser gives. So charge stays in the bound well, and would flow
# over only during a rest.
#
# **Before you run:** work out $k_F B$ with $k_F = 4.5 \cdot 10^{-5}$ 1/s and $B$ = 72 000 A s.

# %%
battery = mission.battery
most_A = battery.flow_rate_per_s * battery.packs * battery.capacity_As
hover_A = -next(each.current_A for each in promised["P3"].phases if each.kind == "hover")
print(f"at most {most_A:.2f} A flow over; hovering takes {hover_A:.2f} A")

# %% [markdown]
# ## Past full as well
#
# A rest does not help. (P4) has a rest on one building, in one of two orders: *rest first*, before
# the hover, or *hover first*, with the rest on the way home. In the paper's best plan the rest
# comes first, on b1, when the well is still nearly full: the plan relies on charge that does not
# fit into the well, and it runs dry as well.

# %%
faults = {each.kind: each for each in optuav.replay(promised["P1"]).violations}
print(*faults.values() or ["No limit is violated."], sep="\n")

# %% [markdown]
# ## What can be flown
#
# The perspective `available` adds $0 \le y_1 \le \omega B$ at every moment.
#
# **Before you run:** the paper's plan rests before the hover, while the well is nearly full. Where
# would you put the rest, and what for?

# %%
flown = {each: optuav.solve(mission, each, perspective="available") for each in ("P3", "P1")}
for problem, plan in flown.items():
    lost_s = promised[problem].hover_time_s - plan.hover_time_s
    print(f"{problem}, by {' → '.join(plan.route)}: {plan.hover_time_s:.2f} s, {lost_s:.1f} s less")
verdicts = {
    each: [optuav.audit(plan).flyable for plan in plans.values()]
    for each, plans in (("battery", promised), ("available", flown))
}
print("passes the audit:", verdicts)

# %% [markdown]
# The direct hover loses two minutes, and another rest is best: after the hover, when it refills the
# well for the flight home.

# %%
optuav.plots.wells([promised["P3"], flown["P3"], promised["P1"], flown["P1"]])

# %% [markdown]
# An itinerary of your own is written as stops in order: place, rest or hover, and seconds. The
# audit simulates it, and says what it breaks.
#
# **Before you run:** the direct flight, with a hover 3 s longer than the best. When is it dry?

# %%
mine = optuav.Itinerary(mission, (Stop("hover", "hover", flown["P3"].hover_time_s + 3.0),))
print(optuav.audit(mine))

# %% [markdown]
# ## Which battery would help?
#
# A shadow price is the hover time that one more unit of a number brings. Here are those of five
# numbers of the battery and the mission, per one percent of each.
#
# **Before you run:** two of the five have no price at all. Which two limits does the plan not
# reach?

# %%
program = optuav.formulate(mission, "P1", perspective="available")
given, prices = program.parts[0].model.row(0), program.shadow_prices()
for name in ("capacity_As", "available_fraction", "flow_rate_per_s", "deadline_s", "min_soc"):
    if name not in prices:
        print(f"{name} plays no part in this perspective")
        continue
    percent_s = 0.01 * given[name] * prices[name].more
    print(f"one percent more {name:<20}{percent_s:8.3f} s of hover")

# %% [markdown]
# Time and the charge to be kept have the price 0. The size of the available well matters most,
# which a larger battery has too; little flows into it within ten minutes.

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
# A rest of some 140 s just fills the well; then halve an interval of hovers.
from optuav.judge import Stop

low_s, high_s = 0.0, 1000.0
while high_s - low_s > 0.5:
    hover_s = 0.5 * (low_s + high_s)
    stops = Stop("b1", "rest", 142.0), Stop("hover", "hover", hover_s)
    flyable = optuav.audit(optuav.Itinerary(task.mission, stops)).flyable
    low_s, high_s = (hover_s, high_s) if flyable else (low_s, hover_s)
letter = next(key for key, reason in task.reasons.items() if "Full" in reason)
answer_1 = letter, [("b1", "rest", 142.0), ("hover", "hover", low_s)]
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
    stops = Stop("hover", "hover", hover_s), Stop("b10", "rest", 270.0)
    answer_2 = optuav.Itinerary(task.mission, stops)
    if optuav.audit(answer_2):
        break
    hover_s -= 2.0
### END SOLUTION

# %%
grade = exercises.check("04.2", answer_2, student)
print(grade)
