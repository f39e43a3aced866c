# %% [markdown]
# # Convexity and a bad local optimum
#
# A solver that walks uphill stops where no step leads further up. The shape of the feasible set
# decides whether it stops at the summit. In the linear problems of the last lessons it always does.
# With the two wells of a battery it need not. Here is a mission on which a good solver stops at a
# sixteenth of the best hover, and reports success.
#
# **Before this lesson:** [Two wells](03_two_wells.py),
# [Declare a problem](05_declare_a_problem.py), [Duality and KKT](08_duality_and_kkt.py).
# **Time:** 45 minutes.
#
# **Learning intentions.** After this page you can
#
# - test by midpoints whether a feasible set is convex, and say why a local optimum is then global;
# - explain from the two wells how a feasible set falls into two parts;
# - find the starts from which a local solver ends at a bad point, and check its KKT conditions
#   there;
# - say how much many starts are worth, and what a proof adds.

# %%
import warnings
from dataclasses import dataclass

import casadi
import numpy as np
import pandas as pd
from scipy.optimize import brentq

import optuav
from optuav.physics.kibam import Battery, Stage, step

Line = optuav.plots.Line
pd.set_option("display.max_colwidth", None)  # Proofs in full

# %% [markdown]
# ## Convex: halfway between two feasible points
#
# A set is convex if it contains the whole line between any two of its points. Linear constraints
# make convex sets. If a convex set has a better point anywhere, the line towards it is feasible and
# leads uphill from the first step. So no solver gets stuck at a bad local optimum.
#
# The perspective decides which constraints are linear. `battery` counts all charge alike, a sum of
# currents times their durations, and is linear. So are `energy`, a sum of powers times their
# durations, and `adjusted`, the same against the energies at the voltages of flight and of hover
# ([Energy or battery?](A1_energy_or_battery.py)). `available` follows both wells, and is not
# linear.
#
# Draw pairs of feasible points of (P4), and look halfway between them.
#
# **Before you run:** in what share of the cases will the point halfway be infeasible?


# %%
def feasible(program, hovers_s, rests_s):
    """Return whether points satisfy all constraints."""
    rows = program.check({"hover_time_s": hovers_s, "rest_time_s": rests_s})
    return np.all([np.broadcast_to(row.satisfied, hovers_s.shape) for row in rows], axis=0)


def halfway(program, least_rest_s, most_rest_s):
    """Return the share of pairs of random feasible points whose midpoint is feasible too."""
    random = np.random.default_rng(1)
    hovers_s = random.uniform(0.0, 1200.0, 10_000)
    rests_s = random.uniform(least_rest_s, most_rest_s, 10_000)
    inside = feasible(program, hovers_s, rests_s)
    hovers_s, rests_s = hovers_s[inside], rests_s[inside]
    middle = 0.5 * (hovers_s[1:] + hovers_s[:-1]), 0.5 * (rests_s[1:] + rests_s[:-1])
    return float(feasible(program, *middle).mean())


paper = optuav.load("paper")
linear = optuav.formulate(paper, optuav.P4("b9", order="hover-first"), perspective="battery")
halfway(linear, 0.0, 1200.0)

# %% [markdown]
# Every midpoint is feasible, as the linear problem promises.
#
# ## A mission with two answers
#
# A strong laser carries nearly all of the hover: it gives 95 A of the 98 A that hovering takes (the
# 88 A of the first lesson are net of the 10 A that the laser gives there). The battery has a small
# available well, into which bound charge flows quickly. And there is something to unload on the
# roof of b9: after the hover, the drone has to stay there for at least 54 s. That is one constraint
# more than (P4) has.


