# %% [markdown]
# # Declare a problem
#
# An optimisation problem is a statement: unknowns, an objective, constraints. Here you write it
# once, in symbols. The printed form, the check of a point and the solvers all use that statement.
#
# **Before this lesson:** [A first mission](01_first_mission.py), [Two wells](03_two_wells.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - declare a problem with unknowns, parameters and labelled constraints, and read it printed;
# - check any point, and say which constraint it violates and by how much;
# - say whether a problem is linear or smooth, and which engines take it.

# %%
from dataclasses import dataclass

import numpy as np

import optuav
from optuav.engines import closed_form
from optuav.engines.registry import takers
from optuav.modelling import Model, Parameter, check, evaluate
from optuav.modelling.classify import traits
from optuav.physics import kibam

# %% [markdown]
# ## Symbols
#
# A drone hovers for Δ and rests for T'. `+` and `/` on symbols do not compute: they build a tree.
# Later the tree is evaluated with numbers, written as text, or filled with the symbols of a solver.
# `>=` builds a constraint, which is neither true nor false before the unknowns have values.
#
# **Before you run:** a hover of ten minutes draws 90 A throughout. What share of 60 000 A s is
# left?

# %%
model = Model("Longest hover with a rest")
hover = model.variable("hover_time_s", "Δ", unit="s")
rest = model.variable("rest_time_s", "T'", unit="s")
deadline = Parameter("deadline_s", "T_max", "s", 900.0)
capacity = Parameter("capacity_As", "B", "A s", 60_000.0)
drain = Parameter("hover_current_A", "I_hv", "A", 90.0)
charge = Parameter("rest_current_A", "I_rest", "A", 10.0)

left = model.let("charge left", 1.0 - (drain * hover - charge * rest) / capacity, symbol="η")
ten_minutes = {"hover_time_s": 600.0, "rest_time_s": 0.0}
round(float(evaluate(left, ten_minutes)), 6)

# %% [markdown]
# **Before you run:** what will Python answer to the question whether `left >= 0.1` is true?

# %%
enough = left >= 0.1
try:
    answer = bool(enough)
except TypeError as error:
    answer = error
answer

# %% [markdown]
# ## The statement
#
# Every constraint has a label and a unit. `let` names an intermediate quantity, so that the printed
# programme stays short: it appears by its symbol, and is written out once. `prefer_small` chooses
# among equally good points: the one with the shortest rest.

# %%
model.maximise(hover)
model.prefer_small(rest)
model.subject_to("state of charge", enough)
model.subject_to("deadline", hover + rest <= deadline, unit="s")
model

# %% [markdown]
# `print(model)` gives the same as text, and `model.to_latex()` gives it for a paper.
#
# ## Is a point feasible?
#
# `check` evaluates both sides of every constraint in NumPy, independently of any solver. It gives
# the slack, and the line of the source that declared the constraint.
#
# **Before you run:** with Δ = 650 s and T' = 200 s, which of the two constraints is violated? Find
# the best Δ by hand: if both bind, 90 Δ − 10 (900 − Δ) = 54 000.

# %%
guess = {"hover_time_s": 650.0, "rest_time_s": 200.0}
check(model, guess)

# %% [markdown]
# The table has four rows: `variable` has declared the bounds Δ ≥ 0 and T' ≥ 0, and they are
# constraints too. Values may be arrays, and then every row holds many points. Is the charge enough
# for hovers of 500, 600 and 650 s?

# %%
many = check(model, {"hover_time_s": np.array([500.0, 600.0, 650.0]), "rest_time_s": 0.0})
many[0].satisfied

# %% [markdown]
# An engine finds the best point, and says which constraints bind there.
# [Hover without a rest](06_hover_without_a_rest.py) explains the multipliers beside them.

# %%
solution = closed_form.solve(model, programmes=1)
solution

# %% [markdown]
# With two unknowns the whole problem is a picture. Each constraint is a line with its forbidden
# side shaded, and the best point is the highest that no shade covers. The dots are 30 s apart.

