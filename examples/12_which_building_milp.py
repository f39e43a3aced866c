# %% [markdown]
# # Which building? One mixed-integer programme
#
# Algorithm 2 solves (P3) and every (P4) one by one and takes the best. One programme can do the
# same: it has a binary λ for each route, exactly one of them 1, and the solver chooses. There are
# two ways to write that. Both are correct, but one gives the solver a bound that is hardly of use.
#
# **Learning intentions.** After this page you can
#
# - join alternatives into one programme with a binary choice;
# - state it with a big M and as a convex hull, and compare their relaxations;
# - read a bound and a gap as a proof;
# - name the inequality from which it follows that one stop is enough.

# %%
import math
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

# %% [markdown]
# ## Big M
#
# All routes share Δ and T'. Every constraint gets a term M (1 − λ) that switches it off where its
# route is not chosen. M must be large enough, and should be no larger: here each follows from the
# deadline, and is printed.

# %%
big = optuav.route_choice(few, perspective="battery", form="big-M", order="rest-first")
print(big.model)
print(big.plan.proof, big.plan.route)

assert math.isclose(big.plan.hover_time_s, max(alone_s.values()), abs_tol=1e-5)
assert big.plan.route[1] == "b1"

# %% [markdown]
# ## The relaxation
#
# Branch and bound starts from the programme with 0 ≤ λ ≤ 1. Its optimum bounds every choice. But
# with a third of each route, the constraints of all are relaxed: the bound is far away, the λ mean
# nothing, and the solver has to try the routes.

# %%
shares = {name: round(share, 3) for name, share in big.shares.items()}
print(f"bound {big.relaxation_s:.3f} s with", shares)

assert big.relaxation_s > 1.4 * big.plan.hover_time_s
assert math.isclose(sum(big.shares.values()), 1.0)
assert all(0.1 < share < 0.9 for share in big.shares.values())

# %% [markdown]
# ## Convex hull
#
# Now every route has a Δ and a T' of its own, and its constraints are multiplied by its λ instead:
# a·x ≤ b becomes a·x_r ≤ b λ_r. With λ = 0 the route has no hover. There are more unknowns, but the
# relaxation is as good as the best route: half of one route and half of another is no better than
# the better of the two.

# %%
hull = optuav.route_choice(few, perspective="battery", form="hull", order="rest-first")
print(hull.model)
for choice in (big, hull):
    print(f"{choice.form}: {traits(choice.model)}, and a bound of {choice.relaxation_s:.3f} s")

assert math.isclose(hull.relaxation_s, big.plan.hover_time_s, abs_tol=1e-5)
assert len(hull.model.variables) > len(big.model.variables)

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
    print(choice, end="\n\n")
    assert choice.plan.route == best.route
    assert math.isclose(choice.plan.hover_time_s, best.hover_time_s, abs_tol=1e-5)
assert abs(choices["hull"].gap_s) < 1e-5
assert choices["big-M"].gap_s > 400.0

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

assert "one stop is enough" in choices["hull"].notes[-1]
assert "more than one stop" in edited.notes[-1]
