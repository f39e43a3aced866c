import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Discrete, relaxed, continuous
#
# The same question can be asked in slots, in slots that may be cut, and in continuous time. The
# answers differ by less than a slot or two; what they cost differs by a hundred times and more.
# Here you measure that, and follow a branch and bound from its first bound to its proof.
#
# **Before this lesson:** [Grid or continuous?](09_grid_or_continuous.py),
# [Which building?](11_which_building_milp.py).
# **Time:** 45 minutes.
#
# **Learning intentions.** After this page you can
#
# - count the cells of a grid of one, two or three unknown times, and predict what it costs;
# - say what a relaxation is, and why its optimum is a bound;
# - write a branch and bound, and read its nodes, bound and gap;
# - choose a method by the number of unknown times and the length of a slot.

# %%
import heapq
import itertools
import math
import time

import numpy as np
from scipy.optimize import linprog

import optuav

Line = optuav.plots.Line
mission = optuav.load("paper")
p4 = optuav.P4("b1", order="rest-first")
exact = optuav.solve(mission, p4, perspective="battery")
print(f"continuous: hover {exact.hover_time_s:.4f} s, rest {exact.rest_time_s:.4f} s")

# %% [markdown]
# ## Three methods, one problem
#
# Algorithm 1 of the paper tries all pairs of slots. A mixed-integer solver counts slots by whole
# numbers and searches by branch and bound. The *relaxation* forgets that they are whole: it is a
# linear programme, and in seconds it is nothing else than continuous time.
#
# Times are taken as the least of three runs, and they are those of your machine: expect other
# numbers than in the pictures here, and the same shapes.
#
# **Before you run:** slots of 1 s make some 600 000 cells. If you halve the slot, by what factor
# does the time of the grid grow? And that of the other two?


# %%
def seconds(work):
    """What a call takes [s]: the least of three."""
    taken = []
    for _ in range(3):
        begin = time.perf_counter()
        work()
        taken.append(time.perf_counter() - begin)
    return max(min(taken), 1e-6)


def solved(engine, slot_s):
    """A call that solves (P4) by an engine, declared beforehand."""
    program = optuav.formulate(mission, p4, perspective="battery", engine=engine, slot_s=slot_s)
    return program.compile().solve


