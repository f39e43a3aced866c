import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

# %% [markdown]
# # Random towns, and how sure their mean is
#
# A result for one town says little about the next. A study draws many towns at random, solves the
# mission in each of them, and states the mean with its confidence.
#
# **Before this lesson:** [A sweep over ten parameters](23_sweep_ten_parameters.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - draw random towns, and solve a mission in all of them at once;
# - state a mean with its confidence interval, and say what it is a mean of;
# - tell from paired differences what a longer deadline brings, with fewer towns;
# - say why one cannot see from a mean that a town has no plan.

# %%
import numpy as np

import optuav

# %% [markdown]
# ## Sixty towns
#
# **Before you run:** four buildings stand somewhere, and no leg may go through one. In how many of
# 60 towns does the drone find no way at all?

# %%
towns = optuav.layouts("paper", 60, "uniform", buildings=4, seed=1)
SHORT_S, LONG_S = 800, 1200
deadlines_s = [SHORT_S, LONG_S]
found = optuav.batch_arrays(towns, {"limits.deadline_s": deadlines_s})
flown = np.isfinite(found["hover_time_s"]).all(axis=1)
hover_s = found["hover_time_s"][flown]
print(f"{flown.sum()} of {len(towns)} towns have a plan")
if flown.sum() < 2:
    raise SystemExit("A spread needs two towns with a plan: take more towns, or more time.")
first = int(flown.argmax())
alone = optuav.solve(towns[first].replace({"limits.deadline_s": LONG_S}))
print(f"the first one: {hover_s[0, 1]:.4f} s, alone {alone.hover_time_s:.4f} s")

# %% [markdown]
# The first of those with a plan:

# %%
optuav.plots.mission_map(alone)

# %% [markdown]
# ## The mean, and how sure it is
#
# By the central limit theorem, the mean of n towns is within 1.96 standard errors of the mean of
# all towns in 95 of 100 such studies.
#
# **Before you run:** how many towns are needed to halve the interval?


# %%
def interval(values: np.ndarray) -> tuple[float, float]:
    """Mean and half of its 95 % confidence interval."""
    return float(values.mean()), 1.96 * float(values.std(ddof=1)) / np.sqrt(len(values))


means = [interval(column) for column in hover_s.T]
for deadline_s, (mean_s, wide_s) in zip(deadlines_s, means, strict=True):
    print(f"deadline {deadline_s} s: hover {mean_s:.1f} ± {wide_s:.1f} s")

# %% [markdown]
# The longer deadline, after more and more towns:

# %%
counts = np.arange(min(5, len(hover_s)), len(hover_s) + 1)
so_far = np.array([interval(hover_s[:count, 1]) for count in counts])
mean_s, wide_s = so_far.T
lines = [
    optuav.plots.Line("upper end", counts, mean_s + wide_s),
    optuav.plots.Line("mean", counts, mean_s),
    optuav.plots.Line("lower end", counts, mean_s - wide_s),
]
words = {"x_label": "towns with a plan", "y_label": "longest hover Δ [s]"}
optuav.plots.curves(lines, title="Mean hover and its 95 % interval", **words)

# %% [markdown]
# Half of the interval takes four times the towns.
#
# ## Differences of the same towns
#
# Each town is solved with both deadlines.
#
# **Before you run:** is the mean of the differences known better than the two means, or worse?

# %%
more_s, sure_s = interval(hover_s[:, 1] - hover_s[:, 0])
apart_s = float(np.hypot(means[0][1], means[1][1]))
print(f"the longer deadline brings {more_s:.1f} ± {sure_s:.1f} s")
print(f"from towns of their own for each deadline it would be ± {apart_s:.1f} s")

# %% [markdown]
# The difference varies less than the hover time itself, so that its mean is known better than the
# two intervals suggest.
#
# The reason is a rule about variances. Two values that are high or low together have a correlation
# $\rho$ near 1, and the variance of their difference is
# $\sigma_1^2 + \sigma_2^2 - 2 \rho \sigma_1 \sigma_2$. Independent values have $\rho = 0$, and
# their variances add up.

# %%
first_s, second_s = hover_s.std(axis=0, ddof=1)
together = float(np.mean(np.prod(hover_s - hover_s.mean(axis=0), axis=1)))
together *= len(hover_s) / (len(hover_s) - 1)  # The covariance ρ σ1 σ2
scatter_s = float(np.sqrt(max(first_s**2 + second_s**2 - 2.0 * together, 0.0)))
print(f"hover times scatter by {first_s:.1f} s and {second_s:.1f} s, ", end="")
print(f"with a correlation of {together / (first_s * second_s):.2f}")
print(f"differences scatter by {scatter_s:.2f} s by the rule, ", end="")
print(f"by {(hover_s[:, 1] - hover_s[:, 0]).std(ddof=1):.2f} s when counted")

# %% [markdown]
# ## Towns without a plan
#
# In some towns a building stands in the way of every route. Their hover time is not 0 but missing,
# and the reason says why. The mean above is one over the other towns: state both numbers.

# %%
reasons = found["reason_words"][found["reason"][~flown].max(axis=1)]
for reason in np.unique(reasons):
    print(f"{(reasons == reason).sum() / len(towns):.1%} of the towns have none: {reason}")

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("24.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
import numpy as np

drawn = optuav.layouts("paper", 20, "uniform", buildings=4, seed=task["seed"])
solved = optuav.batch_arrays(drawn, {"limits.deadline_s": [800, 1200]})["hover_time_s"]
gains_s = np.diff(solved[np.isfinite(solved).all(axis=1)], axis=1)
half_s = 1.96 * gains_s.std(ddof=1) / np.sqrt(len(gains_s))
letter = next(key for key, reason in task.reasons.items() if "that part drops out" in reason)
answer_1 = letter, half_s
### END SOLUTION

# %%
grade = exercises.check("24.1", answer_1, student)
print(grade)
