import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Duality and KKT
#
# An answer without a proof is a claim. For linear problems the proof is short: a few numbers that
# combine the constraints into "no hover is longer". Finding the best such numbers is again a linear
# problem, the *dual*. Here you write it down, solve it, and read from it what everything is worth.
#
# **Before this lesson:** [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py).
# **Time:** 45 minutes.
#
# **Learning intentions.** After this page you can
#
# - write the dual of (P3) and (P4) by hand, and say what its unknowns and constraints mean;
# - prove an answer by weak duality, and say why strong duality makes the proof exact;
# - check complementary slackness and the other KKT conditions;
# - turn multipliers into seconds of hover for one more unit of anything.

# %%
import numpy as np

import optuav
from optuav.engines import closed_form
from optuav.modelling import Model

mission = optuav.load("paper")
program = optuav.formulate(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
if not program.parts:
    raise SystemExit("Nothing can be flown: " + "; ".join(program.reasons))
given = program.parts[0].model.row(0)
if "flight_charge_As" not in given:
    raise SystemExit("This page counts charge, as the perspective battery does.")
battery_As = given["packs"] * given["capacity_As"]
Q = (1.0 - given["min_soc"]) * battery_As - given["flight_charge_As"]
T = given["deadline_s"] - given["flight_time_s"]
I_hv, I_rest = given["hover_current_A"], given["rest_current_A"]
print(f"Q = {Q:.1f} A s may be drawn, T = {T:.2f} s are left")
print(f"hovering draws {I_hv:.3f} A, resting charges {I_rest:.3f} A")

# %% [markdown]
# ## The primal
#
# (P4) in its plainest form, with a name y for each constraint:
#
# $$
# \begin{aligned}
# \max\quad & \Delta \\
# & I_\mathrm{hv}\,\Delta - I_\mathrm{rest}\,T' \le Q && (y_1,\ \text{charge})\\
# & \Delta + T' \le T && (y_2,\ \text{deadline})\\
# & \Delta \ge 0,\quad T' \ge 0
# \end{aligned}
# $$
#
# ## Weak duality: any weights bound
#
# Multiply the charge by $y_1 \ge 0$ and the deadline by $y_2 \ge 0$ and add:
#
# $$(y_1 I_\mathrm{hv} + y_2)\,\Delta + (y_2 - y_1 I_\mathrm{rest})\,T' \le y_1 Q + y_2 T.$$
#
# If the first bracket is at least 1 and the second at least 0, the left side is at least $\Delta$,
# whatever the times. So $y_1 Q + y_2 T$ bounds every feasible hover.
#
# **Before you run:** y1 = 0 and y2 = 1 is the simplest choice. Which bound does it give, and what
# does it say in words? Which of the other two pairs below is allowed?

# %%
for y1, y2 in ((0.0, 1.0), (0.005, 0.6), (0.02, 0.1)):
    allowed = y1 * I_hv + y2 >= 1.0 and y2 - y1 * I_rest >= 0.0
    verdict = f"no hover exceeds {y1 * Q + y2 * T:.1f} s" if allowed else "not allowed"
    print(f"y1 = {y1:.3f}, y2 = {y2:.1f}: {verdict}")

# %% [markdown]
# ## The dual
#
# The best bound is the smallest. Its search is a linear problem in the weights: one constraint for
# each time, one unknown for each constraint.
#
# $$
# \begin{aligned}
# \min\quad & Q\,y_1 + T\,y_2 \\
# & I_\mathrm{hv}\,y_1 + y_2 \ge 1 && (\Delta)\\
# & -I_\mathrm{rest}\,y_1 + y_2 \ge 0 && (T')\\
# & y_1 \ge 0,\quad y_2 \ge 0
# \end{aligned}
# $$
#
# **Before you run:** y1 is in seconds of hover per ampere-second, y2 in seconds per second. What do
# the two constraints say about the price of a second of hover, and of a second of rest?

# %%
dual = Model("Smallest bound on the hover")
y1 = dual.variable("charge_price", "y1", unit="1/A")
y2 = dual.variable("time_price", "y2", unit="1")
dual.minimise(Q * y1 + T * y2)
dual.subject_to("a second of hover is worth a second", I_hv * y1 + y2 >= 1.0, unit="1")
dual.subject_to("a second of rest yields no profit", y2 - I_rest * y1 >= 0.0, unit="1")
weights = closed_form.solve(dual, programmes=1)
price_charge, price_time = weights.point(0).values()
best = program.compile().solve()
hover_s, rest_s = best.point(0).values()
print(dual)
print(f"primal: Δ = {hover_s:.6f} s with T' = {rest_s:.4f} s")
print(f"dual:   {weights.objective[0]:.6f} s with y1 = {price_charge:.6f}, y2 = {price_time:.6f}")

# %% [markdown]
# The two values are equal: that is *strong duality*. The weights of the best bound prove that the
# plan is optimal, and anybody can check them by one addition, without trusting the solver.
#
# In the plane of the weights, every point above both lines is a proof of some bound. The best one
# is where the lines meet. On the third line, all weights give that bound, and below it less.

# %%
along = np.linspace(0.0, 0.02, 201)
ax = optuav.plots.curves(
    [
        optuav.plots.Line("hover worth a second", along, np.maximum(1.0 - I_hv * along, 0.0)),
        optuav.plots.Line("no profit from rest", along, I_rest * along),
        optuav.plots.Line("the best bound", along, (hover_s - Q * along) / T),
    ],
    title="The dual: allowed weights lie above the first two lines",
    x_label="price of charge y1 [s per A s]",
    y_label="price of time y2 [s per s]",
)
ax.plot(price_charge, price_time, "k*", markersize=12)
ax.set_ylim(0.0, 1.05)
ax

# %% [markdown]
# ## Above and below
#
# Any feasible plan bounds from below, any allowed weights from above.
#
# **Before you run:** of a thousand random plans and a thousand random proofs, can a plan ever be
# better than a proof allows?

# %%
random = np.random.default_rng(1)
rests_s = random.uniform(0.0, T, 1000)
shares = random.uniform(0.6, 1.0, 1000)
plans_s = shares * np.minimum((Q + I_rest * rests_s) / I_hv, T - rests_s)
charges = random.uniform(0.0, 1.5 / I_hv, 1000)
times = np.maximum(1.0 - I_hv * charges, I_rest * charges) * random.uniform(1.0, 1.2, 1000)
bounds_s = Q * charges + T * times
print(
    f"best plan {plans_s.max():.1f} s, optimum {hover_s:.1f} s, best bound {bounds_s.min():.1f} s"
)
rank = np.arange(1000)
optuav.plots.curves(
    [
        optuav.plots.Line("plans, sorted", rank, np.sort(plans_s)),
        optuav.plots.Line("bounds, sorted", rank, np.sort(bounds_s)[::-1]),
        optuav.plots.Line("optimum of both", rank, np.full(1000, hover_s)),
    ],
    title="Weak duality, a thousand times",
    x_label="number of the plan or bound",
    y_label="hover time [s]",
)

# %% [markdown]
# ## Complementary slackness
#
# Add up what the bound gives away: $y_1$ times the slack of the charge, $y_2$ times the slack of
# the deadline, $\Delta$ and $T'$ times the slacks of the dual constraints. At the optimum the sum
# is zero, and no term is negative, so *each* term is zero: a constraint with slack has no price,
# and a price says that its constraint binds.
#
# **Before you run:** on the direct route (P3) charge runs out long before the deadline. What are
# its two prices?

# %%
direct = optuav.formulate(mission, "P3", perspective="battery")
numbers = direct.parts[0].model.row(0)
alone = direct.compile().solve()
for name, answer, checked in (
    ("P4", best, program.check(best.point(0))),
    ("P3", alone, direct.check(alone.point(0))),
):
    multipliers = answer.multipliers_at(0)
    for row in checked:
        price = multipliers.get(row.label, 0.0)
        product = price * row.slack
        print(f"{name} {row.label:22} slack {row.slack:10.4f}, price {price:9.4f}, ", end="")
        print(f"product {product:z.6f}")

# %% [markdown]
# The engine writes the charge as a share of the battery, so its price is y1 times B. The bounds of
# a time are constraints too: they have a price where the time is at its bound.
#
# ## The KKT conditions
#
# For smooth problems the same conditions bear the names of Karush, Kuhn and Tucker: the point is
# feasible; no multiplier is negative; products are zero; and the slope of the objective is a sum of
# the slopes of the binding constraints, weighted by the multipliers:
# $(1, 0) = y_1\,(I_\mathrm{hv}, -I_\mathrm{rest}) + y_2\,(1, 1)$.
#
# **Before you run:** what would it mean if the slope of the objective could not be written in this
# way?

# %%
slopes = np.array([[I_hv, -I_rest], [1.0, 1.0]])
print("weighted slopes:", (np.array([price_charge, price_time]) @ slopes).round(9) + 0.0)

# %% [markdown]
# If it could not, some direction would lengthen the hover without violating a binding constraint.
# In a linear problem these conditions prove the optimum; in a nonconvex one a bad point may satisfy
# them too, as [Convexity and a bad local optimum](10_convexity_and_a_bad_local_optimum.py) shows.
#
# ## What everything is worth
#
# Change a number by a little: the binding constraints still bind, and the hover changes by the
# weighted change of the constraints. So each shadow price is a multiplier times a derivative.
#
# **Before you run:** a pack holds one ampere-second more. Two packs, 5 % of which must be kept: by
# how much does Q grow, and what is that worth?

# %%
by_hand = {
    "deadline_s": price_time,
    "flight_charge_As": -price_charge,
    "capacity_As": price_charge * (1.0 - given["min_soc"]) * given["packs"],
    "min_soc": -price_charge * battery_As,
    "hover_current_A": -price_charge * hover_s,
    "rest_current_A": price_charge * rest_s,
}
prices = best.shadow_prices()
compiled = program.compile()
print("s of hover per unit       by hand   shadow price       measured")
for name, worth in by_hand.items():
    step = 1e-4 * given[name] or 1e-4  # Of a zero, no share
    ends = max(given[name] - step, 0.0), given[name] + step  # No number below zero
    less, more = (compiled.solve(**{name: end}).objective[0] for end in ends)
    measured = (more - less) / (ends[1] - ends[0])
    print(f"{name:18}{worth:15.6f}{prices[name].more:15.6f}{measured:15.6f}")

# %% [markdown]
# ## Where the proof is not unique
#
# At the deadline at which no time is left for a rest, three constraints meet in one point. The dual
# then has many best weights, a whole edge of its feasible set, and a price has two sides.
#
# **Before you run:** which two prices of time are at the ends of that edge?

# %%
T_kink = Q / I_hv
ends = {"no rest pays": (0.0, 1.0), "rest breaks even": (price_charge, price_time)}
for words, (charge, time) in ends.items():
    print(
        f"{words:17} y1 = {charge:.6f}, y2 = {time:.6f}: bound {Q * charge + T_kink * time:.4f} s"
    )
kink = compiled.solve(deadline_s=T_kink + given["flight_time_s"]).shadow_prices()["deadline_s"]
print(f"a second less costs {kink.less:.6f} s, a second more brings {kink.more:.6f} s")

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("08.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# A row for each unknown of the primal, an unknown for each of its rows.
from optuav.modelling import Model

answer_1 = Model("the smallest bound")
charge = answer_1.variable("charge_price", "y1", unit="1/A")
time = answer_1.variable("time_price", "y2", unit="1")
rest = answer_1.variable("rest_price", "y3", unit="1")
answer_1.minimise(task["usable_As"] * charge + task["left_s"] * time + task["most_s"] * rest)
answer_1.subject_to("hover", task["hover_A"] * charge + time >= 1.0)
answer_1.subject_to("rest", time + rest - task["rest_A"] * charge >= 0.0)
### END SOLUTION

# %%
grade = exercises.check("08.1", answer_1, student)
print(grade)

# %%
task = exercises.task("08.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# Either the longest rest binds, or it has slack and the deadline binds, as without it.
from fractions import Fraction

drawn_A, returned_A, most_s = task["hover_A"], task["rest_A"], task["most_s"]
longest_s = Fraction(task["usable_As"] + returned_A * most_s, drawn_A)
if longest_s + most_s <= task["left_s"]:
    answer_2 = {"hover_time_s": longest_s, "rest_time_s": most_s, "charge": Fraction(1, drawn_A)}
    answer_2["longest rest"] = Fraction(returned_A, drawn_A)
else:
    charge = Fraction(1, drawn_A + returned_A)
    longest_s = (task["usable_As"] + returned_A * task["left_s"]) * charge
    answer_2 = {"hover_time_s": longest_s, "rest_time_s": task["left_s"] - longest_s}
    answer_2 |= {"charge": charge, "deadline": returned_A * charge}
### END SOLUTION

# %%
grade = exercises.check("08.2", answer_2, student)
print(grade)
