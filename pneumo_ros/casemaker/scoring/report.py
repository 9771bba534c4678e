# SPDX-License-Identifier: Apache-2.0
"""The page of results: every score beside its target and four baselines, every failure, and two plots."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumo_ros.casemaker.plan import plan
from pneumo_ros.casemaker.scoring import families as f
from pneumo_ros.casemaker.scoring import metrics as m
from pneumo_ros.casemaker.scoring.baselines import applied
from pneumo_ros.casemaker.scoring.calibration import expected_error, reliability, risk_coverage
from pneumo_ros.casemaker.scoring.intervals import Share, share
from pneumo_ros.casemaker.scoring.metrics import Case, Label, cases_of
from pneumo_ros.casemaker.scoring.results import Found
from pneumo_ros.errors import InputError

Measure = Callable[[Sequence[Case]], Share | float]


@dataclass(frozen=True)
class Line:
    """One line of the table: name, target in words, how it is counted, whether the value reaches it."""

    name: str
    target: str
    measure: Measure
    reached: Callable[[float], bool]


def _at_least(bound: float) -> Callable[[float], bool]:
    return lambda value: value >= bound - 1e-12


def _at_most(bound: float) -> Callable[[float], bool]:
    return lambda value: value <= bound + 1e-12


def _always(value: float) -> bool:
    return True


LINES: tuple[Line, ...] = (
    Line("top-1, single effect, gap/floor >= 2", ">= 0.95", m.top_one, _at_least(0.95)),
    Line("truth in the declared group", ">= 0.99", m.in_group, _at_least(0.99)),
    Line("mean size of the declared group", "<= 2", m.mean_group, _at_most(2.0)),
    Line("false alarms on none", "<= 1 of 64", m.false_alarms, _at_most(1.0 / 64.0)),
    Line("outside the library: called unknown", ">= 0.85", m.unknown_flagged, _at_least(0.85)),
    Line("outside the library: named with p > 0.5", "<= 0.08", m.wrongly_named, _at_most(0.08)),
    Line("pairs: exact", ">= 0.75", m.pairs_exact, _at_least(0.75)),
    Line("pairs: recall", ">= 0.9", m.pairs_recall, _at_least(0.9)),
    Line("pairs: precision", "-", m.pairs_precision, _always),
    Line("side", ">= 0.97", m.side_right, _at_least(0.97)),
    Line("place", ">= 0.97", m.place_right, _at_least(0.97)),
    Line("place of an unknown effect", "-", m.unknown_place_right, _always),
    Line("calibration error (ECE)", "<= 0.06", expected_error, _at_most(0.06)),
    Line("90 % intervals that cover", "0.85-0.95", lambda c: m.parameters(c)[1], lambda v: 0.85 <= v <= 0.95),
    Line("median relative parameter error", "-", lambda c: m.parameters(c)[0], _always),
    Line("median shrink against refit, noise included", "-", lambda c: m.shrink(c)[0], _always),
    Line("median shrink against refit, above the noise floor", ">= 0.90", lambda c: m.shrink(c)[1], _at_least(0.9)),
    Line("edit test better than nominal", ">= 0.97", m.edit_beaten, _at_least(0.97)),
    Line("time of a diagnosis, median, s", "-", lambda c: m.seconds(c)[0], _always),
    Line("time of a diagnosis, longest, s", "< 60", lambda c: m.seconds(c)[1], _at_most(60.0)),
)


LINES_OF_BUDGETS: tuple[Line, ...] = (
    Line("foreign law, single: family top-1, gap/floor >= 2", ">= 0.92", lambda c: f.top_one(c, True), _at_least(0.92)),
    Line("foreign law, single: in the declared group", ">= 0.98", lambda c: f.in_group(c, True), _at_least(0.98)),
    Line("same law, single: top-1", ">= 0.97", lambda c: f.top_one(c, False), _at_least(0.97)),
    Line("mean size of the declared group", "<= 2", m.mean_group, _at_most(2.0)),
    Line("family right: law called the library's or different, rightly", "-", f.law_right, _always),
    Line("false alarms on none", "<= 1 of 64", lambda c: f.false_alarms(c, False), _at_most(1.0 / 64.0)),
    Line("false alarms on none, form error 4 % of a stated 5 %", "<= 1 of 64", lambda c: f.false_alarms(c, True),
         _at_most(1.0 / 64.0)),
    Line("outside every family: unknown", ">= 0.85", f.outside_unknown, _at_least(0.85)),
    Line("outside every family: named with p > 0.5", "<= 0.08", f.outside_named, _at_most(0.08)),
    Line("outside every family: place", ">= 0.9", f.outside_place, _at_least(0.9)),
    Line("3 to 5 effects: recall of those with >= 10 %", ">= 0.80", f.several_recall, _at_least(0.8)),
    Line("3 to 5 effects: precision of those with >= 10 %", ">= 0.90", f.several_precision, _at_least(0.9)),
    Line("3 to 5 effects: exact", "-", f.several_exact, _always),
    Line("3 to 5 effects: held-out gap left of the refit's, above the floor, median", "<= 0.10", f.left_over,
         _at_most(0.1)),
    Line("named beside unnamed: recall of those with >= 10 %", "-", f.mixed_recall, _always),
    Line("named beside unnamed: precision", "-", f.mixed_precision, _always),
    Line("budget: median error of a share, of the nominal gap", "<= 0.08", lambda c: f.share_error(c, False),
         _at_most(0.08)),
    Line("budget: median error of a share, of what the refit leaves", "<= 0.08", lambda c: f.share_error(c, True),
         _at_most(0.08)),
    Line("budget: median error of the remainder", "-", f.remainder_error, _always),
    Line("measured curve: 90 % band holds the true law where data are dense", "0.80-0.97", f.curve_coverage,
         lambda v: 0.8 <= v <= 0.97),
    Line("calibration error (ECE) of effect probabilities", "<= 0.06", f.effect_calibration, _at_most(0.06)),
    Line("side", ">= 0.97", m.side_right, _at_least(0.97)),
    Line("place", ">= 0.97", m.place_right, _at_least(0.97)),
    Line("edit test better than nominal", ">= 0.97", m.edit_beaten, _at_least(0.97)),
    Line("time of a diagnosis, one effect, median, s", "<= 20", lambda c: f.seconds(c, False), _at_most(20.0)),
    Line("time of a diagnosis, five effects, median, s", "<= 75", lambda c: f.seconds(c, True), _at_most(75.0)),
    Line("time of a diagnosis, longest, s", "-", lambda c: m.seconds(c)[1], _always),
)  # fmt: skip


HEAD = """# The blind check: results

