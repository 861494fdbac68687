"""What goes wrong for reasons a user can mend."""


class UserError(Exception):
    """One line for the user: what, where, and the mend. The command prints it and ends with `status`:
    2 for wrong usage or input (the default), 1 for a failure outside (disk full, a program that is missing)."""

    def __init__(self, text: str, status: int = 2):
        super().__init__(" ".join(str(text).split()))
        self.status = status
