# %% [markdown]
# # Audit somebody else's plan
#
# A plan states where to rest, where to hover, and for how long. Can the battery deliver it? A judge
# must neither trust the plan's figures nor use the code that found them, so the judge simulates the
# plan.
#
# **Before this lesson:** [When the battery runs dry](04_when_the_battery_runs_dry.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - audit an itinerary, and read a violated limit: when, by how much, against what;
# - check the judge itself, by a second method;
# - say why an empty battery may still contain charge, and find a figure that was changed.

# %%
import math
import tomllib

import numpy as np
import pandas as pd
from scipy.linalg import expm

import optuav
from optuav.exercises.helpers import movies

theirs = """
schema = 1
mission = "paper"
stops = [
    { at = "b9", kind = "rest", duration_s = 231.8 },
    { at = "hover", kind = "hover", duration_s = 660 },
    { at = "b10", kind = "rest", duration_s = 254.2 },
]
"""

# %% [markdown]
# ## The verdict
#
# This is the text of a file; `optuav audit theirs.toml` gives the same verdict. The legs follow
# from the stops.
#
# **Before you run:** without a rest, this drone can hover 577 s. The plan above rests twice and
# wants 660 s. Which limits will it violate?

# %%
verdict = optuav.audit(tomllib.loads(theirs))
verdict

# %%
exact = optuav.replay(verdict.subject)
movies.flight(exact)

# %%
optuav.plots.profile(exact)

# %% [markdown]
# ## Who judges the judge?
#
# The simulation uses the closed form of the battery model. A matrix exponential solves the model's
# equations too.
#
# **Before you run:** the judge says that the available well is empty at some moment. How much
# should the second method leave in it then?

# %%
dry_s = exact.first_s("empty")
until_s = dry_s or math.inf  # A plan that does not run dry is followed to its end
battery = verdict.subject.mission.battery
share, flow = battery.available_fraction, battery.flow_rate_per_s
B, out, back = battery.packs * battery.capacity_As, flow / share, flow / (1 - share)
wells = np.array([share * B, (1 - share) * B, 1.0])
for phase in exact.phases:
    for stage in phase.stages:
        begin_s, end_s = np.minimum([stage.start_s, stage.start_s + stage.duration_s], until_s)
        rates = np.array([[-out, back, stage.net.current_A], [out, -back, 0.0], [0.0, 0.0, 0.0]])
        wells = expm((end_s - begin_s) * rates) @ wells
left_As = wells[:2].round(6) + 0.0
pd.Series(left_As, index=["available", "bound"], name="charge [A s]").to_frame()

# %% [markdown]
# ## Empty, with charge left
#
# Counting coulombs includes the bound charge. The energy perspective counts joules at the nominal
# voltage. Neither describes the well that feeds the rotors.
#
# **Before you run:** what does each of the two perspectives say is left when the rotors stop?

# %%
trace = exact.trace
at_dry = {name: float(np.interp(until_s, trace.time_s, soc)) for name, soc in trace.soc.items()}
pd.Series(at_dry, name="left [-]").to_frame()

# %% [markdown]
# By coulombs, nearly a fifth of the charge is left. By nominal energy, the battery was empty 20 s
# before.

# %%
optuav.plots.curves(
    [
        optuav.plots.Line("available", trace.time_s, trace.available_As[:, 0]),
        optuav.plots.Line("bound", trace.time_s, trace.bound_As[:, 0]),
    ],
    title="What is in the two wells",
    x_label="time since take-off [s]",
    y_label="charge [A s]",
    marks=[optuav.plots.Mark(at_s, "runs dry") for at_s in filter(None, [dry_s])],
)

# %% [markdown]
# ## What could be flown
#
# Keep the rests and shorten the hover until the audit passes, by one simulation per try.
#
# **Before you run:** how many tries does halving need to get from 660 s to a millisecond?

# %%
stops = verdict.subject.stops


def flyable(hover_s):
    changed = [
        optuav.Stop(stop.at, stop.kind, hover_s if stop.kind == "hover" else stop.duration_s)
        for stop in stops
    ]
    return optuav.replay(optuav.Itinerary(verdict.subject.mission, changed)).flyable


short_s = 0.0  # Flyable, if these rests are
long_s = max((stop.duration_s for stop in stops if stop.kind == "hover"), default=0.0)
tries = 0
while long_s - short_s > 1e-3:
    middle_s = 0.5 * (short_s + long_s)
    short_s, long_s = (middle_s, long_s) if flyable(middle_s) else (short_s, middle_s)
    tries += 1
pd.Series({"flyable [s]": short_s, "not flyable [s]": long_s, "tries": tries}).to_frame("hover")

# %% [markdown]
# ## A figure that was changed
#
# A saved plan states many figures, and the audit compares each of them with the simulation.
# `optuav.load_plan` refuses a file that contradicts itself; the audit reads it and says where.
#
# **Before you run:** somebody writes that the hover draws 5 A less. Does the verdict change?

# %%
plan = optuav.solve("paper", "P3", perspective="available")
as_saved = optuav.audit(plan)
as_saved

# %%
data = plan.to_dict()
data["phases"][1]["stages"][0]["current_A"] += 5.0
forged = optuav.audit(data)
forged

# %% [markdown]
# The times of this plan can still be flown. The audit fails it all the same, and names the figure
# that the simulation contradicts.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("17.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
first, last = ("b9", "rest", task["first_s"]), ("b10", "rest", task["last_s"])
low_s, high_s = 0.0, 660.0  # the first passes, the second does not
while high_s - low_s > 0.5:
    middle_s = 0.5 * (low_s + high_s)
    stops = [optuav.judge.Stop(*stop) for stop in (first, ("hover", "hover", middle_s), last)]
    passes = optuav.audit(optuav.Itinerary(task.mission, stops)).flyable
    low_s, high_s = (middle_s, high_s) if passes else (low_s, middle_s)
answer_1 = [first, ("hover", "hover", low_s), last]
### END SOLUTION

# %%
grade = exercises.check("17.1", answer_1, student)
print(grade)