Cases are made by a richer rig (`casemaker/`), written apart from the diagnosis: neither imports the other.
Every label is sealed by a salted SHA-256 in the set's manifest before the diagnosis runs; seals are checked when the
answers are opened. How:

    pneumo blind make DIR --set full
    pneumo blind diagnose DIR
    pneumo blind score DIR --output docs/blind-results.md

`gap/floor` is what the nominal model leaves after a refit inside its tolerances, over what it leaves on the same log
without the effect. In brackets: hits, count and the Wilson 95 % interval. The four last columns are baselines scored by
the same code. The full set is opened once per release; results of earlier releases stay below.
"""
MARK = "<!-- newest first -->"


def write_report(
    page: Path, labels: Mapping[str, Label], found: Mapping[str, Found], manifest: Mapping[str, Any]
) -> str:
    """Put a section on ``page`` (Markdown) above earlier ones, and its plot beside it; returns the table of scores."""
    cases = cases_of(labels, found)
    rivals = {name: cases_of(labels, verdicts) for name, verdicts in applied(found).items()}
    table, commit = _table(cases, rivals), "+".join(sorted({c.found.commit for c in cases}))
    # By seed: one release may make two sets, and each keeps its picture.
    plot = page.with_name(f"{page.stem}-{manifest['set']}-{manifest['seed']}.png")
    parts = [
        f"## Set `{manifest['set']}`, diagnosed by commit {commit}",
        f"Seed {manifest['seed']}; the first {len(labels)} cases of {_size_of(manifest)}; {len(cases)} diagnosed; "
        f"{manifest['software']}; all {len(labels)} seals verified.",
        table,
        _detection(cases, rivals),
        f"![reliability and risk]({plot.name})",
        _confusion(cases),
        _failures(cases),
        _short_of_grade(cases),
    ]
    page.parent.mkdir(parents=True, exist_ok=True)
    earlier = page.read_text("utf-8").partition(MARK)[2].strip() if page.exists() else ""
    part = page.with_name(page.name + ".part")
    part.write_text("\n\n".join([HEAD.strip(), MARK, *parts, *filter(None, [earlier])]) + "\n", "utf-8")
    _plot(plot, cases)
    part.rename(page)
    return table


def _size_of(manifest: Mapping[str, Any]) -> int:
    """How many cases the whole set has."""
    try:
        return len(plan(str(manifest["set"])))
    except InputError:  # a set of somebody's own
        return len(manifest.get("cases", []))


def _table(cases: Sequence[Case], rivals: Mapping[str, Sequence[Case]]) -> str:
    head = ["score", "target", "measured", "reached", *rivals]
    rows = []
    for line in lines_for(cases):
        value = line.measure(cases)
        number = value.value if isinstance(value, Share) else value
        verdict = "-" if line.target == "-" or math.isnan(number) else "yes" if line.reached(number) else "no"
        others = [_short(line.measure(other)) for other in rivals.values()]
        rows.append([line.name, line.target, _text(value), verdict, *others])
    return _markdown(head, rows)


def lines_for(cases: Sequence[Case]) -> tuple[Line, ...]:
    """The lines of a set's table; sets from 0.4 on, whose labels carry budgets, have lines of their own."""
    return LINES_OF_BUDGETS if any("refit_share" in c.label for c in cases) else LINES


