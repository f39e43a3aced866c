# %% [markdown]
# # A first mission
#
# A drone flies from an origin to a destination. On its way it hovers within reach of a device on
# the ground for as long as it can. It may rest once on a roof, where a laser charges it.
#
# **Before this lesson:** a little Python, and nothing else. **Time:** 25 minutes.
#
# **Learning intentions.** After this page you can
#
# - load a mission and look up what it states;
# - solve it and read the plan: where, when, for how long, and which limits bind;
# - distinguish a plan that is only promised from one that can be flown;
# - change a value and say why the answer changes.
#
# Many cells are preceded by a question. Write your answer down *before* you run the cell: a wrong
# guess teaches more than a number that you only read.
#
# The last line of a cell shows itself. Click on a title with a triangle to see more, but leave
# *Notes* closed at first: they answer questions that the page asks later.

# %%
import tempfile
from pathlib import Path

import optuav

mission = optuav.load("paper")
mission

# %% [markdown]
# ## Solve
#
# `solve` compares the direct flight with a rest on every building, before the hover point and after
# it, and returns the plan with the longest hover. Problem (P3) of the paper is the direct flight,
# (P4) has a rest on one building, and (P1) is the best of all. `solve(mission, "P3")` solves only
# the direct flight.
#
# **Before you run:** hovering draws 88 A from the two packs, net of what the laser gives meanwhile.
# How long could the drone hover if it did not have to fly anywhere? Will the plan reach that time?

# %%
plan = optuav.solve(mission)
plan

# %% [markdown]
# At 88 A the packs would last for nearly 14 minutes, and the plan hovers for nearly 10. The flight
# takes its share, and the rotors cannot draw all that is left, as the next section shows.
#
# The map shows the route, the disc in which the device is in reach, the laser and its roofs. Beside
# it are the altitudes along the route.

# %%
optuav.plots.mission_map(plan)

# %% [markdown]
# ## Two answers to one question
#
# A battery has two wells, and only the *available* one feeds the rotors. `solve` takes both wells
# into account: its perspective is `available`. The paper behind this mission counts all charge
# alike, the perspective `battery`. Both claim to have found the longest hover.
#
# **Before you run:** which of the two promises the longer hover? Do they rest on the same roof?
# How much charge does each have left at the end, and how much of it can the rotors use?

# %%
promised = optuav.solve(mission, perspective="battery")
promised

# %% [markdown]
# The plan of the paper's perspective promises two more minutes. It lands with 5 % of the charge, as
# it was asked to, but with an available well below zero, which no battery can have. The other plan
# lands with 17 %, all of it bound: the rotors can use none of it.
#
# The next picture compares both plans over time. The available well lies on top of the bound one.
# The upper plan drives the available well past full during its rest. Later the well is empty, and
# the drone falls. Two wells are a picture: in a lithium cell the voltage drops under load below
# what the motors need while charge is left, and two wells reproduce that to some per cent. [When
# the battery runs dry](04_when_the_battery_runs_dry.py) takes this picture apart.

# %%
optuav.plots.wells([promised, plan])

# %% [markdown]
# ## Check it by hand
#
# Two limits bind in the paper's perspective, and you can check both from the phases. A current is
# positive if it charges the battery: negative while hovering, positive while resting in sight of
# the laser.
#
# First the charge: what all phases draw, and what the mission allows.

# %%
capacity_As = mission.battery.packs * mission.battery.capacity_As
drawn_As = -sum(phase.current_A * phase.duration_s for phase in promised.phases)
drawn_As, (1 - mission.limits.min_soc) * capacity_As

# %% [markdown]
# Then the time: what the plan uses, and the deadline.

# %%
round(promised.mission_time_s, 6), mission.limits.deadline_s

# %% [markdown]
# A second of hovering costs as much charge as this many seconds of rest give:

# %%
current_A = {phase.kind: phase.current_A for phase in promised.phases}
price = -current_A["hover"] / current_A.get("rest", float("inf"))
price

# %% [markdown]
# ## Change a value
#
# A mission never changes; `replace` makes a new one. `compare` solves it in every perspective. Two
# of them count energy in place of charge; an [appendix](A1_energy_or_battery.py) explains them.
#
# **Before you run:** the deadline is now 800 s in place of 1200 s. Will the drone still rest
# in the perspective `battery`? And does the plan that can be flown lose hover time?

# %%
hurried = mission.replace({"limits.deadline_s": 800})
sooner = optuav.compare(hurried, by="perspective")
columns = ["perspective", "flyable", "hover_time_s", "rest_time_s", "mission_time_s", "route"]
sooner.to_frame()[columns].round(2)

# %% [markdown]
# There is too little time left for the rest that the paper's plan needs: the direct flight wins,
# and only charge binds. The plan that can be flown loses 17 s of hover: by b10 it would land too
# late, so it rests on b2, for a shorter time. On this route too the available well is empty twice,
# and the drone lands before the deadline.
#
# Sliders answer more questions than cells do. In a notebook of your own, run
#
# ```python
# optuav.explore(mission)
# ```
#
# and move the deadline, the capacity of a pack and the laser. In a terminal, `optuav explore paper`
# opens the same page in a browser.
#
# ## Keep the plan
#
# The file contains the mission as well, and reading it gives the same plan, to the last digit.

# %%
with tempfile.TemporaryDirectory() as directory:
    again = optuav.load_plan(plan.save(Path(directory) / "plan.json"))
again == plan

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
# The longer the hover, the less is left: halve an interval of hovers.
low_s, high_s = 0.0, 1000.0
while high_s - low_s > 0.1:
    hover_s = 0.5 * (low_s + high_s)
    flight = optuav.Itinerary(task.mission, [optuav.judge.Stop("hover", "hover", hover_s)])
    is_more = optuav.replay(flight).trace.available_As[-1, 0] > task["left_As"]
    low_s, high_s = (hover_s, high_s) if is_more else (low_s, hover_s)
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
