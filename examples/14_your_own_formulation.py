# %% [markdown]
# # Your own formulation
#
# The paper asks for the longest hover. An operator may have other questions: how short can the rest
# be for the 700 s of hover that I need? Which battery should I buy? You state each question as one
# class, and everything that works on the problems of the paper then works on it: printing,
# checking, engines, prices.
#
# **Before this lesson:** [Declare a problem](05_declare_a_problem.py),
# [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py).
# **Time:** 45 minutes.
#
# **Learning intentions.** After this page you can
#
# - state a problem of your own as a class with one method;
# - solve it with every engine that takes it, and again with other numbers;
# - check an answer by turning the question around.

# %%
from dataclasses import dataclass

import numpy as np
import pandas as pd

import optuav
from optuav.engines.registry import takers
from optuav.modelling import Parameter
from optuav.modelling.classify import traits

mission = optuav.load("paper")
WANTED_S = 700.0
pd.options.display.max_colwidth = None

# %% [markdown]
# ## Least rest for a wanted hover time
#
# In `declare`, `given` holds the mission's quantities as symbols, such as `given.min_soc`.
# `hover_and_rest` declares Δ and T', which is 0.0 on the direct route. `keep_charge` keeps
# the reserve at the end, in the perspective that you ask for. It also keeps the reserve at every
# landing if the mission has `limits.keep_soc = "always"`. `keep_wells` keeps the battery from
# running dry. The class's own options are its fields. If you wrap an option in a `Parameter`, you
# can change it later.


# %%
@dataclass(frozen=True)
class LeastRest(optuav.Formulation):
    """Least rest for a wanted hover time."""

    wanted_hover_s: float

    def declare(self, model, given):
        wanted = Parameter("wanted_hover_s", "Δ_w", "s", self.wanted_hover_s)
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover == wanted, unit="s")
        given.keep_charge(model, "state of charge", hover, rest)
        given.keep_wells(model, "battery", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


at_b1 = LeastRest(WANTED_S, building="b1", order="rest-first")
program = optuav.formulate(mission, at_b1, perspective="battery")
program

# %% [markdown]
# **Before you run:** (P1) hovers 719.5 s with 392 s of rest on b1. How much rest do 700 s need?
# Counting charge only, each second less of hover saves 8.8 s of rest.

# %%
engines = takers(traits(program.parts[0].model), slots=False)
plans = {
    engine: optuav.solve(
        mission,
        at_b1,
        perspective="battery",
        engine=engine,
        slot_s=10.0 if engine == "grid" else None,
    )
    for engine in engines
}
pd.DataFrame(
    [(engine, plan.rest_time_s, plan.proof) for engine, plan in plans.items()],
    columns=["engine", "rest [s]", "proof"],
)

# %% [markdown]
# The problem is linear, so every engine takes it. `grid` tries slots of 10 s and finds none better
# than its slots.
#
# Now let optuav choose the route as well, and check a second less of rest:

# %%
best = optuav.solve(mission, LeastRest(WANTED_S), perspective="battery")
best

# %%
rows = program.check({"hover_time_s": WANTED_S, "rest_time_s": best.rest_time_s - 1.0})
rows

# %% [markdown]
# ## Turned around
#
# Suppose that the deadline leaves exactly that much rest.
#
# **Before you run:** how long does (P1) hover then?

# %%
tight = mission.replace({"limits.deadline_s": best.mission_time_s})
longest = optuav.solve(tight, perspective="battery")
longest.hover_time_s, longest.rest_time_s, best.rest_time_s

# %% [markdown]
# The two questions are one: the longest hover within a deadline, and the shortest mission for a
# hover, meet in the same plan. (It cannot be flown, because a count of charge does not see the
# wells; `perspective="available"` asks the same questions of the wells.)
#
# ## What a second of hover costs
#
# Prices are in seconds of rest now.
#
# **Before you run:** the direct route hovers 688.8 s without a rest, and no route hovers longer
# than 719.5 s. What does one more second cost at 680 s, at 700 s, and at 720 s?

# %%
compiled = optuav.formulate(mission, LeastRest(WANTED_S), perspective="battery").compile()
wishes_s = [680.0, 690.0, 700.0, 710.0, 720.0]
answers = [compiled.solve(wanted_hover_s=wish_s) for wish_s in wishes_s]
prices = [
    answer.shadow_prices()["wanted_hover_s"].more if answer.status.has_answer else None
    for answer in answers
]
pd.DataFrame(
    {
        "wanted hover [s]": wishes_s,
        "status": [answer.status.value for answer in answers],
        "least rest [s]": [answer.objective[0] for answer in answers],
        "rest for one more second [s]": prices,
    }
)

# %%
fine_s = np.arange(670.0, 719.0, 0.5)
rests_s = [compiled.solve(wanted_hover_s=wish_s).objective[0] for wish_s in fine_s]
optuav.plots.curves(
    [optuav.plots.Line("least rest", fine_s, rests_s)],
    title="What a wanted hover costs",
    x_label="wanted hover [s]",
    y_label="least rest T' [s]",
    y_from_zero=True,
)

# %% [markdown]
# Up to 688.8 s the direct route is enough. Beyond that, a second of hover costs the rest in which
# the laser returns its charge. From 719.5 s on, time is too short. The curve jumps at 688.8 s: the
# rest has to pay for the detour to the roof first.
#
# ## Smallest battery for a wanted hover time
#
# Now the capacity of a pack is unknown. The state of charge divides by it, which is not linear; the
# same limit in ampere-seconds is. With three unknowns, `auto` takes `cvxpy`, not `closed-form`.
#
# **Before you run:** the drone has packs of 36 000 A s and hovers 719.5 s. How much smaller may a
# pack be for 700 s: by a third, or by a thirtieth?


# %%
class SmallestBattery(optuav.Formulation):
    """Smallest battery pack for a hover of 700 s."""

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        pack = model.variable("pack_As", "B_i", unit="A s", upper=100_000.0)
        drawn = given.flight_charge_As + given.hover_current_A * hover - given.rest_current_A * rest
        model.minimise(pack)
        model.subject_to("wanted hover", hover == WANTED_S, unit="s")
        model.subject_to("charge", (1.0 - given.min_soc) * given.packs * pack >= drawn, unit="A s")
        given.keep_deadline(model, "deadline", hover, rest)


smallest = optuav.formulate(mission, SmallestBattery(), perspective="battery").compile().solve()
smallest.point(0)

# %% [markdown]
# Check by turning the question around once more: with that pack, how long does (P1) hover?

# %%
lighter = mission.replace({"battery.capacity_As": smallest.point(0)["pack_As"]})
again = optuav.solve(lighter, perspective="battery")
again.hover_time_s

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("14.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
from dataclasses import dataclass


@dataclass(frozen=True)
class Enough(optuav.Formulation):
    """Least rest for a hover that is long enough."""

    wanted_s: float

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover >= self.wanted_s, unit="s")
        given.keep_charge(model, "state of charge", hover, rest)
        given.keep_wells(model, "wells", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


answer_1 = Enough(task["wanted_s"])
### END SOLUTION

# %%
grade = exercises.check("14.1", answer_1, student)
print(grade)
