# SPDX-License-Identifier: Apache-2.0
"""A diagnosis from log files: reads them, builds the model with the wanted library, and runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from pneumo_ros.diagnosis.diagnose import Fitted, Options, diagnose, split_by_time
from pneumo_ros.diagnosis.fit.together import each
from pneumo_ros.diagnosis.half_car.signals import Signals, check_pair, read_signals
from pneumo_ros.diagnosis.half_car.signals.wiring import check_wiring
from pneumo_ros.diagnosis.half_car.where import (
    Location,
    Start,
    flexible_gain,
    held_equations,
    latent_places,
    locate,
)
from pneumo_ros.diagnosis.judge.equations import Equations
from pneumo_ros.diagnosis.judge.outcome import Whereabouts
from pneumo_ros.diagnosis.result import Diagnosis
from pneumo_ros.diagnosis.search.state import Progress
from pneumo_ros.effects.configured import library_of, with_files
from pneumo_ros.effects.loading import laws_of, origins, own_ids
from pneumo_ros.effects.rig_model import RigModel
from pneumo_ros.errors import InputError, not_one_of
from pneumo_ros.rig import Rig


@dataclass(frozen=True)
class Task:
    """Logs that were read and the model that fits them."""

    model: RigModel
    fit: tuple[Signals, ...]
    holdout: Signals
    edit: Signals | None = None
    notes: tuple[str, ...] = ()

    def diagnose(self, options: Options | None = None, progress: Progress | None = None) -> Diagnosis:
        """Run the diagnosis, with the places of what is left found by flexible corrections."""
        chosen = options or Options()
        if chosen.locate is None:
            chosen = replace(chosen, locate=flexible_search)
        if chosen.equations is None:
            chosen = replace(chosen, equations=left_in_equations)
        if chosen.inputs is None:
            chosen = replace(chosen, inputs=latent_places)
        found = diagnose(self.model, self.fit, self.holdout, chosen, progress, self.edit)
        return replace(found, notes=(*self.notes, *found.notes))


def prepared(
    fit: Sequence[str | Path],
    holdout: str | Path | None = None,
    rig: Rig | None = None,
    edit: str | Path | None = None,
    effects: Sequence[str | Path] = (),
    without: Sequence[str] = (),
    threads: int = 1,
) -> Task:
    """Read the logs and build the model.

    Parameters
    ----------
    fit : logs to fit, at least one
    holdout : log nothing is fitted to; None: the end of the last fit log
    rig : in place of the one the logs carry
    edit : log of the rig after a known change (its own configuration states the change)
    effects : Python files with further effects
    without : ids of effects that must not compete
    threads : simulations at a time

    Raises
    ------
    InputError
        for logs, rigs or effects that cannot be used, and for inputs that throw the nominal model off.
    """
    if not fit:
        raise InputError("no log to fit", remedy="give at least one log")
    first = read_signals(fit[0], rig)
    own = with_files(first.rig, effects)
    library = library_of(own, effects)
    for name in without:
        if name not in library:
            raise not_one_of("unknown effect", name, sorted(laws_of(library)), key="without")
    logs = [first, *(read_signals(path, rig) for path in fit[1:])]
    model = RigModel(own, library, frozenset(without))
    names = own_ids(library)
    told = [f"effects of your own that competed: {', '.join(names)}"] if names else []
    notes = [*told, *origins(library), *_configured_notes(model)]
    if holdout is None:
        check_pair(logs, None)
        logs, held = split_by_time(logs)
        notes.append("no held-out log was given: the end of the last fit log is held out, which tests less")
    else:
        held = read_signals(holdout, rig)
        check_pair(logs, held)
    *logs, held = each(threads, partial(_as_wired, model), (*logs, held))
    changed = None if edit is None else read_signals(edit)
    if changed is not None:
        notes += _about_edit(model, changed)
    return Task(model, tuple(logs), held, changed, tuple(notes))


def _as_wired(model: RigModel, log: Signals) -> Signals:
    """The log, with a limitation if the nominal run is far nearer once a mistake of wiring or clocks is undone.

    Raises
    ------
    InputError
        for inputs on which the nominal model runs away: no fit can start from there.
    """
    if not np.all(np.isfinite(model.simulate(log))):
        raise InputError(
            "the nominal model runs away with this log's road and commands", where=log.name,
            value=f"road up to {np.max(np.abs(log.road)):.3g} m, openings up to {np.max(log.commands):.3g} m2",
            remedy="check the units of /road/profile and /valve/command, and the rig",
        )  # fmt: skip
    found = check_wiring(log, model.simulate)
    return replace(log, limitations=(*log.limitations, *found)) if found else log


def _about_edit(model: RigModel, edit: Signals) -> list[str]:
    """What limits the edit test: the log itself, or a configuration that states no change."""
    notes = [f"{edit.name}: {one.text}" for one in edit.limitations]
    if all(factor == 1.0 for factor in model.changes(edit).values()):
        notes.append(
            f"{edit.name}: its configuration states no change of the rig, so the edit test is one more held-out log"
        )
    return notes


def _configured_notes(model: RigModel) -> tuple[str, ...]:
    """What the rig's configuration brings into the model beyond the nominal equations.

    Raises
    ------
    InputError
        if it names an effect that cannot be.
    """
    if not model.configured:
        return ()
    names = ", ".join(f"{one.effect} ({one.site or 'rig'})" for one in model.configured)
    return (
        f"the rig's configuration names {names}: part of the model as stated there, of 'nominal' and 'refit' too; what "
        "competes is what the logs show beyond it",
    )


def diagnose_files(
    fit: Sequence[str | Path],
    holdout: str | Path | None = None,
    rig: Rig | None = None,
    edit: str | Path | None = None,
    effects: Sequence[str | Path] = (),
    without: Sequence[str] = (),
    options: Options | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnose logs; parameters as in :func:`prepared`."""
    threads = 1 if options is None else options.threads
    return prepared(fit, holdout, rig, edit, effects, without, threads).diagnose(options, progress)


def left_in_equations(model: RigModel, fit: Sequence[Signals], holdout: Signals) -> Equations:
    """The equations along the held-out log: :data:`pneumo_ros.diagnosis.diagnose.HoldEquations`."""
    return held_equations(model, fit, holdout)


def flexible_search(
    model: RigModel, fit: Sequence[Signals], holdout: Signals, fitted: Fitted | None, threads: int
) -> tuple[Whereabouts, Whereabouts | None]:
    """Places of what structures leave, by flexible corrections of their equations in weak form; as
    :data:`pneumo_ros.diagnosis.diagnose.Locate`.
    """

    def located(start: Start) -> Location:
        return locate(model, fit, holdout, start)

    first, *further = each(threads, located, [Start(), *([] if fitted is None else [Start(*fitted)])])
    before = Whereabouts(first.shares, first.level["refit"], first.level["chosen"], first.flat)
    if not further:
        return before, None
    gain = flexible_gain(first, further[0])
    left, mended = float(np.sqrt(gain.left)), float(np.sqrt(gain.mended))
    return before, Whereabouts(gain.shares, left, mended, not gain.places, gain.kept)
