"""The kinds of contact that every output file counts, in the order of the file, and their labels. A mill with bodies
has more kinds: `Run.kinds`."""

KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")


def label(kind: str) -> str:
    """The label in tables, such as "ball-drum"; for a body its name."""
    if kind == "ball_wall":
        return "ball-end wall"
    return kind.replace("_", "-", 1) if kind.startswith("ball_") else kind
