# %% [markdown]
# # Two packs: one flies while the laser charges the other
#
# A drone with two battery packs may use them as one, or in turns. Turns let the laser charge a pack
# while the other works; but a pack that carries everything alone is drained twice as fast.
#
# **Learning intentions.** After this page you can
#
# - name the schedules, and compute how long packs last under each;
# - explain why frequent turns are nearly as good as pooling, and one pack after the other is worse;
# - find the longest hover under a schedule, and say how certain that answer is.

# %%
import math

import optuav
from optuav.network.network import build_network
from optuav.network.timeline import carry, route_phases
from optuav.physics.kibam import Battery, time_to_empty
from optuav.physics.packs import lifetime

cell = {"capacity_As": 7200.0, "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}

# %% [markdown]
# ## Lifetimes
#
# One minute of work and one minute of idling, repeated. Here a positive current *discharges*.
# Pooled packs share every job; in sequence the second pack waits while full, and cannot recover.

# %%
load = [(8.0, 60.0), (0.0, 60.0)]
schedules = {
    "pooled": {},
    "sequential": {},
    "round-robin": {},
    "alternating": {"period_s": 5.0},
    "most-available": {},
}
life_s = {
    name: lifetime(load, packs=2, schedule=name, **more, **cell) for name, more in schedules.items()
}
for name, seconds in life_s.items():
    print(f"{name:<15}{seconds:9.1f} s")

alone = Battery(7200.0, 0.625, 4.5e-5)
assert life_s["sequential"] < life_s["round-robin"] <= life_s["pooled"]
assert life_s["sequential"] < 2 * lifetime(load, **cell) + 120.0
assert math.isclose(lifetime([(3.0, 1.0)], **cell), time_to_empty(alone, alone.full, -3.0))

# %% [markdown]
# An empty pack is not used again; the other takes over in the middle of the job. A load that
# charges what it draws may last for ever: `horizon_s` states how long to follow it.

# %%
assert lifetime([(1.0, 60.0), (-1.0, 60.0)], **cell, horizon_s=86_400.0) == math.inf
assert lifetime([(1.0, 60.0), (-0.5, 60.0)], **cell) < math.inf

# %% [markdown]
# ## Turns as short as you like
#
# Under a constant load, quick turns halve the mean load of each pack, as pooling does.

# %%
pooled_s = lifetime([(8.0, 1.0)], packs=2, **cell)
for period_s in (600.0, 60.0, 6.0):
    turns_s = lifetime([(8.0, 1e4)], packs=2, schedule="alternating", period_s=period_s, **cell)
    print(f"turns of {period_s:5.0f} s: {turns_s:8.2f} s, pooled {pooled_s:8.2f} s")
    assert turns_s < pooled_s + period_s

assert abs(turns_s - pooled_s) < 1.0

# %% [markdown]
# ## In a mission
#
# A job is a phase: a leg, a hover, a rest. While it hovers, the pack that flies gives the whole
# current and the laser charges the other one until it is full; after that the light is lost.

# %%
paper = optuav.load("paper")
direct = {
    name: optuav.solve(
        paper.replace(
            {"battery.schedule": name} | {f"battery.{key}": value for key, value in more.items()}
        ),
        "P3",
        perspective="available",
    )
    for name, more in schedules.items()
}
for name, plan in direct.items():
    print(f"{name:<15}{plan.hover_time_s:8.2f} s  ({plan.proof})")

assert direct["sequential"].hover_time_s < direct["round-robin"].hover_time_s
assert direct["round-robin"].hover_time_s < direct["alternating"].hover_time_s
assert "not proved" in direct["sequential"].proof

# %% [markdown]
# ## Who flew when
#
# Follow the plan's phases pack by pack: in sequence, the second pack takes over in the air.

# %%
mission = direct["sequential"].mission
planned = route_phases(build_network(mission), 0, direct["sequential"].hover_time_s, 0.0)
flown = carry(mission, planned)
for stretch in flown.stretches[1]:
    start_s, duration_s = float(stretch.start_s[0]), float(stretch.duration_s[0])
    if duration_s > 0.0:  # one ends at once, as the laser finds the other pack full
        print(f"from {start_s:6.1f} s for {duration_s:6.1f} s: pack {stretch.carrier[0] + 1} flies")

assert flown.ended_s is None
assert [int(each.carrier[0]) for each in flown.stretches[1] if each.emptied[0]] == [0]
