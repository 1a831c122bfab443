"""Figures of a mirror: what it was sent and how long that took."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

_KEPT_LATENCIES = 4096


@dataclass
class MirrorStats:
    """Counters of a mirror since it was opened.

    Attributes
    ----------
    messages, deltas : int
        Messages received, and consistent ones among them.
    received_bytes : int
        Encoded deltas.
    raw_topology_bytes, raw_geometry_bytes, topology_bytes, geometry_bytes : int
        Sizes of their parts before and after encoding, as the server reports them.
    reconnects : int
        How often the stream was taken up again after it broke.
    refollows : int
        How often everything was fetched again, because the copy differed or the session was another one.
    latencies_s : deque of float
        Seconds from commit to applied, by the two wall clocks, of the last 4096 consistent deltas.
    """

    messages: int = 0
    deltas: int = 0
    received_bytes: int = 0
    raw_topology_bytes: int = 0
    raw_geometry_bytes: int = 0
    topology_bytes: int = 0
    geometry_bytes: int = 0
    reconnects: int = 0
    refollows: int = 0
    latencies_s: deque[float] = field(default_factory=lambda: deque(maxlen=_KEPT_LATENCIES), repr=False)

    def count(self, message: Any) -> None:
        """Adds a SubscribeResponse."""
        self.messages += 1
        self.deltas += message.consistent
        self.received_bytes += len(message.delta)
        self.raw_topology_bytes += message.raw_topology_bytes
        self.raw_geometry_bytes += message.raw_geometry_bytes
        self.topology_bytes += message.topology_bytes
        self.geometry_bytes += message.geometry_bytes

    def latency_s(self, quantile: float = 0.5) -> float:
        """A quantile of `latencies_s`; NaN before the first."""
        return float(np.quantile(self.latencies_s, quantile)) if self.latencies_s else float("nan")
