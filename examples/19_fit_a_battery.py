import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Fit a battery
#
# The kinetic model of a battery has three numbers: its capacity, the share ω of it that is
# available, and the rate k_F at which bound charge follows. No data sheet states the last two. They
# determine how long the battery lasts: a large load gets less charge out of it, and in a pause some
# becomes available again.
#
# **Before this lesson:** [Two wells](03_two_wells.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - fit the three numbers to lifetimes, and say how certain they are;
# - recognise data that do not determine a parameter, however many they are;
# - choose the next measurement by what it would show;
# - use the fit in a mission.

# %%
import tempfile
from pathlib import Path

import optuav
from optuav.physics.packs import lifetime

folder = Path(globals().get("__file__", "")).parent / "data"  # a notebook has no __file__
fit = optuav.fit_kibam([folder / "lifetimes.csv"])
(lifetimes,) = fit.panels
for name, observed_s, fitted_s in zip(
    lifetimes.names, lifetimes.observed, lifetimes.fitted, strict=True
):
    print(f"{name:8}{observed_s:9.1f} s{fitted_s:9.1f} s{fitted_s - observed_s:+8.2f} s")

# %%
optuav.plots.fit(fit)

# %% [markdown]
# ## How certain?
#
# An interval that is meant to hold the truth 95 times in 100, by the profile likelihood: all values
# with which some battery fits nearly as well as the best. Here the truth is known: 660 A s, ω =
# 0.166, k' = 0.122/min.
#
# **Before you run:** which of the three will be known best, and which worst?

# %%
truth = (660.0, 0.166, 0.122 / 60 * 0.166 * (1 - 0.166))  # k_F = k' ω (1 − ω)
for value, true in zip(fit.values, truth, strict=True):
    print(
        f"{value.key:28}{value.value:12.5g}  {value.interval.low:.5g} … {value.interval.high:.5g}"
        f"  truth {true:.5g}"
    )

# %% [markdown]
# ## Many numbers, little information
#
# **Before you run:** somebody measured ten discharges, all at 0.5 A. How many of the three numbers
# can be found from them?

# %%
rows = [f"run {n},0.5,{271.8 + 0.4 * (-1) ** n}" for n in range(10)]
with tempfile.TemporaryDirectory() as place:
    file = Path(place) / "one_size.csv"
    file.write_text("\n".join(["load,current_A,lifetime_s", *rows]), "utf-8")
    blind = optuav.fit_kibam([file])
for warning in blind.warnings:
    print("-", warning)
print("determined:", sum(value.determined for value in blind.values), "of", len(blind.values))

# %% [markdown]
# Ten discharges at one current make only the mean more certain: a large battery that gives a small
# share of its charge lasts as long as a small one that gives a large share. The fit says so, and
# states no value.
#
# **Before you run:** here are two such batteries. Which load would tell them apart?

# %%
small = {"capacity_As": 660.0, "available_fraction": truth[1], "flow_rate_per_s": truth[2]}
large = {"capacity_As": 1000.0, "available_fraction": 0.094, "flow_rate_per_s": truth[2]}
steady, pulsed = [(0.5, 1e6)], [(0.5, 60.0), (0.0, 120.0)]
for load in (steady, pulsed):
    print([f"{lifetime(load, **each):.0f} s" for each in (small, large)])

# %% [markdown]
# They last equally long under the steady load, and differ under one with pauses: that is the
# measurement to make next.
#
# ## Into the mission
#
# The fit writes a mission file that states the three keys, with intervals and origin as comments.
# `optuav calibrate kibam data/lifetimes.csv --save cell.toml` does the same, beside this page.
#
# **Before you run:** with these wells, and the capacity as it was, does the plan of the perspective
# `battery` hover longer? Does it fall earlier?

# %%
print(fit.to_toml())
mission = optuav.load("paper").replace(
    {key: value for key, value in fit.changes.items() if key != "battery.capacity_As"}
)
plans = [optuav.solve(each, "P3", perspective="battery") for each in ("paper", mission)]
for plan in plans:
    dry = "never runs dry" if plan.runs_dry_s is None else f"runs dry at {plan.runs_dry_s:.0f} s"
    print(f"hover {plan.hover_time_s:.2f} s, {dry}")

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("19.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Half as much capacity again; the smaller its available share, the shorter its life.
from optuav.physics.packs import lifetime


def lasts_s(capacity_As, share):
    """Lifetime under the current of the task [s]."""
    cell = {"capacity_As": capacity_As, "available_fraction": share, "flow_rate_per_s": 2.8e-4}
    return lifetime([(task["current_A"], 1e6)], **cell)


measured_s = lasts_s(task["capacity_As"], task["share"])
low, high = 0.001, task["share"]
while high - low > 1e-6:
    share = 0.5 * (low + high)
    is_short = lasts_s(1.5 * task["capacity_As"], share) < measured_s
    low, high = (share, high) if is_short else (low, share)
other = {"capacity_As": 1.5 * task["capacity_As"], "available_fraction": high}
letter = next(key for key, reason in task.reasons.items() if "one combination" in reason)
answer_1 = letter, other
### END SOLUTION

# %%
grade = exercises.check("19.1", answer_1, student)
print(grade)
