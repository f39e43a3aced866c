# %% [markdown]
# # Over the houses
#
# A leg is a straight line, and a town is not empty. optuav refuses a leg that meets a house, or
# bends it over or around that house. This lesson measures what a bend costs, and finds out why.
#
# **Before this lesson:** [One leg, six stages](21_one_leg.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - say what a plan does with a leg that a building blocks, under each of four rules;
# - find the apex of a way over a building by hand;
# - say what a bent way costs, and what makes it expensive;
# - estimate how often it happens in random towns, and check a way of somebody else.

# %%
import dataclasses

import numpy as np
import pandas as pd

import optuav
from optuav.network import vehicle

open_air = optuav.load("paper")
HEIGHT_M = 200.0
wall = {"name": "wall", "position_m": [500, 1250, HEIGHT_M], "footprint_m": [800, 60]}
blocked = open_air.replace({"buildings": [*open_air.buildings, wall]})
refused = optuav.solve(blocked, "P3")
refused

# %% [markdown]
# ## Over the wall
#
# A wall of 200 m stands across the way to the hover point, and the direct flight has no plan. With
# `flight.obstacles = "over"` a blocked leg gets one waypoint, its apex, that clears the wall by
# 5 m.
#
# **Before you run:** the leg is 2.7 km long, and the drone climbs from 50 m to some 210 m and back.
# How many metres longer is the bent way? How many seconds of hover will it cost?

# %%
over = blocked.replace({"flight.obstacles": "over"})
plan = optuav.solve(over, "P3")
optuav.plots.mission_map(plan)

# %%
through = optuav.solve(blocked.replace({"flight.obstacles": "ignore"}), "P3")
apex_m = np.array(plan.phases[0].waypoints_m[0])
start_m, end_m = np.array(open_air.route.origin_m), np.array(vehicle.hover_point_m(open_air))
bent_m = np.linalg.norm(apex_m - start_m) + np.linalg.norm(end_m - apex_m)
extra_m = float(bent_m - np.linalg.norm(end_m - start_m))
lost_s = through.hover_time_s - plan.hover_time_s
costs = {"apex at [m]": apex_m[2], "longer by [m]": extra_m, "hover lost [s]": lost_s}
pd.Series(costs, name="over the wall").round(2).to_frame()

# %% [markdown]
# The way is longer by less than one percent, and the hover is shorter by twenty seconds. The drone
# stops at the apex: each segment is a leg from rest to rest, which turns, accelerates and brakes.
# The picture shows one leg as flown without the wall; the bent way does this twice.

# %%
optuav.plots.leg(open_air, "origin", "hover")

# %% [markdown]
# ## A ceiling
#
# Airspace often has a ceiling. `flight.max_altitude_m` caps the waypoints, and `"around"` allows a
# way beside the wall as well.
#
# **Before you run:** the wall is 800 m wide. With no ceiling, which way does `"around"` take? And
# with one of 150 m?

# %%
around = {
    ceiling_m: optuav.solve(
        blocked.replace({"flight.obstacles": "around", "flight.max_altitude_m": ceiling_m}),
        "P3",
    )
    for ceiling_m in (None, 150.0)
}
pd.DataFrame(
    [(ceiling_m, way.phases[0].waypoints_m, way.hover_time_s) for ceiling_m, way in around.items()],
    columns=["ceiling [m]", "waypoints of the first leg [m]", "hover [s]"],
)

# %%
optuav.plots.mission_map(around[150.0])

# %% [markdown]
# Over the wall is the cheaper way. The way around it costs only a third of a second more, because
# it has one stop as well. So ask first how many stops a way has, and only then how long it is.
#
# ## How often does it happen?
#
# Sixty random layouts of `paper` have their buildings somewhere else.
#
# **Before you run:** in how many of them does a house stand in the way of the direct flight? What
# does a plan lose on average if it may fly over it?

# %%
towns = optuav.layouts("paper", 60)
hover_s = {
    rule: optuav.batch_arrays(
        [town.replace({"flight.obstacles": rule}) for town in towns],
        problem="P3",
    )["hover_time_s"].ravel()
    for rule in ("refuse", "ignore", "over")
}
closed = np.isnan(hover_s["refuse"])
bend_s = (hover_s["ignore"] - hover_s["over"])[closed]
{"towns": len(towns), "closed": int(closed.sum()), "mean loss [s]": round(float(bend_s.mean()), 1)}

# %%
optuav.plots.curves(
    [optuav.plots.Line("closed towns", np.arange(1, len(bend_s) + 1), np.sort(bend_s))],
    title="Hover lost by one way over the houses",
    x_label="closed towns, in order of their loss",
    y_label="hover lost [s]",
    y_from_zero=True,
)

# %% [markdown]
# Over the houses, every town has a plan again. Two towns lose twice as much as most, because houses
# block both of their legs. A stop in the middle of a leg, where the drone is fastest, costs 20 s; a
# stop near an end of the leg costs less.
#
# ## Trust no apex
#
# **Before you run:** somebody lowers the apex of the first plan by 4 m, to save a little. On a
# drawing the drone still passes above the roof. What does an audit say?

# %%
out, *rest = plan.phases
lower_m = tuple((apex_m - [0.0, 0.0, 4.0]).tolist())
changed = (dataclasses.replace(out, waypoints_m=(lower_m,)), *rest)
lowered = plan.model_copy(update={"phases": changed, "flyable": None})
report = optuav.audit(lowered)
events = report.to_frame()
events[events["kind"] == "clearance"]

# %% [markdown]
# Less than 2 m are left of the 5 m: the way is lower at the edges of the roof than in its middle.
# The audit computes the clearance again, with code of its own, from the waypoints that the plan
# states. It also contradicts the times and charges of that plan, which belong to the higher way.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("30.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
import numpy as np

from optuav.flight.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import six_stages

airframe, motor = Rotors.of(task.mission).airframe, Rotors.of(task.mission).motor
way_m = np.subtract(vehicle.hover_point_m(task.mission), task.mission.route.origin_m)


def duration_s(share):
    """Time of a share of the leg, from rest to rest [s]."""
    return float(six_stages.leg(airframe, motor, tuple(share * way_m)).loads.duration_s)


low, high = 1e-4, 0.5
while high - low > 1e-7:
    share = 0.5 * (low + high)
    is_less = duration_s(share) + duration_s(1 - share) - duration_s(1) < task["more_s"]
    low, high = (share, high) if is_less else (low, share)
letter = next(key for key, reason in task.reasons.items() if "from rest to rest" in reason)
answer_1 = letter, low * float(np.linalg.norm(way_m))
### END SOLUTION

# %%
grade = exercises.check("30.1", answer_1, student)
print(grade)
