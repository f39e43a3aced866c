# %% [markdown]
# # How fast to fly?
#
# A fast flight saves time. Does a slow flight save charge? Two speeds have names, best endurance
# and best range. This lesson finds out when to fly at which speed.
#
# **Before this lesson:** [(P4): the plane and shadow prices](07_p4_plane_and_shadow_prices.py),
# [One leg, six stages](21_one_leg.py).
# **Time:** 40 minutes.
#
# **Learning intentions.** After this page you can
#
# - say what drag does to a flight at full power;
# - read a curve of power over speed, and find best endurance and best range in it;
# - choose a speed by what binds, the deadline or the charge;
# - say what a second of flight is worth.

# %%
import numpy as np
import pandas as pd

import optuav

Line, Mark = optuav.plots.Line, optuav.plots.Mark
ideal = optuav.load("paper")
optuav.plots.leg(ideal, "origin", "hover")

# %% [markdown]
# ## A speed that no drone has
#
# The paper accelerates for half of the way and brakes for the other half. On 2.7 km the drone gets
# to 154.9 m/s, or 558 km/h: nothing holds it back, since the model has no drag. `paper-drag` is the
# same mission with a drag area of 0.03 m², which suits a quadrotor of this size.
#
# **Before you run:** drag grows with the square of the speed. How fast is the same drone now? What
# happens to its hover of 578 s, if the leg takes longer at nearly the same current?

# %%
real = optuav.load("paper-drag")
optuav.plots.leg(real, "origin", "hover")

# %%
plans = {
    name: optuav.solve(mission, "P3")
    for name, mission in {"paper": ideal, "paper-drag": real}.items()
}
plans["paper-drag"]

# %%
lost_s = plans["paper"].hover_time_s - plans["paper-drag"].hover_time_s
flown_s = plans["paper-drag"].flight_time_s - plans["paper"].flight_time_s
pd.Series({"hover lost": lost_s, "flight longer by": flown_s}, name="[s]").round(2).to_frame()

# %% [markdown]
# The drone needs three times as long for its way, and loses more hover than the flight takes
# longer: it flies at full power, only to push air aside. That cannot be a good way to fly.
#
# ## Power over speed
#
# `relay-today` has rotors of another model: the power depends on the speed, and the plan may choose
# the speed.
#
# **Before you run:** does it take more power to hover or to fly at 10 m/s? Draw power over speed
# before you look.

# %%
relay = optuav.load("relay-today")
curve = optuav.power_curve(relay)
curve.plot()

# %% [markdown]
# A rotor that moves meets more air, and pushes it down less: flight at a moderate speed takes less
# power than hover. Faster than that, the drag of the fuselage wins, with the cube of the speed.
#
# The minimum of the curve is the speed of *best endurance*: the drone stays in the air for longest.
# A way of one metre takes $P(V)/V$. This is the slope of the line from the origin to the curve, and
# it is least where that line is a tangent: *best range*.
#
# **Before you run:** is the best range faster or slower than best endurance? By how much would you
# guess?

# %%
speeds_m_s = curve.speeds_m_s[20:]
per_metre_J = curve.rotor_power_W[20:] / speeds_m_s
optuav.plots.curves(
    [Line("energy per metre", speeds_m_s, per_metre_J)],
    title="What a metre costs",
    x_label="air speed V [m/s]",
    y_label="energy per metre P/V [J/m]",
    marks=[
        Mark(curve.best_endurance_m_s, "best endurance"),
        Mark(curve.best_range_m_s, "best range"),
    ],
)

# %% [markdown]
# ## The speed of a mission
#
# The device is now 4 km away, so that flying matters. `flight.cruise_speed_m_s` sets the speed of
# all legs. Two missions differ only in their deadline: two hours, or 25 minutes.
#
# **Before you run:** with two hours, charge is scarce. With 25 minutes, time is. Which speed is
# best for each of them? Is it ever best endurance?

# %%
far = relay.replace({"link.device_m": [600, 4450, 0], "route.hover_m": [600, 4450, 80]})
LONG_S, SHORT_S = 7200.0, 1500.0
cruise_m_s = np.linspace(10.0, 23.0, 53)
arrays = optuav.batch_arrays(
    far,
    {"limits.deadline_s": [LONG_S, SHORT_S], "flight.cruise_speed_m_s": cruise_m_s},
    "P3",
    perspective="battery",
)
hover_s = arrays["hover_time_s"].reshape(2, -1)
best_m_s = cruise_m_s[np.nanargmax(hover_s, axis=1)]
optuav.plots.curves(
    [
        Line(f"deadline {deadline_s / 60:g} min", cruise_m_s, row)
        for deadline_s, row in zip((LONG_S, SHORT_S), hover_s, strict=True)
    ],
    title="Longest hover by the speed of the flight",
    x_label="cruise speed [m/s]",
    y_label="longest hover Δ [s]",
    marks=[
        Mark(curve.best_endurance_m_s, "best endurance"),
        Mark(curve.best_range_m_s, "best range"),
    ],
)

