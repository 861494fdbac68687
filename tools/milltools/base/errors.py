"""Errors that a user can correct."""


class MillsimError(Exception):
    """One line for the user: what is wrong, where, and what to do. `status` is the exit status of the command: 2 for
    wrong usage or input (the error is then an InputError), 1 for a failure outside of it (a full disk, a missing
    program)."""

    def __init__(self, text: object, status: int = 2) -> None:
        super().__init__(" ".join(str(text).split()))
        self.status = status
        if type(self) is MillsimError and status == 2:
            self.__class__ = InputError

    def __reduce__(self) -> tuple[object, ...]:  # pickling to another process must keep the status
        return type(self), (str(self), self.status)


class InputError(MillsimError, ValueError):
    """A wrong deck, wrong usage, a damaged file: also a ValueError."""


class MissingFileError(InputError, FileNotFoundError):
    """A file that is not there: also a FileNotFoundError."""


UserError = MillsimError  # the name used within milltools, and in scripts for earlier versions
