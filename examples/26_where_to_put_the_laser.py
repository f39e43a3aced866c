# %% [markdown]
# # Where to put the laser?
#
# One laser, ten roofs to put it on, and many devices that wait for a drone. In haze light does not
# carry far, so the place matters. Some choices can be proved best; some improvements cannot.
#
# **Before this lesson:** [Which building?](11_which_building_milp.py),
# [Link and laser](22_link_and_laser.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - choose sites for one laser and for several, by three objectives, and say how they differ;
# - read a bound and a gap, and check a bound with one line of NumPy;
# - explain when the greedy choice fails;
# - say why no Lipschitz bound, a largest change per metre, holds where a building hides the laser.

# %%
import itertools

import numpy as np
import pandas as pd

import optuav

haze = optuav.load("paper").replace({"laser.visibility_km": 2, "limits.deadline_s": 1800})
devices = [(x, y) for y in (1000, 1700, 2400) for x in (200, 700, 1300, 1800)]
missions = [haze.replace({"link.device_m": [x, y, 0]}) for x, y in devices]
roofs = np.array(
    [(x, y, z + 3) for x, y, z in (building.position_m for building in haze.buildings)]
)
one = optuav.place_laser(missions, roofs, refine=False)
hover_s = np.nan_to_num(one.candidate_hover_s)
table = pd.DataFrame(
    hover_s,
    index=pd.MultiIndex.from_tuples(devices, names=["device at x [m]", "y [m]"]),
    columns=[building.name for building in haze.buildings],
)
table.round(1)

# %% [markdown]
# The table of hover times says it all: one row per device, one column per roof, and 0 for a device
# that cannot be served. In the results below, sites are numbered from 0, so site 5 is the roof of
# b6.
#
# **Before you run:** how do you find the best roof for one laser in such a table?

# %%
one

# %%
means_s = table.mean()
means_s.round(1).to_frame("mean hover [s]").T

# %% [markdown]
# ## Three lasers
#
# Each device is served by the laser that lets its drone hover longest. There are few enough choices
# here to try them all. The solver gives the same answer, and also answers when trying takes too
# long.
#
# **Before you run:** how many choices of three roofs out of ten are there?

# %%
LASERS = 3
three = optuav.place_laser(missions, roofs, LASERS, refine=False)
three

# %%
trios = list(itertools.combinations(range(len(roofs)), min(LASERS, len(roofs))))
best_s = max(hover_s[:, trio].max(axis=1).mean() for trio in trios)
{"choices": len(trios), "best mean [s]": float(best_s)}

# %%
optuav.plots.sites(three)

# %% [markdown]
# ## What is best, and for whom?
#
# The mean over all devices is one objective. Another is the worst device: nobody should wait for a
# drone that has to leave at once. A third is the number of devices that get at least so much.
#
# **Before you run:** will the three choose the same roofs?

# %%
ENOUGH_S = 616.0
selections = {
    objective: optuav.place_laser(
        missions,
        roofs,
        LASERS,
        objective=objective,
        at_least_s=ENOUGH_S if objective == "covered" else None,
        refine=False,
    ).selection
    for objective in ("mean", "worst", "covered")
}
served_s = {
    name: pd.Series(hover_s[:, choice.sites].max(axis=1, initial=0.0)).replace(0.0, np.nan)
    for name, choice in selections.items()
}
pd.DataFrame(
    [
        (name, selections[name].sites, s.mean(), s.min(), (s >= ENOUGH_S).sum())
        for name, s in served_s.items()
    ],
    columns=["objective", "sites", "mean of the served [s]", "worst of them [s]", "with enough"],
)

# %% [markdown]
# ## A bound that you can check
#
# Give each device any level u. A set of sites gives it at most u and, for each site, what that site
# has above u. Added up, this bounds every choice. Good levels make a good bound: begin with what
# the second best laser gives each device. Then lower the level of a device that none of the three
# best columns exceeds, and raise it if several do.
#
# **Before you run:** with all levels zero, what does the bound add up?


