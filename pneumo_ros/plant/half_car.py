# SPDX-License-Identifier: Apache-2.0
"""The half car of a rig, ready to integrate: its numbers for :mod:`pneumo_ros.plant.equations`, and runs of them.

State (10) as :data:`~pneumo_ros.rig.channels.STATE_FIELDS`. Inputs: commanded orifice areas (front inlet, rear inlet,
front outlet, rear outlet) [m2], held over a period, and road height (front, rear) [m], linear over a period.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.plant.air_spring import MEAN_AREA, VOLUME_OFFSET, AreaSurface, Gas, load_surface
from pneumo_ros.plant.equations import Body, derivative
from pneumo_ros.plant.integrator import DEFAULT_STEP, advance_packed, simulate, substeps
from pneumo_ros.plant.orifice import critical_ratio, flow_function
from pneumo_ros.rig import LIMITS, Rig
from pneumo_ros.units import INCH

BUMP_STOP_HEIGHT = 1.2 * INCH  # m, below it the stop pushes; not in the thesis: keeps every run bounded
BUMP_STOP_STIFFNESS = 2e5  # N/m


@dataclass(frozen=True)
class HalfCar:
    """A half car ready to integrate: parameters only, no state.

    Attributes
    ----------
    body : masses and stiffnesses
    front, rear : gas of each spring
    surface : effective area over height and gauge pressure
    step : longest RK4 step, s
    """

    body: Body
    front: Gas
    rear: Gas
    surface: AreaSurface
    step: float = DEFAULT_STEP

    @cached_property
    def packed(self) -> NDArray[np.float64]:
        """(42,) body, front and rear gas in one array.

        Handing 42 numbers to compiled code one by one costs more than a whole control period of simulation (6 us
        against 1 us); one array costs 0.1 us.
        """
        return np.array([*self.body, *self.front, *self.rear])

    def advance(
        self, state: NDArray[np.float64], command: NDArray[np.float64], road: NDArray[np.float64], period: float
    ) -> NDArray[np.float64]:
        """State after one period.

        Parameters
        ----------
        state : (10,) float64
        command : (4,) float64, orifice areas, m2, held
        road : (2, 2) float64, front and rear height, m, at the start (row 0) and end (row 1) of the period
        period : s
        """
        surface = self.surface
        return advance_packed(
            state, command, road, period, substeps(period, self.step), self.packed, surface.heights,
            surface.pressures, surface.cubics,
        )  # fmt: skip

    def simulate(
        self, state: NDArray[np.float64], commands: NDArray[np.float64], road: NDArray[np.float64], period: float
    ) -> NDArray[np.float64]:
        """Trajectory over N periods: commands (N, 4), road (N + 1, 2) -> states (N + 1, 10)."""
        return simulate(
            np.asarray(state, dtype=float),
            np.ascontiguousarray(commands, dtype=float),
            np.ascontiguousarray(road, dtype=float),
            period,
            substeps(period, self.step),
            self.body,
            self.front,
            self.rear,
            self.surface,
        )

    def rates(
        self, state: NDArray[np.float64], command: NDArray[np.float64], road: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Time derivative of the state, (10,), at one instant: command (4,), road (2,)."""
        return np.array(
            derivative(
                tuple(np.asarray(state, dtype=float)),
                *(float(v) for v in command),
                float(road[0]),
                float(road[1]),
                self.body,
                self.front,
                self.rear,
                self.surface,
            )
        )


def half_car(
    rig: Rig, reference_pressures: tuple[float, float], surface: AreaSurface | None = None, step: float = DEFAULT_STEP
) -> HalfCar:
    """Build the half car of a rig.

    Parameters
    ----------
    rig : parameters, SI
    reference_pressures : static pressures of the *nominal* rig, front and rear, Pa absolute (Eq. 4.17's reference;
        :func:`pneumo_ros.plant.trim.trim` gives them). They stay when parameters are perturbed.
    surface : effective area surface; the 2M2A's by default
    step : longest RK4 step, s
    """
    v = {name: getattr(rig, name).value for name in LIMITS}
    body = Body(
        sprung_mass=v["sprung_mass"],
        pitch_inertia=v["pitch_inertia"],
        front_arm=v["front_arm"],
        rear_arm=v["rear_arm"],
        unsprung_mass_front=v["unsprung_mass_front"],
        unsprung_mass_rear=v["unsprung_mass_rear"],
        tyre_stiffness_front=v["tyre_stiffness_front"],
        tyre_stiffness_rear=v["tyre_stiffness_rear"],
        damping_front=v["bushing_damping"],
        damping_rear=v["bushing_damping"],
        area_scale_front=v["effective_area_scale"],
        area_scale_rear=v["effective_area_scale"],
        stop_height=BUMP_STOP_HEIGHT,
        stop_stiffness=BUMP_STOP_STIFFNESS,
    )
    front, rear = (gas_of(rig, reference) for reference in reference_pressures)
    return HalfCar(body, front, rear, surface or load_surface(), step)


def gas_of(rig: Rig, reference_pressure: float) -> Gas:
    """The gas of one spring of a rig; ``reference_pressure`` Pa absolute as in :func:`half_car`."""
    n = rig.polytropic_exponent.value
    k = (n - 1.0) / n
    supply, ambient = rig.supply_pressure.value, rig.ambient_pressure.value
    critical = float(critical_ratio(n))
    return Gas(
        exponent=n,
        k=k,
        supply_pressure=supply,
        ambient_pressure=ambient,
        supply_temperature=rig.supply_temperature.value,
        reference_pressure=reference_pressure,
        supply_power=(reference_pressure / supply) ** k,
        ambient_power=(ambient / reference_pressure) ** k,
        critical=critical,
        choked=float(flow_function(critical, n)),
        inlet_scale=rig.discharge_coefficient.value,
        outlet_scale=rig.discharge_coefficient.value,
        volume_offset=VOLUME_OFFSET * rig.volume_scale.value,
        mean_area=MEAN_AREA * rig.volume_scale.value,
    )
