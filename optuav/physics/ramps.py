"""Motion whose speed rises evenly from rest to a peak, stays there and falls as evenly to rest."""

import numpy as np

from optuav.physics.quantity import TINY, Quantity


def motion(
    peak_speed_m_s: Quantity, rise_s: Quantity, duration_s: Quantity, time_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Way travelled [m] and speed [m/s] at moments [s] between the start and the end.

    Rising takes as long as falling, at most half of the duration [s]; with a rise of 0 s the speed
    is constant.
    """
    ramp = np.maximum(rise_s, TINY)
    up, down = np.minimum(time_s / ramp, 1.0), np.minimum((duration_s - time_s) / ramp, 1.0)
    cruised_s = np.clip(time_s - rise_s, 0.0, duration_s - 2.0 * rise_s)
    travelled_s = 0.5 * rise_s * (up**2 + 1.0 - down**2) + cruised_s
    return peak_speed_m_s * travelled_s, peak_speed_m_s * np.minimum(up, down)
