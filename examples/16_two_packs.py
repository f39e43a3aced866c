# %% [markdown]
# # Two packs: one flies while the laser charges the other
#
# A drone with two battery packs may use them as one, or in turns. Turns let the laser charge a pack
# while the other works; but a pack that carries everything by itself drains twice as fast.
#
# **Before this lesson:** [Two wells](03_two_wells.py),
# [When the battery runs dry](04_when_the_battery_runs_dry.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - name the schedules, and compute how long packs last under each;
# - explain how pooling, frequent turns and one pack after the other differ;
# - find the longest hover under a schedule, and say how certain that answer is.

# %%
import pandas as pd

import optuav
from optuav.network.network import build_network
from optuav.network.timeline import carry, route_phases
from optuav.physics.kibam import Battery, time_to_empty
from optuav.physics.packs import lifetime

cell = {"capacity_As": 7200.0, "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}
pd.options.display.max_colwidth = None

# %% [markdown]
# ## Lifetimes
#
# The load is one minute of work and one minute of idling, repeated. Here a positive current
# *discharges*. Pooled packs share every job. In sequence the second pack waits while full, and
# cannot recover. The other schedules take turns: at every job (round-robin), every five seconds
# (alternating), or by which pack has more available charge.
#
# **Before you run:** order the five schedules by how long the packs last.

# %%
load = [(8.0, 60.0), (0.0, 60.0)]
schedules = {
    "pooled": {},
    "sequential": {},
    "round-robin": {},
    "alternating": {"period_s": 5.0},
    "most-available": {},
}
life_s = {
    name: lifetime(load, packs=2, schedule=name, **options, **cell)
    for name, options in schedules.items()
}
pd.Series(life_s, name="lifetime [s]").to_frame()

# %% [markdown]
# Two packs that share a load halve the current of each, and a battery gives more charge at a
# smaller current. Is the function right? One pack under a steady load has a closed form to compare
# with:

# %%
single = Battery(7200.0, 0.625, 4.5e-5)
lifetime([(3.0, 1.0)], **cell), float(time_to_empty(single, single.full, -3.0))

# %% [markdown]
# An empty pack is neither used nor charged again; the other takes over in the middle of the job. A
# load that charges what it draws may last without end: `horizon_s` states how long to follow it.
#
# **Before you run:** a minute with 1 A is followed by a minute of charging with 1 A, or with 0.5 A.
# Which of the two loads ends?

# %%
lasts_s = {
    charge_A: lifetime([(1.0, 60.0), (-charge_A, 60.0)], **cell, horizon_s=86_400.0)
    for charge_A in (1.0, 0.5)
}
pd.Series(lasts_s, name="lifetime by charging current [s]").round(1).to_frame()

# %% [markdown]
# ## Turns as short as you like
#
# Under a constant load, quick turns halve the mean load of each pack, as pooling does.
#
# **Before you run:** are turns of ten minutes better or worse than pooling? And turns of six
# seconds?

# %%
pooled_s = lifetime([(8.0, 1.0)], packs=2, **cell)
turns_s = {
    period_s: lifetime([(8.0, 1e4)], packs=2, schedule="alternating", period_s=period_s, **cell)
    for period_s in (600.0, 60.0, 6.0)
}
pd.DataFrame({"in turns [s]": turns_s, "pooled [s]": pooled_s})

# %% [markdown]
# ## In a mission
#
# A job is a phase: a leg, a hover, a rest. While the drone hovers, the pack that flies gives the
# whole current, and the laser charges the other pack until it is full. After that the light is
# lost.
#
# **Before you run:** at last the laser can charge all the time. Does any schedule hover longer than
# the pooled packs?

# %%
paper = optuav.load("paper")
direct = {
    name: optuav.solve(
        paper.replace(
            {"battery.schedule": name} | {f"battery.{key}": value for key, value in options.items()}
        ),
        "P3",
        perspective="available",
    )
    for name, options in schedules.items()
}
pd.DataFrame(
    [(name, plan.hover_time_s, plan.proof) for name, plan in direct.items()],
    columns=["schedule", "hover [s]", "proof"],
)

# %% [markdown]
# None does. Turns of 5 s come close: the laser always finds a pack that is not full. In sequence it
# finds no such pack, because the second pack is full until the first is empty.
#
# ## Which pack flew when
#
# The picture shows the available wells of both packs, in sequence and in turns. The strips below
# say which pack flies and which pack the laser charges.

# %%
optuav.plots.packs([direct["sequential"], direct["alternating"], direct["pooled"]])

# %% [markdown]
# The same from the plan's phases, pack by pack: in sequence, the second pack takes over in the air.

# %%
mission = direct["sequential"].mission
planned = route_phases(build_network(mission), 0, direct["sequential"].hover_time_s, 0.0)
flown = carry(mission, planned)
turns = pd.DataFrame(
    [
        (float(stretch.start_s[0]), float(stretch.duration_s[0]), int(stretch.carrier[0]) + 1)
        for stretch in flown.stretches[1]
    ],
    columns=["from [s]", "for [s]", "pack that flies"],
)
turns[turns["for [s]"] > 0.0]  # One ends at once, as the laser finds the other pack full

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("16.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# The gain shrinks as the current grows: halve an interval of currents.
from optuav.physics.packs import lifetime

cell = {"capacity_As": task["capacity_As"], "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}
low_A, high_A = 2.0, 20.0
while high_A - low_A > 1e-4:
    current_A = 0.5 * (low_A + high_A)
    pooled_s, in_turn_s = (
        lifetime([(current_A, 1e6)], packs=2, schedule=schedule, **cell)
        for schedule in ("pooled", "sequential")
    )
    is_more = pooled_s - in_turn_s > task["gain_s"]
    low_A, high_A = (current_A, high_A) if is_more else (low_A, current_A)
letter = next(key for key, reason in task.reasons.items() if "half of the current" in reason)
answer_1 = letter, low_A
### END SOLUTION

# %%
grade = exercises.check("16.1", answer_1, student)
print(grade)
