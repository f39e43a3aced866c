"""``limits.keep_soc = "always"``: η0 is left at the end of every leg, in all ways to an answer."""

from __future__ import annotations

import itertools
import math
from typing import Any

import networkx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

import optuav
from optuav import Mission
from optuav.network import vehicle
from optuav.network.network import build_network
from optuav.network.timeline import stay_net
from optuav.physics.kibam import Battery, Stage
from tests.examples import few
from tests.solving.sequences import random_mission

LINEAR = ("battery", "energy", "adjusted")
ALWAYS = {"limits.keep_soc": "always"}


@pytest.mark.parametrize(
    ("name", "changes", "perspective", "end_s", "always_s"),
    [
        ("paper", {}, "available", 597.270, 597.270),
        ("paper", {"limits.min_soc": 0.2}, "available", 597.270, 585.627),
    ],
)
def test_check_numbers(
    name: str, changes: dict[str, Any], perspective: Any, end_s: float, always_s: float
) -> None:
    """SPEC-BATTERY 5, from code of its own."""
    mission = optuav.load(name).replace(changes)
    for keep_soc, expected_s in (("end", end_s), ("always", always_s)):
        asked = mission.replace({"limits.keep_soc": keep_soc})
        plan = optuav.solve(asked, perspective=perspective)
        assert plan.hover_time_s == pytest.approx(expected_s, abs=5e-4)
        assert plan.flyable
        batch = optuav.batch_arrays(asked, {"limits.min_soc": [asked.limits.min_soc] * 2})
        assert batch["hover_time_s"] == pytest.approx(plan.hover_time_s, abs=1e-6)


class Way:
    """One route of a mission: its legs and net currents and powers, from the network's figures."""

    def __init__(self, mission: Mission, route: int) -> None:
        network = build_network(mission)
        table, names = network.legs, network.places.names
        self.mission, self.legs = (
            mission,
            [k for k in network.routes.legs[route].tolist() if k >= 0],
        )
        self.flown = [
            tuple(float(each[k]) for each in (table.duration_s, table.charge_As, table.energy_J))
            for k in self.legs
        ]
        self.places = [names[table.end[k]] for k in self.legs[:-1]]
        ends = [int(table.end[k]) for k in self.legs[:-1]]
        self.net = [tuple(float(each) for each in stay_net(network, end)) for end in ends]
        received = [float(network.places.received_power_W[end]) for end in ends]
        self.drawn_W = [lit - net for lit, (_, net) in zip(received, self.net, strict=True)]
        self.received_W = received

    def rates(self, perspective: str) -> tuple[list[float], list[float]]:
        """State of charge that each leg takes [-], and that each stay gives [1/s]."""
        battery = self.mission.battery
        full_As = battery.packs * battery.capacity_As
        full_J = full_As * battery.nominal_voltage_V
        _, charge_As, energy_J = map(sum, zip(*self.flown, strict=True))
        if perspective == "battery":
            return [Q / full_As for _, Q, _ in self.flown], [A / full_As for A, _ in self.net]
        if perspective == "energy":
            return [E / full_J for *_, E in self.flown], [W / full_J for _, W in self.net]
        E_1 = battery.flight_energy_J or full_As * energy_J / charge_As
        stays = []
        for place, (_, net_W), lit_W, drawn_W in zip(
            self.places, self.net, self.received_W, self.drawn_W, strict=True
        ):
            if place != "hover":
                stays.append(net_W / full_J)
                continue
            drawn_A = float(vehicle.hover_load(self.mission).current_A)
            E_2 = battery.hover_energy_J or full_As * drawn_W / drawn_A
            stays.append(lit_W / full_J - drawn_W / E_2)
        return [E / E_1 for *_, E in self.flown], stays

    def longest_s(self, perspective: str) -> float:
        """The longest hover with η0 after every leg, by HiGHS [s]; −∞ for none."""
        taken, given = self.rates(perspective)
        limits = self.mission.limits
        rows = [[1.0] * len(given)]
        right = [limits.deadline_s - sum(T for T, *_ in self.flown)]
        for number in range(len(taken)):
            rows.append([-rate * (stay < number) for stay, rate in enumerate(given)])
            right.append(1.0 - limits.min_soc - sum(taken[: number + 1]))
        scale = [1.0] + [max(map(abs, row)) or 1.0 for row in rows[1:]]
        rows = [[x / size for x in row] for row, size in zip(rows, scale, strict=True)]
        right = [b / size for b, size in zip(right, scale, strict=True)]
        goal = [-float(place == "hover") for place in self.places]
        found = linprog(goal, A_ub=rows, b_ub=right, method="highs")
        return -float(found.fun) if found.status == 0 else -math.inf


