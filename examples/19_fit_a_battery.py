# %% [markdown]
# # Fit a battery
#
# The kinetic model of a battery has three numbers: its capacity, the share ω of it that is
# available, and the rate k_F at which bound charge follows. No data sheet states the last two. They
# determine how long the battery lasts: a large load gets less charge out of it, and in a pause some
# charge becomes available again.
#
# **Before this lesson:** [Two wells](03_two_wells.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - fit the three numbers to lifetimes, and say how certain they are;
# - recognise data that do not determine a parameter, however many they are;
# - choose the next measurement by what it would show;
# - say what constant loads determine, and make a fit that never promises too much;
# - use the fit in a mission.

# %%
import tempfile
from pathlib import Path

import pandas as pd

import optuav
from optuav.physics.packs import lifetime

folder = Path(globals().get("__file__", "")).parent / "data"  # A notebook has no __file__
pd.read_csv(folder / "lifetimes.csv", comment="#")

# %% [markdown]
# Each row is one step of a load, and the steps of a load repeat: their current, how long they last,
# and when the battery was empty.

# %%
fit = optuav.fit_kibam([folder / "lifetimes.csv"])
optuav.plots.fit(fit)

# %% [markdown]
# ## How certain?
#
# optuav states an interval that is meant to hold the truth 95 times in 100, by the profile
# likelihood: all values with which some battery fits nearly as well as the best. Here the truth is
# known, because a model battery made the data: 660 A s, ω = 0.166, k' = 0.122/min. The last row is
# the lag (1 − ω)²/k_F, which comes up below.
#
# **Before you run:** which of the three will be known best, and which worst?

# %%
flow = 0.122 / 60 * 0.166 * (1 - 0.166)  # k_F = k' ω (1 − ω)
truth = (660.0, 0.166, flow, (1 - 0.166) ** 2 / flow)
known = fit.to_frame().assign(truth=truth)
known[["key", "value", "low", "high", "truth"]]

# %% [markdown]
# ## Many numbers, little information
#
# **Before you run:** somebody measured ten discharges, all at 0.5 A. How many of the three numbers
# can be found from them?

# %%
rows = [(f"run {n}", 0.5, 271.8 + 0.4 * (-1) ** n) for n in range(10)]
with tempfile.TemporaryDirectory() as place:
    file = Path(place) / "one_size.csv"
    pd.DataFrame(rows, columns=["load", "current_A", "lifetime_s"]).to_csv(file, index=False)
    blind = optuav.fit_kibam([file])
blind

# %% [markdown]
# Ten discharges at one current make only the mean more certain: a large battery that gives a small
# share of its charge lasts as long as a small one that gives a large share. The fit says so, and
# counts no value as determined.
#
# **Before you run:** here are two such batteries. Which load would tell them apart?

# %%
small = {"capacity_As": 660.0, "available_fraction": truth[1], "flow_rate_per_s": truth[2]}
large = {"capacity_As": 1000.0, "available_fraction": 0.094, "flow_rate_per_s": truth[2]}
loads = {"steady": [(0.5, 1e6)], "with pauses": [(0.5, 60.0), (0.0, 120.0)]}
life_s = pd.DataFrame(
    {
        name: [lifetime(load, **battery) for battery in (small, large)]
        for name, load in loads.items()
    },
    index=["small", "large"],
)
life_s

# %% [markdown]
# They last equally long under the steady load, and differ under the load with pauses. So the next
# measurement should have pauses.
#
# ## Constant loads
#
# Usually somebody measures a pack at several constant currents. Once the wells have settled, a
# current I leaves I·L of the charge in the bound well, with the *lag* L = (1 − ω)²/k_F: the battery
# lasts B/I − L. Here are eight lifetimes of a lithium cell of 10 Ah.
#
# **Before you run:** what of the three numbers will these lifetimes determine?

# %%
cell = optuav.fit_kibam(folder / "lipo.csv")
cell

# %% [markdown]
# The capacity and the lag. Wells that settle in 3 s or in 60 s have the same lag with another ω,
# and last as long. optuav then takes 30 s, because lithium cells take 19 to 47 s. A load with
# pauses of 30 to 120 s would show it: in such a pause the cell gets its charge back, or not yet.
#
# ## Before flying
#
# The best fit promises too much about half of the time.
#
# **Before you run:** with `never_longer` no fitted lifetime is longer than measured, less 1 %. How
# much capacity does that cost?

# %%
careful = optuav.fit_kibam(folder / "lipo.csv", never_longer=True)
fits = {"best": cell, "never longer": careful}
capacity_As = pd.Series({name: each.values[0].value for name, each in fits.items()})
left_over_s = pd.DataFrame(
    {
        name: pd.Series(each.panels[0].fitted) - each.panels[0].observed
        for name, each in fits.items()
    }
)
left_over_s

# %% [markdown]
# Three percent. Use the careful fit for a plan that shall be flown, and the best fit for science.
#
# ## Into the mission
#
# The fit writes a mission file that states the three keys, with intervals and origin as comments.
# `optuav calibrate kibam data/lifetimes.csv --save cell.toml` does the same, beside this page.

# %%
print(fit.to_toml())

# %% [markdown]
# **Before you run:** with these wells, and the capacity as it was, does the plan of the perspective
# `battery` hover longer? Does it fall earlier?

# %%
wells = {key: value for key, value in fit.changes.items() if key != "battery.capacity_As"}
mission = optuav.load("paper").replace(wells)
plans = [optuav.solve(site, "P3", perspective="battery") for site in ("paper", mission)]
pd.DataFrame(
    [(plan.hover_time_s, plan.runs_dry_s) for plan in plans],
    columns=["hover [s]", "runs dry at [s]"],
    index=["wells of paper", "fitted wells"],
)

# %% [markdown]
# The perspective `battery` promises the same hover, because it knows of no wells. With the fitted
# wells the drone falls much earlier: they make only a sixth of the charge available at once.
#
# ## A doubt is not an error
#
# Each fit doubts values that no drone has, because such values usually have another unit than the
# file says. Here is the propeller of the paper, from its data sheet.
#
# **Before you run:** the figure of merit is the ideal power in hover over the power that the
# propeller takes. What is it at most?

# %%
optuav.fit_rotor(folder / "propeller.csv")

# %% [markdown]
# It is 1.00: the published torque coefficient is that of an ideal propeller, which wastes nothing.
# Real ones reach 0.4 to 0.8. The file is read correctly, so you keep the values; but the drone of
# the paper hovers on less power than any real one.

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
