"""A bar on the terminal."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import TypeVar

T = TypeVar("T")
_WIDTH = 30


class Bar:
    """Shows how much is done, where standard error is a terminal."""

    def __init__(self, name: str, count: int, wanted: bool) -> None:
        self._name = name
        self._count = max(count, 1)
        self._done = 0
        self._shown = wanted and sys.stderr.isatty()

    def after(self, result: T) -> T:
        """One more is done."""
        self._done += 1
        self.at(self._done / self._count, f"{self._done} of {self._count}")
        return result

    def at(self, share: float, text: str) -> None:
        """So much is done, 0…1."""
        if self._shown:
            full = round(share * _WIDTH)
            line = f"\r{self._name}  {'━' * full}{' ' * (_WIDTH - full)}  {text}\x1b[K"
            print(line, end="", file=sys.stderr, flush=True)

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, e: BaseException | None, at: TracebackType | None
    ) -> None:
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
