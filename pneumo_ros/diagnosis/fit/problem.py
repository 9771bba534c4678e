# SPDX-License-Identifier: Apache-2.0
"""A fit's data and unknowns: logs averaged to fit samples, weights, and the vector of scaled unknowns.

Unknowns, in this order, each scaled to order one: nuisance parameters in prior sigmas, initial-state corrections of
every log in prior sigmas, effect values in their typical sizes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array, Mask
from pneumo_ros.diagnosis.fit.averaging import average, between, grouped
from pneumo_ros.diagnosis.fit.pace import Pace
from pneumo_ros.diagnosis.fit.record_pace import shared_pace
from pneumo_ros.diagnosis.fit.together import Done, Item, each
from pneumo_ros.diagnosis.model import Model, parameters_at
from pneumo_ros.diagnosis.record import Record
from pneumo_ros.diagnosis.traits import HasCoarse, HasModelForm, HasScale, HasSlowNoise
from pneumo_ros.effects.parameters import Active, EffectParameter, is_law

# Share of a channel's std below which a model of this kind is not asked to explain anything [taste]
MODEL_FORM_FLOOR: Final = 2.5e-3
COARSE_BELOW: Final = 2.1e-3  # s between rows; a slower log is not halved for its sensitivities [numerics]
REACH: Final = 3.0  # prior sigmas that a nuisance parameter may move [taste]
# Mean square of the tolerances, prior sigmas, from which on a structure strains them; one is as told [taste]
STRAINED: Final = 1.5
# Factor on the std of the measured initial state: its samples were low-passed, which white noise does not know
# [taste]
INITIAL_WIDENING: Final = 3.0
SELECT_EVERY: Final = 3  # one of so many blocks is kept from the fit and used for selection [taste]

Part = tuple[str, str]  # effect id, site


@dataclass(frozen=True)
class Candidate:
    """A set of effects at sites; empty: the nominal structure re-estimated."""

    parts: tuple[Part, ...] = ()

    @property
    def laws(self) -> tuple[Part, ...]:
        """The effects that are claimed, without the shapes that take up what their laws leave."""
        return tuple(part for part in self.parts if is_law(part[0]))

    @property
    def shapes(self) -> tuple[Part, ...]:
        """Shapes of families, and what may act anywhere."""
        return tuple(part for part in self.parts if not is_law(part[0]))

    @property
    def label(self) -> str:
        """Short name, for progress and messages."""
        return " + ".join(f"{e}:{s}" if s else e for e, s in self.parts) or "none"


@dataclass(frozen=True)
class Problem:
    """Model, logs and what is fixed about a fit.

    Attributes
    ----------
    model : a :class:`~pneumo_ros.diagnosis.model.Model`
    records : logs to fit
    own_average : log samples in one fit sample; None: what the logs' own pace says
    fold : which of every :data:`SELECT_EVERY` blocks is kept from the fit
    threads : simulations at a time; more than one pays where the model runs without the interpreter's lock
    tightness : times the weight that the tolerances of the nuisance parameters are told to have
    loose : whether each may be off by its :attr:`~pneumo_ros.effects.parameters.Parameter.loose` tolerances
    scanned : start values, SI, of shapes that these logs were scanned for
        (:mod:`pneumo_ros.diagnosis.search.intervals`)
    """

    model: Model
    records: tuple[Record, ...]
    own_average: int | None = None
    fold: int = SELECT_EVERY - 1
    threads: int = 1
    tightness: float = 1.0
    loose: bool = False
    scanned: Mapping[Part, tuple[float, ...]] = field(default_factory=dict)

    def each(self, work: Callable[[Item], Done], items: Iterable[Item]) -> list[Done]:
        """``work`` done on each item, in their order, several at a time."""
        return each(self.threads, work, items)

    @cached_property
    def pace(self) -> Pace:
        """Lengths that these logs are measured by."""
        return shared_pace(self.records)

    @cached_property
    def averaged(self) -> int:
        """Log samples in one fit sample: of the half car five keep 50 Hz at 500 Hz, and a fifth of the algebra."""
        shortest = min(len(r.measured) for r in self.records)
        return max(1, min(self.own_average or self.pace.averaged, shortest))

    @cached_property
    def states(self) -> int:
        """Length of the initial state."""
        return len(self.model.initial(self.records[0], ())[0])

    @cached_property
    def fixed(self) -> int:
        """Number of unknowns that every candidate has: nuisance and initial states."""
        return len(self.model.parameters) + self.states * len(self.records)

    @cached_property
    def measured(self) -> Array:
        """(n, C) averaged measurements of all logs, one after the other."""
        return np.vstack([self._averaged(k, r.measured) for k, r in enumerate(self.records)])

    @cached_property
    def weight(self) -> Array:
        """(n, C) 1/sigma, zero where no sample is there: noise after averaging and the model-form floor together."""
        form = np.vstack(
            [np.tile(form_of(r) * scale_of(r), (len(n), 1)) for r, n in zip(self.records, self._real, strict=True)]
        )
        sigma = np.hypot(self.noise, form)
        there = np.vstack([real.any(axis=1) for real in self._real])
        return np.asarray(there / np.where(sigma > 0.0, sigma, np.inf))

    @cached_property
    def noise(self) -> Array:
        """(n, C) standard deviation of the sensor noise after averaging; what of it wanders does not average out."""
        out = []
        for r, real in zip(self.records, self._real, strict=True):
            noise, slow = np.asarray(r.noise), np.asarray(r.slow_noise if isinstance(r, HasSlowNoise) else 0.0)
            white = np.sqrt(np.maximum(noise**2 - slow**2, 0.0)) if np.any(slow) else noise
            fast = white / np.sqrt(np.maximum(real.sum(axis=1), 1.0))
            out.append(np.hypot(fast, slow) if np.any(slow) else fast)
        return np.vstack(out)

    @cached_property
    def expected(self) -> Array:
        """(n, C) what noise and the model form that a rig's maker states leave; the noise where none is stated."""
        stated = [stated_form(r) * scale_of(r) for r in self.records]
        rows = [np.tile(s, (len(n), 1)) for s, n in zip(stated, self._real, strict=True)]
        return np.hypot(self.noise, np.vstack(rows))

    @cached_property
    def _real(self) -> list[Array]:
        """For each log (n, averaged, C): 1 where a real sample stands behind the row's value."""
        return [grouped(np.asarray(r.weight), self.averaged) for r in self.records]

    @cached_property
    def _shares(self) -> list[Array | None]:
        """For each log, what each row counts in its average: only real samples do, in log and prediction alike, so that
        a channel at a slower rate is compared where it was sampled. None where every sample is there."""
        out: list[Array | None] = []
        for real in self._real:
            total = real.sum(axis=1, keepdims=True)
            whole = bool(np.all(real == 1.0))
            out.append(None if whole else np.where(total > 0.0, real / np.maximum(total, 1.0), 1.0 / self.averaged))
        return out

    def _averaged(self, k: int, samples: Array) -> Array:
        """Fit samples of rows of log ``k``."""
        shares = self._shares[k]
        if shares is None:
            return average(samples, self.averaged)
        return np.asarray(np.einsum("nac,nac->nc", grouped(samples, self.averaged), shares))

    @cached_property
    def block(self) -> NDArray[np.int64]:
        """(n,) number of the time block of each fit sample, running on from log to log."""
        blocks, first = [], 0
        for r in self.records:
            time = np.arange(len(r.measured) // self.averaged) * self.averaged * r.period
            count = max(1, round(float(time[-1] + self.averaged * r.period) / self.pace.block))
            index = np.minimum((time / (time[-1] + 1e-12) * count).astype(np.int64), count - 1)
            blocks.append(first + index)
            first += count
        return np.concatenate(blocks)

    @cached_property
    def fitted(self) -> Mask:
        """(n,) samples that the fit sees; the others are for selection."""
        return self.block % SELECT_EVERY != self.fold

    @cached_property
    def samples(self) -> float:
        """Effective number of fitted samples: what the training cost grows with."""
        return float(np.count_nonzero(self.fitted) * self.weight.shape[1] / self.pace.correlation)

    @cached_property
    def rows_of(self) -> tuple[slice, ...]:
        """The fit samples of each log."""
        ends = np.cumsum([0, *(len(r.measured) // self.averaged for r in self.records)]).tolist()
        return tuple(slice(first, last) for first, last in pairwise(ends))

    @cached_property
    def parameters_of(self) -> dict[Part, tuple[EffectParameter, ...]]:
        """Parameters of each effect where it may act."""
        return {(e.id, site): parameters_at(e, site) for e in self.model.effects.values() for site in e.sites}

    def effect_parameters(self, candidate: Candidate) -> tuple[EffectParameter, ...]:
        """Parameters of all its effects, in order."""
        found = self._parameters.get(candidate)
        if found is None:
            found = tuple(p for part in candidate.parts for p in self.parameters_of[part])
            self._parameters[candidate] = found
        return found

    @cached_property
    def _parameters(self) -> dict[Candidate, tuple[EffectParameter, ...]]:
        """Of candidates asked for: each of their simulations asks four times."""
        return {}

    def active(self, candidate: Candidate, values: Array) -> tuple[Active, ...]:
        """Its effects with values (SI)."""
        out, first, numbers = [], 0, values.tolist()
        for effect, site in candidate.parts:
            count = len(self.parameters_of[effect, site])
            out.append(Active(effect, site, tuple(numbers[first : first + count])))
            first += count
        return tuple(out)

    def bounds(self, candidate: Candidate) -> tuple[Array, Array]:
        """Lower and upper bounds of the scaled unknowns."""
        parameters = self.effect_parameters(candidate)
        count = len(self.model.parameters)
        free = np.full(self.fixed - count, np.inf)
        reach = REACH * self._widths
        low = np.array([p.low / p.typical for p in parameters])
        high = np.array([p.high / p.typical for p in parameters])
        return np.concatenate([-reach, -free, low]), np.concatenate([reach, free, high])

    def prior(self, candidate: Candidate) -> Array:
        """Inverse variance of each scaled unknown: nuisance and initial state one (the former times :attr:`tightness`),
        effects that of their spread."""
        own = [1.0 / p.spread**2 for p in self.effect_parameters(candidate)]
        count = len(self.model.parameters)
        return np.concatenate([self.tightness / self._widths**2, np.ones(self.fixed - count), own])

    @cached_property
    def _widths(self) -> Array:
        """Of the nuisance parameters' priors, in their tolerances."""
        return np.array([p.loose if self.loose else 1.0 for p in self.model.parameters])

    def start(self, candidate: Candidate, fixed: Array | None, values: Sequence[float]) -> Array:
        """Scaled unknowns from the fixed part (None: nominal) and effect values (SI)."""
        scaled = [v / p.typical for v, p in zip(values, self.effect_parameters(candidate), strict=True)]
        return np.concatenate([np.zeros(self.fixed) if fixed is None else fixed, scaled])

    def strains(self, x: Array) -> bool:
        """Whether scaled unknowns strain the tolerances, as where these answer for an effect that is missing."""
        own = x[: len(self.model.parameters)]
        return len(own) > 0 and bool(own @ own >= STRAINED * len(own))

    def values(self, candidate: Candidate, x: Array) -> Array:
        """Effect values, SI."""
        return x[self.fixed :] * np.array([p.typical for p in self.effect_parameters(candidate)])

    def nuisance(self, x: Array) -> Array:
        """Nuisance values, SI."""
        parameters = self.model.parameters
        return np.array([p.nominal + p.std * v for p, v in zip(parameters, x, strict=False)])

    def predict(self, candidate: Candidate, x: Array) -> Array:
        """(n, C) averaged prediction of all logs."""
        return np.vstack([self.predict_log(k, record, candidate, x) for k, record in enumerate(self.records)])

    def predict_log(self, k: int, record: Record, candidate: Candidate, x: Array) -> Array:
        """(n_k, C) averaged prediction of one log, which may stand there in another form."""
        nuisance, active = self.nuisance(x), self.active(candidate, self.values(candidate, x))
        initial, std = self.model.initial(record, active)
        first = len(self.model.parameters) + k * self.states
        initial = initial + INITIAL_WIDENING * std * x[first : first + self.states]
        return self._averaged(k, self.model.predict(record, nuisance, initial, active))

    def gap(self, residual: Array) -> float:
        """Normalised gap on the fitted logs (averaged samples) of a residual in sigmas."""
        sigma = np.where(self.weight > 0.0, 1.0 / np.maximum(self.weight, 1e-300), 0.0)
        scale = np.mean([scale_of(r) for r in self.records], axis=0)
        there = np.maximum((self.weight > 0.0).sum(axis=0), 1)
        return float(np.sqrt(np.mean(np.sum((residual * sigma / scale) ** 2, axis=0) / there)))

    @cached_property
    def coarse_records(self) -> tuple[Record, ...] | None:
        """The logs at half the rate, if the model knows how: good enough for sensitivities at half the cost."""
        model = self.model
        if not isinstance(model, HasCoarse) or any(r.period > COARSE_BELOW for r in self.records):
            return None
        return tuple(model.coarse(r) for r in self.records)

    def predict_coarse(self, candidate: Candidate, x: Array) -> Array:
        """(n, C) as :meth:`predict`, from the coarse logs."""
        if self.coarse_records is None:
            return self.predict(candidate, x)
        return np.vstack([self._from_coarse(k, r, candidate, x) for k, r in enumerate(self.coarse_records)])

    def predict_log_coarse(self, k: int, record: Record, candidate: Candidate, x: Array) -> Array:
        """(n_k, C) as :meth:`predict_log`, from the coarse log."""
        if self.coarse_records is None:
            return self.predict_log(k, record, candidate, x)
        assert isinstance(self.model, HasCoarse)
        return self._from_coarse(k, self.model.coarse(record), candidate, x)

    def coarse_serves(self, candidate: Candidate, x: Array) -> bool:
        """Whether the coarse logs are good enough for the sensitivities there."""
        model = self.model
        return isinstance(model, HasCoarse) and model.coarse_serves(self.active(candidate, self.values(candidate, x)))

    def _from_coarse(self, k: int, record: Record, candidate: Candidate, x: Array) -> Array:
        nuisance, active, whole = self.nuisance(x), self.active(candidate, self.values(candidate, x)), self.records[k]
        initial, std = self.model.initial(whole, active)
        first = len(self.model.parameters) + k * self.states
        initial = initial + INITIAL_WIDENING * std * x[first : first + self.states]
        rows = self.model.predict(record, nuisance, initial, active)
        return self._averaged(k, between(rows, len(whole.measured)))

    def residual(self, candidate: Candidate, x: Array) -> Array:
        """(n, C) measured - predicted, in sigmas."""
        with np.errstate(over="ignore", invalid="ignore"):  # a run that runs away: its cost is infinite
            return (self.measured - self.predict(candidate, x)) * self.weight


def stated_form(record: Record) -> float:
    """Share of a channel's std that the maker's model form is worth; 0 where nothing is stated."""
    return float(record.model_form) if isinstance(record, HasModelForm) else 0.0


def form_of(record: Record) -> float:
    """Share of a channel's std that the maker's model form is worth, with the floor of any model of this kind."""
    return float(np.hypot(MODEL_FORM_FLOOR, stated_form(record)))


def scale_of(record: Record) -> Array:
    """Std of the log's channels, what the gap is normalised by; a constant channel counts as its noise."""
    own = record.scale if isinstance(record, HasScale) else np.std(record.measured, axis=0)
    return np.maximum(own, np.maximum(record.noise, 1e-12))
