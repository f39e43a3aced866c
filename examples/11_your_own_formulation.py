# %% [markdown]
# # Your own formulation
#
# The paper asks for the longest hover. An operator may ask otherwise: how little may I rest for the
# 700 s that I need? Which battery should I buy? Each is one class, and everything that works on the
# problems of the paper works on it: printing, checking, every engine, shadow prices.
#
# **Learning intentions.** After this page you can
#
# - state a problem of your own in a class with one method;
# - solve it on every engine that takes it, and again with other numbers;
# - check an answer by turning the question around.

# %%
import math

import optuav
from formulations.formulation import Formulation
from formulations.given import Given
from optuav.engines.registry import takers
from optuav.modelling import Model, Parameter
from optuav.modelling.classify import traits

mission = optuav.load("paper")
WANTED_S = 700.0

# %% [markdown]
# ## Least rest for a wanted hover time
#
# Inside `declare` the mission's quantities are symbols: `self.min_soc`, `self.time_left`. Δ and T'
# come from `hover_and_rest`, without T' on the direct route; `soc_end` goes by the perspective, and
# `keep_wells` keeps the battery from running dry. A number of your own is a `Parameter`.


# %%
class LeastRest(Formulation):
    """Least rest for a wanted hover time."""

    def declare(self, model: Model, given: Given) -> None:
        """Rest as little as the charge allows."""
        wanted = Parameter("wanted_hover_s", "Δ_w", "s", WANTED_S)
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover == wanted, unit="s")
        model.subject_to("state of charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "battery", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


counted = {"perspective": "battery"}
asked = {"problem": LeastRest(), "building": "b1", "order": "rest-first", **counted}
program = optuav.formulate(mission, **asked)
print(program)
found = traits(program.parts[0].model)
print(f"{found}; taken by {', '.join(takers(found, slots=False))}")
for engine in takers(found, slots=False):
    slot_s = 10.0 if engine == "grid" else None
    plan = optuav.solve(mission, **asked, engine=engine, slot_s=slot_s)
    print(f"{engine:<12}{plan.rest_time_s:10.4f} s  {plan.proof}")
    assert math.isclose(plan.hover_time_s, WANTED_S)

best = optuav.solve(mission, LeastRest(), **counted)
print("over all routes:", " → ".join(best.route), f"rests {best.rest_time_s:.4f} s")
rows = program.check({"hover_time_s": WANTED_S, "rest_time_s": best.rest_time_s - 1.0})
assert best.route == ("origin", "b1", "hover", "destination")
assert [row.label for row in rows if not row.satisfied] == ["state of charge"]

# %% [markdown]
# Turned around: where the deadline leaves just that much rest, (P1) hovers just as long as wanted.

# %%
tight = mission.replace({"limits.deadline_s": best.mission_time_s})
assert math.isclose(optuav.solve(tight, **counted).hover_time_s, WANTED_S, abs_tol=1e-6)

# %% [markdown]
# Prices are in seconds of rest now. Up to 688 s the direct route will do; from there on a second of
# hover costs what the laser needs to bring its charge; beyond 719 s there is no time for that.

# %%
compiled = optuav.formulate(mission, LeastRest(), **counted).compile()
for wanted_s in (680.0, 690.0, 700.0, 710.0, 720.0):
    answer = compiled.solve(wanted_hover_s=wanted_s)
    if answer.status.has_answer:
        price = answer.shadow_prices()["wanted_hover_s"].more
        rest_s = answer.point(0).get("rest_time_s", 0.0)
        print(f"{wanted_s:.0f} s: rest {rest_s:7.3f} s, a second more costs {price:.3f} s")
        assert math.isclose(price, 87.91038 / 10.0 if rest_s else 0.0, rel_tol=1e-6)
assert answer.status == "infeasible"

# %% [markdown]
# ## Smallest battery for a wanted hover time
#
# Now the pack is unknown. The state of charge divides by it, which is not linear; the same said in
# A s is. A rest makes three unknowns, too many for `closed-form`; `cvxpy` takes over by itself.


# %%
class SmallestBattery(Formulation):
    """Smallest battery pack for a wanted hover time."""

    def declare(self, model: Model, given: Given) -> None:
        """Carry as much charge as the mission draws, and η0 besides."""
        wanted = Parameter("wanted_hover_s", "Δ_w", "s", WANTED_S)
        hover, rest = given.hover_and_rest(model)
        pack = model.variable("pack_As", "B_i", unit="A s", upper=100_000.0)
        charged = given.rest_current_A * rest
        drawn = given.flight_charge_As + given.hover_current_A * hover - charged
        model.minimise(pack)
        model.subject_to("wanted hover", hover == wanted, unit="s")
        model.subject_to("charge", (1.0 - given.min_soc) * given.packs * pack >= drawn, unit="A s")
        given.keep_deadline(model, "deadline", hover, rest)


smallest = optuav.formulate(mission, SmallestBattery(), **counted).compile().solve()
print(smallest.engine, {name: round(value, 1) for name, value in smallest.point(0).items()})
lighter = mission.replace({"battery.capacity_As": smallest.point(0)["pack_As"]})
print(f"with that pack (P1) hovers {optuav.solve(lighter, **counted).hover_time_s:.6f} s")

assert (smallest.engine, lighter.battery.capacity_As < 36_000.0) == ("cvxpy", True)
assert math.isclose(optuav.solve(lighter, **counted).hover_time_s, WANTED_S, abs_tol=1e-6)
