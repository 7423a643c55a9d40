"""A bar on the terminal and in notebooks."""

from __future__ import annotations

import sys
import warnings
from types import TracebackType
from typing import TypeVar

with warnings.catch_warnings():
    # without widgets in a notebook it writes text, which is fine
    warnings.simplefilter("ignore")
    from tqdm.auto import tqdm

T = TypeVar("T")


class Bar:
    """Shows how much is done, where somebody can see it: on a terminal or in a notebook."""

    def __init__(self, name: str, count: int, wanted: bool) -> None:
        shown = wanted and (sys.stderr.isatty() or "ipykernel" in sys.modules)
        self._bar = tqdm(total=max(count, 1), desc=name, disable=not shown, leave=False)

    def after(self, result: T) -> T:
        """Counts one more that is done."""
        self._bar.update()
        return result

    def at(self, share: float, text: str) -> None:
        """Shows that so much is done, 0…1."""
        self._bar.n = round(share * self._bar.total, 2)
        self._bar.set_postfix_str(text)

    def __enter__(self) -> Bar:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, e: BaseException | None, at: TracebackType | None
    ) -> None:
        self._bar.close()