def _detection(cases: Sequence[Case], rivals: Mapping[str, Sequence[Case]]) -> str:
    ours, others = m.detection(cases), {name: m.detection(c) for name, c in rivals.items()}
    right = {g: share([c.right for c in cases if c.kind == "single" and c.label["grade"] == g]) for g in ours}
    rows = [[f"{g:g}", str(ours[g]), str(right[g]), *(_short(o[g]) for o in others.values())] for g in ours]
    return "### Detection and naming against size\n\n" + _markdown(
        ["gap/floor", "alarm", "named rightly", *(f"{n}: alarm" for n in others)], rows
    )


def _confusion(cases: Sequence[Case]) -> str:
    table = m.confusion(cases)
    rows = [[truth, ", ".join(f"{verdict} {n}" for verdict, n in sorted(row.items(), key=lambda kv: -kv[1]))]
            for truth, row in sorted(table.items())]  # fmt: skip
    return "### Confusion (truth: verdicts)\n\n" + _markdown(["truth", "verdicts"], rows)


def _failures(cases: Sequence[Case]) -> str:
    rows = []
    for c in cases:
        if c.right or (c.kind == "single" and not c.clear and not c.found.alarm):
            continue
        rows.append([
            str(c.label["case"]), c.kind, _truth_text(c.label), f"{c.label['ratio']['fit']:.1f}",
            f"{c.found.verdict} {c.found.probability:.2f}", ", ".join(c.found.group) or "-",
            "; ".join(f"{'+'.join(e['effects'])} {float(e['probability']):.2f}" for e in c.found.ranking[:3]),
        ])  # fmt: skip
    head = ["case", "kind", "truth", "gap/floor", "verdict", "group", "ranking"]
    return f"### Every failure ({len(rows)})\n\n" + (_markdown(head, rows) if rows else "None.")


def _short_of_grade(cases: Sequence[Case]) -> str:
    """Cases whose gap is below their grade even at the largest realistic size of the effect; they stay in the set."""
    rows = [
        [str(c.label["case"]), _truth_text(c.label), f"{c.label['grade']:g}", f"{c.label['ratio']['fit']:.2f}"]
        for c in cases
        if c.kind in ("single", "unknown", "withheld")
        and c.label["grade"]
        and c.label["ratio"]["fit"] < 0.9 * c.label["grade"]
    ]
    head = ["case", "effect", "wanted gap/floor", "reached at the largest sane size"]
    return f"### Short of their grade ({len(rows)})\n\n" + (_markdown(head, rows) if rows else "None.")


def _truth_text(label: Label) -> str:
    return " + ".join(map(_one_truth, label["truth"])) or ("form error" if _formed(label) else "none")


def _one_truth(item: Mapping[str, Any]) -> str:
    words = [str(item["side"])] if item["side"] else []
    if item.get("family"):
        words += [str(item["law"]), f"{100.0 * item['share_of_refit']:.0f} %"]
    return f"{item['effect']} ({', '.join(words)})" if words else str(item["effect"])


def _formed(label: Label) -> bool:
    return bool((label.get("model_form") or {}).get("stated"))


def _text(value: Share | float) -> str:
    return str(value) if isinstance(value, Share) else "-" if math.isnan(value) else f"{value:.3f}"


def _short(value: Share | float) -> str:
    number = value.value if isinstance(value, Share) else value
    return "-" if math.isnan(number) else f"{number:.2f}"


def _markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def _plot(path: Path, cases: Sequence[Case]) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (left, right) = pyplot.subplots(1, 2, figsize=(9.0, 4.0))
    bins = reliability(cases)
    left.plot([0, 1], [0, 1], color="0.7")
    left.scatter([b.stated for b in bins], [b.right for b in bins], s=[12 + 3 * b.count for b in bins])
    left.set(
        xlabel="stated probability", ylabel="share right", title=f"the whole verdict: ECE {expected_error(cases):.3f}"
    )
    coverage, risk = risk_coverage(cases)
    right.plot(coverage, risk)
    right.set(
        xlabel="share of cases answered",
        ylabel="share wrong among them",
        title="the whole verdict: risk against coverage",
        ylim=(0, None),
    )
    figure.tight_layout()
    figure.savefig(path, dpi=120)
    pyplot.close(figure)
