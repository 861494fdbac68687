"""What the tests of studies share."""

MEDIAN = "impacts/all/normal_speed/median_above_floor"


def runs(folder):
    """The stand-in's log: (pid, seed, speed as text) of each run that was begun."""
    path = folder / "runs"
    lines = path.read_text().splitlines() if path.exists() else []
    return [(int(line.split()[0]), int(line.split()[1]), line.split()[2]) for line in lines]


def alive(pid):
    """Is there such a process, and no zombie?"""
    try:
        with open(f"/proc/{pid}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
