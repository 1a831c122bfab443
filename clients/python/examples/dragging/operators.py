"""What the simulation asked for, and what became of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from dynmesh import EditResult

SMOOTHING = "smooth vertex"


@dataclass
class Outcome:
    """Of one operator: items asked for and carried out, and reasons for refusals.

    The service tells the reasons of the first 100 refusals in a batch.
    """

    asked: int = 0
    accepted: int = 0
    reasons: Counter[str] = field(default_factory=Counter)


class Tally:
    """Outcomes by the name of the operator, in the order in which they were first asked for."""

    def __init__(self) -> None:
        self.outcomes: dict[str, Outcome] = {}

    def add(self, result: EditResult, asked: Sequence[tuple[str, int]]) -> int:
        """Counts a batch, of whose edits `asked` has the operator and the number of items.

        Returns how many were carried out. To smooth a vertex that is best where it is counts as refused.
        """
        accepted = 0
        for index, (name, count) in enumerate(asked):
            outcome = self.outcomes.setdefault(name, Outcome())
            done = result.num_moved[index] if name == SMOOTHING else count - len(result.skipped[index])
            outcome.asked += count
            outcome.accepted += done
            outcome.reasons.update(refusal.reason for refusal in result.refusals[index])
            accepted += done
        return accepted
