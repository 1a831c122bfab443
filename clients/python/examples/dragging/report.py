"""Aligned tables and a list of checks, in plain text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

Cell = str | int | float


def print_table(title: str, header: Sequence[str], rows: Sequence[Sequence[Cell]]) -> None:
    """Prints a table: the first column to the left, numbers to the right with thousands separated."""
    texts = [[_text(cell) for cell in row] for row in [header, *rows]]
    widths = [max(len(row[i]) for row in texts) for i in range(len(header))]
    print(f"\n{title}")
    for number, row in enumerate(texts):
        first = row[0].ljust(widths[0])
        rest = [text.rjust(width) for text, width in zip(row[1:], widths[1:])]
        print("  " + "  ".join([first, *rest]).rstrip())
        if number == 0:
            print("  " + "  ".join("-" * width for width in widths))


def megabytes(count: float) -> str:
    """Bytes as text in MB of 10^6 bytes."""
    return f"{count / 1e6:,.2f} MB"


def milliseconds(seconds: float) -> str:
    """Seconds as text in ms."""
    return f"{seconds * 1e3:,.1f} ms"


def rate(count: float, seconds: float) -> str:
    """Items per second as text."""
    return f"{count / seconds:,.0f} /s" if seconds > 0 else "-"


def part(of: float, whole: float) -> float:
    """`of` / `whole`; 0 of nothing."""
    return of / whole if whole else 0.0


def _text(cell: Cell) -> str:
    if isinstance(cell, str):
        return cell
    return f"{cell:,}" if isinstance(cell, int) else f"{cell:,.3g}"


@dataclass
class Checks:
    """What must hold at the end. Each is printed as it is made."""

    failed: list[str] = field(default_factory=list)
    count: int = 0

    def add(self, holds: bool, what: str, found: str = "") -> None:
        """Notes whether `what` holds; `found` says what was seen."""
        self.count += 1
        print(f"  {'ok    ' if holds else 'FAILED'}  {what}" + (f": {found}" if found else ""))
        if not holds:
            self.failed.append(f"{what}: {found}" if found else what)

    def exit_code(self) -> int:
        """Prints the verdict; 0 if all held, else 1."""
        if not self.failed:
            print(f"\nall {self.count} checks held")
            return 0
        print(f"\n{len(self.failed)} of {self.count} checks FAILED:")
        for what in self.failed:
            print(f"  - {what}")
        return 1