# %%
optuav.plots.plane(model, model.row(0), slot_s=30.0)

# %% [markdown]
# ## Which engines take it?
#
# Nobody declares a model linear: optuav finds that from its trees. The physics functions take
# numbers and symbols alike. The second model below has the two wells of the battery and no rest. It
# is no longer linear, but *smooth*: its constraint can be differentiated. The model says which
# constraint is not linear. `closed-form` and `cvxpy` take linear models; `bracket` halves an
# interval with a proof, and `casadi` follows derivatives to a local optimum.
#
# **Before you run:** which engines can take the first model and not the second, and why?

# %%
wells = Model("Longest hover that leaves charge in the available well")
stay = wells.variable("hover_time_s", "Δ", unit="s", upper=deadline)
pool = kibam.Battery(60_000.0, 0.8, 4.5e-5)
after = kibam.step(pool, pool.full, kibam.Stage(-90.0, stay))
wells.maximise(stay)
wells.subject_to("available well", after.available_As >= 0.0, unit="A s")
{item.title: (str(traits(item)), takers(traits(item), slots=False)) for item in (model, wells)}

# %% [markdown]
# The constraint that is not linear, and the reason:

# %%
traits(wells).nonlinear

# %% [markdown]
# The problems of the paper are declared in the same way: `formulations/p4.py` in the repository
# contains only (P4). `formulate` fills in the numbers of a mission.

# %%
optuav.formulate("paper", optuav.P4("b1", order="rest-first"), perspective="battery")

# %% [markdown]
# ## One of your own, over a mission
#
# A class derived from `optuav.Formulation` has a method `declare`, which optuav calls once for each
# route. `given` holds the numbers of the mission on that route, as symbols:
#
# - `given.hover_and_rest(model)` declares Δ and T';
# - `given.keep_charge(model, label, hover, rest)` keeps the reserve `limits.min_soc` at the end,
#   and at every landing if the mission has `limits.keep_soc = "always"`;
# - `given.time_left` is the deadline less the flights;
# - other numbers have the names of the mission, such as `given.min_soc`.
#
# Here the rest may last half as long as the hover, and no longer.
# [Your own formulation](14_your_own_formulation.py) continues from here.


# %%
@dataclass(frozen=True)
class ShortRest(optuav.Formulation):
    """Longest hover with a rest of at most a share of it."""

    share: float

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        given.keep_charge(model, "state of charge", hover, rest)
        model.subject_to("deadline", hover + rest <= given.time_left, unit="s")
        model.subject_to("short rest", rest <= self.share * hover, unit="s")


plan = optuav.solve("paper", ShortRest(0.5), perspective="battery")
plan.to_frame()[["kind", "start_place", "end_place", "duration_s"]].round(2)

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("05.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
from optuav.modelling import Model

answer_1 = Model("longest hover")
hover = answer_1.variable("hover_time_s", "Δ", unit="s")
rest = answer_1.variable("rest_time_s", "T'", unit="s")
answer_1.maximise(hover)
drawn_As = task["hover_A"] * hover - task["rest_A"] * rest
answer_1.subject_to("charge", drawn_As <= task["usable_As"], unit="A s")
answer_1.subject_to("deadline", hover + rest <= task["left_s"], unit="s")
answer_1.subject_to("cool motors", rest >= task["cool_s"] / 100 * hover, unit="s")
### END SOLUTION

# %%
grade = exercises.check("05.1", answer_1, student)
print(grade)

# %%
task = exercises.task("05.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
from dataclasses import dataclass


@dataclass(frozen=True)
class Early(optuav.Formulation):
    """Longest hover of a UAV that is back early."""

    margin_s: float

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        given.keep_charge(model, "state of charge", hover, rest)
        given.keep_wells(model, "battery", hover, rest)
        early = hover + rest <= given.time_left - self.margin_s
        model.subject_to("back early", early, unit="s")


answer_2 = Early(task["margin_s"])
### END SOLUTION

# %%
grade = exercises.check("05.2", answer_2, student)
print(grade)
