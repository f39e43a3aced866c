# %% [markdown]
# # Your own drone
#
# A datasheet states a mass, a battery and a flight time. That is enough for a mission: its capacity
# divided by its flight time is a current. This page takes you from ten numbers to a plan, and asks
# whether a laser is worth the weight of its receiver.
#
# **Before this lesson:** [A first mission](01_first_mission.py).
# **Time:** 30 minutes.
#
# **Learning intentions.** After this page you can
#
# - turn a flight time into a current and a power, and scale both with the payload;
# - say which numbers of a mission come from the datasheet, and which are assumed;
# - compare the weight of a receiver with the hover that its laser gives;
# - say how much received power keeps a drone in the air without end.

# %%
import optuav

sheet = optuav.Datasheet(
    mass_kg=3.77,
    packs=2,
    cells=7,
    capacity_mAh=5880,
    hover_min=36,
    cruise_min=41,
    cruise_speed_m_s=10,
    reserve_percent=20,
    payload_kg=0.25,
    laser_power_W=5000,
)
mission = sheet.mission()
mission

# %% [markdown]
# **Before you run:** the datasheet promises 36 minutes of hover from full to empty, without
# payload. This drone carries 250 g and must keep 20 %, but a laser shines at it. Guess its hover
# time.

# %%
plan = optuav.solve(mission)
plan

# %% [markdown]
# The drone hovers longer than the datasheet promises: the laser gives more than half of the hover
# current. The deadline of 3000 s ends the hover, not the charge.
#
# ## What a flight time says
#
# Two packs of 5.88 Ah in 36 minutes are 19.6 A, without payload. Rotors push air down: lifting a
# weight $W$ takes a power proportional to $W^{1.5}$, so the current grows faster than the mass.
#
# **Before you run:** the payload adds 6.6 % to the mass. How many percent does it add to the
# current?

# %%
bare_A = 2 * 5.88 / (36 / 60)
loaded_A = bare_A * (1 + 0.25 / 3.77) ** 1.5
bare_A, loaded_A, 100 * (loaded_A / bare_A - 1)

# %% [markdown]
# The mission has the same current:

# %%
mission.flight.hover_current_A, mission.flight.hover_power_W

# %% [markdown]
# The datasheet says nothing about the other numbers. Places, link and acceleration are those of the
# shipped mission `matrice350`. The wells of the battery are those of lithium pouch cells
# (`battery="lipo"`). `optuav new FILE --from regimes` writes a file in which you can replace each,
# with the assumptions at its head. These tables are
# the same in both missions; `flight` and `battery` also hold numbers of the datasheet, and differ:

# %%
shipped = optuav.load("matrice350")
tables = ("route", "link", "wind", "buildings", "flight", "battery")
same = [name for name in tables if getattr(mission, name) == getattr(shipped, name)]
same

# %% [markdown]
# ## Is the laser worth its receiver?
#
# Compare with the drone without laser and receiver. A light receiver pays; a heavy one costs more
# hover than the laser gives. In between is the mass at which the two are equal.
#
# **Before you run:** is that mass 200 g, 1 kg, or 5 kg?


# %%
def hover_s(payload_kg: float, laser_power_W: float) -> float:
    changed = sheet.model_copy(update={"payload_kg": payload_kg, "laser_power_W": laser_power_W})
    patient = changed.mission().replace({"limits.deadline_s": 7200})
    return optuav.solve(patient, "P3").hover_time_s


without_s = hover_s(0.0, 0.0)
low_kg, high_kg = 0.0, 10.0
while high_kg - low_kg > 1e-6:
    middle_kg = 0.5 * (low_kg + high_kg)
    worth = hover_s(middle_kg, 5000) > without_s
    low_kg, high_kg = (middle_kg, high_kg) if worth else (low_kg, middle_kg)
low_kg

# %% [markdown]
# The receiver may weigh about a third as much as the drone itself. The curves cross at that mass:

# %%
masses_kg = [0.25 * k for k in range(25)]
optuav.plots.curves(
    [
        optuav.plots.Line("with laser", masses_kg, [hover_s(kg, 5000) / 60 for kg in masses_kg]),
        optuav.plots.Line("without laser and receiver", masses_kg, [without_s / 60] * 25),
    ],
    title="Is the laser worth its receiver?",
    x_label="mass of the receiver [kg]",
    y_label="longest hover [min]",
    marks=[optuav.plots.Mark(low_kg, "equal")],
)

# %% [markdown]
# ## For ever
#
# If the received power equals the power of the hover, the net hover current is 0, and only the
# deadline ends the flight. The receiver then has to feed the motors directly: it delivers more
# current than the charger of the packs takes. Even more power would charge the packs past full. A
# charger prevents that, but this section counts only charge (the perspective `battery`).
#
# **Before you run:** with 90 % of the power that carries the drone, the battery has to give the
# remaining tenth. From 90 % to 99 %, does the hover become a tenth longer, twice as long, or ten
# times as long?

# %%
direct = mission.replace({"battery.charge_current_A": 30, "limits.deadline_s": 1e6})
received_W = optuav.graph(direct).nodes["hover"]["received_power_W"]
needed_W = direct.laser.power_W * direct.flight.hover_power_W / received_W


def hours(share: float) -> float:
    """Return the hover [h] with a share of the laser power that carries the drone."""
    strong = direct.replace({"laser.power_W": share * needed_W})
    return optuav.solve(strong, "P3", perspective="battery").hover_time_s / 3600


by_share = {share: hours(share) for share in (0.9, 0.99, 1.01)}
by_share

# %% [markdown]
# From 90 % to 99 % the battery gives a tenth of what it gave before, so it lasts ten times as long.
# Above 100 % only the deadline ends the hover. The laser would have to draw this power [W], where
# the datasheet has 5000 W:

# %%
needed_W

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("02.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
# The larger the current, the shorter the hover: halve an interval of currents.
stated_A = task.mission.flight.hover_current_A
longest_s = optuav.solve(task.mission, "P3").hover_time_s
low, high = 0.0, 0.5
while high - low > 1e-5:
    more = 0.5 * (low + high)
    hungry = task.mission.replace({"flight.hover_current_A": stated_A * (1 + more)})
    hover_s = optuav.solve(hungry, "P3").hover_time_s
    low, high = (more, high) if hover_s > (1 - task["less"]) * longest_s else (low, more)
answer_1 = 100 * low
### END SOLUTION

# %%
grade = exercises.check("02.1", answer_1, student)
print(grade)
