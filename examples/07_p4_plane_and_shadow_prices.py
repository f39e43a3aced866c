import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # (P4): the plane and shadow prices
#
# With a rest there are two unknowns, Δ and T', and the problem can be drawn. The optimum lies in a
# corner, where two lines meet; how the corner moves when a number changes is that number's price.
#
# **Before this lesson:** [Hover without a rest](06_hover_without_a_rest.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - find the optimum of (P4) as a corner of the (Δ, T') plane;
# - prove it with two multipliers, by adding two inequalities;
# - read shadow prices with their sign and unit, and verify them by solving again;
# - say where a price has two sides, and how to use it there.

# %%
import numpy as np

import optuav

mission = optuav.load("paper")
program = optuav.formulate(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
compiled = program.compile()
best = compiled.solve()
print(program)

# %% [markdown]
# ## Two lines
#
# $$
# \begin{aligned}
# I_\mathrm{hv} \Delta - I_\mathrm{rest} T' &\le \text{usable charge}\\
# \Delta + T' &\le \text{time left}
# \end{aligned}
# $$
#
# More rest lifts the first line and presses against the second; the best $\Delta$ is where they
# meet.
#
# **Before you run:** with 59 334 A s of usable charge, 87.9 A of hovering, 10 A of rest and 1112 s
# of time left, solve the two equations by hand.

# %%
given = program.parts[0].model.row(0)
if "flight_charge_As" not in given:
    raise SystemExit("This page counts charge, as the perspective battery does.")
battery_As = given["packs"] * given["capacity_As"]
usable_As = (1.0 - given["min_soc"]) * battery_As - given["flight_charge_As"]
left_s = given["deadline_s"] - given["flight_time_s"]
lines = np.array([[given["hover_current_A"], -given["rest_current_A"]], [1.0, 1.0]])
corner = np.linalg.solve(lines, [usable_As, left_s])
print(f"the lines meet at Δ = {corner[0]:.4f} s, T' = {corner[1]:.4f} s")
print("the engine says", {name: round(value, 4) for name, value in best.point(0).items()})

# %%
optuav.plots.plane(program.parts[0].model, given, [program.solve()])

# %% [markdown]
# ## The proof
#
# Multiply the charge line by $y_1$ and the deadline by $y_2$, so that the sum reads Δ ≤ a number.
# No feasible point can exceed it, and the corner attains it: that is linear programming duality,
# which [the next lesson](08_duality_and_kkt.py) takes further.
#
# **Before you run:** which $y_1$ and $y_2$ make $T'$ vanish from the sum, and leave one $\Delta$?

# %%
y1, y2 = np.linalg.solve(lines.T, [1.0, 0.0])
bound_s = y1 * usable_As + y2 * left_s
print(f"{y1:.6f} × charge + {y2:.6f} × deadline:  Δ ≤ {bound_s:.4f} s")
weights = best.multipliers_at(0)
print({label: round(weight, 4) for label, weight in weights.items()})
print(f"(P4.a) is charge over B, so its multiplier is y1·B = {y1 * battery_As:.4f}")

# %% [markdown]
# ## Shadow prices
#
# A shadow price is what one more unit of a number brings, in seconds of hover: per second of
# deadline, per ampere of charge current. Its sign is that of the change: more hover current costs
# hover. To test a price, change the number a little and solve again, on both sides. Packs are
# whole: take one more and one less, as the price is the same as long as the same two lines meet.
#
# **Before you run:** a second of hover costs 8.8 s of rest. How much hover does one second more of
# deadline bring, and how much do ten minutes more bring?

# %%
prices = best.shadow_prices()
for name, price in prices.items():
    step = 1.0 if name == "packs" else 1e-4 * given[name] or 1e-4  # Of a zero, no share
    least = 1.0 if name == "packs" else 0.0
    ends = max(given[name] - step, least), given[name] + step
    down, up = (compiled.solve(**{name: end}).objective[0] for end in ends)
    measured = (up - down) / (ends[1] - ends[0])
    print(f"{name:<17} {price.more:12.6f} s per unit, measured {measured:12.6f}")

hover_s = 600.0 * prices["deadline_s"].more
print(f"of ten minutes more, {hover_s:.2f} s are hover, {600.0 - hover_s:.2f} s rest")

# %% [markdown]
# ## A kink
#
# Shorten the deadline until no time is left for a rest. There three lines meet: charge, deadline,
# and $T' \ge 0$.
#
# **Before you run:** there, what does a second less of deadline cost? Is that what a second more
# brings?

# %%
kink_s = given["flight_time_s"] + usable_As / given["hover_current_A"]
if kink_s <= given["flight_time_s"]:
    raise SystemExit("The flights take all charge, and there is no kink.")
tight = compiled.solve(deadline_s=kink_s)
price = tight.shadow_prices()["deadline_s"]
hovers = [compiled.solve(deadline_s=kink_s + step).objective[0] for step in (-1.0, 0.0, 1.0)]
print(f"at {kink_s:.2f} s: a second less {price.less:.4f}, a second more {price.more:.4f}")
print("measured:", *np.diff(hovers).round(4))

# %% [markdown]
# A second less costs a whole second of hover; a second more brings only a tenth of one, because
# most of it is needed to rest. Such a price has two sides, and no single multiplier. In the longest
# hover over the deadline it is a corner:

# %%
deadlines_s = np.sort([*np.linspace(300.0, 1800.0, 151), kink_s])
longest_s = [compiled.solve(deadline_s=each).objective[0] for each in deadlines_s]
optuav.plots.curves(
    [optuav.plots.Line("longest hover with a rest on b1", deadlines_s, longest_s)],
    title="What time is worth",
    x_label="deadline [s]",
    y_label="longest hover Δ [s]",
    marks=[optuav.plots.Mark(kink_s, "the kink")],
)

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("07.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# y1 (I_hv, −I_rest) + y2 (1, 1) = (1, 0): from the second, y2 = I_rest y1.
from fractions import Fraction

charge = Fraction(1, task["hover_A"] + task["rest_A"])
answer_1 = {"charge": charge, "deadline": task["rest_A"] * charge}
### END SOLUTION

# %%
grade = exercises.check("07.1", answer_1, student)
print(grade)

# %%
task = exercises.task("07.2", student)
print(task)

# %%
answer_2 = ...
### BEGIN SOLUTION
# With y1 = 0 the deadline alone bounds Δ, and the bound of T' takes the rest out.
charge = Fraction(1, task["hover_A"] + task["rest_A"])
least = {"charge": charge, "deadline": task["rest_A"] * charge}
letter = next(key for key, reason in task.reasons.items() if "earn its own charge" in reason)
answer_2 = letter, [least, {"deadline": 1, "bounds of T'": 1}]
### END SOLUTION

# %%
grade = exercises.check("07.2", answer_2, student)
print(grade)
