# %% [markdown]
# # Discrete, relaxed, continuous
#
# The same question can be asked in slots, in slots that may be cut, and in continuous time. The
# answers differ by less than a slot or two; the run times differ by a factor of a hundred and more.
# Here you measure the run times, and follow a branch and bound from its first bound to its proof.
#
# **Before this lesson:** [Grid or continuous?](09_grid_or_continuous.py),
# [Which building?](11_which_building_milp.py).
# **Time:** 45 minutes.
#
# **Learning intentions.** After this page you can
#
# - count the cells of a grid of one, two or three unknown times, and predict its run time;
# - say what a relaxation is, and why its optimum is a bound;
# - draw the tree of a branch and bound, and read its nodes, bound and gap;
# - choose a method by the number of unknown times and the length of a slot.

# %%
import math
import time

import numpy as np
import pandas as pd

import optuav
from optuav.exercises.helpers import tree
from optuav.exercises.helpers.charts import logarithmic

Line = optuav.plots.Line
mission = optuav.load("paper")
p4 = optuav.P4("b1", order="rest-first")
exact = optuav.solve(mission, p4, perspective="battery")
exact

# %% [markdown]
# ## Three methods, one problem
#
# Algorithm 1 of the paper tries all pairs of slots. A mixed-integer solver counts slots by whole
# numbers and searches by branch and bound. The *relaxation* forgets that the numbers are whole: it
# is a linear programme, and in seconds it is the same as continuous time.
#
# Each run time is the shortest of three runs. They are those of your machine: expect other numbers
# than in the pictures here, and the same shapes.
#
# **Before you run:** slots of 1 s make some 600 000 cells. If you halve the slot, by what factor
# does the run time of the grid grow? And the run times of the other two methods?


# %%
def seconds(work):
    """Return the run time of a call [s], the shortest of three."""
    times_s = []
    for _ in range(3):
        begin = time.perf_counter()
        work()
        times_s.append(time.perf_counter() - begin)
    return max(min(times_s), 1e-6)


def solved(engine, slot_s):
    """Return a call that solves (P4) by an engine, declared beforehand."""
    program = optuav.formulate(mission, p4, perspective="battery", engine=engine, slot_s=slot_s)
    return program.compile().solve


