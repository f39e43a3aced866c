import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

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
# - explain why the greedy choice may be beaten;
# - say why no Lipschitz bound, a largest change per metre, holds where a building hides the laser.

# %%
import itertools

import numpy as np

import optuav

haze = optuav.load("paper").replace({"laser.visibility_km": 2, "limits.deadline_s": 1800})
devices = [(x, y) for y in (1000, 1700, 2400) for x in (200, 700, 1300, 1800)]
missions = [haze.replace({"link.device_m": [x, y, 0]}) for x, y in devices]
roofs = np.array([(x, y, z + 3) for x, y, z in (each.position_m for each in haze.buildings)])
one = optuav.place_laser(missions, roofs, refine=False)
print(one)

# %% [markdown]
# Candidates are numbered from 0: site 5 is the roof of b6. The table of hover times says it all:
# one row a device, one column a roof.
#
# **Before you run:** how do you find the best roof for one laser in such a table?

# %%
hover_s = np.nan_to_num(one.candidate_hover_s)
if not hover_s.any():
    raise SystemExit("From no roof can any device be served: take more time, or clearer air.")
means_s = hover_s.mean(axis=0)
print("mean hover by roof [s]:", *means_s.round(1))

# %% [markdown]
# ## Three lasers
#
# Each device is served by the laser that lets its drone hover longest. There are few enough choices
# here to try them all; the solver gives the same answer, and goes on where that takes too long.
#
# **Before you run:** how many choices of three roofs out of ten are there?

# %%
LASERS = 3
three = optuav.place_laser(missions, roofs, LASERS, refine=False)
trios = list(itertools.combinations(range(len(roofs)), min(LASERS, len(roofs))))
best_s = max(hover_s[:, trio].max(axis=1).mean() for trio in trios)
print(three)
print(f"the best of {len(trios)} choices: {best_s:.2f} s")

# %%
optuav.plots.sites(three)

# %% [markdown]
# ## What is best, and for whom?
#
# The mean over all devices is one objective. Another is the worst device: nobody should wait for a
# drone that has to leave at once. A third is the number of devices that get so much at least.
#
# **Before you run:** will the three choose the same roofs?

# %%
ENOUGH_S = 616.0
for objective in ("mean", "worst", "covered"):
    asked = {"at_least_s": ENOUGH_S if objective == "covered" else None, "refine": False}
    found = optuav.place_laser(missions, roofs, LASERS, objective=objective, **asked).selection
    served_s = hover_s[:, found.sites].max(axis=1, initial=0.0)
    served_s = served_s[served_s > 0.0]  # without the devices that no laser serves
    words = f"enough for {(served_s >= ENOUGH_S).sum()}"
    if len(served_s):
        words = f"mean of the served {served_s.mean():.1f} s, worst {served_s.min():.1f} s, {words}"
    print(f"{objective:8} sites {found.sites}: {words}")

# %% [markdown]
# ## A bound that you can check
#
# Give each device any level u. A set of sites gives it at most u and, for each site, what that site
# has above u. Added up, this bounds every choice. Good levels make a good bound: begin with what
# the second best laser gives each device, then lower the level of a device that none of the three
# best columns exceeds, and raise it where several do.
#
# **Before you run:** with all levels zero, what does the bound add up?


# %%
def bound_s(u: np.ndarray) -> float:
    """What no such number of sites exceeds on average, by any levels."""
    above = np.maximum(hover_s - u[:, None], 0.0).sum(axis=0)
    return (u.sum() + np.sort(above)[-LASERS:].sum()) / len(missions)


u = np.sort(hover_s[:, three.selection.sites])[:, -2:][:, 0]  # Of one laser, what it gives
bounds_s = [bound_s(np.zeros(len(missions))), bound_s(u)]
for step in range(1, 101):
    above = np.maximum(hover_s - u[:, None], 0.0)
    best_columns = above[:, np.argsort(above.sum(axis=0))[-LASERS:]]
    u = np.maximum(u + 20.0 / step * ((best_columns > 0.0).sum(axis=1) - 1), 0.0)
    bounds_s.append(bound_s(u))
print(f"bounds: all levels zero {bounds_s[0]:.1f} s, second best {bounds_s[1]:.1f} s, ", end="")
print(f"best of all {min(bounds_s):.1f} s")

# %% [markdown]
# With all levels zero, the bound adds up the three best columns, as if every device were served
# three times over. Good levels count each device nearly once.
#
# ## Where greed fails
#
# The greedy choice takes the best roof, then the one that adds most to it, and so on.
#
# **Before you run:** will the best four roofs contain the greedy first one?

# %%
four = optuav.place_laser(missions, roofs, 4, refine=False).selection
print(f"greedy on {four.greedy_sites}: {four.greedy_value:.2f} s")
print(f"best on {four.sites}: {four.value:.2f} s")

# %% [markdown]
# The best choice does without the two roofs that a greedy one takes first: each of them is good
# alone, and what others add to it is little.
#
# ## Nearer to the best, without a proof
#
# Lasers may be moved away from their roofs. That is tried point by point where the same places stay
# in sight. If the hover time changed by at most L seconds per metre, a point that is tried would
# bound all points around it: that is a *Lipschitz bound*. There is no such L once a building can
# come in the way: here the laser moves on by a tenth of a metre, a wall hides a roof, and the hover
# time jumps.

# %%
moved = optuav.place_laser(missions, roofs, LASERS)
print(f"refined from {moved.selection.value:.2f} to {moved.value:.2f} s")
(roof,) = (each for each in haze.to_dict()["buildings"] if each["name"] == "b9")
wall = {"name": "wall", "position_m": [750, 890, 150], "footprint_m": [300, 20]}
walled = haze.replace({"buildings": [roof, wall], "flight.through_buildings": True})
line = np.column_stack([np.arange(380.0, 420.0, 0.1), np.zeros(400), np.full(400, 50.0)])
along = np.nan_to_num(optuav.place_laser(walled, line, refine=False).candidate_hover_s[0])
steps_s = np.abs(np.diff(along))
print(f"largest step {steps_s.max():.2f} s, the median of all {np.median(steps_s):.5f} s")

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
