"""The verdict of a run in one breath."""

from collections.abc import Mapping, Sequence

from comparisons.report.check import CheckView
from comparisons.report.criterion import use_of


def sentence_of(views: Sequence[CheckView], broken: int) -> str:
    """How many checks hold, and the one to look at first; `broken` scenes could not be read."""
    if not views:
        return "No check was run, so nothing is known."
    failing = [view for view in views if view.verdict == "FAIL"]
    regressed = [view for view in views if view.verdict == "REGRESSED"]
    passing = [view for view in views if view.verdict == "PASS"]
    total = f"{len(views)} check{'' if len(views) == 1 else 's'}"
    if failing:
        verb = "exceeds its" if len(failing) == 1 else "exceed their"
        return f"{len(failing)} of {total} {verb} budget: worst is {_extreme(failing)}."
    if regressed:
        verb = "has" if len(regressed) == 1 else "have"
        return f"{len(regressed)} of {total} {verb} regressed within the budget: worst is {_extreme(regressed)}."
    if len(passing) < len(views):
        return f"{len(passing)} of {total} {'holds its' if len(passing) == 1 else 'hold their'} budget."
    if broken:
        return f"{total} {'holds its' if len(views) == 1 else 'hold their'} budget, but not all scenes could be read."
    if len(views) == 1:
        return f"The only check holds its budget: {_extreme(views)}."
    return f"All {total} hold their budgets; closest to its budget: {_extreme(views)}."


def rest_of(counts: Mapping[str, int], broken: int) -> str:
    """What the sentence leaves out.

    Parameters
    ----------
    counts : checks of each verdict
    broken : scenes that could not be read
    """
    texts = []
    if counts["FAIL"] and (regressed := counts["REGRESSED"]):
        texts.append(f"{regressed} {'has' if regressed == 1 else 'have'} regressed within the budget.")
    if undecided := counts["INCONCLUSIVE"]:
        verb = "is" if undecided == 1 else "are"
        texts.append(f"{undecided} {verb} undecided: the truth is not certain enough for the budget.")
    if errors := counts["ERROR"]:
        texts.append(f"{errors} could not be judged.")
    if broken:
        texts.append(f"{broken} scene{'' if broken == 1 else 's'} could not be read, and {_is(broken)} not judged.")
    return " ".join(texts)


def _is(count: int) -> str:
    return "is" if count == 1 else "are"


def _extreme(views: Sequence[CheckView]) -> str:
    """Name the check that takes most of its budget, among those of light where there are any."""
    judged = [view for view in views if not view.is_parity] or views
    worst = max(judged, key=lambda view: use_of(view.headline))
    name = f"{worst.raw['scene']} with {worst.raw['technique']}{f' ({worst.how})' if worst.how else ''}"
    if worst.headline is None:
        return name
    return f"{name}, {worst.headline.metric} {worst.headline.value} against {worst.headline.bound}"
