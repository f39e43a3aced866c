# %% [markdown]
# # The endless cycle
#
# One hover ends when the battery is empty. A service does not end: the drone flies to the device,
# hovers, flies back, rests, and begins again. What share of the day does it cover, and what would
# raise that share?
#
# **Before this lesson:** [Two wells](03_two_wells.py),
# [When the battery runs dry](04_when_the_battery_runs_dry.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - compute the share of the time that one drone hovers, from currents only;
# - say how long the drone should stay on each visit, and why;
# - say how full the two wells are at each take-off, and why;
# - tell whether better flights or a better charger help more.

# %%
import numpy as np
import pandas as pd

import optuav

mission = optuav.load("paper")
plan = optuav.solve(mission)
plan

# %% [markdown]
# ## From one hover to a day
#
# The best single plan hovers for ten minutes of its deadline. It ends with the battery nearly
# empty, so nobody can repeat it at once. In a cycle the rest gives back what hovering and flying
# took:
#
# $$ I_r r = I_h h + Q, \qquad \text{share} = \frac{h}{h + T + r}, $$
#
# with the flights' duration $T$ and charge $Q$, the hovering current $I_h$ and the charging current
# $I_r$.
#
# **Before you run:** hovering draws 87.9 A here, and resting returns 10 A. Even if flights were
# free, what share of the day could the drone cover? And with flights, is it better to take turns
# quickly, or to stay until the battery is nearly empty?

# %%
best = optuav.coverage(mission)
visit = best.visit
hover_s = np.linspace(1.0, best.hover_s, 200)
rest_s = (visit.hover_A * hover_s + visit.flight_As) / visit.rest_A
share = hover_s / (hover_s + visit.flight_s + rest_s)
optuav.plots.curves(
    [optuav.plots.Line(best.building, hover_s, 100.0 * share)],
    title="Share of the time by the length of a hover",
    x_label="hover in each cycle [s]",
    y_label="share [%]",
    y_from_zero=True,
)

# %%
pd.Series(
    {"free flights": best.limit_share, "this cycle": best.share, "bound": best.bound}, name="share"
).round(4).to_frame()

# %% [markdown]
# A hover of a hundred seconds already covers more than half of what is possible, but the curve
# never falls: each cycle pays for its flights once, and a longer hover spreads that over more
# seconds. **The longest cycle is the best.**
#
# ## Where a cycle begins
#
# **Before you run:** the drone of a single plan takes off with both wells full. Does the drone of
# the endless cycle? If not, which well is not full?

# %%
best

# %%
best.plot()["cycle.png"]

# %% [markdown]
# The available well is full at each take-off, since charging has to stop there. The bound well is
# not: filling it goes through the available one, and takes hours. The charge at the departure is
# 92 %, and there is just one such pair of wells for each length of the hover. The search shortens
# the hover until its pair exists and no landing is too low.
#
# ## As a problem
#
# The same cycle is a declared problem: the charge at the start is unknown, and the end must give it
# back.

# %%
optuav.coverage(mission, perspective="battery").program()

# %% [markdown]
# ## What helps?
#
# **Before you run:** order these by how much they raise the share: flights that cost nothing, a
# charger of twice the current, the exchange of an empty pack within two minutes.

# %%
faster = mission.replace({"battery.charge_current_A": 20.0})
shares = {
    "as it is": best.share,
    "free flights, at most": best.limit_share,
    "charger of 20 A": optuav.coverage(faster).share,
    "pack exchanged in 120 s": optuav.coverage(mission, swap_s=120).share,
}
pd.Series(shares, name="share of the day").round(4).to_frame()

# %%
{"charger of 20 A": optuav.coverage(faster).building, "as it is": best.building}

# %% [markdown]
# The charger decides. Still, twice its current does not give twice the share: the laser supplies 20
# A on no roof, and the best roof is now another one, nearer to the laser and farther from the
# device. Exchanging packs beats all light, but needs somebody on the roof.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("31.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Fill the available well at each departure, and repeat the cycle until nothing changes.
from optuav.physics.kibam import Stage, Tilted, Wells, tilted_after

visit, hover_s = optuav.coverage(task.mission).visit, task["hover_s"]
battery, bound_As = visit.battery, 8000.0
cycle = *visit.stages(hover_s), Stage(visit.rest_A, visit.rest_s(hover_s))
for _ in range(100):
    begin = Tilted.of(battery, Wells(battery.full.available_As, bound_As))
    bound_As = float(tilted_after(battery, begin, *cycle).wells(battery).bound_As)
letter = next(key for key, reason in task.reasons.items() if "through the available well" in reason)
answer_1 = letter, bound_As
### END SOLUTION

# %%
grade = exercises.check("31.1", answer_1, student)
print(grade)