@pytest.mark.campaign
@few(12, 2000)
@given(seed=st.integers(0, 2**32 - 1), perspective=st.sampled_from(LINEAR))
def test_linear_answers_are_those_of_a_programme_per_route(seed: int, perspective: Any) -> None:
    """`solve`, batches, the closed form, CVXPY and one MILP, against rows written by hand."""
    mission = random_mission(np.random.default_rng(seed)).replace(ALWAYS)
    routes = build_network(mission).routes
    ways = [Way(mission, k) for k in np.flatnonzero(routes.flyable).tolist()]
    longest_s = max((way.longest_s(perspective) for way in ways), default=-math.inf)
    plan = optuav.solve(mission, perspective=perspective)
    batch = optuav.batch_arrays(
        mission, {"limits.deadline_s": [mission.limits.deadline_s]}, perspective=perspective
    )
    found = {"solve": plan.hover_time_s if plan else -math.inf}
    found["batch"] = float(np.nan_to_num(batch["hover_time_s"], nan=-np.inf)[0])
    for engine in ("closed-form", "cvxpy"):
        other = optuav.solve(mission, perspective=perspective, engine=engine)
        found[engine] = other.hover_time_s if other else -math.inf
    if plan:
        found["milp"] = optuav.route_choice(mission, perspective=perspective).plan.hover_time_s
    assert found == pytest.approx(dict.fromkeys(found, longest_s), abs=2e-5, rel=1e-7)


def cap_s(mission: Mission, route: int) -> float:
    """What the landing after the hover allows [s]: (F − Q_1 − Q_2)/I_h, ∞ where it comes last."""
    way = Way(mission, route)
    battery = mission.battery
    spare_As = (1.0 - mission.limits.min_soc) * battery.packs * battery.capacity_As
    if way.places[0] != "hover" or len(way.places) == 1:
        return math.inf
    (_, first_As, _), (_, second_As, _), _ = way.flown
    return (spare_As - first_As - second_As) / -way.net[0][0]


@few(10, 1000)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_hover_first_is_capped_and_nothing_else(seed: int) -> None:
    """Through the wells: the answer of "end", but no longer than the cap, on each building."""
    rng = np.random.default_rng(seed)
    mission = optuav.load("paper").replace(
        {
            "limits.deadline_s": rng.uniform(800.0, 4000.0),
            "limits.min_soc": rng.uniform(0.0, 0.5),
            "battery.available_fraction": rng.uniform(0.2, 0.9),
            "battery.flow_rate_per_s": 10.0 ** rng.uniform(-5.0, -2.0),
        }
    )
    number = int(rng.integers(10))
    problem = optuav.P4(f"b{number + 1}", order="hover-first")
    by_end = optuav.solve(mission, problem)
    always = optuav.solve(mission.replace(ALWAYS), problem)
    capped_s = min(by_end.hover_time_s, cap_s(mission, 2 + 2 * number)) if by_end else -1.0
    assert (always.hover_time_s if always else -1.0) == pytest.approx(max(capped_s, -1.0), abs=1e-5)


def theorem_fails() -> tuple[Mission, networkx.DiGraph[str]]:
    """B 100 A s, η0 0.2, deadline 120 s, hover 1 A; b1 charges 1 A before, b2 10 A behind."""
    mission = optuav.load("paper-table2").replace(
        {
            "limits.deadline_s": 120.0,
            "limits.min_soc": 0.2,
            "battery.packs": 1,
            "battery.capacity_As": 100.0,
            "battery.charge_current_A": 100.0,
            "flight.hover_current_A": 1.0,
            "flight.hover_power_W": 11.1,
            "battery.nominal_voltage_V": 11.1,
        }
    )
    mission = mission.replace({"buildings": [mission.buildings[0], mission.buildings[1]]})
    graph = optuav.graph(mission)
    graph.clear_edges()
    seconds = {
        **{("origin", "b1"): 1.0, ("b1", "hover"): 1.0, ("origin", "hover"): 2.0},
        **{("hover", "b2"): 1.0, ("b2", "destination"): 20.0, ("hover", "destination"): 21.0},
    }
    for (start, end), time_s in seconds.items():
        figures = {"duration_s": time_s, "charge_As": time_s, "energy_J": 11.1 * time_s}
        graph.add_edge(start, end, **figures, distance_m=1.0, peak_speed_m_s=1.0)
    for name, current_A in (("hover", 0.0), ("b1", 1.0), ("b2", 10.0)):
        graph.nodes[name]["laser_sight"] = current_A > 0.0
        graph.nodes[name]["received_power_W"] = 11.1 * current_A
    return mission, graph


