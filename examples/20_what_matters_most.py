# %% [markdown]
# # What matters most?
#
# No number of a mission is known exactly. Which of them are worth measuring better? And what
# happens to a plan when all of them are a little wrong at once? The ranges are from the comments of
# `matrice350`, most of them assumed; the current is 969 to 1150 W over 44.76 V. Here the reserve
# counts at the end only, so that the drone hovers first and no rest can overfill its packs.
#
# **Before this lesson:** [Your own drone](02_your_own_drone.py),
# [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - read an elasticity, and get it from a shadow price with pencil and paper;
# - say what a tornado chart shows and what it hides;
# - draw samples from stated uncertainties, and read quantiles of the hover time;
# - give a plan the margin that it needs.

# %%
import pandas as pd

import optuav

mission = optuav.load("matrice350").replace({"limits.keep_soc": "end"})
ranges = {
    "battery": {"capacity_As": {"low": 19000, "likely": 21000, "high": 21168}},
    "flight": {"hover_current_A": {"low": 21.65, "likely": 24.65, "high": 25.69}},
    "laser": {
        "visibility_km": {"low": 3, "likely": 10, "high": 23},
        "receiver_slope": {"low": 0.15, "likely": 0.2, "high": 0.25},
    },
}
result = optuav.sensitivity(mission, ranges)
result.plot()["tornado.png"]

# %% [markdown]
# Each bar shows the longest hover at the two ends of one key's range, the other keys as they are.
# `optuav.explore(mission)` has a slider for most keys. The table has the rates of the first keys as
# well:

# %%
by_key = result.to_frame().set_index("key")
by_key[["now", "low", "high", "hover_low_s", "hover_high_s", "local_elasticity", "swing_s"]].head(8)

# %% [markdown]
# ## An elasticity by hand
#
# The shadow price of the capacity of a pack is in seconds of hover per ampere-second. Multiplied by
# the capacity and divided by the hover time, it becomes percent per percent.
#
# **Before you run:** does one percent more capacity give one percent more hover, less, or more?

# %%
price = optuav.formulate(mission).shadow_prices()["capacity_As"].more
longest_s = result.hover_time_s
by_hand = price * mission.battery.capacity_As / longest_s
exact = by_key.loc["battery.capacity_As", "local_elasticity"]
by_hand, float(exact)

# %% [markdown]
# Keys that are factors of one product have the same elasticity: the power that the laser draws, the
# share that becomes light, and the share of that which becomes electricity. Their ranges may
# differ.
#
# **Before you run:** so which of the three is worth measuring better?

# %%
factors = by_key.loc[["laser.power_W", "laser.emitter_slope", "laser.receiver_slope"]]
factors[["low", "high", "local_elasticity", "swing_s"]]

# %% [markdown]
# ## What the tornado hides
#
# An exact rate holds for small steps only. The share of the charge that is available at once has
# rate 0, because charge and time end this hover and not the wells.
#
# **Before you run:** is it safe to assume any other share, then?

# %%
wells = by_key.loc[["battery.available_fraction", "battery.flow_rate_per_s"]]
wells[["now", "low", "high", "hover_low_s", "hover_high_s", "local_elasticity"]]

# %% [markdown]
# No: ten percent to either side change nothing, neither in the share nor in the flow between the
# wells. But a key without effect in its whole range may have an effect outside it. A slow flow
# decides whether a plan that counts charge only can be flown:

# %%
slow = mission.replace({"battery.flow_rate_per_s": 1e-5, "battery.available_fraction": 0.8})
optuav.solve(slow, perspective="battery").warnings

# %% [markdown]
# ## Everything at once
#
# Now optuav draws all numbers at once, each from its range.
#
# **Before you run:** the best plan uses all the charge that it may. In what share of the samples
# can it be flown?

# %%
chances = result.chances
chances.flyable

# %%
result.plot()["hover.png"]

# %% [markdown]
# Asymmetric ranges move the median away from the hover of the mission itself, and a plan without a
# margin is a coin toss.
#
# ## A margin
#
# Plan to keep more charge than the 20 % that are required. (2000 samples are enough here, so the
# first share differs a little from the share above.)
#
# **Before you run:** how much charge would you plan to keep, so that nine flights of ten succeed,
# and how much hover does it cost?

# %%
rows = []
for reserve in (0.2, 0.25, 0.3, 0.35):
    plan = optuav.solve(mission.replace({"limits.min_soc": reserve}))
    sampled = optuav.sensitivity(mission, ranges, plan=plan, samples=2000).chances
    rows.append((reserve, plan.hover_time_s, sampled.flyable))
margins = pd.DataFrame(rows, columns=["charge to keep", "hover [s]", "share that can be flown"])
margins

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("20.1", student)
print(task)

# %%
answer_1 = ...


### BEGIN SOLUTION
# The more mass, the more hover is lost: halve an interval of percent.
def hover_s(percent):
    mass_kg = task["body.mass_kg"] * (1 + percent / 100)
    return optuav.solve(task.mission.replace({"body.mass_kg": mass_kg})).hover_time_s


wanted_s = (1 - task["less"] / 100) * hover_s(0)
few, many = 0.0, 20.0
while many - few > 1e-3:
    middle = (few + many) / 2
    few, many = (middle, many) if hover_s(middle) > wanted_s else (few, middle)
letter = next(key for key, reason in task.reasons.items() if "rotor speed" in reason)
answer_1 = letter, few
### END SOLUTION

# %%
grade = exercises.check("20.1", answer_1, student)
print(grade)
