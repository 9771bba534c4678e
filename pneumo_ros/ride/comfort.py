# SPDX-License-Identifier: Apache-2.0
"""How the ride is judged: accelerations, personal ratings, tyre load and workspace.

The scaled rig has a time scale of 1 and a length scale of 5, so its accelerations times 5 are the full-scale car's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumo_ros.road import LENGTH_SCALE
from pneumo_ros.units import GRAVITY

MPR_RANGE = (0.0, 5.0)


def rms(signal: ArrayLike) -> float:
    """Root mean square about zero, in the signal's unit."""
    x = np.asarray(signal, dtype=float)
    return float(np.sqrt(np.mean(x * x)))


def mean_personal_rating(vertical_rms: float, lateral_rms: float = 0.0) -> float:
    """MPR of Smith et al. (Eq. 2.1): 5.43 - 40 sqrt(a_v^2 + a_l^2), a in g, limited to 0 (worst) to 5 (best).

    Parameters
    ----------
    vertical_rms, lateral_rms : full-scale rms accelerations, m/s2

    The regression exceeds the scale of its raters below 0.011 g and is negative above 0.136 g.
    """
    return min(max(rating_regression(vertical_rms, lateral_rms), MPR_RANGE[0]), MPR_RANGE[1])


def rating_regression(vertical_rms: float, lateral_rms: float = 0.0) -> float:
    """The regression of :func:`mean_personal_rating` as it comes, also where it leaves its raters' scale."""
    return 5.43 - 40.0 * float(np.hypot(vertical_rms, lateral_rms)) / GRAVITY


@dataclass(frozen=True)
class Ride:
    """What a run is judged by.

    Attributes
    ----------
    heave_rms, pitch_rms : acceleration of the rig's body, m/s2 and rad/s2
    full_scale_heave_rms : m/s2, the rig's times the length scale
    rating : MPR of it, 0 to 5
    rated : whether the regression stays inside that range; where it does not, its end stands in ``rating``
    scale : full scale over the rig
    tyre_load_variation : (2,) front and rear standard deviation of tyre force over its static value
    workspace : (2,) front and rear largest minus smallest spring height, m
    """

    heave_rms: float
    pitch_rms: float
    full_scale_heave_rms: float
    rating: float
    tyre_load_variation: tuple[float, float]
    workspace: tuple[float, float]
    rated: bool = True
    scale: float = LENGTH_SCALE


def tyre_load_variation(force: ArrayLike, static: float) -> float:
    """Standard deviation of a tyre's force over its static load, both N."""
    return float(np.std(np.asarray(force, dtype=float)) / static)


def workspace(height: ArrayLike) -> float:
    """Suspension travel used: largest minus smallest spring height, m."""
    return float(np.ptp(np.asarray(height, dtype=float)))


def judge(
    heave_acceleration: ArrayLike,
    pitch_acceleration: ArrayLike,
    tyre_forces: NDArray[np.float64],
    static_loads: tuple[float, float],
    heights: NDArray[np.float64],
    scale: float = LENGTH_SCALE,
) -> Ride:
    """Judge a run.

    Parameters
    ----------
    heave_acceleration, pitch_acceleration : (N,) of the rig, m/s2 and rad/s2
    tyre_forces, heights : (N, 2) front and rear, N and m
    static_loads : front and rear, N
    scale : full-scale vehicle over the rig, in length
    """
    heave = rms(heave_acceleration)
    full = heave * scale
    variation = [tyre_load_variation(tyre_forces[:, i], static_loads[i]) for i in (0, 1)]
    return Ride(
        heave,
        rms(pitch_acceleration),
        full,
        mean_personal_rating(full),
        (variation[0], variation[1]),
        (workspace(heights[:, 0]), workspace(heights[:, 1])),
        MPR_RANGE[0] < rating_regression(full) < MPR_RANGE[1],
        scale,
    )
