"""Signs: told apart without colour, whole in one line, and hollow where a thing is absent."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.markers import MarkerStyle

from optuav.looks import LOOKS
from optuav.plots import signs, style


def test_no_two_signs_differ_only_in_colour() -> None:
    for one, other in combinations(signs.SIGNS.values(), 2):
        styles = [MarkerStyle(each.marker) for each in (one, other)]
        corners = (each.get_transform().transform(each.get_path().vertices) for each in styles)
        same = np.array_equal(*corners)
        assert not same or max(one.size_pt, other.size_pt) > 2.0 * min(one.size_pt, other.size_pt)
    assert {each.role for each in signs.SIGNS.values()} <= LOOKS.keys()


def test_a_device_is_a_dot_within_a_ring_of_dashes() -> None:
    """Nothing is drawn between the dot and the ring; a device that is not served has no dot."""
    for shape, has_dot in ((signs.SIGNS["device"].marker, True), (signs.SIGNS["device"].hollow, 0)):
        radii = np.hypot(*MarkerStyle(shape).get_path().vertices.T)
        inner, outer = radii < 0.55, radii > 0.8
        assert bool(inner.any()) == bool(has_dot)
        assert (inner | outer).all()


def test_many_things_are_one_entry_of_the_legend() -> None:
    """Several devices and hover points come in one call, with or without heights."""
    ax = style.page(2.0).subplots()
    (entry,) = signs.put(ax, "device", [[0.0, 0.0, 5.0], [1.0, 2.0, 5.0]], "devices")
    assert entry.get_xydata().tolist() == [[0.0, 0.0], [1.0, 2.0]]
    assert entry.get_label() == "devices"
    (entry,) = signs.put(ax, "hover", (3.0, 4.0), "hover point", hollow=True)
    assert entry.get_markerfacecolor() == "white"
    assert signs.put(ax, "hover", np.empty((0, 3)), "none") == []
    assert signs.put(ax, "laser", (0.0, 0.0)) == []
    assert len(ax.lines) == 3
