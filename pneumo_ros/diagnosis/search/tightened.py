# SPDX-License-Identifier: Apache-2.0
"""A second search with the tolerances held tightly, where the first one's structure strains them or leaves much.

While an effect is missing the tolerances answer for it as far as they reach, most of them to their bounds: a load hides
in masses and areas, and what the search then adds closes what these have left. With its tolerances near their nominal
values a rig shows such an effect; what is found so is fitted once more with the tolerances as they are told and
competes with the rest. They also are a start of their own: beside tolerances that answer for it, a law that is not the
rig's, and its family's shape, may end far from where they end beside these at rest.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from pneumo_ros.diagnosis.fit.solver import Fit, fit
from pneumo_ros.diagnosis.search.competition import compete, room_for_more
from pneumo_ros.diagnosis.search.growth import grow
from pneumo_ros.diagnosis.search.selection import THIRD, Thresholds, score, select
from pneumo_ros.diagnosis.search.state import Effort, Search

TIGHTNESS: Final = 10.0  # times the weight that the tolerances have in the second search [taste]
MUCH: Final = 2.0  # mean square on the kept blocks, sigma squared, that is much to be left [numerics]
MUCH_OF_REFIT: Final = 0.01  # the same as a share of the refit's [numerics]
# Less than a first search needs: that one has seen what needs no tight tolerances [numerics]
EFFORT: Final = Effort(singles=6, finalists=3, seconds=(3,), blind_pairs=2, pair_finalists=2, probes=8, exchanged=3)


def search_tightened(search: Search, limits: Thresholds) -> None:
    """Add to ``search.structures`` what a search with tight tolerances finds, fitted with the tolerances as told.

    Nothing where the best structure leaves its tolerances alone and little besides, or leaves nothing to find. What one
    of three effects and more leaves is no reason: laws that nobody wrote leave as much together.
    """
    problem, refit = search.problem, score(search.problem, search.refit)
    best = select(refit, [score(problem, one) for one in search.finalists], limits)
    much = best.size < THIRD and best.level > max(MUCH, MUCH_OF_REFIT * refit.level)
    if not (much or (best.size and problem.strains(best.fit.x))) or not room_for_more(search):
        return

    def told(_: float, what: str) -> None:
        search.progress(0.89, f"tolerances held tightly: {what}")

    tight = replace(search.logged, fold=problem.fold, tightness=TIGHTNESS)
    other = compete(tight, EFFORT, True, told)
    grow(other, limits)

    def released(one: Fit) -> Fit:
        return fit(problem, one.candidate, one.x, iterations=search.effort.long)

    found = problem.each(released, [one for one in other.finalists if one.candidate.laws])
    search.structures += [one for one in found if not one.diverged]