slots_s = np.array([0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
costs_s = {
    "grid": [seconds(solved("grid", slot_s)) for slot_s in slots_s],
    "branch and bound": [seconds(solved("cvxpy", slot_s)) for slot_s in slots_s],
    "continuous": [seconds(solved("closed-form", None))] * len(slots_s),
}
ax = optuav.plots.curves(
    [Line(name, slots_s, times_s, "o") for name, times_s in costs_s.items()],
    title="Run time per answer on this machine",
    x_label="slot length [s]",
    y_label="run time [s]",
)
logarithmic(ax, [time_s for times_s in costs_s.values() for time_s in times_s])

# %% [markdown]
# The run time of the grid grows with the square of the number of slots, as soon as there are many.
# The others hardly notice: a whole number is a whole number, however large.
#
# ## More unknown times
#
# (P3) has one unknown time, (P4) two. A plan with two rests has three, and one with two rests and
# two hovers has four. With n slots for k times of at least one slot each, there are C(n, k) cells.
#
# **Before you run:** divide 1100 s. In slots of 10 s, how many cells are there for one, two, three
# and four times? And in slots of 1 s?

# %%
LEFT_S = 1100.0
lengths_s = [100.0, 10.0, 1.0]
pd.DataFrame(
    {
        f"{k} unknown{'s' * (k > 1)}": [math.comb(int(LEFT_S / slot_s), k) for slot_s in lengths_s]
        for k in (1, 2, 3, 4)
    },
    index=pd.Index(lengths_s, name="slot [s]"),
)

# %% [markdown]
# Try it, with a rest before the hover and one after it. The search computes the charge of each cell
# and keeps the deadline; the longest hover wins.

# %%
part = optuav.formulate(mission, p4, perspective="battery").parts[0]
numbers = part.model.row(0)
usable_As = (1.0 - numbers["min_soc"]) * numbers["packs"] * numbers["capacity_As"]
usable_As -= numbers["flight_charge_As"]
time_left_s = numbers["deadline_s"] - numbers["flight_time_s"]
hover_A, rest_A = numbers["hover_current_A"], numbers["rest_current_A"]


def search(times, slot_s):
    """Return the longest hover over all cells of one hover and `times` − 1 rests."""
    count = int(time_left_s / slot_s)
    axes = np.ogrid[tuple(slice(1, count + 1) for _ in range(times))]
    hover, rests = axes[0] * slot_s, sum(axes[1:]) * slot_s
    good = (hover + rests <= time_left_s) & (hover_A * hover - rest_A * rests <= usable_As)
    return float(np.where(good, hover, 0.0).max(initial=0.0))


by_times = {
    "one time": (1, [0.001, 0.002, 0.005, 0.01, 0.1, 1.0]),
    "two times": (2, [0.5, 1.0, 2.0, 5.0, 10.0, 20.0]),
    "three times": (3, [5.0, 10.0, 20.0, 50.0]),
}
growth = {
    name: (lengths_s, [seconds(lambda k=k, s=slot_s: search(k, s)) for slot_s in lengths_s])
    for name, (k, lengths_s) in by_times.items()
}
ax = optuav.plots.curves(
    [Line(name, lengths_s, times_s, "o") for name, (lengths_s, times_s) in growth.items()],
    title="A grid over one, two and three unknown times",
    x_label="slot length [s]",
    y_label="run time [s]",
)
logarithmic(ax, [time_s for _, times_s in growth.values() for time_s in times_s])

# %% [markdown]
# Each unknown time makes the line steeper, by about one: half the slot costs twice as much, four
# times, eight times, and more when the cells no longer fit into the fast memory. With a third time,
# the paper's slots of a second would make more than two hundred million cells.
#
# ## Branch and bound
#
# Take slots of a minute, and count them: h slots of hover and r slots of rest, at least one each.
# The dots are the cells of the grid. The star is the optimum of the relaxation.

# %%
SLOT_S = 60.0
optuav.plots.plane(part.model, numbers, [exact], slot_s=SLOT_S)

# %% [markdown]
# The star has h = 11.99 and r = 6.54, and no dot is there. Branch and bound cuts the plane:
#
# - Solve the relaxation. If all numbers are whole, it is a plan; keep it if it is the best so far.
# - If not, *branch*: choose the number that is farthest from whole, here r, and make two problems.
#   One has r ≤ 6, the other r ≥ 7. No dot is lost, and the star is in neither.
# - Go on with the problem of the largest bound. Drop problems whose bound does not exceed the best
#   plan.
#
# Each problem is a *node*, and its optimum bounds all plans below it. The bound of all open nodes
# and the best plan so far close in on the optimum; between them is the *gap*.
#
# **Before you run:** the grid has C(18, 2) = 153 cells. How many nodes does the tree need: about 7,
# about 20, or more than 100? Which node is split
# first, r ≤ 6 or r ≥ 7?

# %%
minutes = tree.branch_and_bound(
    gain=[SLOT_S, 0.0],
    rows=np.array([[hover_A * SLOT_S, -rest_A * SLOT_S], [SLOT_S, SLOT_S]]),
    limits=np.array([usable_As, time_left_s]),
    least=[1.0, 1.0],
    most=[time_left_s / SLOT_S] * 2,
    names=["h", "r"],
)
tree.draw(minutes)

# %% [markdown]
# Seven nodes prove what the grid needs 153 cells for: no plan of whole minutes hovers longer than
# 660 s. The helper `optuav.exercises.helpers.tree` has the algorithm in some forty lines.
#
# A plan of 11 minutes is found in step 2. The last step only proves that it is the best.

# %%
steps = np.arange(len(minutes.bounds))
plans_s = np.where(np.isfinite(minutes.best), minutes.best, np.nan)
optuav.plots.curves(
    [
        Line("bound of the open nodes", steps, minutes.bounds, "o"),
        Line("best plan so far", steps, plans_s, "o"),
    ],
    title="Bound and best plan close in",
    x_label="step",
    y_label="hover time [s]",
)

# %% [markdown]
# **Before you run:** with slots of 7 s there are more than a hundred times as many cells. How many
# times as many nodes?

# %%
sevens = tree.branch_and_bound(
    gain=[7.0, 0.0],
    rows=np.array([[hover_A * 7.0, -rest_A * 7.0], [7.0, 7.0]]),
    limits=np.array([usable_As, time_left_s]),
    least=[1.0, 1.0],
    most=[time_left_s / 7.0] * 2,
    names=["h", "r"],
)
len(sevens.nodes), sevens.best[-1], math.comb(int(time_left_s / 7.0), 2)

# %% [markdown]
# ## A better relaxation
#
# The size of the tree depends on the first bound. [Which building?](11_which_building_milp.py)
# states the choice among 21 routes in two ways. With a big M, the relaxation promises far more than
# any route gives, and the solver has to exclude nearly every route. Stated as a convex hull, the
# relaxation is as good as the best route.
#
# **Before you run:** how large is the first gap of the hull?

# %%
choices = [
    optuav.route_choice(mission, perspective="battery", form=form) for form in ("big-M", "hull")
]
pd.DataFrame(
    [(choice.form, choice.relaxation_s, abs(choice.gap_s)) for choice in choices],
    columns=["form", "relaxation [s]", "first gap [s]"],
).round(3)

# %% [markdown]
# With no gap there is nothing left to branch on.
#
# ## Which method, then?
#
# - One or two unknown times, any constraints at all: the grid is a proof by trying, in hardly more
#   than a line of code. It is this package's reference.
# - Linear constraints: the relaxation is the answer, and its dual is the proof.
# - Whole slots with linear constraints, or choices: branch and bound, with a good relaxation.
# - Nonlinear constraints in continuous time: none of the three.
#   [Convexity and a bad local optimum](10_convexity_and_a_bad_local_optimum.py) shows why.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("12.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Without more far slots, the near ones have their own bound. With one more, charge is short.
from fractions import Fraction

charge = Fraction(task["near"], task["near_As"])  # Value of an ampere-second at the near device
first = {"near slots": task["near"], "branch": task["far"]}
second = {"charge": charge, "branch": task["far_As"] * charge - task["far"]}
answer_1 = [first, second]
### END SOLUTION

# %%
grade = exercises.check("12.1", answer_1, student)
print(grade)
