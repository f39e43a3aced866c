import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Audit somebody else's plan
#
# A plan states where to rest, where to hover, and for how long. Can the battery deliver it? A judge
# must neither trust the plan's figures nor use the code that found them, so it simulates the plan.
# (Change the plan as you like; one that can be flown has nothing to show here, and ends the page.)
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
import json
import tempfile
from pathlib import Path

import numpy as np
from scipy.linalg import expm

import optuav
from optuav.judge import Stop

folder = tempfile.TemporaryDirectory()
theirs = Path(folder.name, "theirs.toml")
theirs.write_text("""
schema = 1
mission = "paper"
stops = [
    { at = "b9", kind = "rest", duration_s = 231.8 },
    { at = "hover", kind = "hover", duration_s = 660 },
    { at = "b10", kind = "rest", duration_s = 254.2 },
]
""")
print("their plan:", theirs.name)

# %% [markdown]
# ## The verdict
#
# `optuav audit theirs.toml` prints the same. The legs follow from the stops.
#
# **Before you run:** without a rest, this drone can hover 577 s. The plan above rests twice and
# wants 660 s. Which limits will it violate?

# %%
verdict = optuav.audit(theirs)
print(str(verdict).replace(str(theirs), theirs.name))
empty = [each for each in verdict.violations if each.kind == "empty"]
if not empty:
    folder.cleanup()
    raise SystemExit("This plan does not run dry. Hover for longer, and run the page again.")

# %%
dry = empty[0]
exact = optuav.replay(verdict.subject)
optuav.plots.profile(exact)

# %% [markdown]
# ## Who judges the judge?
#
# The simulation uses the closed form of the battery model. A matrix exponential solves the model's
# equations too.
#
# **Before you run:** at the moment that was found, how much should it leave in the available well?

# %%
given = verdict.subject.mission.battery
B, share, flow = given.packs * given.capacity_As, given.available_fraction, given.flow_rate_per_s
out, back = flow / share, flow / (1 - share)
wells = np.array([share * B, (1 - share) * B, 1.0])
for stage in (stage for phase in exact.phases for stage in phase.stages):
    begin_s, end_s = np.minimum([stage.start_s, stage.start_s + stage.duration_s], dry.time_s)
    rates = np.array([[-out, back, stage.net.current_A], [out, -back, 0.0], [0.0, 0.0, 0.0]])
    wells = expm((end_s - begin_s) * rates) @ wells
print(f"{wells[0]:z.6f} A s available and {wells[1]:.0f} A s bound at {dry.time_s:.6f} s")

# %% [markdown]
# ## Empty, with charge left
#
# Counting coulombs includes the bound charge; by nominal energy the battery was empty 20 s before.
# Neither describes the well that feeds the rotors. `exact.to_frame()` gives the table to pandas.
#
# **Before you run:** what does each of the two perspectives say is left when the rotors stop?

# %%
trace = exact.trace
at_dry = {name: float(np.interp(dry.time_s, trace.time_s, soc)) for name, soc in trace.soc.items()}
print({name: f"{100 * soc:.1f} %" for name, soc in at_dry.items()})

# %%
optuav.plots.curves(
    [
        optuav.plots.Line("available", trace.time_s, trace.available_As[:, 0]),
        optuav.plots.Line("bound", trace.time_s, trace.bound_As[:, 0]),
    ],
    title="What is in the two wells",
    x_label="time since take-off [s]",
    y_label="charge [A s]",
    marks=[optuav.plots.Mark(dry.time_s, "runs dry")],
)

# %% [markdown]
# ## What could be flown
#
# Keep the rests and shorten the hover until the audit passes, by one simulation a try.
#
# **Before you run:** how many tries does halving need to get from 660 s to a millisecond?

# %%
hovers_s = [each.duration_s for each in verdict.subject.stops if each.kind == "hover"]


def flyable(hover_s):
    stops = [
        Stop(each.at, each.kind, hover_s if each.kind == "hover" else each.duration_s)
        for each in verdict.subject.stops
    ]
    return optuav.replay(optuav.Itinerary(verdict.subject.mission, stops)).flyable


short_s, long_s, tries = 0.0, max(hovers_s, default=0.0), 0  # flyable, and not
while long_s - short_s > 1e-3:
    middle_s = 0.5 * (short_s + long_s)
    short_s, long_s = (middle_s, long_s) if flyable(middle_s) else (short_s, middle_s)
    tries += 1
if flyable(short_s):
    print(f"{short_s:.4f} s of hover can be flown, {long_s:.4f} s cannot, after {tries} tries")
else:
    print("with these rests, not even a plan without a hover can be flown")

# %% [markdown]
# ## A figure that was changed
#
# A saved plan states many figures, and each is compared with the simulation. `optuav.load_plan`
# refuses a file that contradicts itself; the audit reads it and says where.
#
# **Before you run:** somebody writes that the hover draws 5 A less. Does the verdict change?

# %%
saved = Path(folder.name, "plan.json")
optuav.solve("paper", "P3", perspective="energy").save(saved)
print("as saved:", "passes" if optuav.audit(saved) else "fails")
data = json.loads(saved.read_text("utf-8"))
data["phases"][1]["stages"][0]["current_A"] += 5.0
saved.write_text(json.dumps(data), "utf-8")
print(*optuav.audit(saved).violations, sep="\n")
folder.cleanup()

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
