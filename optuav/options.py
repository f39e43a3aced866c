"""Named options of a question and of a battery, with `Literal` types."""

from typing import Literal, TypeAlias, get_args

Order: TypeAlias = Literal["rest-first", "between", "hover-first"]
Trajectory: TypeAlias = Literal["optimal", "direct", "traj1", "traj2"]
HoverPoint: TypeAlias = Literal["w_U", "free"]
Speed: TypeAlias = Literal["mission", "free"]
Perspective: TypeAlias = Literal["battery", "energy", "adjusted", "wells", "available"]
ProblemName: TypeAlias = Literal["P1", "P2", "P2-tight", "P3"]
Charging: TypeAlias = Literal["constant", "taper"]
Schedule: TypeAlias = Literal[
    "pooled", "sequential", "round-robin", "alternating", "most-available"
]
BatteryName: TypeAlias = Literal["lipo", "liion", "paper"]
KeepSoc: TypeAlias = Literal["end", "always"]
Obstacles: TypeAlias = Literal["refuse", "ignore", "over", "around"]

LONGEST_HOVER = ("P1", "P3", "P4")  # Problems that ask for the longest hover
ORDERS: tuple[Order, ...] = ("rest-first", "hover-first")
ORDERS_OF_SEVERAL: tuple[Order, ...] = get_args(Order)  # With several devices
TRAJECTORIES: tuple[Trajectory, ...] = get_args(Trajectory)
HOVER_POINTS: tuple[HoverPoint, ...] = get_args(HoverPoint)
SPEEDS: tuple[Speed, ...] = get_args(Speed)
BATTERIES: tuple[BatteryName, ...] = get_args(BatteryName)
KEEP_SOC: tuple[KeepSoc, ...] = get_args(KeepSoc)
SCHEDULES: tuple[Schedule, ...] = get_args(Schedule)  # The default first
SET = "set/"  # How the names of the missions of the benchmark set begin
