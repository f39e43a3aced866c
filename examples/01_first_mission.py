import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # A first mission
#
# A drone flies from an origin to a destination. On its way it hovers within reach of a device on
# the ground for as long as it can, and it may rest once on a roof, where a laser charges it.
#
# **Before this lesson:** a little Python, and nothing else. **Time:** 25 minutes.
#
# **Learning intentions.** After this page you can
#
# - load a mission and look up what it states;
# - solve it and read the plan: where, when, for how long, and which limits bind;
# - distinguish what a perspective promises from a plan that can be flown;
# - change a value and say why the answer changes.
#
# Many cells are preceded by a question. Write your answer down *before* you run the cell: a guess
# that turns out wrong teaches more than a number that was only read.

# %%
import math
import tempfile
from pathlib import Path

import optuav

mission = optuav.load("paper")
print(mission.description)
print(f"deadline {mission.limits.deadline_s:g} s, least charge {mission.limits.min_soc:.0%}")
print(f"{mission.battery.packs} packs of {mission.battery.capacity_As:g} A s each")
print(f"{len(mission.buildings)} buildings to rest on")

# %% [markdown]
# ## Solve
#
# `solve` compares the direct flight with a rest on every building, before the hover point and
# after it, and returns the plan with the longest hover. The paper calls the direct flight problem
# (P3), a rest on one building (P4), and the best of all (P1): `solve(mission, "P3")` solves one.
#
# **Before you run:** hovering draws 88 A from the packs, net of what the laser gives meanwhile. How
# long could the drone hover if it did not have to fly anywhere? Will the plan reach that?

# %%
plan = optuav.solve(mission)
print(plan.summary())
if not plan:
    raise SystemExit("There is nothing to show: give the mission more time or charge.")

# %% [markdown]
# At 88 A the packs would last for nearly 14 minutes, and the plan hovers for nearly 10: flying
# takes its share, and not all that is left can be drawn, as the next section shows.
#
# On a map: the route, the disc in which the device is in reach, the laser and its roofs, and beside
# it the altitudes along the way.

# %%
optuav.plots.mission_map(plan)

# %% [markdown]
# ## Two answers to one question
#
# A battery has two wells, and only the *available* one feeds the rotors. `solve` takes that into
# account: its perspective is `available`. The paper behind this mission counts all charge alike,
# the perspective `battery`. Both say of themselves that they found the longest hover.
#
# **Before you run:** a note of the plan says which of the two promises the longer hover. Do they
# rest on the same roof? How much charge has each at the end, and how much of it can the rotors use?

# %%
promised = optuav.solve(mission, perspective="battery")
capacity_As = mission.battery.packs * mission.battery.capacity_As
ends = {"available": plan.phases[-1], "battery": promised.phases[-1]}
rows = {
    "route": [" → ".join(each.route[1:-1]) for each in (plan, promised)],
    "hover": [f"{each.hover_time_s:.2f} s" for each in (plan, promised)],
    "rest": [f"{each.rest_time_s:.2f} s" for each in (plan, promised)],
    "mission": [f"{each.mission_time_s:.1f} s" for each in (plan, promised)],
    "charge at the end": [f"{each.soc['battery']:.1%}" for each in (plan, promised)],
    "available well": [f"{each.available_As[0] / capacity_As:z.1%}" for each in ends.values()],
    "can be flown": ["yes" if each.flyable else "no" for each in (plan, promised)],
}
print(f"{'':20}{'available':>14}{'battery':>14}")
for name, (ours, theirs) in rows.items():
    print(f"{name:20}{ours:>14}{theirs:>14}")

# %% [markdown]
# The plan of the paper's perspective lands with 5 % of the charge, as it was asked to, but with an
# available well below zero, which no battery can have. The plan says so itself:

# %%
for warning in promised.warnings:
    print("Warning:", warning)

# %% [markdown]
# Both wells over time, of both plans, one well on top of the other. The upper plan is driven past
# full at its rest, and falls when nothing is left of the available well. A later lesson,
# [When the battery runs dry](04_when_the_battery_runs_dry.py), takes this picture apart.

# %%
optuav.plots.wells([promised, plan])

# %% [markdown]
# ## Check it by hand
#
# Two limits bind in the paper's perspective, and both can be checked from the phases. Currents are
# counted into the battery: negative while hovering, positive while resting in sight of the laser.

# %%
drawn_As = -sum(phase.current_A * phase.duration_s for phase in promised.phases)
allowed_As = (1 - mission.limits.min_soc) * capacity_As
print(f"charge drawn {drawn_As:.1f} A s, allowed {allowed_As:.1f}")
print(f"time used {promised.mission_time_s:.1f} s, allowed {mission.limits.deadline_s:.1f} s")
current_A = {phase.kind: phase.current_A for phase in promised.phases}
price = -current_A["hover"] / current_A.get("rest", math.inf)
print(f"a second of hovering costs as much charge as {price:.2f} s of rest give")

# %% [markdown]
# ## Change a value
#
# A mission never changes; `replace` makes a new one.
#
# **Before you run:** with a deadline of 800 s in place of 1200 s, will the drone of the paper's
# perspective still rest? And does the plan that can be flown lose hover time?

# %%
hurried = mission.replace({"limits.deadline_s": 800})
sooner = {each: optuav.solve(hurried, perspective=each) for each in ("available", "battery")}
for name, each in sooner.items():
    print(f"{name:10} {' → '.join(each.route)}: hover {each.hover_time_s:.2f} s, ", end="")
    print(f"rest {each.rest_time_s:.2f} s; binding:", *each.binding)

# %% [markdown]
# There is too little time left for the rest that the paper's plan needs: the direct flight wins,
# and charge alone binds. The plan that can be flown keeps a rest, a shorter one on another roof: it
# is limited by the well and hardly by time.
#
# ## Keep the plan
#
# The file contains the mission as well, and reading it gives the same plan, to the last digit.

# %%
with tempfile.TemporaryDirectory() as directory:
    plan.save(Path(directory) / "plan.json")
    print("the same plan again:", optuav.load_plan(Path(directory) / "plan.json") == plan)

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("01.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Halve the interval between a hover that can be flown and one that cannot.
low_s, high_s = 0.0, 1000.0
while high_s - low_s > 1.0:
    hover_s = 0.5 * (low_s + high_s)
    itinerary = optuav.Itinerary(task.mission, [optuav.judge.Stop("hover", "hover", hover_s)])
    low_s, high_s = (hover_s, high_s) if optuav.audit(itinerary).flyable else (low_s, hover_s)
answer_1 = [("hover", "hover", low_s)]
### END SOLUTION

# %%
grade = exercises.check("01.1", answer_1, student)
print(grade)

# %%
task = exercises.task("01.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# The replay says when the available well is empty, and its trace what is in the other one then.
import numpy as np

falling = optuav.replay(optuav.solve(task.mission, "P3", perspective="battery"))
bound_As = np.interp(falling.first_s("empty"), falling.trace.time_s, falling.trace.bound_As[:, 0])
letter = next(key for key, reason in task.reasons.items() if "available well is empty" in reason)
answer_2 = letter, bound_As
### END SOLUTION

# %%
grade = exercises.check("01.2", answer_2, student)
print(grade)