slots_s = np.array([0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
costs_s = {
    "grid": [seconds(solved("grid", slot_s)) for slot_s in slots_s],
    "branch and bound": [seconds(solved("cvxpy", slot_s)) for slot_s in slots_s],
    "continuous": [seconds(solved("closed-form", None))] * len(slots_s),
}
for name, taken in costs_s.items():
    finest, coarsest = taken[0], taken[-1]
    print(f"{name:17} finest {1e3 * finest:9.3f} ms, coarsest {1e3 * coarsest:9.3f} ms")

# %%
ax = optuav.plots.curves(
    [Line(name, slots_s, taken, "o") for name, taken in costs_s.items()],
    title="What an answer costs, on this machine",
    x_label="slot length [s]",
    y_label="time taken [s]",
)
ax.set_xscale("log")
ax.set_yscale("log")
ax.set_ylim(0.3 * min(map(min, costs_s.values())), 3.0 * max(map(max, costs_s.values())))
ax

# %% [markdown]
# The grid grows with the square of the number of slots, as long as it has enough of them to matter.
# The others hardly notice: a whole number is a whole number, however large.
#
# ## More unknown times
#
# (P3) has one unknown time, (P4) two. A plan with two rests has three, one with two rests and two
# hovers four. With n slots for k times of at least one slot each, there are C(n, k) cells.
#
# **Before you run:** 1100 s are to be divided. In slots of 10 s, how many cells are there for one,
# two, three and four times? And in slots of 1 s?

# %%
LEFT_S = 1100.0
for slot_s in (100.0, 10.0, 1.0):
    slots = int(LEFT_S / slot_s)
    print(f"slots of {slot_s:5.1f} s:", *(f"{math.comb(slots, k):16,}" for k in (1, 2, 3, 4)))

# %% [markdown]
# Try it, with a rest before the hover and one after it. For each cell the charge is counted, and
# the deadline kept; the longest hover wins.

# %%
given = optuav.formulate(mission, p4, perspective="battery").parts[0].model.row(0)
if "flight_charge_As" not in given:
    raise SystemExit("This page counts charge, as the perspective battery does.")
usable_As = (1.0 - given["min_soc"]) * given["packs"] * given["capacity_As"]
usable_As -= given["flight_charge_As"]
time_left_s = given["deadline_s"] - given["flight_time_s"]


def search(times, slot_s):
    """The longest hover over all cells of one hover and so many rests less one."""
    count = int(time_left_s / slot_s)
    axes = np.ogrid[tuple(slice(1, count + 1) for _ in range(times))]
    hover, rests = axes[0] * slot_s, sum(axes[1:]) * slot_s
    drawn_As = given["hover_current_A"] * hover - given["rest_current_A"] * rests
    good = (hover + rests <= time_left_s) & (drawn_As <= usable_As)
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
for name, (lengths_s, taken) in growth.items():
    print(f"{name:12} slots of {lengths_s[0]:g} s take {taken[0]:.3f} s")

# %%
ax = optuav.plots.curves(
    [Line(name, lengths_s, taken, "o") for name, (lengths_s, taken) in growth.items()],
    title="A grid over one, two and three unknown times",
    x_label="slot length [s]",
    y_label="time taken [s]",
)
every = [each for _, taken in growth.values() for each in taken]
ax.set_xscale("log")
ax.set_yscale("log")
ax.set_ylim(0.3 * min(every), 3.0 * max(every))
ax

# %% [markdown]
# Each unknown time makes the line steeper, by about one: half the slot costs twice as much, four
# times, eight times, and more where the cells no longer fit into the fast memory. With a third
# time, the paper's slots of a second would make more than two hundred million cells.
#
# ## Branch and bound, by hand
#
# Which route, with which times? A binary λ for each route says which one is flown, with a big M to
# switch the constraints of all others off ([Which building?](11_which_building_milp.py) has the
# programme in full). The relaxation lets every λ be between 0 and 1. Its optimum bounds all routes.
#
# - Solve the relaxation. If all λ are whole, it is a plan, and if it is the best so far, keep it.
# - If not, *branch*: choose a λ that is not whole, and make two programmes, with λ = 0 and λ = 1.
# - Go on with the programme of the best bound. Drop those whose bound is not above the best plan.
#
# Each programme is a *node*. The bound of all that are left, and the best plan so far, close in on
# the optimum; between them is the *gap*.
#
# **Before you run:** there are 21 routes. How many nodes will it take: fewer than 21, or more?

# %%
parts = optuav.formulate(mission, perspective="battery").parts
figures = {
    name: np.concatenate([part.given[name] for part in parts])
    for name in ("flight_charge_As", "flight_time_s", "rest_current_A")
}
routes = len(figures["flight_time_s"])
draw_A = given["hover_current_A"]
charge_As = (1.0 - given["min_soc"]) * given["packs"] * given["capacity_As"]
charge_As = charge_As - figures["flight_charge_As"]
times_s = given["deadline_s"] - figures["flight_time_s"]
most_s = times_s.max()  # Of the hover, and of the rest
big_charge, big_time = draw_A * most_s - charge_As, 2.0 * most_s - times_s

ones, no = np.ones((routes, 1)), np.zeros((routes, 1))
rests = (figures["rest_current_A"] > 0.0)[:, None]  # The direct route has no rest
rows = np.block(
    [
        [draw_A * ones, -figures["rest_current_A"][:, None], np.diag(big_charge)],
        [ones, ones, np.diag(big_time)],
        [no, ones, np.diag(most_s * ~rests[:, 0])],
    ]
)
limits = np.concatenate([charge_As + big_charge, times_s + big_time, np.full(routes, most_s)])
choose_one = np.concatenate([[0.0, 0.0], np.ones(routes)])[None, :]


def relaxed(whole):
    """The relaxation with some λ fixed: its bound [s], and its λ; None where it has no point."""
    bounds = [(0.0, None), (0.0, most_s)]
    bounds += [(whole.get(route, 0), whole.get(route, 1)) for route in range(routes)]
    cost = np.concatenate([[-1.0], np.zeros(1 + routes)])
    answer = linprog(cost, rows, limits, choose_one, [1.0], bounds)
    return (-answer.fun, answer.x[2:]) if answer.success else None


best_s, history, number = 0.0, [], itertools.count()
began_s = time.perf_counter()
bound_s, shares = relaxed({})
print(f"the first bound is {bound_s:.1f} s; the largest λ is {shares.max():.2f}")
waiting = [(-bound_s, next(number), {}, shares)]
while waiting:
    minus_bound_s, _, whole, shares = heapq.heappop(waiting)
    if -minus_bound_s <= best_s + 1e-6:
        history.append((best_s, best_s, time.perf_counter() - began_s))
        break  # No node that is left has a better bound
    if np.abs(shares - shares.round()).max() < 1e-6:
        best_s = max(best_s, -minus_bound_s)
    else:
        route = int(np.abs(shares - 0.5).argmin())
        for value in (0, 1):
            if (node := relaxed({**whole, route: value})) and node[0] > best_s:
                heapq.heappush(waiting, (-node[0], next(number), {**whole, route: value}, node[1]))
    history.append((-minus_bound_s, best_s, time.perf_counter() - began_s))
nodes = next(number)
print(f"{nodes} nodes, {len(history)} of them looked at: {best_s:.4f} s, and none is better")

# %%
bounds_s, plans_s, taken_s = np.transpose(history)
optuav.plots.curves(
    [
        Line("bound of what is left", np.arange(len(history)), bounds_s),
        Line("best plan so far", np.arange(len(history)), plans_s),
    ],
    title="Bound and best plan close in",
    x_label="nodes that were looked at",
    y_label="hover time [s]",
)

# %% [markdown]
# Before a plan is known, it counts as a hover of 0 s. The gap between the two, over the time that
# your machine took:

# %%
optuav.plots.curves(
    [Line("bound less best plan", 1000.0 * taken_s, bounds_s - plans_s)],
    title=f"The gap, over {len(history)} nodes",
    x_label="time since the first node [ms]",
    y_label="gap [s]",
    y_from_zero=True,
)

# %% [markdown]
# That is more work than trying the 21 routes one by one: the bound says nothing until nearly every
# route is excluded.
#
# ## A better relaxation
#
# The same choice stated as a convex hull has a relaxation that is as good as the best route. Then
# nothing is left to branch on.
#
# **Before you run:** what is its first gap?

# %%
for form in ("big-M", "hull"):
    choice = optuav.route_choice(mission, perspective="battery", form=form)
    print(f"{form:6} relaxation {choice.relaxation_s:9.3f} s, gap {abs(choice.gap_s):8.3f} s")

# %% [markdown]
# ## Which one, then?
#
# - One or two unknown times, any constraints at all: the grid is a proof by trying, and hardly more
#   than a line of code. It is this package's reference.
# - Linear constraints: the relaxation is the answer, and its dual the proof.
# - Whole slots with linear constraints, or choices: branch and bound, with a good relaxation.
# - Nonlinear constraints in continuous time: none of the three. That was the subject of
#   [Convexity and a bad local optimum](10_convexity_and_a_bad_local_optimum.py).

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
