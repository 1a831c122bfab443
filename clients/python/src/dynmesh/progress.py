"""Progress bars for long transfers: only on a terminal, unless asked for."""

from __future__ import annotations

import sys
from types import TracebackType
from typing import Any


class Progress:
    """A tqdm bar on stderr, or nothing at all.

    Parameters
    ----------
    what : str
        What the bar says before anything is known.
    show : bool, optional
        Default: whether stderr is a terminal.
    """

    def __init__(self, what: str, show: bool | None = None) -> None:
        self._bar: Any = None
        if sys.stderr.isatty() if show is None else show:
            from tqdm import tqdm

            self._bar = tqdm(desc=what, unit="", unit_scale=True, leave=False, file=sys.stderr)

    def __enter__(self) -> Progress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.close()

    @property
    def shown(self) -> bool:
        """Whether there is a bar."""
        return self._bar is not None

    def set(self, phase: str, done: int, total: int) -> None:
        """Shows `done` of `total` (0: not known) items of `phase`."""
        if self._bar is None:
            return
        self._bar.set_description(phase, refresh=False)
        self._bar.total = total or None
        self._bar.n = done
        self._bar.refresh()

    def add(self, count: int) -> None:
        """Shows that `count` more items are done."""
        if self._bar is not None:
            self._bar.update(count)
