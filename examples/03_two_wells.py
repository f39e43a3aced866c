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
# - explain what a pause does to it (the recovery effect);
# - predict lifetimes under a load that comes and goes.

# %%
import math
from itertools import cycle

import numpy as np
import pandas as pd

import optuav
from optuav.exercises.helpers.vessels import moving, vessels
from optuav.physics.kibam import Battery, Stage, step, time_to_empty

MINUTE_S = 60.0
ω, k = 0.166, 0.122 / MINUTE_S
cell = Battery(5.5 * MINUTE_S, ω, k * ω * (1 - ω))  # capacity 5.5 A min, k' = 0.122 1/min
drone = Battery(72_000.0, 0.8, 4.5e-5)
vessels({"a small cell": (cell, cell.full, 0.5), "a drone": (drone, drone.full, 87.91)})

# %% [markdown]
# ## Two vessels
#
# Think of two vessels of different widths, joined by a thin pipe at their floors. The available
# vessel has the tap, and the load drains it. Its width is $\omega$, and the width of the bound
# vessel is $1 - \omega$. In the small cell the vessel with the tap is the narrow one; in the drone
# it is the wide one.
#
# The charge of a well over its width is its height: $y_1 / \omega$ and $y_2 / (1 - \omega)$. In a
# full battery of the capacity $B$ both heights are $B$. Charge flows towards the lower height and
# stops when both are equal; the wells then hold charge in proportion to their widths. The flow is
#
# $$k_F \left( \frac{y_2}{1 - \omega} - \frac{y_1}{\omega} \right),$$
#
# so $k_F$ is the flow [A] per 1 A s of difference between the heights. The two heights approach
# each other at the rate $k' = k_F / (\omega (1 - \omega))$. Measurements usually state $k'$, which
# tells how fast a battery recovers; $k_F$ tells how many amperes flow.
#
# ## Drained fast, and slowly
#
# The small cell has 5.5 A min, a sixth of it available, with k' = 0.122 per minute.
#
# **Before you run:** if all charge could be used, 0.5 A would last for eleven minutes. How long
# does it last? Does half the current last twice as long, less, or longer?

# %%
currents_A = np.array([0.125, 0.25, 0.5, 1.0])
lifetimes_s = time_to_empty(cell, cell.full, -currents_A)
delivered = currents_A * lifetimes_s / cell.capacity_As
left = step(cell, cell.full, Stage(-currents_A, lifetimes_s))
pd.DataFrame(
    {
        "current [A]": currents_A,
        "lifetime [min]": lifetimes_s / MINUTE_S,
        "charge delivered [%]": 100.0 * delivered,
        "available, left [A s]": np.abs(left.available_As),
        "bound, left [A s]": left.bound_As,
    }
).round(3)

# %% [markdown]
# Whatever the current, the available well is empty at the end, and the bound one is not. The slower
# the load, the more charge it gets out of the cell. A fast load gets only the available sixth.

# %%
many_A = np.linspace(0.02, 1.5, 100)
shares = many_A * time_to_empty(cell, cell.full, -many_A) / cell.capacity_As
optuav.plots.curves(
    [optuav.plots.Line("delivered by a constant load", many_A, 100.0 * shares)],
    title="What a cell gives before it is empty",
    x_label="current drawn [A]",
    y_label="share of the charge [%]",
    y_from_zero=True,
)

# %% [markdown]
# ## A pause
#
# **Before you run:** 0.5 A empties the cell. Then it rests for two minutes without load, and
# nothing is added. Will it be able to feed a load again? Will it contain more charge than before?

# %%
PAUSE_S = 2 * MINUTE_S
emptied_s = float(time_to_empty(cell, cell.full, -0.5))
empty = step(cell, cell.full, Stage(-0.5, emptied_s))
rested = step(cell, empty, Stage(0.0, PAUSE_S))
vessels({"emptied with 0.5 A": (cell, empty, 0.5), "two minutes later": (cell, rested, 0.0)})

# %% [markdown]
# The cell holds as much as before, but charge has moved to the vessel with the tap, so it can feed
# a load again. Drained, left alone, and drained again:

