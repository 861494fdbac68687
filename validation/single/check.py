"""Single balls: everything that has an exact answer."""

from single import bounce, drum, figures, oblique, pairs, strokes
from single.common import TIME_BOUND, Tally


def check(case):
    tally = Tally()
    bounce.check(case, tally)
    drum.check(case, tally)
    pairs.check(case, tally)
    strokes.check(case, tally)
    errors = [error for group in tally.groups.values() for error in group]
    case.bound(
        f"all {len(errors)} contact times of this case that are known exactly: largest error",
        max(errors),
        TIME_BOUND,
        against="closed forms and roots to 50 digits",
        unit="s",
        headline=True,
    )
    laws = oblique.check(case)
    figures.oblique(case, laws)
    figures.times(case, tally)
