# SPDX-License-Identifier: Apache-2.0
"""One shape that a flexible correction may take."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

# What a correction's series is added to; ``column`` 0 front, 1 rear, or the channel's column [definition]
KINDS: Final = ("force", "air", "axle", "heave", "pitch", "supply", "road", "sensor")


class Basis(NamedTuple):
    """A correction at one place.

    Attributes
    ----------
    place : contract name of the place
    name : of the shape
    kind : one of :data:`KINDS`: force of a spring, N, up on the body; air let into a spring, kg/s; force on an axle, N;
        force on the body, N; moment on the body, N m, nose up; supply pressure, Pa; road height, m; measured channel,
        in its unit
    column : 0 front, 1 rear, or the channel's column; 0 where there is one only
    series : (N,)
    """

    place: str
    name: str
    kind: str
    column: int
    series: NDArray[np.float64]
