"""Exceptions of the rig. What a user's own code raises in a run is raised as it is."""

from __future__ import annotations


class InputError(ValueError):
    """An input error names a mistake in a scenario, a value or an array.

    Attributes:
        message: What is wrong.
        help: What would be right.
        file: The file, where there is one.
        line: The line of the file, from 1, where it is known.
        key: The path of the value in the file, such as ``load.mass_kg``.
    """

    def __init__(
        self,
        message: str,
        help: str = "",
        file: str | None = None,
        line: int | None = None,
        key: str | None = None,
    ) -> None:
        place = ":".join(str(part) for part in (file, line, key) if part is not None)
        text = f"{place}: {message}" if place else message
        super().__init__(f"{text}\n  help: {help}" if help else text)
        self.message = message
        self.help = help
        self.file = file
        self.line = line
        self.key = key

    def __reduce__(self) -> tuple[type[InputError], tuple[object, ...]]:
        return type(self), (self.message, self.help, self.file, self.line, self.key)


class RunError(RuntimeError):
    """A run error says that the simulation left the range in which it means anything, such as a train that ran off its track."""
