# %% [markdown]
# # Which building? One mixed-integer programme
#
# Algorithm 2 solves (P3) and every (P4) one by one and takes the best. One programme can do the
# same: it has a binary λ for each route, exactly one of them 1, and the solver chooses. There are
# two ways to write that choice. Both are correct, but one gives the solver a bound that is hardly
# of use. The lesson begins with only the buildings b1 and b9.
#
# **Before this lesson:** [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - join alternatives into one programme with a binary choice;
# - state it with a big M and as a convex hull, and compare their relaxations;
# - read a bound and a gap as a proof;
# - name the inequality from which it follows that one stop is enough.

# %%
import pandas as pd

import optuav
from optuav.modelling.classify import traits

mission = optuav.load("paper")
few = mission.replace({f"buildings.b{k}": None for k in (2, 3, 4, 5, 6, 7, 8, 10)})
optuav.plots.mission_map(few)

# %% [markdown]
# One by one, as Algorithm 2 does it:

# %%
problems = {"direct": "P3"} | {name: optuav.P4(name, order="rest-first") for name in ("b1", "b9")}
alone_s = {
    route: optuav.solve(few, problem, perspective="battery").hover_time_s
    for route, problem in problems.items()
}
alone_s

# %% [markdown]
# ## Big M
#
# All routes share Δ and T'. Every constraint gets a term $M (1 - \lambda)$ that switches it off if
# its route is not chosen. $M$ must be large enough, and should be no larger: here each follows from
# the deadline, and is shown with the programme. (In a model of your own,
# `model.variable("by_way", "λ", unit="1", binary=True)` declares a binary unknown.)
#
# **Before you run:** three routes, so three copies of each constraint. How many constraints does
# the programme have, and how many of them do anything at the answer?

# %%
big = optuav.route_choice(few, perspective="battery", form="big-M", order="rest-first")
big.model

# %%
big.plan.route, big.plan.proof

# %% [markdown]
# At the answer the λ of b1 is 1: its two constraints end the hover, and the big M switches off the
# constraints of the other two routes.
#
# ## The relaxation
#
# A solver starts from the programme with $0 \le \lambda \le 1$, the *relaxation*. Its optimum
# bounds every choice. But with a third of each route, the constraints of all routes are relaxed.
# [Discrete, relaxed, continuous](12_discrete_relaxed_continuous.py) follows a solver from there.
#
# **Before you run:** no route hovers longer than 720 s. Guess the bound.

# %%
optuav.plots.bars(
    [optuav.plots.Bar(route, "", hover_s) for route, hover_s in alone_s.items()],
    title="Each route by itself, and what the relaxation promises",
    y_label="longest hover [s]",
    level=optuav.plots.Mark(big.relaxation_s, "bound with a big M"),
)

# %%
big.relaxation_s, big.shares

# %% [markdown]
# The bound is far away, the λ mean nothing, and the solver has to try the routes.
#
# ## Convex hull
#
# Now every route has a Δ and a T' of its own, and its constraints are multiplied by its λ instead:
# $a^T x \le b$ becomes $a^T x_r \le b\,\lambda_r$. With $\lambda_r = 0$ the route has no hover.
#
# **Before you run:** take half of one route and half of another. How long does that mixture hover,
# at most? So what is the bound?

# %%
hull = optuav.route_choice(few, perspective="battery", form="hull", order="rest-first")
hull.model

# %%
pd.DataFrame(
    [
        (choice.form, str(traits(choice.model)), choice.relaxation_s, choice.plan.hover_time_s)
        for choice in (big, hull)
    ],
    columns=["form", "programme", "bound [s]", "hover [s]"],
).round(3)

# %% [markdown]
# There are more unknowns, but the relaxation is as good as the best route: half of one route and
# half of another is no better than the better of the two.
#
# ## All routes
#
# `route_choice` chooses among every building and both orders. It must find the same plan as
# Algorithm 2, ties included. The gap between bound and answer proves that nothing is better.

# %%
best = optuav.solve(mission, perspective="battery")
choices = {
    form: optuav.route_choice(mission, perspective="battery", form=form)
    for form in ("hull", "big-M")
}
pd.DataFrame(
    {
        form: (choice.relaxation_s, abs(choice.gap_s), choice.plan.route == best.route)
        for form, choice in choices.items()
    },
    index=["bound [s]", "gap of the relaxation [s]", "same plan as one by one"],
)

# %% [markdown]
# ## Why one stop
#
# A second rest pays only if a detour is shorter than the leg that it replaces. Legs of the flight
# model obey the triangle inequality, and a note of the choice says so:

# %%
choices["hull"].notes

# %% [markdown]
# Measured legs may not obey it. Edit one, and the note changes.

# %%
graph = optuav.graph(mission)
graph.edges["origin", "b1"].update(duration_s=1.0, charge_As=10.0, energy_J=100.0)
edited = optuav.route_choice(mission, perspective="battery", graph=graph)
edited.notes

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("11.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# The rows meet where first + M (1 − λ) = second + M λ; adding them gives twice Δ.
from fractions import Fraction

first_s, second_s, M = task["first_s"], task["second_s"], task["M"]
best = {
    "hover_time_s": Fraction(first_s + second_s + M, 2),
    "by_way": Fraction(first_s + M - second_s, 2 * M),
}
letter = next(key for key, reason in task.reasons.items() if "both rows at once" in reason)
answer_1 = letter, best
### END SOLUTION

# %%
grade = exercises.check("11.1", answer_1, student)
print(grade)

# %%
task = exercises.task("11.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
from optuav.modelling import Model

answer_2 = Model("longest hover, direct or by way of a building")
hover = answer_2.variable("hover_time_s", "Δ", unit="s")
rest = answer_2.variable("rest_time_s", "T'", unit="s")
by_way = answer_2.variable("by_way", "λ", unit="1", binary=True)
answer_2.maximise(hover)
drawn_As = task["hover_A"] * hover - task["rest_A"] * rest
answer_2.subject_to("charge", drawn_As <= task["usable_As"] + 1000 * (1 - by_way), unit="A s")
answer_2.subject_to("deadline", hover + rest <= task["left_s"] + 20 * (1 - by_way), unit="s")
answer_2.subject_to("rest only by way", rest <= 2000 * by_way, unit="s")
### END SOLUTION

# %%
grade = exercises.check("11.2", answer_2, student)
print(grade)