# %%
again_s = float(time_to_empty(cell, rested, -0.5))
load = [(0.5, emptied_s), (0.0, PAUSE_S), (0.5, again_s)]
moving(cell, load)

# %% [markdown]
# Both wells over the same time:

# %%
times_s = np.linspace(0.0, emptied_s + PAUSE_S + again_s, 400)
wells = cell.full
begin_s = 0.0
for drawn_A, duration_s in load:
    wells = step(cell, wells, Stage(-drawn_A, np.clip(times_s - begin_s, 0.0, duration_s)))
    begin_s += duration_s
optuav.plots.curves(
    [
        optuav.plots.Line("available", times_s / MINUTE_S, wells.available_As),
        optuav.plots.Line("bound", times_s / MINUTE_S, wells.bound_As),
    ],
    title="Emptied, left alone for two minutes, and emptied again",
    x_label="time [min]",
    y_label="charge [A s]",
    y_from_zero=True,
    marks=[
        optuav.plots.Mark(emptied_s / MINUTE_S, "load off"),
        optuav.plots.Mark((emptied_s + PAUSE_S) / MINUTE_S, "load on"),
    ],
)

# %% [markdown]
# ## Lifetimes
#
# Jongerden and Haverkort use these test loads: continuous (CL), a minute on and a minute off (ILs),
# a minute on and two off (ILl), with 250 mA, 500 mA or both in turn (alt).
#
# **Before you run:** CL500 lasts for two minutes. A minute on and a minute off draws half as much
# on average: does ILs500 last for four minutes? And how long does CL500 last with a second cell
# beside the first, twice the capacity?


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
lifetimes_min = {
    name: [lifetime_min(b, load) for b in (cell, twice)] for name, load in loads.items()
}
pd.DataFrame(lifetimes_min, index=["one cell [min]", "two cells [min]"]).T.round(2)

# %% [markdown]
# Half the current on average lasts more than twice as long: in every pause charge flows back into
# the available well. With twice the capacity, the battery also lasts more than twice as long: for
# it, the same current is a smaller one.
#
# ## The drone
#
# A state of charge counts both wells, and so says little about the one that feeds the load.
#
# **Before you run:** the drone of the mission `paper` starts with four fifths of its charge
# available. After ten minutes of hovering a quarter of all charge is left. In which well?

# %%
hovered = step(drone, drone.full, Stage(-87.91, 600.0))
vessels({"at take-off": (drone, drone.full, 0.0), "after ten minutes": (drone, hovered, 87.91)})

# %% [markdown]
# The wide vessel is nearly empty, and the narrow one nearly full. The thin pipe lets far less
# through than the rotors draw.
#
# ## Two time scales
#
# The wells of `paper` need an hour to level, $1/k'$ = 3556 s. A lithium pouch cell needs some 30 s:
# there the wells stand for a voltage that drops under load. `optuav new --battery lipo` writes such
# wells. What a constant current I leaves unused is I·L, with the lag L = (1 − ω)²/k_F.
#
# **Before you run:** both batteries hover until they are empty, and then rest for one minute. Which
# of the two can hover again, and for about how long?

# %%
lipo = Battery(72_000.0, 0.2, 0.16 / 30)


def hovers_s(battery):
    """Lag, first hover, and hover after a minute of rest [s]."""
    first_s = float(time_to_empty(battery, battery.full, -87.91))
    empty = step(battery, battery.full, Stage(-87.91, first_s))
    rested = step(battery, empty, Stage(0.0, 60.0))
    return battery.lag_s, first_s, float(time_to_empty(battery, rested, -87.91))


pauses_s = pd.DataFrame(
    [hovers_s(drone), hovers_s(lipo)],
    index=["wells of paper", "lipo"],
    columns=["lag", "first hover", "hover after 60 s"],
).round(1)
pauses_s

# %% [markdown]
# In a minute the LiPo wells have nearly levelled, and give half a minute of hover. The paper's
# give 2 s, and 2 minutes after a day.

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