def test_two_rests_may_be_better_where_one_is_enough_at_the_end() -> None:
    """The counter-example of SPEC-BATTERY 5: 77 s with one rest, 86 s with two, 93.364 s by end."""
    mission, graph = theorem_fails()

    def hover_s(keep_soc: str, stops: int) -> float:
        asked, problem = mission.replace({"limits.keep_soc": keep_soc}), optuav.P1(stops=stops)
        return optuav.solve(asked, problem, perspective="battery", graph=graph).hover_time_s

    assert hover_s("end", 1) == pytest.approx(93.364, abs=5e-4)
    assert hover_s("always", 1) == pytest.approx(77.0, abs=1e-6)
    assert hover_s("always", 2) == pytest.approx(86.0, abs=1e-6)
    notes = optuav.solve(mission.replace(ALWAYS), perspective="battery", graph=graph).notes
    assert any("more stops might gain hover time" in note for note in notes)


@pytest.mark.parametrize("keep_soc", ["end", "always"])
def test_longest_hovers_from_arrays(keep_soc: Any) -> None:
    """Hover first on `paper`'s figures: the cap binds if it is asked for, else it does not."""
    flight, battery = Stage(-90.0, 40.0), Battery(72_000.0, 0.8, 4.5e-5)
    steps: list[Any] = [flight, "hover", flight, "rest", flight]
    hovers = optuav.longest_hovers(
        steps,
        battery=battery,
        deadline_s=np.array([4000.0]),
        min_soc=0.5,
        hover_current_A=88.0,
        rest_current_A=6.0,
        keep_soc=keep_soc,
    )
    cap = (0.5 * 72_000.0 - 2 * 90.0 * 40.0) / 88.0
    assert (hovers.hover_time_s[0] <= cap + 1e-6) == (keep_soc == "always")
    if keep_soc == "always":
        assert hovers.hover_time_s[0] == pytest.approx(cap, abs=1e-6)
    with pytest.raises(optuav.InputError, match="keep_soc"):
        optuav.longest_hovers(
            [flight, "hover", flight],
            battery=battery,
            deadline_s=100.0,
            min_soc=0.1,
            hover_current_A=88.0,
            keep_soc="sometimes",  # type: ignore[arg-type]
        )


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_the_judge_finds_a_landing_below_the_reserve(perspective: Any) -> None:
    """A hover 1e-6 of the capacity too long lands too low, and only then."""
    mission = optuav.load("paper").replace({**ALWAYS, "limits.min_soc": 0.3})
    plan = optuav.solve(mission, optuav.P4("b9", order="hover-first"), perspective=perspective)
    hover, rest = plan.stops
    battery = mission.battery
    more_s = 1e-6 * battery.packs * battery.capacity_As / -plan.phases[1].current_A
    for extra_s, broken in ((0.0, []), (more_s, ["state of charge"])):
        stops = [
            optuav.Stop("hover", "hover", hover.duration_s + extra_s),
            optuav.Stop("b9", "rest", rest.duration_s + 30.0 * (extra_s > 0.0)),
        ]
        changed = mission.replace({"limits.deadline_s": 2000.0})
        events = optuav.replay(optuav.Itinerary(changed, stops)).violations
        wells = ("empty", "full")
        assert [event.kind for event in events if event.kind not in wells] == broken
        for event in events:
            if event.kind == "state of charge":
                words = "lands on b9 with 29.9999 % of the charge, below the reserve of 30 %"
                assert event.words + event.value_and_limit == words
                assert event.value == pytest.approx(0.3 - 1e-6, abs=1e-9)


def test_a_landing_below_the_reserve_is_told_where_it_is_allowed() -> None:
    """With "end" a plan that lands low is flyable, and the simulation says where."""
    mission = optuav.load("paper").replace({"limits.min_soc": 0.2, "limits.deadline_s": 3000.0})
    replayed = optuav.replay(optuav.solve(mission, optuav.P4("b9", order="hover-first")))
    assert replayed.flyable
    (event,) = (event for event in replayed.events if event.kind == "below reserve")
    assert event.words + event.value_and_limit == (
        f"lands on b9 with {100 * event.value:.2f} % of the charge, below the reserve of 20 %; "
        "allowed by limits.keep_soc = end"
    )


