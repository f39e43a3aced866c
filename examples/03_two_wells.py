import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Two wells: the kinetic battery model
#
# A battery holds its charge in two wells. Only the available one feeds the load. Charge flows into
# it from the bound one, and the larger the difference of their levels, the faster it flows.
#
# **Before this lesson:** [A first mission](01_first_mission.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - explain why a battery stops with charge left in it (the rate-capacity effect);
# - explain why it can be used again after a pause (the recovery effect);
# - predict lifetimes under a load that comes and goes.

# %%
import math
from itertools import cycle

import numpy as np

import optuav
from optuav.physics.kibam import Battery, Stage, Wells, step, time_to_empty

MINUTE_S = 60.0

# %% [markdown]
# ## Drained fast, it stops with charge left
#
# Think of two vessels that are joined by a thin pipe at their floors. The available one has the
# width $\omega$, the bound one the width $1 - \omega$. What a well holds over its width is its
# height: $y_1 / \omega$ and $y_2 / (1 - \omega)$. In a full battery of the capacity $B$ both are
# $B$. Charge flows towards the lower height and stops where both are equal; the wells then hold
# charge in proportion to their widths. The flow is
#
# $$k_F \left( \frac{y_2}{1 - \omega} - \frac{y_1}{\omega} \right),$$
#
# so that $k_F$ is what a unit of difference lets through. The two heights approach each other at
# the rate $k' = k_F / (\omega (1 - \omega))$, which is what measurements are usually given by: $k'$
# for how fast a battery recovers, $k_F$ for how many amperes flow.
#
# A small cell of 5.5 A min, a sixth of it available, with k' = 0.122 per minute.
#
# **Before you run:** if all charge were of use, 0.5 A would last for eleven minutes. How long does
# it last? Does half the current last twice as long, less, or longer?

# %%
ω, k = 0.166, 0.122 / MINUTE_S
if not 0.0 < ω < 1.0:
    raise SystemExit("Neither well may be without a width: take ω between 0 and 1.")
cell = Battery(5.5 * MINUTE_S, ω, k * ω * (1 - ω))  # capacity 5.5 A min, k' = 0.122 1/min
delivered = {}
for current_A in (0.125, 0.25, 0.5, 1.0):
    lifetime_s = float(time_to_empty(cell, cell.full, -current_A))
    delivered[current_A] = current_A * lifetime_s / cell.capacity_As
    left = step(cell, cell.full, Stage(-current_A, lifetime_s))
    print(
        f"{current_A:5.3f} A: {lifetime_s / MINUTE_S:6.2f} min, gives {delivered[current_A]:6.1%}, "
        f"available {abs(left.available_As):.1f} A s, bound {left.bound_As:.1f} A s"
    )

# %% [markdown]
# Whatever the current, the available well is empty at the end, and the bound one is not. Over many
# currents: the slower the load, the more it gets out of the cell; a fast one gets only the
# available sixth.

# %%
currents_A = np.linspace(0.02, 1.5, 100)
shares = currents_A * time_to_empty(cell, cell.full, -currents_A) / cell.capacity_As
optuav.plots.curves(
    [optuav.plots.Line("delivered by a constant load", currents_A, 100.0 * shares)],
    title="What a cell gives before it is empty",
    x_label="current drawn [A]",
    y_label="share of the charge [%]",
    y_from_zero=True,
)

# %% [markdown]
# ## A pause brings charge back
#
# **Before you run:** emptied with 0.5 A, the cell rests for two minutes without load. Nothing is
# added. Will it be able to feed a load again, and will it contain more charge than before?

# %%
emptied_s = float(time_to_empty(cell, cell.full, -0.5))
empty = step(cell, cell.full, Stage(-0.5, emptied_s))
rested = step(cell, empty, Stage(0.0, 2 * MINUTE_S))
print(f"available before the pause: {empty.available_As:z.2f} of {empty.total_As:.2f} A s")
print(f"available after the pause:  {rested.available_As:.2f} of {rested.total_As:.2f} A s")

# %% [markdown]
# Both wells in time: drained, paused, drained again.

# %%
times_s = np.arange(0.0, emptied_s + 2 * MINUTE_S + 1.0)
draining = step(cell, cell.full, Stage(-0.5, np.minimum(times_s, emptied_s)))
pausing = step(cell, draining, Stage(0.0, np.maximum(times_s - emptied_s, 0.0)))
optuav.plots.curves(
    [
        optuav.plots.Line("available", times_s / MINUTE_S, pausing.available_As),
        optuav.plots.Line("bound", times_s / MINUTE_S, pausing.bound_As),
    ],
    title="Emptied, and left alone for two minutes",
    x_label="time [min]",
    y_label="charge [A s]",
    y_from_zero=True,
    marks=[optuav.plots.Mark(emptied_s / MINUTE_S, "load off")],
)

