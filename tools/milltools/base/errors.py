"""Errors that a user can correct."""


class MillsimError(Exception):
    """One line for the user: what is wrong, where, and what to do. A list of texts gives a line for each: the faults
    of a wrong deck. `status` is the exit status of the command: 2 for
    wrong usage or input (the error is then an InputError), 1 for a failure outside of it (a full disk, a missing
    program)."""

    def __init__(self, text: object, status: int = 2) -> None:
        texts = text.lines if isinstance(text, MillsimError) else text if isinstance(text, list) else [text]
        super().__init__("\n".join(" ".join(str(one).split()) for one in texts))
        self.status = status
        if type(self) is MillsimError and status == 2:
            self.__class__ = InputError

    @property
    def lines(self) -> list[str]:
        return str(self).split("\n")

    @property
    def line(self) -> str:
        """The first line, and how many there are more."""
        first, *more = self.lines
        return f"{first} (and {len(more)} more fault{'s' * (len(more) > 1)})" if more else first

    def __reduce__(self) -> tuple[object, ...]:  # pickling to another process must keep the status
        return type(self), (self.lines, self.status)


class InputError(MillsimError, ValueError):
    """A wrong deck, wrong usage, a damaged file: also a ValueError."""


class MissingFileError(InputError, FileNotFoundError):
    """A file that is not there: also a FileNotFoundError."""


UserError = MillsimError  # the name used within milltools, and in scripts for earlier versions
