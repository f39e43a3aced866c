# %% [markdown]
# # Energy or battery?
#
# A planner may count joules or coulombs. The paper's Table II compares three ways to write the
# state of charge; `paper-table2` is the mission that reproduces it.
#
# **Before this lesson:** [A first mission](01_first_mission.py),
# [Grid or continuous?](09_grid_or_continuous.py).
# **Time:** 35 minutes.
#
# **Learning intentions.** After this page you can
#
# - say how the perspectives `battery`, `energy` and `adjusted` differ;
# - reproduce Table II, and find the cells in which it contradicts itself;
# - explain how counting energy at the nominal voltage misjudges a battery.

# %%
import numpy as np
import pandas as pd

import optuav

mission = optuav.load("paper-table2")
PERSPECTIVES = ("battery", "energy", "adjusted")

# %% [markdown]
# ## Table II: the direct path in slots of a second
#
# Δ is the hover time, T the whole mission. The last three columns give the state of charge at the
# end in all three perspectives, whichever of them the plan had to obey. At least 5 % must be left.
#
# **Before you run:** a joule is not a coulomb: which perspective allows the shortest hover? And can
# the state of charge be negative in another one?

# %%
SHORT_S, LONG_S = 800, 1200
plans = {
    (deadline_s, perspective): optuav.solve(
        mission.replace({"limits.deadline_s": deadline_s}),
        "P3",
        perspective=perspective,
        slot_s=1.0,
    )
    for deadline_s in (SHORT_S, LONG_S)
    for perspective in PERSPECTIVES
}
table = pd.DataFrame(
    {
        key: {"Δ [s]": plan.hover_time_s, "T [s]": plan.mission_time_s}
        | {f"{name} [%]": 100.0 * share for name, share in plan.soc.items()}
        for key, plan in plans.items()
    }
).T.rename_axis(index=["deadline [s]", "obeyed"])
table.round(2)

# %%
optuav.plots.bars(
    [
        optuav.plots.Bar(f"deadline {deadline_s} s", perspective, plan.hover_time_s, plan.flyable)
        for (deadline_s, perspective), plan in plans.items()
    ],
    title="The direct path of Table II",
    y_label="hover time Δ [s]",
)

# %% [markdown]
# Hatched plans cannot be flown: the available well runs dry, and none of the three perspectives
# looks at it.
#
# The column Δ agrees with the paper, and so do `battery` and `energy` of Δ = 697 and Δ = 950, to
# the digits that the paper prints. Four of its cells contradict its other rows, and no model can
# match them:
#
# - `energy` of the first and third row is −12.79 %, but the rows 697 and 950 lead to −0.27 %;
# - `adjusted` of Δ = 950 and Δ = 697 is 11.71 % and 33.17 % in one row, and 5.09 % and 28.30 % in
#   another.
#
# The 24.27 % in its first row belongs to Δ = 741; 740.65 gives 24.30 %.
#
# Along the direct path, all perspectives fall on straight lines in Δ. So two rows predict a third:

# %%
long, short, first = plans[LONG_S, "battery"], plans[LONG_S, "energy"], plans[SHORT_S, "battery"]
hovers_s, left = zip(
    *((plan.hover_time_s, plan.soc["energy"]) for plan in (short, long)), strict=True
)
by_line = np.interp(first.hover_time_s, hovers_s, left)
pd.Series({"by the line": by_line, "by the plan": first.soc["energy"]}, name="energy").to_frame()

# %% [markdown]
# ## Volts
#
# The energy perspective compares $E_0 = B e_\mathrm{nom}$ with the joules that were drawn.
#
# **Before you run:** the nominal voltage is 11.1 V, and the hover draws its current at 14.3 V. Is a
# plan that counts joules too careful, or too bold? How much charge is left when all energy is
# counted as used?

# %%
loads, nominal_V = mission.flight, mission.battery.nominal_voltage_V
voltages = pd.DataFrame(
    {
        "voltage [V]": {
            "hover": loads.hover_power_W / loads.hover_current_A,
            "flight": loads.flight_power_W / loads.flight_current_A,
            "charge": loads.charge_power_W / loads.charge_current_A,
        }
    }
)
voltages["over nominal"] = voltages["voltage [V]"] / nominal_V
voltages

# %% [markdown]
# A coulomb of hovering counts as 1.29 coulombs, so counting energy at the nominal voltage is too
# careful. The energy plan lands with this share of the charge to spare, and hovers that many
# seconds less:

# %%
short.soc["battery"] - mission.limits.min_soc, long.hover_time_s - short.hover_time_s

# %% [markdown]
# ## The correction
#
# `adjusted` measures flight and hover against $E_1$ and $E_2$, the energies that the battery holds
# at the voltages of flight and of hover. With exact voltages it equals the battery perspective. The
# paper's $E_1$ uses a rounded 15.4 V. If the mission leaves out $E_1$ and $E_2$, optuav derives
# them from the loads. The only difference left is that the laser charges slightly above the nominal
# voltage.
#
# **Before you run:** with derived energies, by how many seconds do the two answers differ?

# %%
exact = mission.replace({"battery.flight_energy_J": None, "battery.hover_energy_J": None})
answers = pd.DataFrame(
    {
        energies: [
            optuav.solve(site, perspective=name).hover_time_s for name in ("battery", "adjusted")
        ]
        for energies, site in {"the paper's [s]": mission, "derived [s]": exact}.items()
    },
    index=["battery", "adjusted"],
)
answers

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("A1.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# Less power lets energy hover longer: halve an interval.
low_W, high_W = 300.0, 1400.0
by_charge_s = optuav.solve(task.mission, "P3", perspective="battery").hover_time_s
while high_W - low_W > 0.01:
    power_W = 0.5 * (low_W + high_W)
    changed = task.mission.replace({"flight.hover_power_W": power_W})
    is_longer = optuav.solve(changed, "P3", perspective="energy").hover_time_s > by_charge_s
    low_W, high_W = (power_W, high_W) if is_longer else (low_W, power_W)
letter = next(key for key, reason in task.reasons.items() if "above the nominal voltage" in reason)
answer_1 = letter, low_W
### END SOLUTION

# %%
grade = exercises.check("A1.1", answer_1, student)
print(grade)
