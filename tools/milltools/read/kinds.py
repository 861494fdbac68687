"""The kinds of contact that every file counts, in its order, and what kinds are called. A mill of bodies has more:
`Run.kinds`."""

KINDS = ("ball_ball", "ball_drum", "ball_wall", "ball_shaft", "ball_blade")


def label(kind: str) -> str:
    """As tables say it: "ball-drum"; of a body its name."""
    if kind == "ball_wall":
        return "ball-end wall"
    return kind.replace("_", "-", 1) if kind.startswith("ball_") else kind