@pytest.mark.parametrize("schedule", ["sequential", "round-robin", "most-available"])
def test_packs_in_turn_keep_it_together(schedule: str) -> None:
    """All packs together hold η0 wherever the UAV lands; the hover is shorter for it."""
    mission = optuav.load("matrice350").replace(
        {"battery.schedule": schedule, "limits.min_soc": 0.3}
    )
    hovers_s = []
    for keep_soc in ("end", "always"):
        asked = mission.replace({"limits.keep_soc": keep_soc})
        plan = optuav.solve(asked, optuav.P4("b5", order="hover-first"), slot_s=20.0)
        hovers_s.append(plan.hover_time_s)
        assert plan.flyable
        capacity_As = mission.battery.packs * mission.battery.capacity_As
        left = [(sum(p.available_As) + sum(p.bound_As)) / capacity_As for p in plan.phases]
        if keep_soc == "always":
            assert min(left) >= 0.3 - 1e-9
    assert hovers_s[1] <= hovers_s[0]


def test_constraints_are_declared_for_each_leg_but_the_last() -> None:
    """Printed and classified: "end" declares one constraint, "always" one more per landing."""
    for keep_soc, count in (("end", 1), ("always", 3)):
        mission = optuav.load("paper").replace({"limits.keep_soc": keep_soc})
        program = optuav.formulate(mission, optuav.P4("b1"), perspective="battery")
        for part in program.parts:
            kinds = [c.kind for c in part.declared.constraints]
            assert kinds.count("state of charge") == count
    labels = optuav.solve(mission.replace({"limits.min_soc": 0.5})).binding
    assert all(isinstance(label, str) for label in labels)


def test_it_is_validated() -> None:
    """Another word is one fault that names both."""
    with pytest.raises(optuav.InputError, match=r"limits\.keep_soc = 'often'.*end.*always"):
        optuav.load("paper").replace({"limits.keep_soc": "often"})


def test_no_key_no_change() -> None:
    """A mission without the key is the one that keeps η0 at the end."""
    paper = optuav.load("paper")
    assert paper == paper.replace({"limits.keep_soc": "end"})


def test_every_pair_of_stops_and_hovers_keeps_it() -> None:
    """The search over several stops: flyable, and never longer than with the reserve at the end."""
    mission = optuav.load("paper").replace({"limits.min_soc": 0.3, "limits.deadline_s": 3000.0})
    for stops, hovers in itertools.product((1, 2), repeat=2):
        problem = optuav.P1(stops=stops, hovers=hovers)
        end, always = (
            optuav.solve(mission.replace({"limits.keep_soc": each}), problem)
            for each in ("end", "always")
        )
        assert always.flyable
        assert always.hover_time_s <= end.hover_time_s + 1e-6


class KeptAtTheEnd(optuav.Formulation):
    """Longest hover that keeps the reserve at the end, and both wells."""

    def declare(self, model: Any, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        self.keep(model, given, hover, rest)
        given.keep_wells(model, "wells", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)

    def keep(self, model: Any, given: Any, hover: Any, rest: Any) -> None:
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)


class Kept(KeptAtTheEnd):
    """The same with the reserve wherever the mission wants it."""

    def keep(self, model: Any, given: Any, hover: Any, rest: Any) -> None:
        given.keep_charge(model, "charge", hover, rest)


def test_a_problem_of_ones_own_that_forgets_the_landings_is_refused() -> None:
    """Its plan would land too low; with `keep_charge` it is (P1), with "end" it may."""
    relay = optuav.load("relay-today")
    words = (
        r"KeptAtTheEnd keeps the reserve at the end only, not at landings: call given\.keep_charge"
    )
    for perspective in ("available", "battery"):
        with pytest.raises(optuav.InputError, match=words):
            optuav.solve(relay, KeptAtTheEnd(), perspective=perspective)
    kept, end = optuav.solve(relay, Kept()), relay.replace({"limits.keep_soc": "end"})
    assert kept.flyable
    assert kept.hover_time_s == pytest.approx(1993.892, abs=1e-2)
    assert optuav.solve(end, KeptAtTheEnd()).hover_time_s == pytest.approx(2385.803, abs=1e-2)


def test_landings_are_named_by_their_places() -> None:
    """In what binds, in prices and in the mathematics, never by the number of a flight."""
    told = str(optuav.explain("relay-today"))
    assert "Charge and 20 % left on landing at b11 bind." in told
    assert "of the draw up to the landing at b11 costs" in told
    mission = optuav.load("relay-today")
    text = str(optuav.formulate(mission, optuav.P4("b11", order="hover-first")))
    first, second = (
        text.index(f"P4.a state of charge {where}")
        for where in ("on reaching the hover point", "on landing at the building")
    )
    assert first < second
    assert "flight 1" not in text.partition("P4.a available")[0]
