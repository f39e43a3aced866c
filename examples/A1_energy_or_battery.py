import sys

if hasattr(sys.stdout, "reconfigure"):
    sys.stdout.reconfigure(errors="replace")  # a console without Greek letters shows ? instead

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
# - explain why counting energy at the nominal voltage is too careful.

# %%
import optuav

mission = optuav.load("paper-table2")
if mission.flight.model != "regimes":
    raise SystemExit("This mission states rotors and no loads: take one that states its loads.")
PERSPECTIVES = ("battery", "energy", "adjusted")

# %% [markdown]
# ## Table II: the direct path in slots of a second
#
# Δ is the hover time, T the whole mission; the state of charge at the end is given in all three
# perspectives, whichever of them the plan had to obey. At least 5 % must be left.
#
# **Before you run:** a joule is not a coulomb: which perspective allows the shortest hover? And can
# the state of charge be negative in another one?

# %%
plans = {}
SHORT_S, LONG_S = 800, 1200
print("deadline  obeyed         Δ        T        battery    energy  adjusted")
for deadline_s in (SHORT_S, LONG_S):
    for perspective in PERSPECTIVES:
        plan = optuav.solve(
            mission.replace({"limits.deadline_s": deadline_s}),
            "P3",
            perspective=perspective,
            slot_s=1.0,
        )
        if not plan:
            raise SystemExit(f"With a deadline of {deadline_s} s there is no plan: take more time.")
        plans[deadline_s, perspective] = plan
        print(
            f"{deadline_s:6} s  {perspective:<9}{plan.hover_time_s:8.2f} {plan.mission_time_s:8.2f}"
            "     " + "".join(f"{100 * share:8.2f} %" for share in plan.soc.values())
        )

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
# Hatched plans cannot be flown: the available well runs dry, which none of the three looks at.
#
# The column Δ agrees with the paper, and so do `battery` and `energy` of Δ = 697 and Δ = 950, to
# the digits it prints. Four of its cells contradict its other rows, and no model can match them:
# `energy` of the first and third row, −12.79 %, where the rows 697 and 950 lead to −0.27 %, and
# `adjusted` of Δ = 950 and Δ = 697, 11.71 % and 33.17 % in one row and 5.09 % and 28.30 % in
# another. Its 24.27 % in the first row belongs to Δ = 741; 740.65 gives 24.30 %.
#
# Along the direct path, all perspectives fall on straight lines in Δ:

# %%
long, short, first = plans[LONG_S, "battery"], plans[LONG_S, "energy"], plans[SHORT_S, "battery"]
if long.hover_time_s > short.hover_time_s:
    slope = (long.soc["energy"] - short.soc["energy"]) / (long.hover_time_s - short.hover_time_s)
    by_line = short.soc["energy"] + slope * (first.hover_time_s - short.hover_time_s)
    print(f"energy at Δ = {first.hover_time_s:.2f} s, by a line through two rows: {by_line:.2%}")
else:
    print("The deadline ends both hovers at the same time: one point makes no line.")

# %% [markdown]
# ## Why the energy perspective is too careful
#
# It compares $E_0 = B e_\mathrm{nom}$ with joules that were drawn at a higher voltage: a coulomb of
# hovering counts as more than one, by the ratio of the hover voltage to the nominal one.
#
# **Before you run:** the nominal voltage is 11.1 V and the hover takes 14.3 V. How much charge is
# left when all energy is counted as used?

# %%
given, loads = mission.battery, mission.flight
hover_V = loads.hover_power_W / loads.hover_current_A
flight_V = loads.flight_power_W / loads.flight_current_A
print(f"hover {hover_V:.3f} V, flight {flight_V:.2f} V, nominal {given.nominal_voltage_V} V")
print(f"overcounted: hover {hover_V / given.nominal_voltage_V:.3f} times, ", end="")
print(f"flight {flight_V / given.nominal_voltage_V:.3f} times")
unused = short.soc["battery"] - mission.limits.min_soc
print(f"the energy plan lands with {unused:.1%} of the charge to spare,")
print(f"and hovers {long.hover_time_s - short.hover_time_s:.0f} s less")

# %% [markdown]
# ## The correction
#
# `adjusted` measures flight and hover against $E_1$ and $E_2$, the energies that the battery holds
# at the voltages of flight and of hover. With exact voltages it equals the battery perspective. The
# paper's $E_1$ uses a rounded 15.4 V. If the mission leaves out $E_1$ and $E_2$, they are derived
# from the loads, and the only difference left is that the laser charges slightly above the nominal
# voltage.
#
# **Before you run:** with derived energies, by how many seconds do the two answers differ?

# %%
exact = mission.replace({"battery.flight_energy_J": None, "battery.hover_energy_J": None})
same = [optuav.solve(exact, perspective=name).hover_time_s for name in ("battery", "adjusted")]
stated = [optuav.solve(mission, perspective=name).hover_time_s for name in ("battery", "adjusted")]
print(f"the paper's energies: battery {stated[0]:.3f} s, adjusted {stated[1]:.3f} s")
print(f"derived energies: battery {same[0]:.3f} s, adjusted {same[1]:.3f} s")
print(f"charging voltage {loads.charge_power_W / loads.charge_current_A:.4f} V")

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
