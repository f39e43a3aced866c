# %% [markdown]
# # Which building? One mixed-integer programme
#
# Algorithm 2 solves (P3) and every (P4) one by one and takes the best. One programme can do the
# same: it has a binary λ for each route, exactly one of them 1, and the solver chooses. There are
# two ways to write that. Both are correct, but one gives the solver a bound that is hardly of use.
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
import sys

import optuav
from optuav.modelling.classify import traits

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Δ shows ? in its place

mission = optuav.load("paper")
few = mission.replace({f"buildings.b{k}": None for k in (2, 3, 4, 5, 6, 7, 8, 10)})
alone_s = {"direct": optuav.solve(few, "P3", perspective="battery").hover_time_s}
for building in ("b1", "b9"):
    plan = optuav.solve(few, optuav.P4(building, order="rest-first"), perspective="battery")
    alone_s[building] = plan.hover_time_s
print({name: f"{hover_s:.3f} s" for name, hover_s in alone_s.items()})

# %%
optuav.plots.mission_map(few)

# %% [markdown]
# ## Big M
#
# All routes share Δ and T'. Every constraint gets a term M (1 − λ) that switches it off where its
# route is not chosen. M must be large enough, and should be no larger: here each follows from the
# deadline, and is printed.
#
# **Before you run:** three routes, so three copies of each constraint. How many constraints does
# the programme have, and how many of them do anything at the answer?

# %%
big = optuav.route_choice(few, perspective="battery", form="big-M", order="rest-first")
print(big.model)
print(big.plan.proof, big.plan.route)

# %% [markdown]
# ## The relaxation
#
# Branch and bound starts from the programme with 0 ≤ λ ≤ 1. Its optimum bounds every choice. But
# with a third of each route, the constraints of all are relaxed.
#
# **Before you run:** no route hovers longer than 720 s. Guess the bound.

# %%
shares = {name: round(share, 3) for name, share in big.shares.items()}
print(f"bound {big.relaxation_s:.3f} s with", shares)

# %% [markdown]
# The bound is far away, the λ mean nothing, and the solver has to try the routes.

# %%
optuav.plots.bars(
    [optuav.plots.Bar(route, "", hover_s) for route, hover_s in alone_s.items()],
    title="Each route by itself, and what the relaxation promises",
    y_label="longest hover [s]",
    level=optuav.plots.Mark(big.relaxation_s, "bound with a big M"),
)

# %% [markdown]
# ## Convex hull
#
# Now every route has a Δ and a T' of its own, and its constraints are multiplied by its λ instead:
# a·x ≤ b becomes a·x_r ≤ b λ_r. With λ = 0 the route has no hover.
#
# **Before you run:** take half of one route and half of another. How long does that mixture hover,
# at most? So what is the bound?

# %%
hull = optuav.route_choice(few, perspective="battery", form="hull", order="rest-first")
print(hull.model)
for choice in (big, hull):
    print(f"{choice.form}: {traits(choice.model)}, and a bound of {choice.relaxation_s:.3f} s")

# %% [markdown]
# There are more unknowns, but the relaxation is as good as the best route: half of one route and
# half of another is no better than the better of the two.

# %% [markdown]
# ## All routes
#
# `route_choice` chooses among every building and both orders. It must find what Algorithm 2 finds,
# ties included; the gap between bound and answer proves that nothing is better.

# %%
best = optuav.solve(mission, perspective="battery")
choices = {
    form: optuav.route_choice(mission, perspective="battery", form=form)
    for form in ("hull", "big-M")
}
for choice in choices.values():
    print(choice)
    print("as one by one:", choice.plan.route == best.route, end="\n\n")

# %% [markdown]
# ## Why one stop
#
# A second rest pays only if a detour is shorter than the leg that it replaces. Legs of the flight
# model obey the triangle inequality; measured ones may not. Edit one, and the note changes.

# %%
graph = optuav.graph(mission)
graph.edges["origin", "b1"].update(duration_s=1.0, charge_As=10.0, energy_J=100.0)
edited = optuav.route_choice(mission, perspective="battery", graph=graph)
print(edited.notes[-1])
