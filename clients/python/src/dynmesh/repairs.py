"""Repairs of a session's mesh: the steps that can be asked for, and what they found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from .arguments import as_int64, as_list, as_number, bad_argument
from .arrays import Ids, from_bytes
from .checksum import Checksum
from .errors import InternalError
from .info import Counts, checksum_from_proto, counts_from_proto
from .progress import Progress
from .v1 import repairs_pb2


@dataclass(frozen=True)
class Orient:
    """Makes neighbouring faces, and neighbouring cells, turn alike; names what cannot be oriented.

    Findings: "reversed", "not_orientable".

    Attributes
    ----------
    by_majority : bool
        Most elements of each component stay as they are. Else closed surfaces are made to face outwards and cells
        to have positive volume.
    """

    by_majority: bool = False
    name: ClassVar[str] = "orient"

    def to_proto(self) -> repairs_pb2.RepairStep:
        """The message."""
        return repairs_pb2.RepairStep(orient=repairs_pb2.OrientElements(by_majority=bool(self.by_majority)))


@dataclass(frozen=True)
class Weld:
    """Merges vertices within a distance of each other onto the lowest id; what folds up or becomes equal goes.

    Findings: "merged", "shrunk", "degenerate", "duplicate".

    Attributes
    ----------
    tolerance : float
        A length; 0: equal positions only.
    """

    tolerance: float = 0.0
    name: ClassVar[str] = "weld"

    def to_proto(self) -> repairs_pb2.RepairStep:
        """The message."""
        tolerance = as_number(self.tolerance, "tolerance")
        return repairs_pb2.RepairStep(weld=repairs_pb2.WeldVertices(tolerance=tolerance))


@dataclass(frozen=True)
class RemoveDuplicates:
    """Removes elements that are equal to others, or degenerate.

    Findings: "duplicate", "degenerate", "isolated".

    Attributes
    ----------
    max_measure : float, optional
        Elements of at most this length, area or volume are degenerate; None: just those that name a vertex twice.
    isolated_vertices : bool
        Vertices without elements are removed too.
    """

    max_measure: float | None = 0.0
    isolated_vertices: bool = False
    name: ClassVar[str] = "remove_duplicates"

    def to_proto(self) -> repairs_pb2.RepairStep:
        """The message."""
        any_shape = self.max_measure is None
        message = repairs_pb2.RemoveDuplicates(
            max_measure=None if any_shape else as_number(self.max_measure, "max_measure"),
            any_shape=any_shape,
            isolated_vertices=bool(self.isolated_vertices),
        )
        return repairs_pb2.RepairStep(remove_duplicates=message)


@dataclass(frozen=True)
class SplitNonManifold:
    """Gives each fan of elements that others only touch in a vertex or an edge vertices of its own.

    Findings: "split", "added", "still_non_manifold".
    """

    name: ClassVar[str] = "split_non_manifold"

    def to_proto(self) -> repairs_pb2.RepairStep:
        """The message."""
        return repairs_pb2.RepairStep(split_non_manifold=repairs_pb2.SplitNonManifold())


@dataclass(frozen=True)
class FillHoles:
    """Closes holes of surfaces with triangles that turn as the surface does. The rim of a sheet is a hole too.

    Findings: "filled", "added", "hole_too_long", "hole_branches", "hole_inconsistent", "hole_face_exists".

    Attributes
    ----------
    max_edges : int
        Holes of more edges stay.
    """

    max_edges: int
    name: ClassVar[str] = "fill_holes"

    def to_proto(self) -> repairs_pb2.RepairStep:
        """The message."""
        max_edges = as_int64(self.max_edges, "max_edges", 0, 2**32 - 1)
        return repairs_pb2.RepairStep(fill_holes=repairs_pb2.FillHoles(max_edges=max_edges))


RepairStep = Orient | Weld | RemoveDuplicates | SplitNonManifold | FillHoles


@dataclass(frozen=True)
class RepairFinding:
    """How often something was found, and the first 1000 entities.

    Attributes
    ----------
    count : int
    kinds : uint8[n]
        `EntityKind` of each: 1 vertices, 2 edges, 3 faces, 4 cells.
    ids : uint32[n]
    """

    count: int
    kinds: NDArray[np.uint8]
    ids: Ids


@dataclass(frozen=True)
class RepairStepResult:
    """What one step found, by the names that its class tells; what was not found is not in it."""

    step: RepairStep
    findings: Mapping[str, RepairFinding] = field(default_factory=dict)

    def count(self, finding: str) -> int:
        """How often `finding` was found."""
        return self.findings[finding].count if finding in self.findings else 0


@dataclass(frozen=True)
class RepairResult:
    """What a repair did or, if it was only validated, would have done.

    Attributes
    ----------
    revision : int
        After the repair: as before when nothing had to be changed, or with ``validate_only``.
    steps : tuple of RepairStepResult
    checksum, counts
        Of the session then.
    durable_revision : int
        The last one that is on disk; without durability the last one.
    """

    revision: int
    steps: tuple[RepairStepResult, ...]
    checksum: Checksum
    counts: Counts
    durable_revision: int

    def count(self, finding: str) -> int:
        """How often `finding` was found by all steps together."""
        return sum(step.count(finding) for step in self.steps)


def choose_steps(
    steps: Iterable[RepairStep],
    *,
    weld: float | None,
    remove_duplicates: bool,
    split_non_manifold: bool,
    orient: bool,
    fill_holes: int | None,
) -> list[RepairStep]:
    """The steps, or those that the keywords name, in the order in which each helps the next."""
    named: list[RepairStep] = []
    if weld is not None:
        named.append(Weld(as_number(weld, "weld")))
    if remove_duplicates:
        named.append(RemoveDuplicates())
    if split_non_manifold:
        named.append(SplitNonManifold())
    if orient:
        named.append(Orient())
    if fill_holes is not None:
        named.append(FillHoles(as_int64(fill_holes, "fill_holes")))
    if orient and fill_holes is not None:
        named.append(Orient())  # a surface that is closed now can be made to face outwards
    given = as_list(steps, "steps")
    if given and named:
        raise bad_argument("steps", "name the steps of a repair by a list or by keywords, not both")
    for step in given:
        if not isinstance(step, RepairStep):
            raise bad_argument("steps", f"a step of a repair is one of those of dynmesh.repairs, not {step!r}")
    return given or named


def read_repair(
    replies: Iterator[repairs_pb2.RepairSessionResponse], steps: list[RepairStep], progress: Progress
) -> RepairResult:
    """Follows a repair to its result."""
    for reply in replies:
        if reply.WhichOneof("part") == "progress":
            progress.set("repairing", reply.progress.steps_done, reply.progress.steps_total)
        elif reply.WhichOneof("part") == "result":
            return _result_from_proto(reply.result, steps)
    raise InternalError("the repair ended without a result")


def _result_from_proto(message: repairs_pb2.RepairResult, steps: list[RepairStep]) -> RepairResult:
    results = tuple(
        RepairStepResult(step, dict(map(_finding_from_proto, result.findings)))
        for step, result in zip(steps, message.steps, strict=True)
    )
    return RepairResult(
        revision=message.revision,
        steps=results,
        checksum=checksum_from_proto(message.checksum),
        counts=counts_from_proto(message.counts),
        durable_revision=message.durable_revision,
    )


def _finding_from_proto(message: repairs_pb2.RepairFinding) -> tuple[str, RepairFinding]:
    try:
        name = repairs_pb2.RepairFindingKind.Name(message.kind)
    except ValueError:  # of a newer server
        name = f"finding_{message.kind}"
    finding = RepairFinding(message.count, from_bytes(message.entity_kinds, "u1"), from_bytes(message.ids, "<u4"))
    return name.removeprefix("REPAIR_FINDING_KIND_").lower(), finding