# %%
def bound_s(u: np.ndarray) -> float:
    """Mean hover that no such number of sites exceeds, by any levels."""
    above = np.maximum(hover_s - u[:, None], 0.0).sum(axis=0)
    return (u.sum() + np.sort(above)[-LASERS:].sum()) / len(missions)


u = np.sort(hover_s[:, three.selection.sites])[:, -2:][:, 0]  # Hover by the second best laser
bounds_s = [bound_s(np.zeros(len(missions))), bound_s(u)]
for step in range(1, 101):
    above = np.maximum(hover_s - u[:, None], 0.0)
    best_columns = above[:, np.argsort(above.sum(axis=0))[-LASERS:]]
    u = np.maximum(u + 20.0 / step * ((best_columns > 0.0).sum(axis=1) - 1), 0.0)
    bounds_s.append(bound_s(u))
optuav.plots.curves(
    [
        optuav.plots.Line("least bound so far", range(101), np.minimum.accumulate(bounds_s[1:])),
        optuav.plots.Line("best choice", range(101), np.full(101, three.value)),
    ],
    title="Bounds of the mean hover by step of the levels",
    x_label="steps",
    y_label="mean hover [s]",
)

# %%
bounds = {"all levels zero": bounds_s[0], "second best": bounds_s[1], "least": min(bounds_s)}
pd.Series(bounds, name="bound [s]").to_frame()

# %% [markdown]
# With all levels zero, the bound adds up the three best columns, as if every device were served
# three times over. Good levels count each device nearly once.
#
# ## The greedy choice
#
# The greedy choice takes the best roof, then the roof that adds most to it, and so on.
#
# **Before you run:** will the best four roofs contain the greedy first one?

# %%
four = optuav.place_laser(missions, roofs, 4, refine=False).selection
pd.DataFrame(
    [(four.greedy_sites, four.greedy_value), (four.sites, four.value)],
    index=["greedy", "best"],
    columns=["sites", "mean [s]"],
)

# %% [markdown]
# The best choice does without the two roofs that a greedy one takes first: each of them is good by
# itself, but others add little to it.
#
# ## Nearer to the best, without a proof
#
# Lasers may be moved away from their roofs. optuav tries points as long as the same places stay in
# sight.

# %%
moved = optuav.place_laser(missions, roofs, LASERS)
moved.selection.value, moved.value

# %% [markdown]
# Is that the best place? If the hover time changed by at most L seconds per metre, each point that
# is tried would bound all points around it: a *Lipschitz bound*. Now a building may come in the
# way: the laser moves along a line, in steps of a tenth of a metre, past a wall.
#
# **Before you run:** draw the hover time along the line. Which L holds?

# %%
(roof,) = (building for building in haze.to_dict()["buildings"] if building["name"] == "b9")
wall = {"name": "wall", "position_m": [750, 890, 150], "footprint_m": [300, 20]}
walled = haze.replace({"buildings": [roof, wall], "flight.through_buildings": True})
along_m = np.arange(380.0, 420.0, 0.1)
line = np.column_stack([along_m, np.zeros(400), np.full(400, 50.0)])
along_s = np.nan_to_num(optuav.place_laser(walled, line, refine=False).candidate_hover_s[0])
optuav.plots.curves(
    [optuav.plots.Line("one laser", along_m, along_s)],
    title="Hover by the place of the laser",
    x_label="laser at x [m]",
    y_label="longest hover Δ [s]",
)

# %% [markdown]
# No L holds: within a tenth of a metre the wall hides a roof, and the hover time jumps.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("26.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
a, b = ([task[f"{device}{roof}"] for roof in (1, 2, 3)] for device in "ab")
pairs = {(i, j): (max(a[i], a[j]) + max(b[i], b[j])) / 2 for i, j in ((0, 1), (0, 2), (1, 2))}
greedy_s = max(pairs[0, 1], pairs[0, 2])  # Roof 1 has the largest mean of one
letter = next(key for key, reason in task.reasons.items() if "best for none" in reason)
answer_1 = letter, {"greedy_s": greedy_s, "best_s": pairs[1, 2]}
### END SOLUTION

# %%
grade = exercises.check("26.1", answer_1, student)
print(grade)
