"""The longest hovers of many scenarios of the shipped mission, as one writes them in NumPy by hand.

Closed forms for these very columns: weights, winds and places within what can be flown, the device
beyond the straight line, the laser in sight everywhere, and no rest after a hover so long that the
wells pass full.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.laser.fits import Fits, Laser
from optuav.mission import Mission
from optuav.network.network import Network, build_network
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.timeline import stay_net
from optuav.network.vehicle import coverage_radius_m

STEPS = 5  # Newton's
STEPS_TO_FULL = 8
STEPS_ON_RIM = 5
SAME_S = 1e-6


class Flights(NamedTuple):
    """Legs and loads of scenarios, each (scenario or 1, leg or 1)."""

    time_s: Floats
    charge_As: Floats
    # What a leg adds to the tilt z = y1 - ω y, and by how much that decays.
    tilt_As: Floats
    decay: Floats
    hover_A: Floats


class ByHand:
    """The mission's constants, and the two closed forms."""

    def __init__(self, mission: Mission) -> None:
        self.mission, self.network = mission, build_network(mission)
        battery, routes = mission.battery, self.network.routes
        self.share, rate = battery.available_fraction, battery.flow_rate_per_s
        self.k = rate / (self.share * (1.0 - self.share))
        by_building = FIRST_BUILDING + np.arange(len(mission.buildings))
        self.rest_A = stay_net(self.network, by_building).current_A
        self.gained_A = np.concatenate([[0.0], np.repeat(self.rest_A, 2)])
        self.legs = routes.legs
        self.fixed = fixed(self.network, self.k, self.share)
        self.fixed_full_s = self.until_full_s(self.fixed)

    def routes(self, flights: Flights) -> tuple[Floats, Floats]:
        """Time [s] and charge [A s] of routes."""
        first, second, third = self.legs.T
        found = []
        for table in flights.time_s, flights.charge_As:
            found.append(table[:, first] + table[:, second])
            found[-1][:, 1:] += table[:, third[1:]]
        return found[0], found[1]

    def battery(self, deadline_s: Floats, capacity_As: Floats, flights: Flights) -> Floats:
        """The longest hover by charge alone, with its rest and the tie rule."""
        share, rest_A, hover_A = 1.0 - self.mission.limits.min_soc, self.gained_A, flights.hover_A
        flight_s, flight_As = self.routes(flights)
        left = deadline_s[:, None] - flight_s
        spare = share * self.mission.battery.packs * capacity_As[:, None] - flight_As
        hover = np.minimum(left, (spare + rest_A * left) / (hover_A + rest_A))
        hover = np.where(hover >= 0.0, hover, -np.inf)
        tied = hover >= hover.max(axis=1)[:, None] - SAME_S
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = np.where(rest_A > 0.0, np.maximum((hover_A * hover - spare) / rest_A, 0.0), 0.0)
        whole = np.where(tied, flight_s + hover + rest, np.inf)
        best = np.argmax(whole <= whole.min(axis=1)[:, None] + SAME_S, axis=1)
        every = np.arange(len(best))
        rest[every, best]  # the answer too
        found: Floats = hover[every, best]
        return found

    def available(self, deadline_s: Floats, capacity_As: Floats, flights: Flights) -> Floats:
        """The longest hover with wells, where a rest fills them as far as time allows."""
        share, k, rest_A, hover_A = self.share, self.k, self.rest_A, flights.hover_A
        hold, gain = (1.0 - share) * hover_A / k, (1.0 - share) * rest_A / k
        full_As = self.mission.battery.packs * capacity_As[:, None]
        flight_s, flight_As = self.routes(flights)
        left = deadline_s[:, None] - flight_s
        spare = (1.0 - self.mission.limits.min_soc) * full_As - flight_As
        gained = self.gained_A
        most = np.minimum(left, (spare + gained * left) / (hover_A + gained))
        start = np.maximum(most, 0.0)

        def of(routes: slice) -> list[tuple[Floats, Floats, Floats]]:
            """Charge, tilt and decay of the first, second and third leg of routes."""
            charge_As, tilt_As, decay = flights.charge_As, flights.tilt_As, flights.decay
            columns = self.legs[routes].T
            return [(charge_As[:, leg], tilt_As[:, leg], decay[:, leg]) for leg in columns]

        # Directly: until the well is empty at the end.
        (c1, z1, _), (c2, z2, d2), _ = of(slice(0, 1))
        hover, top = start[:, :1], most[:, :1]
        for _ in range(STEPS):
            e = np.exp(-k * hover)
            y1 = share * (full_As - c1 - c2 - hover_A * hover)
            y1 = y1 + (z1 * e - hold * (1.0 - e)) * d2 + z2
            hover = np.minimum(hover + y1 / (share * hover_A + k * (z1 + hold) * e * d2), top)
        found: Floats = hover[:, 0]
        # Resting first, until the wells are full or no time is left.
        which = slice(1, None, 2)
        (c1, z1, _), (c2, z2, d2), (c3, z3, d3) = of(which)
        left_here, hover, top = left[:, which], start[:, which], most[:, which]
        full_s = self.fixed_full_s if flights is self.fixed else self.until_full_s(flights)
        for _ in range(STEPS):
            e, rest = np.exp(-k * hover), np.minimum(full_s, left_here - hover)
            r = np.exp(-k * rest)
            tilted = (z1 * r + gain * (1.0 - r)) * d2 + z2
            y1 = share * (full_As - c1 - c2 - c3 + rest_A * rest - hover_A * hover)
            y1 = y1 + (tilted * e - hold * (1.0 - e)) * d3 + z3
            slope = share * hover_A + k * (tilted + hold) * e * d3
            more = share * rest_A + (gain - z1) * k * r * d2 * e * d3
            slope = slope + np.where(rest < full_s, more, 0.0)
            hover = np.minimum(hover + y1 / slope, top)
        found = np.maximum(found, hover.max(axis=1))
        # Hovering first: until the well is empty on the building, or at the end.
        which = slice(2, None, 2)
        (c1, z1, _), (c2, z2, d2), (c3, z3, d3) = of(which)
        left_here, hover, top = left[:, which], start[:, which], most[:, which]
        for _ in range(STEPS):
            e, rest = np.exp(-k * hover), left_here - hover
            r = np.exp(-k * rest)
            tilted = (z1 * e - hold * (1.0 - e)) * d2 + z2
            bend = k * (z1 + hold) * e * d2
            y1 = share * (full_As - c1 - c2 - hover_A * hover)
            end = y1 - share * (c3 - rest_A * rest) + (tilted * r + gain * (1.0 - r)) * d3 + z3
            y1 = y1 + tilted
            slope = share * hover_A + bend
            end_slope = share * (hover_A + rest_A) + (bend + (gain - tilted) * k) * r * d3
            hover = np.minimum(hover + np.minimum(y1 / slope, end / end_slope), top)
        found = np.maximum(found, hover.max(axis=1))
        return found

    def until_full_s(self, flights: Flights) -> Floats:
        """Rests until the available well is full, flown to from the origin [s]."""
        share, k, rest_A = self.share, self.k, self.rest_A
        gain, first = (1.0 - share) * rest_A / k, self.legs[1::2, 0]
        c1, z1 = flights.charge_As[:, first], flights.tilt_As[:, first]
        full_s = (share * c1 - z1) / (share * rest_A + (gain - z1) * k)
        for _ in range(STEPS_TO_FULL):
            e = np.exp(-k * full_s)
            y1 = share * (rest_A * full_s - c1) + z1 * e + gain * (1.0 - e)
            full_s = np.maximum(full_s - y1 / (share * rest_A + (gain - z1) * k * e), 0.0)
        found: Floats = full_s
        return found

    def flown(
        self,
        mass_kg: Floats,
        wind_x_N: Floats,
        wind_y_N: Floats,
        device_x_m: Floats,
        device_y_m: Floats,
        *,
        wells: bool,
    ) -> Flights:
        """Legs and loads where mass, wind and the device's place vary; without `wells` no tilt."""
        mission, position_m = self.mission, self.network.places.position_m
        body, motor, link, laser = mission.body, mission.rotor, mission.link, mission.laser
        assert body is not None
        assert motor is not None
        assert isinstance(laser, Laser)
        inertia_x, inertia_y, arm_m = body.inertia_x_kg_m2, body.inertia_y_kg_m2, body.arm_length_m
        assert inertia_x is not None
        assert inertia_y is not None
        assert arm_m is not None
        hover_m = self._hover_m(device_x_m, device_y_m)
        legs, places = self.network.legs, np.empty((3, len(mass_kg), len(position_m)))
        places[:] = position_m.T[:, None]
        places[:, :, HOVER] = hover_m
        x, y, z = places[:, :, legs.end] - places[:, :, legs.start]
        mass, wx, wy = (each[:, None] for each in (mass_kg, wind_x_N, wind_y_N))
        weight = mass * body.gravity_m_s2
        top = motor.max_speed_rad_s
        thrust = 4.0 * motor.lift_coefficient_N_s2_rad2 * top**2
        pull = wx * wx + wy * wy + weight * weight
        d = np.sqrt(x * x + y * y + z * z)
        x, y, z = x / d, y / d, z / d
        along = wx * x + wy * y - weight * z
        root = np.sqrt(along * along + (thrust**2 - pull))
        ahead, back = root + along, root - along
        cruise_pitch = np.arctan2(ahead * x - wx, ahead * z + weight)
        cruise_roll = np.arcsin((ahead * y - wy) / thrust)
        brake_pitch = np.arctan2(-back * x - wx, weight - back * z)
        brake_roll = np.arcsin((-back * y - wy) / thrust)
        moving = np.sqrt(2.0 * d * mass * (1.0 / ahead + 1.0 / back))
        torque = arm_m * motor.lift_coefficient_N_s2_rad2 * top**2
        by_pitch = 2.0 * np.sqrt(inertia_y / torque)
        by_roll = 2.0 * np.sqrt(inertia_x / torque)

        def turn_s(pitch: Floats, roll: Floats) -> Floats:
            found: Floats = by_pitch * np.sqrt(np.abs(pitch)) + by_roll * np.sqrt(np.abs(roll))
            return found

        t1, t5 = turn_s(cruise_pitch, cruise_roll), turn_s(brake_pitch, brake_roll)
        t3 = turn_s(brake_pitch - cruise_pitch, brake_roll - cruise_roll)
        turning = t1 + t3 + t5

        def rotor_A(speed: float | Floats) -> Floats:
            drag = motor.drag_coefficient_Nm_s2_rad2 * speed * speed
            torque = motor.friction_torque_Nm + drag + motor.viscous_damping_Nm_s_rad * speed
            return np.asarray(torque * motor.velocity_constant_rpm_V / 9.5493)

        full_A = 4.0 * rotor_A(top)
        turning_A = rotor_A(top) + 2.0 * rotor_A(top / np.sqrt(2.0))
        speed = np.sqrt(np.sqrt(pull) / (4.0 * motor.lift_coefficient_N_s2_rad2))
        lx, ly, lz = (h - p for h, p in zip(hover_m, laser.position_m, strict=True))
        light = laser.emitter_slope * laser.power_W + laser.emitter_offset_W
        fog = float(Fits.of(mission).attenuation_per_km) / 1000.0
        arrives = np.exp(-fog * np.sqrt(lx * lx + ly * ly + lz * lz))
        received = laser.receiver_slope * arrives * light + laser.receiver_offset_W
        nominal_V = mission.battery.nominal_voltage_V
        charged_A = np.minimum(received / nominal_V, mission.battery.charge_current_A)
        radio_A = link.transmit_power_W / link.transmit_voltage_V
        hover_A = 4.0 * rotor_A(speed) + radio_A - charged_A[:, None]
        tilt = decay = np.zeros((1, 1))
        if wells:
            t2 = moving * back / (ahead + back)
            for current_A, t in zip(
                (turning_A, full_A, turning_A, full_A, turning_A),
                (t1, t2, t3, moving - t2, t5),
                strict=True,
            ):
                e = np.exp(-self.k * t)
                tilt = tilt * e - (1.0 - self.share) * current_A / self.k * (1.0 - e)
            decay = np.exp(-self.k * (moving + turning))
        charge = full_A * moving + turning_A * turning
        return Flights(moving + turning, charge, tilt, decay, hover_A)

    def _hover_m(self, device_x_m: Floats, device_y_m: Floats) -> Floats:
        """Where the shortest way touches the coverage at the least altitude (3, n) [m]."""
        mission, position_m = self.mission, self.network.places.position_m
        altitude_m = mission.limits.min_altitude_m
        reach_m = float(coverage_radius_m(mission))
        radius = np.sqrt(reach_m**2 - (altitude_m - mission.device_m[2]) ** 2)
        ends = position_m[[ORIGIN, DESTINATION]]
        middle = ends.mean(axis=0)
        angle = np.arctan2(middle[1] - device_y_m, middle[0] - device_x_m)
        for _ in range(STEPS_ON_RIM):
            x, y = np.cos(angle), np.sin(angle)
            slope, bend = 0.0, 0.0
            for end in ends:
                wx, wy = device_x_m + radius * x - end[0], device_y_m + radius * y - end[1]
                d = np.sqrt(wx * wx + wy * wy + (altitude_m - end[2]) ** 2)
                across = (wy * x - wx * y) / d
                slope = slope + across
                bend = bend + (radius * (1.0 - across * across) - (wx * x + wy * y)) / d
            angle = angle - slope / bend
        at = device_x_m + radius * np.cos(angle), device_y_m + radius * np.sin(angle)
        return np.array([*at, np.full_like(angle, altitude_m)])


def fixed(network: Network, k: float, share: float) -> Flights:
    """Legs and loads of the mission itself."""
    legs = network.legs
    tilt = np.zeros(len(legs.start))
    for current_A, duration_s in zip(legs.currents_A, legs.durations_s, strict=True):
        e = np.exp(-k * duration_s)
        tilt = tilt * e - (1.0 - share) * current_A * (1.0 - e) / k
    decay = np.exp(-k * legs.duration_s)
    hover_A = np.atleast_2d(-stay_net(network, HOVER).current_A)
    return Flights(legs.duration_s[None], legs.charge_As[None], tilt[None], decay[None], hover_A)
