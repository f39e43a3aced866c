# %% [markdown]
# # Two wells: the kinetic battery model
#
# A battery holds its charge in two wells. Only the available one feeds the load. Charge flows into
# it from the bound one, and the larger the difference of their levels, the faster it flows.
#
# **Learning intentions.** After this page you can
#
# - explain why a battery stops with charge left in it (the rate-capacity effect);
# - explain why it can be used again after a pause (the recovery effect);
# - predict lifetimes under a load that comes and goes.

# %%
import math
from itertools import cycle

from optuav.physics.kibam import Battery, Stage, Wells, step, time_to_empty

MINUTE_S = 60.0

# %% [markdown]
# ## Drained fast, it stops with charge left
#
# A small cell, a sixth of it available. The lower the current, the more of its charge it gives.

# %%
ω, k = 0.166, 0.122 / MINUTE_S
cell = Battery(5.5 * MINUTE_S, ω, k * ω * (1 - ω))  # capacity 5.5 A min, k' = 0.122 1/min
delivered = []
for current_A in (0.125, 0.25, 0.5, 1.0):
    lifetime_s = float(time_to_empty(cell, cell.full, -current_A))
    delivered.append(current_A * lifetime_s / cell.capacity_As)
    left = step(cell, cell.full, Stage(-current_A, lifetime_s))
    print(
        f"{current_A:5.3f} A: {lifetime_s / MINUTE_S:6.2f} min, gives {delivered[-1]:6.1%}, "
        f"available {abs(left.available_As):.1f} A s, bound {left.bound_As:.1f} A s"
    )
    assert math.isclose(left.available_As, 0.0, abs_tol=1e-9)
    assert left.bound_As > 0.0

assert delivered == sorted(delivered, reverse=True)
assert math.isclose(cell.rate_per_s * MINUTE_S, 0.122)

# %% [markdown]
# ## A pause brings charge back
#
# Emptied with 0.5 A, the cell rests for two minutes without load. No charge is added, yet some of
# it is available again.

# %%
emptied_s = float(time_to_empty(cell, cell.full, -0.5))
empty = step(cell, cell.full, Stage(-0.5, emptied_s))
rested = step(cell, empty, Stage(0.0, 2 * MINUTE_S))
print(f"available after the pause: {rested.available_As:.2f} of {rested.total_As:.2f} A s")

assert rested.available_As > 0.0
assert math.isclose(rested.total_As, empty.total_As)

# %% [markdown]
# ## Lifetimes
#
# Test loads of Jongerden and Haverkort: continuous (CL), a minute on and a minute off (ILs), a
# minute on and two off (ILl), with 250 mA, 500 mA or both in turn (alt).


# %%
def lifetime_min(battery: Battery, load: list[tuple[float, float]]) -> float:
    """Time [min] until a battery is empty under phases (current drawn [A], duration [min])."""
    wells, passed_s = battery.full, 0.0
    for current_A, duration_min in cycle(load):
        duration_s = duration_min * MINUTE_S
        empty_s = float(time_to_empty(battery, wells, -current_A)) if current_A else math.inf
        if empty_s <= duration_s:
            return (passed_s + empty_s) / MINUTE_S
        wells = step(battery, wells, Stage(-current_A, duration_s))
        passed_s += duration_s
    raise AssertionError("a load drains the battery in the end")


on, off = [(0.25, 1.0), (0.5, 1.0)], (0.0, 1.0)
loads = {
    "CL250": ([on[0]], 4.53, 12.16),
    "CL500": ([on[1]], 2.02, 4.53),
    "CLalt": ([on[1], on[0]], 2.58, 6.45),
    "ILs250": ([on[0], off], 10.80, 44.78),
    "ILs500": ([on[1], off], 4.30, 10.80),
    "ILsalt": ([on[1], off, on[0], off], 4.80, 16.93),
    "ILl250": ([on[0], off, off], 21.86, 84.90),
    "ILl500": ([on[1], off, off], 6.53, 21.86),
}
twice = Battery(2 * cell.capacity_As, ω, cell.flow_rate_per_s)
for name, (load, small_min, large_min) in loads.items():
    found_min = lifetime_min(cell, load), lifetime_min(twice, load)
    print(f"{name:<7} {found_min[0]:6.2f} min, with twice the capacity {found_min[1]:6.2f} min")
    assert math.isclose(found_min[0], small_min, abs_tol=0.0051)
    assert math.isclose(found_min[1], large_min, abs_tol=0.0051)

# %% [markdown]
# With twice the capacity, the battery lasts more than twice as long.
#
# A state of charge counts both wells, and so says little about the one that feeds the load: after
# ten minutes of hovering the drone of the mission `paper` has most of the charge in the bound well.

# %%
drone = Battery(72_000.0, 0.8, 4.5e-5)
wells = step(drone, Wells(57_600.0, 14_400.0), Stage(-87.91, 600.0))
print(f"a drone after ten minutes of hovering: available {wells.available_As:.1f} A s,")
print(f"bound {wells.bound_As:.1f} A s; together {wells.total_As / drone.capacity_As:.1%} of full")

assert math.isclose(wells.available_As, 5696.064, abs_tol=1e-3)
assert math.isclose(wells.bound_As, 13_557.936, abs_tol=1e-3)
assert all(large > 2 * small for _, small, large in loads.values())
