# %% [markdown]
# # (P4): the plane and shadow prices
#
# With a rest there are two unknowns, Δ and T', and you can draw the problem. The optimum lies in a
# corner, where two lines meet. When a number changes, the corner moves: that is the number's price.
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
import pandas as pd

import optuav

mission = optuav.load("paper")
program = optuav.formulate(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
program

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
numbers = program.parts[0].model.row(0)
battery_As = numbers["packs"] * numbers["capacity_As"]
usable_As = (1.0 - numbers["min_soc"]) * battery_As - numbers["flight_charge_As"]
left_s = numbers["deadline_s"] - numbers["flight_time_s"]
lines = np.array([[numbers["hover_current_A"], -numbers["rest_current_A"]], [1.0, 1.0]])
corner = np.linalg.solve(lines, [usable_As, left_s])
corner

# %% [markdown]
# The engine finds the same point:

# %%
compiled = program.compile()
best = compiled.solve()
best.point(0)

# %%
optuav.plots.plane(program.parts[0].model, numbers, [program.solve()])

# %% [markdown]
# ## The proof
#
# Multiply the charge line by $y_1$ and the deadline by $y_2$, so that the sum reads Δ ≤ a number.
# No feasible point can exceed the number, and the corner attains it. That is linear programming
# duality, the subject of [the next lesson](08_duality_and_kkt.py).
#
# **Before you run:** which $y_1$ and $y_2$ make $T'$ vanish from the sum, and leave one $\Delta$?

# %%
y1, y2 = np.linalg.solve(lines.T, [1.0, 0.0]).tolist()
bound_s = float(y1 * usable_As + y2 * left_s)
{"y1": y1, "y2": y2, "bound [s]": bound_s}

# %% [markdown]
# The engine states the charge as a share of the battery, so its multiplier is $y_1 B$:

# %%
weights = best.multipliers_at(0)
weights, y1 * battery_As

# %% [markdown]
# ## Shadow prices
#
# A shadow price is the hover, in seconds, that one more unit of a number gives: per second of
# deadline, per ampere of charge current. Its sign is the sign of the change: more hover current
# costs hover. To test a price, change the number a little and solve again, on both sides. Packs are
# whole: take one more and one less. The price is the same as long as the same two lines meet.
#
# **Before you run:** a second of hover costs 8.8 s of rest. How much hover does one second more of
# deadline give, and how much do ten minutes more give?

# %%
prices = best.shadow_prices()


def measured(name):
    """Return the change of the hover per unit of a number, by solving again on both sides."""
    step = 1.0 if name == "packs" else 1e-4 * numbers[name] or 1e-4  # Zero has no share
    least = 1.0 if name == "packs" else 0.0
    ends = max(numbers[name] - step, least), numbers[name] + step
    down, up = (compiled.solve(**{name: end}).objective[0] for end in ends)
    return (up - down) / (ends[1] - ends[0])


pd.DataFrame(
    {
        "price [s per unit]": {name: price.more for name, price in prices.items()},
        "measured": {name: measured(name) for name in prices},
    }
).round(6)

# %% [markdown]
# Of ten minutes more, so many seconds are hover; the drone rests for the others.

# %%
hover_s = 600.0 * prices["deadline_s"].more
hover_s, 600.0 - hover_s

# %% [markdown]
# ## A kink
#
# Shorten the deadline until no time is left for a rest. There three lines meet: charge, deadline,
# and $T' \ge 0$.
#
# **Before you run:** how much hover does a second less of deadline cost there? Does a second more
# give as much?

# %%
kink_s = numbers["flight_time_s"] + usable_As / numbers["hover_current_A"]
tight = compiled.solve(deadline_s=kink_s)
price = tight.shadow_prices()["deadline_s"]
hovers = [compiled.solve(deadline_s=kink_s + step).objective[0] for step in (-1.0, 0.0, 1.0)]
pd.DataFrame(
    {"price": [price.less, price.more], "measured": np.diff(hovers)},
    index=["a second less", "a second more"],
).round(4)

# %% [markdown]
# A second less costs a whole second of hover. A second more gives only a tenth of one, because the
# drone needs most of it to rest. Such a price has two sides, and no single multiplier. The longest
# hover over the deadline has a corner there:

# %%
deadlines_s = np.sort([*np.linspace(300.0, 1800.0, 151), kink_s])
longest_s = [compiled.solve(deadline_s=deadline_s).objective[0] for deadline_s in deadlines_s]
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
