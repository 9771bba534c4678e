# SPDX-License-Identifier: Apache-2.0
"""Which places make the gap: the smallest set of places whose flexible correction closes it, and each one's fair share.

The corrections are fitted to the weak residuals of the logs to fit and judged on those of the log held out, always with
the uncertain parameters free inside their tolerances. The set is chosen on alternate blocks of the logs to fit, so that
the held-out log only judges. Where no such set predicts the held-out log, its own equations say which places move.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pneumo_ros.arrays import Array
from pneumo_ros.diagnosis.half_car.signals import Signals
from pneumo_ros.diagnosis.half_car.where.design import Design, design_of, with_sensor_columns
from pneumo_ros.diagnosis.half_car.where.path_share import explained
from pneumo_ros.diagnosis.half_car.where.sets import FLAT, LARGEST, Closing, best_subset, rivals, shapley, smallest
from pneumo_ros.diagnosis.half_car.where.solve import Forms, Rows, forms_of
from pneumo_ros.diagnosis.half_car.where.time_course import time_courses_of
from pneumo_ros.diagnosis.half_car.where.weak import EQUATIONS
from pneumo_ros.effects.parameters import Active
from pneumo_ros.effects.rig_model import RigModel

# share of the held-out squared residual: shapes that close less do not know the law, and its time course decides
# [taste]
TRUSTED: Final = 0.5
MOST_TIME_COURSES: Final = 2  # places with a free time course in one set: three would fit any residual [taste]
# share of the squared residual that a second time course must close: bumps 40 ms apart leave a few per cent
# themselves [numerics]
SECOND: Final = 0.1
# Gauss-Newton passes on each sensor's error: the first comes within a few per cent, the others settle corners (stops)
# [numerics]
SENSOR_PASSES: Final = 3
BLOCK: Final = 0.5  # s, longer than the memory of a window, shorter than the body's period [physics]


@dataclass(frozen=True)
class Start:
    """The model that the search starts from: nominal by default.

    Attributes
    ----------
    nuisance : (P,) parameter values already fitted, or None
    active : effects already in the model
    """

    nuisance: Array | None = None
    active: tuple[Active, ...] = ()

    @property
    def nominal(self) -> bool:
        """Whether nothing has been fitted yet."""
        return self.nuisance is None and not self.active

    def put_into(self, model: RigModel, design: Design) -> Design:
        """The design of a log without what the started model accounts for."""
        if self.nominal and not model.configured:
            return design
        known = explained(model, design, self.values(model, np.zeros(len(model.parameters))), self.active)
        return replace(design, residual=design.residual - known * design.weight / design.null)

    def offset(self, model: RigModel) -> Array:
        """(P,) standard deviations that the parameters are from nominal."""
        if self.nuisance is None:
            return np.zeros(len(model.parameters))
        return np.array([(v - p.nominal) / p.std for v, p in zip(self.nuisance, model.parameters, strict=True)])

    def values(self, model: RigModel, sigmas: Array) -> Array:
        """(P,) parameter values, ``sigmas`` standard deviations from the start's."""
        own = [p.nominal for p in model.parameters] if self.nuisance is None else self.nuisance
        return np.asarray(own, dtype=float) + sigmas * np.array([p.std for p in model.parameters])


@dataclass(frozen=True)
class Location:
    """Where the gap lives.

    Attributes
    ----------
    shares : (place, share of the held-out squared residual), largest first; what is missing to one is
        unexplained
    chosen : the smallest set of places that closes what can be closed; empty if there is no gap to speak of
    alone : (place, share closed when it alone is corrected), largest first
    rivals : other sets of the same size that close nearly as much, with the level they leave
    level : rms residual in null standard deviations on the held-out log: ``nominal``, ``refit`` (parameters inside
        their tolerances), ``chosen`` and ``flexible`` (all places at once)
    equations : per equation the level (``nominal``, ``refit``, ``chosen``)
    nuisance : (P,) parameters that go with ``chosen``, in standard deviations from the start's
    coefficients : of every basis, zero outside ``chosen``
    fit, judge : the fitted logs' problems and the judge's, for what comes after (regimes, simulation)
    followed : shapes of the chosen places follow what is missing there; if not, the places are known by the equations
        that a free time course closes (:mod:`pneumo_ros.diagnosis.half_car.where.time_course`)
    """

    shares: tuple[tuple[str, float], ...]
    chosen: tuple[str, ...]
    alone: tuple[tuple[str, float], ...]
    rivals: tuple[tuple[tuple[str, ...], float], ...]
    level: dict[str, float]
    equations: dict[str, dict[str, float]]
    nuisance: Array
    coefficients: Array
    refit_nuisance: Array
    fit: tuple[Design, ...]
    judge: Design
    forms: Forms
    start: Start
    followed: bool = True

    @property
    def flat(self) -> bool:
        """Whether noise, tolerances and model form explain every equation."""
        return not self.chosen

    @property
    def flexible_improves(self) -> float:
        """How much lower (ratio of levels) the chosen flexible correction leaves the residual than refitting does."""
        return self.level["refit"] / max(self.level["chosen"], 1.0)


def locate(model: RigModel, fit: Sequence[Signals], holdout: Signals, start: Start | None = None) -> Location:
    """Find the places of the gap between a rig model and its logs.

    Parameters
    ----------
    model : the nominal rig with its tolerances
    fit : logs the corrections are fitted to
    holdout : log they are judged on
    start : parameters and effects already in the model; the places then tell what those leave
    """
    start = start or Start()
    designs = _designs(model, [*fit, holdout], start)
    fitted, judge = designs[:-1], designs[-1]
    offset = start.offset(model)
    places = [basis.place for basis in judge.bases]
    final = forms_of(_stacked(fitted), _stacked([judge]), offset, places)
    names = final.testable()
    chosen = smallest(_halved(fitted, offset, places), names, LARGEST)
    refit_square = max(final.value(()), 1e-12)
    closing: Closing = final
    followed = final.value(chosen) < (1.0 - TRUSTED) * refit_square
    if refit_square > FLAT**2 and not followed:
        courses = time_courses_of(judge, model, offset)
        closing, chosen = courses, smallest(courses, courses.candidates(), MOST_TIME_COURSES, SECOND)
    return _location(closing, final, chosen, names, fitted, judge, start)


