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
# - use paired differences to measure an effect with fewer towns;
# - say what a mean hides if some towns have no plan.

# %%
import numpy as np
import pandas as pd

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
arrays = optuav.batch_arrays(towns, {"limits.deadline_s": deadlines_s})
flown = np.isfinite(arrays["hover_time_s"]).all(axis=1)
hover_s = arrays["hover_time_s"][flown]
{"towns": len(towns), "with a plan": int(flown.sum())}

# %% [markdown]
# If buildings stand in the way of every route, the hover time is not 0 but missing, and the reason
# says why. All means below are over the other towns: state both numbers.

# %%
reasons = arrays["reason_words"][arrays["reason"][~flown].max(axis=1)]
pd.Series(reasons).value_counts().to_frame()

# %% [markdown]
# The first town with a plan:

# %%
first = int(flown.argmax())
single = optuav.solve(towns[first].replace({"limits.deadline_s": LONG_S}))
optuav.plots.mission_map(single)

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


means = pd.DataFrame(
    [interval(column) for column in hover_s.T],
    columns=["mean hover [s]", "± [s]"],
    index=pd.Index(deadlines_s, name="deadline [s]"),
)
means

# %%
counts = np.arange(min(5, len(hover_s)), len(hover_s) + 1)
so_far = np.array([interval(hover_s[:count, 1]) for count in counts])
mean_s, wide_s = so_far.T
lines = [
    optuav.plots.Line("upper end", counts, mean_s + wide_s),
    optuav.plots.Line("mean", counts, mean_s),
    optuav.plots.Line("lower end", counts, mean_s - wide_s),
]
optuav.plots.curves(
    lines,
    title="Mean hover with the longer deadline, and its 95 % interval",
    x_label="towns with a plan",
    y_label="longest hover Δ [s]",
)

# %% [markdown]
# Half of the interval takes four times the towns.
#
# ## Differences of the same towns
#
# Each town is solved with both deadlines.
#
# **Before you run:** is the mean of the differences known better than the two means, or worse?

# %%
gain_s = hover_s[:, 1] - hover_s[:, 0]
apart_s = float(np.hypot(*means["± [s]"]))
gains = pd.DataFrame(
    {
        "same towns": interval(gain_s),
        "different towns for each deadline": (gain_s.mean(), apart_s),
    },
    index=["mean gain [s]", "± [s]"],
)
gains.T

# %% [markdown]
# The difference varies less than the hover time itself, so its mean is known better than the two
# intervals suggest.
#
# The reason is a rule about variances. Two values that are high or low together have a correlation
# $\rho$ near 1, and the variance of their difference is
# $\sigma_1^2 + \sigma_2^2 - 2 \rho \sigma_1 \sigma_2$. Independent values have $\rho = 0$, and
# their variances add up.

# %%
scatter_s, correlation = hover_s.std(axis=0, ddof=1), np.corrcoef(hover_s.T)[0, 1]
by_rule_s = np.sqrt(scatter_s @ scatter_s - 2.0 * correlation * scatter_s.prod())
pd.Series(
    {
        "scatter with the short deadline [s]": scatter_s[0],
        "scatter with the long deadline [s]": scatter_s[1],
        "correlation": correlation,
        "scatter of the difference, by the rule [s]": by_rule_s,
        "scatter of the difference, counted [s]": gain_s.std(ddof=1),
    },
    name="all towns with a plan",
).to_frame()

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