# %% [markdown]
# ## Lifetimes
#
# Test loads of Jongerden and Haverkort: continuous (CL), a minute on and a minute off (ILs), a
# minute on and two off (ILl), with 250 mA, 500 mA or both in turn (alt).
#
# **Before you run:** CL500 lasts for two minutes. A minute on and a minute off draws half as much
# on average: does ILs500 last for four minutes? And what does a second cell beside the first, twice
# the capacity, do to CL500?


# %%
def lifetime_min(battery: Battery, load: list[tuple[float, float]]) -> float:
    """Time [min] until a battery is empty under phases (current drawn [A], duration [min])."""
    if not any(current_A > 0.0 for current_A, _ in load):
        return math.inf  # Nothing is drawn
    wells, passed_s = battery.full, 0.0
    for current_A, duration_min in cycle(load):
        duration_s = duration_min * MINUTE_S
        empty_s = float(time_to_empty(battery, wells, -current_A)) if current_A else math.inf
        if empty_s <= duration_s:
            break
        wells = step(battery, wells, Stage(-current_A, duration_s))
        passed_s += duration_s
    return (passed_s + empty_s) / MINUTE_S


low, high, off = (0.25, 1.0), (0.5, 1.0), (0.0, 1.0)
loads = {
    "CL250": [low],
    "CL500": [high],
    "CLalt": [high, low],
    "ILs250": [low, off],
    "ILs500": [high, off],
    "ILsalt": [high, off, low, off],
    "ILl250": [low, off, off],
    "ILl500": [high, off, off],
}
twice = Battery(2 * cell.capacity_As, ω, cell.flow_rate_per_s)
lifetimes_min = {}
for name, load in loads.items():
    lifetimes_min[name] = lifetime_min(cell, load), lifetime_min(twice, load)
    small_min, large_min = lifetimes_min[name]
    print(f"{name:<7} {small_min:6.2f} min, with twice the capacity {large_min:6.2f} min")

# %% [markdown]
# With twice the capacity, the battery lasts more than twice as long: the same current is a smaller
# one for it.
#
# ## The drone
#
# A state of charge counts both wells, and so says little about the one that feeds the load.
#
# **Before you run:** the drone of the mission `paper` starts with four fifths of its charge
# available. After ten minutes of hovering a quarter of all charge is left. In which well?

# %%
drone = Battery(72_000.0, 0.8, 4.5e-5)
wells = step(drone, Wells(57_600.0, 14_400.0), Stage(-87.91, 600.0))
print(f"a drone after ten minutes of hovering: available {wells.available_As:.1f} A s,")
print(f"bound {wells.bound_As:.1f} A s; together {wells.total_As / drone.capacity_As:.1%} of full")

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("03.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Halve the interval of currents: the smaller the current, the larger the share.
from optuav.physics.kibam import Battery, time_to_empty

battery = Battery(task["capacity_As"], task["share"], 2e-4)
low_A, high_A = 0.1, 500.0
while high_A - low_A > 1e-6:
    current_A = 0.5 * (low_A + high_A)
    lasts_s = time_to_empty(battery, battery.full, -current_A)
    is_more = lasts_s * current_A / task["capacity_As"] > task["out"]
    low_A, high_A = (current_A, high_A) if is_more else (low_A, current_A)
letter = next(key for key, reason in task.reasons.items() if "limited rate" in reason)
answer_1 = letter, low_A
### END SOLUTION

# %%
grade = exercises.check("03.1", answer_1, student)
print(grade)

# %%
task = exercises.task("03.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# An empty available well makes the flow largest. So empty it nearly at once, and then draw what
# flows in: try some times of the first stage, and find the largest current that can follow.
from optuav.physics.kibam import Stage, step

battery = Battery(task["capacity_As"], task["share"], 2e-4)
most_A, time_s = task["most_A"], task["time_s"]
dry_s, best_As = float(time_to_empty(battery, battery.full, -most_A)), 0.0
for first_s in (0.9 * dry_s, 0.93 * dry_s, 0.96 * dry_s, 0.98 * dry_s):
    wells = step(battery, battery.full, Stage(-most_A, first_s))
    low_A, high_A = 0.0, 50.0
    while high_A - low_A > 1e-6:
        then_A = 0.5 * (low_A + high_A)
        lasts = time_to_empty(battery, wells, -then_A) > time_s - first_s
        low_A, high_A = (then_A, high_A) if lasts else (low_A, then_A)
    if (drawn_As := most_A * first_s + low_A * (time_s - first_s)) > best_As:
        best_As = drawn_As
        answer_2 = {"first_A": most_A, "first_s": first_s, "then_A": low_A}
### END SOLUTION

# %%
grade = exercises.check("03.2", answer_2, student)
print(grade)
