"""What a reader of the numbers ought to know: what the run's own program says of them (/run/notes), and before that what only a
file can tell, that of a run which has not come to its end."""

import math


def how_far(run) -> list[str]:
    """What is not there because the run has not come to its end."""
    until = f"{run.time:.6g} s of {run.quantity('run/time', math.nan):.6g} s"
    if run.status == "failed":
        found = [f"The run failed, at {until}; the file holds everything up to its last checkpoint."]
    elif run.status == "running" and run.time == 0:
        found = [
            "The run has not come to its first checkpoint: the file holds its deck and nothing else. If it is not running any "
            "more, it has to be started again."
        ]
    elif run.status == "running":
        found = [
            f"The run is not complete: this is what the file held at its last checkpoint, at {until}. If it is not running "
            "any more, --resume goes on from there."
        ]
    else:
        found = []
    return found


def notes(run) -> list[str]:
    """Sentences, the weightiest first; empty if there is nothing to warn of."""
    return how_far(run) + [note[:1].upper() + note[1:] for note in run.notes]
