# SPDX-License-Identifier: Apache-2.0
"""A log of any small plant: what it put out and what drove it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumo_ros.arrays import Array

PERIOD, NOISE = 2e-3, 1e-3


@dataclass(frozen=True)
class DrivenLog:
    """One output with white noise, no sample missing."""

    measured: Array
    drive: Array
    name: str = "plant"
    period: float = PERIOD
    noise_std: float = NOISE

    @property
    def weight(self) -> Array:
        return np.ones_like(self.measured)

    @property
    def noise(self) -> Array:
        return np.array([self.noise_std])

    def slice(self, first: int, last: int) -> DrivenLog:
        return replace(self, measured=self.measured[first:last], drive=self.drive[first:last])