# %% [markdown]
# With time to spare, the best speed is the speed of least charge per metre: near best range, and a
# little below it, because the drone also has to reach that speed. With a deadline, flying faster
# pays until charge ends the hover as well. There the curve has a kink, and both limits bind.
#
# Best endurance is never the best speed for a leg: it keeps a drone in the air, and does not get it
# anywhere.
#
# ## What a second is worth
#
# The price of the deadline says what one more second of time is worth, in seconds of hover.
#
# **Before you run:** at best range, what is a second worth with two hours, and what with 25
# minutes? Which of the two would buy a faster flight?

# %%
prices = {
    deadline_s: optuav.formulate(
        far.replace({"limits.deadline_s": deadline_s}), optuav.P3(), perspective="battery"
    ).shadow_prices()["deadline_s"]
    for deadline_s in (LONG_S, SHORT_S)
}
pd.Series(
    {deadline_s: price.more for deadline_s, price in prices.items()},
    name="hover for one more second, by the deadline in s",
).to_frame()

# %% [markdown]
# If the deadline binds, a second that the flight saves is a second of hover. If charge binds, it is
# worth nothing by itself. So a rule for all cases: minimise $t \, (I(V) + \mu)$ for each leg, where
# $I$ is the current at the speed $V$, $t$ the time of the leg, and $\mu$ the price of a second in
# amperes. For $\mu = 0$ this is best range; the dearer a second is, the faster the leg. If only
# the deadline binds, the best speed is the largest one.
#
# The rules of `flight.speed` are three fixed answers:

# %%
rules = ("best-endurance", "best-range", "max")
by_rule = {
    rule: [
        optuav.solve(
            far.replace({"flight.speed": rule, "limits.deadline_s": deadline_s}),
            "P3",
            perspective="battery",
        ).hover_time_s
        for deadline_s in (LONG_S, SHORT_S)
    ]
    for rule in rules
}
pd.DataFrame(by_rule, index=["deadline of two hours", "deadline of 25 minutes"]).T

# %% [markdown]
# Take best range if charge is scarce, and the largest speed if time is. The right rule gains
# minutes over the wrong one.
#
# `speed="free"` leaves the speed of each leg to the solver. In this perspective it looks for the
# one price $\mu$ that fits all legs, and proves that no other speeds hover longer.
#
# **Before you run:** how much longer than the better rule will the drone hover, with two hours and
# with 25 minutes? Where does each free speed lie?

# %%
free = [
    optuav.solve(
        far.replace({"limits.deadline_s": deadline_s}),
        optuav.P3(speed="free"),
        perspective="battery",
    )
    for deadline_s in (LONG_S, SHORT_S)
]
pd.DataFrame(
    {
        "longest hover [s]": [plan.hover_time_s for plan in free],
        "gain over the better rule [s]": [
            plan.hover_time_s - max(hovers[number] for hovers in by_rule.values())
            for number, plan in enumerate(free)
        ],
        "speed of the first leg [m/s]": [plan.speeds_m_s[0][0] for plan in free],
    },
    index=["deadline of two hours", "deadline of 25 minutes"],
).T

# %% [markdown]
# With two hours the price is zero and best range is all but right. With 25 minutes both limits
# bind, the best speed lies between the rules, and it gains 20 seconds: the rule matters most, and
# its refinement matters a little.
#
# ## Hover in the wind
#
# **Before you run:** a wind of 10 m/s blows. Does the drone need more power to hover, or less?

# %%
windy = optuav.power_curve(relay.replace({"wind.velocity_m_s": [10, 0, 0]}))
pd.Series(
    {"calm": curve.hover_power_W, "windy": windy.hover_power_W}, name="power to hover [W]"
).to_frame()

# %% [markdown]
# To the rotors, hovering in wind is flying, which takes less power than hovering in calm air. The
# wind costs charge on the legs: there and back no longer take the same.

# %% [markdown]
# ## Exercises
#
# Everybody gets numbers of their own: write your matriculation number, or any name, between the
# quotation marks, and replace each `...` by your answer. A wrong answer gets a hint.

# %%
from optuav import exercises

student = ""
task = exercises.task("29.1", student)
print(task)

# %%
answer_1 = ...
### BEGIN SOLUTION
import numpy as np

speeds_m_s = np.linspace(10, 23, 1301)
hovers = optuav.batch_arrays(task.mission, {"flight.cruise_speed_m_s": speeds_m_s}, "P3")
answer_1 = float(speeds_m_s[np.nanargmax(hovers["hover_time_s"].ravel())])
### END SOLUTION

# %%
grade = exercises.check("29.1", answer_1, student)
print(grade)
