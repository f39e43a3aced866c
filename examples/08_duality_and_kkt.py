# %% [markdown]
# # Duality and KKT
#
# An answer without a proof is a claim. For linear problems the proof is short: a few numbers that
# combine the constraints into "no hover is longer". The search for the best such numbers is again a
# linear problem, the *dual*. Here you write it down, solve it, and read from it the worth of every
# number of the mission.
#
# **Before this lesson:** [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py).
# **Time:** 45 minutes.
#
# **Learning intentions.** After this page you can
#
# - write the dual of (P3) and (P4) by hand, and say what its unknowns and constraints mean;
# - prove an answer by weak duality, and say why strong duality makes the proof exact;
# - check complementary slackness and the other KKT conditions;
# - turn multipliers into seconds of hover for one more unit of any number.

# %%
import numpy as np
import pandas as pd

import optuav
from optuav.engines import closed_form
from optuav.looks import LOOKS
from optuav.modelling import Model

mission = optuav.load("paper")
program = optuav.formulate(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
numbers = program.parts[0].model.row(0)
battery_As = numbers["packs"] * numbers["capacity_As"]
Q = (1.0 - numbers["min_soc"]) * battery_As - numbers["flight_charge_As"]
T = numbers["deadline_s"] - numbers["flight_time_s"]
I_hv, I_rest = numbers["hover_current_A"], numbers["rest_current_A"]
pd.Series({"Q [A s]": Q, "T [s]": T, "I_hv [A]": I_hv, "I_rest [A]": I_rest}).to_frame("value")

# %% [markdown]
# ## The primal
#
# (P4) in its plainest form: the plan may draw the charge Q and has the time T. Each constraint gets
# a weight y.
#
# $$
# \begin{aligned}
# \max\quad & \Delta \\
# & I_\mathrm{hv}\,\Delta - I_\mathrm{rest}\,T' \le Q && (y_1,\ \text{charge})\\
# & \Delta + T' \le T && (y_2,\ \text{deadline})\\
# & \Delta \ge 0,\quad T' \ge 0
# \end{aligned}
# $$

# %%
optuav.plots.plane(program.parts[0].model, numbers, [program.solve()])

# %% [markdown]
# ## Weak duality: any weights give a bound
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
pairs = pd.DataFrame({"y1": [0.0, 0.005, 0.02], "y2": [1.0, 0.6, 0.1]})
pairs["bracket of Δ"] = pairs.y1 * I_hv + pairs.y2
pairs["bracket of T'"] = pairs.y2 - pairs.y1 * I_rest
pairs["allowed"] = (pairs["bracket of Δ"] >= 1.0) & (pairs["bracket of T'"] >= 0.0)
pairs["bound [s]"] = (pairs.y1 * Q + pairs.y2 * T).where(pairs.allowed)
pairs.round(3)

# %% [markdown]
# The first pair says: no hover is longer than the time that is left. The second pair combines both
# constraints and gives a smaller bound. The third pair is not allowed: its second bracket is
# negative, so a long rest would make the left side smaller than Δ.
#
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
dual.subject_to("a second of hover costs at least a second", I_hv * y1 + y2 >= 1.0, unit="1")
dual.subject_to("a second of rest yields no profit", y2 - I_rest * y1 >= 0.0, unit="1")
dual

# %% [markdown]
# In words: y1 and y2 are prices of charge and of time.
#
# - A second of hover uses $I_\mathrm{hv}$ of charge and one second of time. Together they must cost
#   at least the one second of hover that they make. Otherwise a buyer could turn cheap charge and
#   time into hover, and the bound would be too low.
# - A second of rest uses one second of time and yields $I_\mathrm{rest}$ of charge. The charge must
#   not be worth more than the time. Otherwise resting alone would make a profit.
#
# The dual looks for the lowest prices at which nobody can make a profit.

# %%
weights = closed_form.solve(dual, programmes=1)
price_charge, price_time = weights.point(0).values()
best = program.compile().solve()
hover_s, rest_s = best.point(0).values()
{"primal [s]": hover_s, "dual [s]": float(weights.objective[0]), **weights.point(0)}

# %% [markdown]
# The two values are equal: that is *strong duality*. The weights of the best bound prove that the
# plan is optimal, and anybody can check them by one addition, without trusting the solver.
#
# In the plane of the weights, each constraint forbids the shaded side of its line, as in the plane
# of the times. Every point that no shade covers proves a bound. On the dotted lines all weights
# give the same bound, and it falls towards the lower left. The best point is the last that the
# falling line touches: the corner.

# %%
along = np.linspace(0.0, 0.02, 201)
hover_line, rest_line = 1.0 - I_hv * along, I_rest * along
levels_s = (hover_s, 900.0, T)
ax = optuav.plots.curves(
    [
        optuav.plots.Line("hover costs a second", along, hover_line),
        optuav.plots.Line("no profit from rest", along, rest_line),
    ],
    title="The dual: weights that prove a bound",
    x_label="price of charge y1 [s per A s]",
    y_label="price of time y2 [s per s]",
)
ax.fill_between(along, -0.05, hover_line, color=LOOKS["flight"].light, alpha=0.15, linewidth=0.0)
ax.fill_between(along, -0.05, rest_line, color=LOOKS["rest"].light, alpha=0.15, linewidth=0.0)
for level_s in levels_s:
    ax.plot(along, (level_s - Q * along) / T, "k:", linewidth=0.9)
    ax.annotate(f"{level_s:.0f} s", (0.0002, level_s / T), va="bottom", fontsize=8)
ax.plot(
    price_charge, price_time, "*", color=LOOKS["optimum"].light, markeredgecolor="k", markersize=13
)
ax.set_ylim(0.0, 1.1)
ax.set_xlim(0.0, 0.019)
ax

# %% [markdown]
# ## Above and below
#
# Any feasible plan bounds the optimum from below, any allowed weights bound it from above.
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
# It cannot: all plans stay below the optimum, and all bounds above it.
#
# ## Complementary slackness
#
# Add up what the bound gives away: $y_1$ times the slack of the charge, $y_2$ times the slack of
# the deadline, $\Delta$ and $T'$ times the slacks of the dual constraints. At the optimum the sum
# is zero, and no term is negative, so *each* term is zero. A constraint with slack has no price,
# and a constraint with a price binds.
#
# **Before you run:** on the direct route (P3) charge runs out long before the deadline. What are
# its two prices?

# %%
direct = optuav.formulate(mission, "P3", perspective="battery")
alone = direct.compile().solve()
rows = [
    (problem, row.label, round(row.slack, 9) + 0.0, answer.multipliers_at(0).get(row.label, 0.0))
    for problem, answer, asked in (("P4", best, program), ("P3", alone, direct))
    for row in asked.check(answer.point(0))
]
slackness = pd.DataFrame(rows, columns=["problem", "constraint", "slack", "price"])
slackness["product"] = slackness.slack * slackness.price
slackness.round(4)

# %% [markdown]
# On the direct route the deadline has slack and the price 0, and charge has the whole price. The
# engine writes the charge as a share of the battery, so its price is y1 times B. The bounds of a
# time are constraints too: they have a price if the time is at its bound.
#
# ## The KKT conditions
#
# For smooth problems the same conditions bear the names of Karush, Kuhn and Tucker. The point is
# feasible, no multiplier is negative, and all products are zero. The slope of the objective is a
# sum of the slopes of the binding constraints, weighted by the multipliers:
# $(1, 0) = y_1\,(I_\mathrm{hv}, -I_\mathrm{rest}) + y_2\,(1, 1)$.
#
# **Before you run:** what would it mean if no weights gave the slope of the objective?

# %%
slopes = np.array([[I_hv, -I_rest], [1.0, 1.0]])
np.array([price_charge, price_time]) @ slopes

# %% [markdown]
# Then some direction would lengthen the hover without violating a binding constraint. In a linear
# problem these conditions prove the optimum. In a nonconvex one a bad point may satisfy them too,
# as [Convexity and a bad local optimum](10_convexity_and_a_bad_local_optimum.py) shows.
#
# ## The worth of every number
#
# Change a number by a little: the binding constraints still bind, and the hover changes by the
# weighted change of the constraints. So each shadow price is a multiplier times a derivative.
#
# **Before you run:** a pack holds one ampere-second more. Two packs, 5 % of which must be kept: by
# how much does Q grow, and how much hover is that worth?

# %%
by_hand = {
    "deadline_s": price_time,
    "flight_charge_As": -price_charge,
    "capacity_As": price_charge * (1.0 - numbers["min_soc"]) * numbers["packs"],
    "min_soc": -price_charge * battery_As,
    "hover_current_A": -price_charge * hover_s,
    "rest_current_A": price_charge * rest_s,
}
prices, compiled = best.shadow_prices(), program.compile()


def measured(name):
    """Return the change of the hover per unit of a number, by solving again on both sides."""
    step = 1e-4 * numbers[name] or 1e-4  # Zero has no share
    ends = max(numbers[name] - step, 0.0), numbers[name] + step  # No number is below zero
    less, more = (compiled.solve(**{name: end}).objective[0] for end in ends)
    return (more - less) / (ends[1] - ends[0])


pd.DataFrame(
    {
        "by hand": by_hand,
        "shadow price": {name: prices[name].more for name in by_hand},
        "measured": {name: measured(name) for name in by_hand},
    }
).round(6)

# %% [markdown]
# ## Where the proof is not unique
#
# At the deadline at which no time is left for a rest, three constraints meet in one point. The dual
# then has many best weights, a whole edge of its feasible set, and a price has two sides.
#
# **Before you run:** which two prices of time are at the ends of that edge?

# %%
T_kink = Q / I_hv
ends = pd.DataFrame(
    {"y1": [0.0, price_charge], "y2": [1.0, price_time]}, index=["no rest pays", "rest breaks even"]
)
ends["bound [s]"] = Q * ends.y1 + T_kink * ends.y2
ends.round(6)

# %% [markdown]
# Both ends give the same bound. They are the prices of a second less and of a second more:

# %%
kink = compiled.solve(deadline_s=T_kink + numbers["flight_time_s"]).shadow_prices()["deadline_s"]
round(kink.less, 6), round(kink.more, 6)

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
