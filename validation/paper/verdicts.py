"""Statements of the paper, the questions that the mill was asked about each, and what the answers make of it.

A question has a number, its standard error, and a bound or an expected value with a band. Its verdict is *confirmed*
or *refuted* where the number lies on one side of the bound by more than Student's 97.5 % quantile of standard
errors, else *open*.
"""

import collections
import dataclasses
import json

import ladder
import numpy as np
from scipy import stats
from study_case import KEPT, StudyCase

from milltools.base.engine import version

CONFIRMED, REFUTED, OPEN = "confirmed", "refuted", "open"


@dataclasses.dataclass
class Question(ladder.Claim):
    """What was asked of the mill about one statement; `what` is the question, `against` the statement."""

    sign: int = 0  # 1: `measured` is to exceed `band`, -1: to stay below; 0: within `band` of `expected`
    runs: int = 0  # from which the error is; 0: the number is exact or known otherwise
    reason: str = ""  # for which the verdict is open whatever the number

    @property
    def holds(self) -> bool:
        """An answer was had. That a statement is refuted is a result, not a failure."""
        return bool(self.reason) or bool(np.isfinite(self.measured))

    @property
    def verdict(self) -> str:
        if self.reason:
            return OPEN
        if self.sign:
            margin = self.sign * (self.measured - self.band)
        else:
            margin = self.band - abs(self.measured - self.expected)
        quantile = stats.t.ppf(0.975, self.runs - 1) if self.runs > 1 else 2.0
        doubt = quantile * (self.error or 0.0)
        return CONFIRMED if margin > doubt else REFUTED if margin < -doubt else OPEN

    @property
    def asked(self) -> str:
        if self.reason:
            return ""
        if self.sign:
            words = f"{'>' if self.sign > 0 else '<'} {ladder.show(self.band, 3)}"
        else:
            words = f"{ladder.show(self.expected, 3)} +- {ladder.show(self.band, 2)}"
        return ladder.with_unit(words, self.unit)

    @property
    def answer(self) -> str:
        if self.reason:
            return self.reason
        error = f" +- {self.error:.2g}" if self.error else ""
        return ladder.with_unit(f"{self.measured:.4g}{error}", self.unit)


def overall(questions) -> str:
    """One word for a statement where all answers agree, else how many say what."""
    said = collections.Counter(q.verdict for q in questions)
    if len(said) == 1:
        return next(iter(said))
    return ", ".join(f"{said[v]} {v}" for v in (CONFIRMED, REFUTED, OPEN) if said[v])


def by_statement(questions) -> dict:
    """Statement -> its questions, in the order in which they were asked."""
    found = {}
    for question in questions:
        found.setdefault(question.against, []).append(question)
    return found


def table(questions) -> list[str]:
    """Statements, questions, answers and verdicts as lines of Markdown."""
    lines = []
    for statement, asked in by_statement(questions).items():
        lines += [f"**{statement}** *{overall(asked)}*", ""]
        lines += ["| question | confirmed if | answer | runs | verdict |"]
        lines += ["| --- | --- | --- | --- | --- |"]
        for q in asked:
            cells = (q.what, q.asked, q.answer, str(q.runs or ""), q.verdict)
            lines.append("| " + " | ".join(map(ladder.cell, cells)) + " |")
        lines.append("")
    return lines


def counted(questions) -> str:
    """The sentence that begins the results."""
    said = collections.Counter(q.verdict for q in questions)
    statements = collections.Counter(overall(asked) for asked in by_statement(questions).values())
    whole = ", ".join(f"{statements[v]} {v}" for v in (CONFIRMED, REFUTED, OPEN))
    mixed = sum(statements.values()) - sum(statements[v] for v in (CONFIRMED, REFUTED, OPEN))
    return (
        f"{sum(statements.values())} statements: {whole}, {mixed} with answers that differ between questions; "
        f"of {sum(said.values())} answers {', '.join(f'{said[v]} {v}' for v in (CONFIRMED, REFUTED, OPEN))}."
    )


def summary(results) -> list[str]:
    """A table with a line for each statement: the answer to its first question."""
    rows = [
        "| statement of the paper | question, confirmed if | answer | verdict |",
        "| --- | --- | --- | --- |",
    ]
    for result in results:
        for statement, asked in by_statement(result["claims"]).items():
            link = f"[{overall(asked)}](#{result['name']})"
            first = next((q for q in asked if q.headline), asked[0])
            cells = (statement, f"{first.what}: {first.asked}".rstrip(": "), first.answer, link)
            rows.append("| " + " | ".join(map(ladder.cell, cells)) + " |")
    return rows


class PaperCase(StudyCase):
    """A part whose claims are questions, and whose measurements are kept."""

    def table(self):
        return table(self.claims)

    def ask(
        self, statement, question, values=None, *, above=None, below=None, expected=None, band=0.0,
        error=None, unit="1", headline=False, reason="",
    ):  # fmt: skip
        """values: one number a run (its mean and standard error count), or one number with its `error`.

        above, below: the bound that confirms; else `expected` and `band`. reason: why the verdict stays open.
        """
        values = np.atleast_1d(np.asarray(np.nan if values is None else values, float))
        runs = len(values) if len(values) > 1 else 0
        if runs:
            error = values.std(ddof=1) / np.sqrt(runs)
        sign = 1 if above is not None else -1 if below is not None else 0
        bound = above if above is not None else below if below is not None else band
        self.claims.append(
            Question(
                question, statement, float(values.mean()), None if sign else expected, float(bound),
                None if error is None else float(error), unit, headline, sign=sign, runs=runs, reason=reason,
            )
        )  # fmt: skip

    def kept(self, name, measure):
        """What measure() returns, as JSON holds it; kept in build/study as tables are."""
        path = KEPT / f"{name}.json"
        if self.keep and path.exists():
            made = json.loads(path.read_text())
        else:
            made = {"millsim": version(), "values": measure()}
            path.write_text(json.dumps(made) + "\n")
        return made["values"]
