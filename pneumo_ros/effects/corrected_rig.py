# SPDX-License-Identifier: Apache-2.0
"""The rig as diagnosed, stepped period by period: what sessions, the emulator and the closed loop run.

A step is a block of one row through the same hooks and the same kernel that simulate whole logs, with everything that
an effect remembers (lags, delays, bristles, air masses, a sagging supply) carried in the state. So stepping gives the
numbers of :meth:`pneumo_ros.effects.rig_model.RigModel.simulate`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.effects.configured import library_of
from pneumo_ros.effects.contract import Inputs, Plant
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import NO_CORRECTION, Memories, RigModel
from pneumo_ros.errors import PneumoError
from pneumo_ros.plant.half_car import HalfCar
from pneumo_ros.plant.integrator import DEFAULT_STEP, substeps
from pneumo_ros.plant.sensors import read_channels, truth
from pneumo_ros.plant.trim import trim
from pneumo_ros.rig import Rig
from pneumo_ros.units import GRAVITY

INSTANT = 1e-7  # s: over so short a step the rates' change is the acceleration, to 1e-8 of g


class CorrectedState(NamedTuple):
    """Everything that the next step needs.

    Attributes
    ----------
    plant : (10,) of :mod:`pneumo_ros.plant.equations`
    inner : (K, 2, S) states of the kernel's terms
    road : (2,) height that acts, m
    acting : (4,) openings that acted in the last period, m2
    inputs, outputs : what effects keep
    channels : (6,) as the sensors show them
    started : False before the first step
    """

    plant: Array
    inner: Array
    road: Array
    acting: Array
    inputs: Memories
    outputs: Memories
    channels: tuple[float, ...]
    started: bool


@dataclass(frozen=True)
class CorrectedRig:
    """A rig model that is stepped; implements :class:`pneumo_ros.plant.stepping.SteppedRig`.

    Attributes
    ----------
    model : the rig with the library, and the effects that the rig's configuration names
    period : s
    nuisance : values of the model's parameters; None for the configuration's
    active : further effects
    start : (10,) plant state to begin at; None for the trim of the rig's numbers
    """

    model: RigModel
    period: float
    nuisance: Array | None = None
    active: tuple[Active, ...] = ()
    start: Array | None = None

    @cached_property
    def plant(self) -> Plant:
        """Parameters of the equations."""
        return self.model.plant(self.nuisance, self.active)

    @cached_property
    def car(self) -> HalfCar:
        """The equations without the kernel's terms."""
        return HalfCar(*self.plant, self.model.surface, self.model.step)

    @cached_property
    def _switches(self) -> tuple[Mask, Array] | None:
        terms = self.model.terms(self.active)
        return self.model.switches(terms) if terms else None

    def init(self) -> CorrectedState:
        """At the start; no effect remembers anything."""
        state = trim(self.model.rig).state if self.start is None else self.start
        return self._seen(CorrectedState(state, self.model.inner(), np.zeros(2), np.zeros(4), (), (), (), False))

    def step(self, state: CorrectedState, command: Array, road: Array) -> CorrectedState:
        """One period.

        Raises
        ------
        PneumoError
            if the rig runs away: its effects are not those of a rig that stands.
        """
        # The road's rows are a stream: its first row comes with the first step, then one row a period.
        given = Inputs(command.reshape(1, 4), road if not state.started else road[1:])
        acting, kept = self.model.driven(given, self.period, self.active, state.inputs)
        heights = acting.road if not state.started else np.vstack([state.road, acting.road])
        plant, inner = self._advanced(state, acting.commands, heights, self.period)
        if not np.isfinite(plant[0]):
            raise PneumoError(
                f"the simulated rig ran away: its effects ({self.names}) make it unstable in this session"
            )
        return self._seen(
            CorrectedState(plant, inner, heights[-1], acting.commands[0], kept, state.outputs, state.channels, True)
        )

    def read(self, state: CorrectedState) -> tuple[float, ...]:
        """Through the sensors' effects."""
        return state.channels

    def plant_state(self, state: CorrectedState) -> Array:
        """State of the half car, (10,), without what effects remember."""
        return state.plant

    def truth(self, state: CorrectedState, command: Array, road: Array) -> Array:
        """With the effects' forces in accelerations and tyre forces; the areas are the table's.

        Command and road only count before the first step; afterwards it is what acts that acts.
        """
        if not state.started:
            return truth(self.car, state.plant, command, road)
        heights = np.vstack([state.road, state.road])
        after, _ = self._advanced(state, state.acting.reshape(1, 4), heights, INSTANT)
        rates = (after[4:8] - state.plant[4:8]) / INSTANT
        out = truth(self.car, state.plant, state.acting, state.road)
        out[10:12] = rates[:2]
        out[14:16] = _tyre_forces(rates, self.plant)
        return out

    def supply(self, state: CorrectedState) -> float:
        """With what an effect takes from it."""
        drop = 0.0
        for one in self.model.terms(self.active):
            term = self.model.library[one.effect].term
            if term is not None and term.supply is not None and state.started:
                k = [slot.name for slot in self.model.slots].index(self.model.library[one.effect].place_in_kernel)
                values = self.model.switches([one])[1][k, 0]
                drop += term.supply(tuple(state.inner[k, 0, : term.states]), tuple(values))
        return self.plant.front.supply_pressure - drop

    def with_supply(self, pressure: float) -> CorrectedRig:
        """The same effects and values at another supply."""
        rig = self.model.rig.with_values(supply_pressure=pressure)
        references = {
            f"reference_pressure_{end}": gas.reference_pressure
            for end, gas in (("front", self.plant.front), ("rear", self.plant.rear))
        }
        rig = replace(rig, ends=tuple({**dict(rig.ends), **references}.items()))
        nuisance = None if self.nuisance is None else self.nuisance.copy()
        for m, p in enumerate(self.model.parameters):
            if nuisance is not None and p.name == "supply_pressure":
                nuisance[m] = pressure
        start = trim(self.model.rig).state if self.start is None else self.start
        return replace(self, model=replace(self.model, rig=rig), nuisance=nuisance, start=start)

    @property
    def names(self) -> str:
        """Effects and where they act."""
        effects = (*self.model.configured, *self.active)
        return ", ".join(f"{one.effect} ({one.site or 'rig'})" for one in effects) or "no effect"

    def _advanced(self, state: CorrectedState, command: Array, road: Array, period: float) -> tuple[Array, Array]:
        """Plant state and inner states one period of acting inputs later."""
        if self._switches is None:
            return self.car.advance(state.plant, command[0], np.ascontiguousarray(road), period), state.inner
        on, values = self._switches
        inner = state.inner.copy()
        out = self.model.kernel(
            state.plant, np.ascontiguousarray(command), np.ascontiguousarray(road), NO_CORRECTION, period,
            substeps(period, self.model.step), *self.plant, self.model.surface, on, values, inner, state.started,
        )  # fmt: skip
        return out[1], inner

    def _seen(self, state: CorrectedState) -> CorrectedState:
        body = self.plant.body
        exact = np.array([read_channels(state.plant, body.front_arm, body.rear_arm)])
        shown, kept = self.model.sensed(exact, self.period, self.active, state.outputs)
        return state._replace(channels=tuple(shown[0].tolist()), outputs=kept)


def _tyre_forces(rates: Array, plant: Plant) -> Array:
    """(2,) N upwards on the axles, from accelerations of heave, pitch and axles (4,): Eqs. 4.63-4.68 solved."""
    body = plant.body
    force, moment = body.sprung_mass * (rates[0] + GRAVITY), body.pitch_inertia * rates[1]
    base = body.front_arm + body.rear_arm
    struts = np.array([(body.rear_arm * force + moment) / base, (body.front_arm * force - moment) / base])
    masses = np.array([body.unsprung_mass_front, body.unsprung_mass_rear])
    return np.asarray(masses * (rates[2:] + GRAVITY) + struts)


def diagnosed_rig(rig: Rig, period: float) -> CorrectedRig:
    """A rig whose configuration names effects, or values of an end, ready to step.

    Raises
    ------
    InputError
        if its effects are not those of the library.
    """
    rig_found = CorrectedRig(RigModel(rig, library_of(rig), step=DEFAULT_STEP), period)
    # Compiled code is loaded now, so that the first period is as short as the others.
    state = rig_found.step(rig_found.init(), trim(rig).command, np.zeros((2, 2)))
    rig_found.truth(state, trim(rig).command, np.zeros(2))
    return rig_found
