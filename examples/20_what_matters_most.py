import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # What matters most?
#
# No number of a mission is known exactly. Which of them are worth measuring better? And what
# happens to a plan when all of them are a little wrong at once? The ranges are from the comments of
# `matrice350`, most of them assumed; the current is 969 to 1150 W over 44.76 V.
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
import optuav

mission = optuav.load("matrice350")
stated = {
    "battery": {"capacity_As": {"low": 19000, "likely": 21000, "high": 21168}},
    "flight": {"hover_current_A": {"low": 21.65, "likely": 24.65, "high": 25.69}},
    "laser": {
        "visibility_km": {"low": 3, "likely": 10, "high": 23},
        "receiver_slope": {"low": 0.15, "likely": 0.2, "high": 0.25},
    },
}
found = optuav.sensitivity(mission, stated)
longest_s = found.facts["hover_time_s"]
print(found)

# %%
found.plot()

# %% [markdown]
# ## An elasticity by hand
#
# The shadow price of the capacity of a pack is in seconds of hover per ampere-second. Times the
# capacity over the hover time, it is percent per percent.
#
# **Before you run:** one percent more capacity: one percent more hover, less, or more?

# %%
prices = optuav.formulate(mission).shadow_prices()
by_key = {row["key"]: row for row in found.rows}
price = prices["capacity_As"].more
exact = by_key["battery.capacity_As"]["local_elasticity"]
by_hand = price * mission.battery.capacity_As / longest_s
print(f"{price:.5f} s per As, {by_hand:.4f} % by %; the table has {exact:.4f}")

# %% [markdown]
# Keys that are factors of one product have the same elasticity: the power that the laser draws, the
# share that becomes light, and the share of that which becomes electricity. Ranges may differ.
#
# **Before you run:** so which of the three is worth measuring better?

# %%
factors = [by_key[f"laser.{name}"] for name in ("power_W", "emitter_slope", "receiver_slope")]
for each in factors:
    print(f"{each['key']:24}{each['local_elasticity']:8.4f}, swing {each['swing_s']:6.1f} s")

# %% [markdown]
# ## What the tornado hides
#
# An exact rate holds for small steps only. The share of the charge that is available at once has
# rate 0, because charge and time end this hover and not the wells.
#
# **Before you run:** is it safe to assume any other share, then?

# %%
share = by_key["battery.available_fraction"]
print(f"ω = {share['now']}: rate {share['local_elasticity']:.3f}; ", end="")
print(f"ω = {share['low']}: {share['hover_low_s']:.1f} s")
wells = by_key["battery.flow_rate_per_s"]
slow = mission.replace({"battery.flow_rate_per_s": 1e-5, "battery.available_fraction": 0.8})
plan = optuav.solve(slow, perspective="battery")
print(f"effect of k_F: {wells['swing_s']:.3f} s; with slow wells:", *plan.warnings)

# %% [markdown]
# With a tenth less, the wells end the hover. And a key without effect in its whole range may have
# one outside it, such as the flow between the wells: a slow flow decides whether a plan that counts
# charge alone can be flown.
#
# ## Everything at once
#
# Now all numbers are drawn at once, each from its range.
#
# **Before you run:** the best plan uses all the charge that it may. In what share of the samples
# can it be flown?

# %%
chances = found.facts["chances"]
for share, hover_s in chances.quantiles_s.items():
    print(f"{share:4.0%} of the samples hover less than {hover_s:7.1f} s")
print(f"the mission itself {longest_s:.1f} s; that plan can be flown in {chances.flyable:.1%}")

# %% [markdown]
# Asymmetric ranges move the median away from the hover of the mission itself, and a plan without a
# margin is a coin toss.
#
# ## A margin
#
# Plan to keep more charge than the 20 % that are required. (2000 samples are enough here, so that
# the first share differs a little from the one above.)
#
# **Before you run:** how much charge would you plan to keep, so that nine flights of ten succeed,
# and how much hover does it cost?

# %%
flyable = []
for reserve in (0.2, 0.25, 0.3, 0.35):
    plan = optuav.solve(mission.replace({"limits.min_soc": reserve}))
    held = optuav.sensitivity(mission, stated, plan=plan, samples=2000).facts["chances"].flyable
    flyable.append(held)
    print(f"planned to keep {reserve:.0%}: hover {plan.hover_time_s:7.1f} s, flown in {held:.1%}")
again = optuav.sensitivity(mission, stated, plan=plan, samples=2000).facts["chances"]
print("the same seed, the same samples:", again.flyable == flyable[-1])

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
heavy = task.mission.replace({"body.mass_kg": task["body.mass_kg"] * (1 + task["more"])})
light_s, heavy_s = (optuav.solve(each).hover_time_s for each in (task.mission, heavy))
answer_1 = 100 * (1 - heavy_s / light_s)
### END SOLUTION

# %%
grade = exercises.check("20.1", answer_1, student)
print(grade)