# %%
@dataclass(frozen=True)
class Unload(optuav.Formulation):
    """Longest hover before a rest of at least so long."""

    least_rest_s: float

    def declare(self, model, given):
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        model.prefer_small(rest)
        model.subject_to("time to unload", rest >= self.least_rest_s, unit="s")
        given.keep_charge(model, "state of charge", hover, rest)
        given.keep_wells(model, "battery", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


LEAST_REST_S = 54.0
bright = {"battery.charge_current_A": 95.0, "laser.power_W": 13_000.0}
quick = {"battery.available_fraction": 0.4, "battery.flow_rate_per_s": 1e-3}
mission = paper.replace(bright | quick)
unload = Unload(LEAST_REST_S, building="b9", order="hover-first")
best = optuav.solve(mission, unload)
best

# %%
program = optuav.formulate(mission, unload)
(part,) = program.parts
ax = optuav.plots.plane(part.model, part.model.row(0), [best])
ax.set_xlim(45.0, 62.0)
ax

# %% [markdown]
# The feasible set is in two parts, between the line of the time to unload and the line of the full
# well: a corner at the bottom, and a strip far above it. Now many midpoints are infeasible:

# %%
halfway(program, LEAST_REST_S, 57.0)

# %% [markdown]
# ## Why two parts
#
# The laser fills the available well on the roof with 95 A. It must not drive the well past full:
# that is the line "full after the rest". The hover before decides how much room there is. After the
# flight out the available well is lower than the bound one, and charge flows into it. For the first
# minutes of the hover the available well *rises*, although the drone draws more than the laser
# gives. Later the wells are level, and both fall slowly.
#
# **Before you run:** so for which hovers does a rest of 54 s drive the well past full: short ones,
# long ones, or those in between?

# %%
out, hover, back, rest, home = best.phases
pack = mission.battery
battery = Battery(pack.packs * pack.capacity_As, pack.available_fraction, pack.flow_rate_per_s)


def flown(wells, leg):
    """Return both wells after the stages of a leg."""
    for stage in leg.stages:
        wells = step(battery, wells, Stage(stage.current_A, stage.duration_s))
    return wells


def after_hover_and_rest(hover_s, rest_s):
    """Return both wells after the rest, and at the landing; of numbers, arrays or symbols."""
    wells = step(battery, flown(battery.full, out), Stage(hover.current_A, hover_s))
    rested = step(battery, flown(wells, back), Stage(rest.current_A, rest_s))
    return rested, flown(rested, home)


hovers_s = np.linspace(0.0, 1100.0, 441)
rested, _ = after_hover_and_rest(hovers_s, LEAST_REST_S)
full_As = float(battery.full.available_As)
fits = rested.available_As <= full_As


def room_As(hover_s):
    """Return the charge that still fits into the well after the shortest rest [A s]."""
    return full_As - float(after_hover_and_rest(hover_s, LEAST_REST_S)[0].available_As)


changes = np.flatnonzero(fits[1:] != fits[:-1])
ends_s = [brentq(room_As, hovers_s[at], hovers_s[at + 1]) for at in changes]
optuav.plots.curves(
    [
        Line("after the shortest rest", hovers_s, rested.available_As),
        Line("full", hovers_s, np.full(len(hovers_s), full_As)),
    ],
    title="The available well at the end of the rest",
    x_label="hover time Δ [s]",
    y_label="available y1 [A s]",
    marks=[optuav.plots.Mark(end_s, "just full") for end_s in ends_s],
)

# %% [markdown]
# Hovers in between do. A short hover ends before the well has risen, and a long one after it has
# fallen again.
#
# ## Uphill from one start
#
# IPOPT is an interior-point solver, one of the best. CasADi hands it the objective, the constraints
# and their slopes: the functions above take symbols as well as numbers. You choose only where it
# starts.
#
# **Before you run:** it starts with a hover of 30 s. Where will it stop, and what will it report?

# %%
x = casadi.SX.sym("x", 2)  # Δ and T'
with warnings.catch_warnings():
    warnings.simplefilter("ignore", FutureWarning)  # Types of results that NumPy will not change
    rested, landed = after_hover_and_rest(x[0], x[1])
time_left_s = mission.limits.deadline_s - best.flight_time_s - x[0] - x[1]
room = (full_As - rested.available_As) / battery.capacity_As
left = landed.available_As / battery.capacity_As
problem = {"x": x, "f": -x[0], "g": casadi.vertcat(room, left, time_left_s)}
options = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
solver = casadi.nlpsol("uphill", "ipopt", problem, options)


def uphill(hover_s):
    """Return where IPOPT stops from a start, its report, and the multipliers."""
    answer = solver(x0=[hover_s, LEAST_REST_S], lbx=[0.0, LEAST_REST_S], lbg=0.0)
    stopped_s = float(answer["x"][0])
    return stopped_s, solver.stats()["return_status"], np.asarray(answer["lam_g"]).ravel()


stopped_s, report, multipliers = uphill(30.0)
{"IPOPT stops at [s]": stopped_s, "report": report, "best hover [s]": best.hover_time_s}

# %% [markdown]
# IPOPT has succeeded in its own terms: the KKT conditions hold. One constraint binds, its
# multiplier has the right sign, and it balances the slope of the objective. Every step from here
# leads down or out of the feasible set. IPOPT minimises −Δ and counts the multiplier of a
# constraint g ≥ 0 as negative or zero. So the sign is right if the multiplier times the slope of
# its constraint adds up to the slope of Δ, which is 1.
#
# **Before you run:** which of the three constraints binds?

# %%
names = ["room in the well", "charge at the landing", "time left"]
slopes = casadi.Function("slopes", [x], [casadi.jacobian(problem["g"], x)])
at = np.asarray(slopes([stopped_s, LEAST_REST_S]))[:, 0]
conditions = pd.DataFrame({"multiplier": multipliers, "times its slope": multipliers * at}, names)
conditions.round(4) + 0.0

# %% [markdown]
# The well is full: there is no room for a longer hover here.
#
# ## Many starts
#
# **Before you run:** from which starts will it find the better part: from those inside it, or from
# some outside too?

# %%
starts_s = np.linspace(0.0, 1050.0, 43)
stops_s = np.array([uphill(start_s)[0] for start_s in starts_s])
good = stops_s > best.hover_time_s - 1.0
optuav.plots.curves(
    [Line("IPOPT stops at", starts_s, stops_s, "o"), Line("where it began", starts_s, starts_s)],
    title="The end of a walk depends on its start",
    x_label="start of Δ [s]",
    y_label="hover time Δ [s]",
    y_from_zero=True,
)

# %% [markdown]
# The share of the starts that end at the best hover:

# %%
float(good.mean())

# %% [markdown]
# Trying several starts and keeping the best is called *multi-start*. The engine `casadi` does that,
# and here it finds the better part. But it cannot know that no third part exists, and says so: its
# answer is locally optimal.
#
# ## A proof
#
# The engine `bracket` does not walk. It shows, over whole intervals of the times at once, that no
# point in them can be better. `grid` tries all slots, and knows nothing between them.
#
# **Before you run:** which of the three engines may say `optimal`?

# %%
engines = {"casadi": None, "grid": 1.0, "bracket": None}
plans = {
    engine: optuav.solve(mission, unload, engine=engine, slot_s=slot_s)
    for engine, slot_s in engines.items()
}
pd.DataFrame(
    {engine: (plan.hover_time_s, plan.status.value, plan.proof) for engine, plan in plans.items()},
    index=["hover [s]", "status", "proof"],
).T

# %% [markdown]
# The `optimal` of `grid` is the best of its slots, and less than the optimum of `bracket`.
#
# [A bracket, or a solver?](15_bracket_or_solver.py) has more missions of this kind. A local solver
# is a good servant if somebody checks the shape.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("10.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Both hovers as far from the middle: look for a short one whose partner can be flown too.
p4 = optuav.formulate(task.mission, optuav.P4("b9", order="hover-first"))


def can_be_flown(hover_s):
    """Whether a hover satisfies all constraints before the rest of the task."""
    return p4.check({"hover_time_s": hover_s, "rest_time_s": task["rest_s"]}).satisfied


for short_s in range(30):
    long_s = 2 * task["middle_s"] - short_s
    if can_be_flown(short_s) and can_be_flown(long_s):
        letter = next(key for key, reason in task.reasons.items() if "flows over first" in reason)
        answer_1 = letter, {"short_s": short_s, "long_s": long_s}
### END SOLUTION

# %%
grade = exercises.check("10.1", answer_1, student)
print(grade)

# %%
task = exercises.task("10.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# Step by step from the start, as long as the next step is feasible.
p4 = optuav.formulate(task.mission, optuav.P4("b9", order="hover-first"))
answer_2 = 5.0
while p4.check({"hover_time_s": answer_2 + 0.5, "rest_time_s": task["rest_s"]}).satisfied:
    answer_2 += 0.5
### END SOLUTION

# %%
grade = exercises.check("10.2", answer_2, student)
print(grade)