def _location(
    closing: Closing,
    forms: Forms,
    chosen: Sequence[str],
    names: Sequence[str],
    fitted: Sequence[Design],
    judge: Design,
    start: Start,
) -> Location:
    """Everything that is said of a set of places, ``closing`` having judged it."""
    count = forms.parameters
    before = max(closing.value(()), 1e-12)
    shares = shapley(closing, chosen or best_subset(closing, min(3, len(names)), [], names))
    alone = {place: 1.0 - closing.value([place]) / before for place in names}
    return Location(
        shares=_sorted({place: max(part, 0.0) / before for place, part in shares.items()}),
        chosen=tuple(sorted(chosen, key=lambda place: -shares[place])),
        alone=_sorted({place: share for place, share in alone.items() if share > 0.0}),
        rivals=rivals(closing, chosen, names),
        level={
            "nominal": float(np.sqrt(judge.residual[judge.weight > 0] @ judge.residual[judge.weight > 0] / forms.rows)),
            "refit": float(np.sqrt(forms.value(()))),
            "chosen": float(np.sqrt(forms.value(chosen))),
            "flexible": float(np.sqrt(forms.value(names))),
        },
        equations=_by_equation(judge, forms, chosen),
        nuisance=forms.coefficients(chosen)[:count],
        coefficients=spread(forms, chosen),
        refit_nuisance=forms.coefficients(())[:count],
        fit=tuple(fitted),
        judge=judge,
        forms=forms,
        start=start,
        followed=closing is forms,
    )


def corrected_residual(design: Design, nuisance: Array, coefficients: Array) -> Array:
    """Residuals (K, 6) in null standard deviations with parameters (in sigma) and corrections applied."""
    out = design.residual + np.tensordot(nuisance, design.parameters, 1) + np.tensordot(coefficients, design.columns, 1)
    corrected = {basis.place for basis, value in zip(design.bases, coefficients, strict=True) if value != 0.0}
    for place, rest in design.nonlinear.items():
        if place in corrected:
            out = out + rest
    return np.asarray(out)


def _designs(model: RigModel, logs: Sequence[Signals], start: Start) -> list[Design]:
    first = design_of(model, logs[0])
    rest = [design_of(model, log, first.features.yardstick) for log in logs[1:]]
    designs = [start.put_into(model, design) for design in (first, *rest)]
    offset, places = start.offset(model), [basis.place for basis in first.bases]
    for _ in range(SENSOR_PASSES):
        forms = forms_of(_stacked(designs[:-1]), _stacked(designs[:-1]), offset, places)
        for place in [name for name in forms.testable() if name.startswith("sensor:")]:
            error = forms.solve([place])[len(offset) :]
            designs = [with_sensor_columns(design, model, place, error) for design in designs]
    return designs


def _flat(design: Design) -> Rows:
    columns = np.concatenate([design.parameters, design.columns])
    nonlinear = {place: rest.ravel() for place, rest in design.nonlinear.items()}
    return Rows(design.residual.ravel(), columns.reshape(len(columns), -1).T, nonlinear)


def _stacked(designs: Sequence[Design]) -> Rows:
    parts = [_flat(design) for design in designs]
    nonlinear = {place: np.concatenate([part.nonlinear[place] for part in parts]) for place in parts[0].nonlinear}
    columns = np.concatenate([part.columns for part in parts])
    return Rows(np.concatenate([part.residual for part in parts]), columns, nonlinear)


def _halved(designs: Sequence[Design], offset: Array, places: Sequence[str]) -> Forms:
    """Fitted on every other block of the logs to fit, judged on the blocks between."""
    rows = _stacked(designs)
    odd = np.concatenate([_odd_rows(design) for design in designs])
    return forms_of(rows.masked(~odd), rows.masked(odd), offset, places)


def _odd_rows(design: Design) -> NDArray[np.bool_]:
    block = (design.windows.centres * design.signals.period / BLOCK).astype(int)
    return np.repeat(block % 2 == 1, len(EQUATIONS))


def _by_equation(judge: Design, forms: Forms, chosen: Sequence[str]) -> dict[str, dict[str, float]]:
    count = forms.parameters
    none = np.zeros(len(judge.columns))
    states = {
        "nominal": judge.residual,
        "refit": corrected_residual(judge, forms.coefficients(())[:count], none),
        "chosen": corrected_residual(judge, forms.coefficients(chosen)[:count], spread(forms, chosen)),
    }
    rows = np.maximum(judge.weight.sum(axis=0), 1.0)
    return {
        equation: {name: float(np.sqrt((r[:, e] ** 2).sum() / rows[e])) for name, r in states.items()}
        for e, equation in enumerate(EQUATIONS)
    }


def spread(forms: Forms, chosen: Sequence[str]) -> Array:
    """Coefficients of every basis: fitted inside the chosen places, zero outside."""
    out = np.zeros(len(forms.sizes))
    if chosen:
        out[forms.index(chosen)[forms.parameters :] - forms.parameters] = forms.coefficients(chosen)[forms.parameters :]
    return out


def _sorted(shares: dict[str, float]) -> tuple[tuple[str, float], ...]:
    return tuple(sorted(((place, float(share)) for place, share in shares.items()), key=lambda item: -item[1]))
