# SPDX-License-Identifier: Apache-2.0
"""Which names stand beside the verdict: what the logs do not exclude."""

from __future__ import annotations

from helpers.structures import scored

from pneumo_ros.diagnosis.judge.ambiguity import ambiguity_group, as_good
from pneumo_ros.diagnosis.judge.verdict import Opinion


def test_the_group_holds_what_is_not_excluded() -> None:
    """Beside none and unknown as well; the verdict itself first, the likeliest next."""
    chosen = scored(0.2, -900.0)

    def group(verdict: str, named: dict[tuple[str, ...], float]) -> tuple[str, ...]:
        candidates = {scored(1.0, 0.0, *names).fit.candidate: p for names, p in named.items()}
        return ambiguity_group(None, Opinion(chosen, verdict, candidates, 0.5), chosen, [])  # type: ignore[arg-type]

    assert group("none", {(): 0.7, ("leak",): 0.1, ("dead_volume",): 0.16, ("payload",): 0.04}) == (
        "dead_volume", "leak")  # fmt: skip
    assert group("unknown", {("leak", "payload"): 0.2, ("leak",): 0.3}) == ("leak", "leak+payload")
    assert group("leak", {(): 0.02, ("leak",): 0.9, ("heat_transfer",): 0.08}) == ("leak", "heat_transfer")


def test_a_rival_that_leaves_what_another_law_might_is_in_the_group() -> None:
    refit, chosen = scored(550.0, 3450.0), scored(0.24, -740.0, "leak")
    assert as_good(refit, chosen, scored(0.5, -300.0, "orifice_coefficient"))
    assert not as_good(refit, chosen, scored(3.0, 700.0, "orifice_coefficient"))
    small, tiny = scored(0.43, -480.0), scored(0.3, -600.0, "leak")
    assert not as_good(small, tiny, scored(0.41, -500.0, "heat_transfer")), "of a small gap it must close most as well"
