"""What a batch of edits did."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .arguments import bad_argument
from .arrays import Ids, as_array, as_ids, from_bytes
from .checksum import Checksum
from .handles import NEW_VERTEX, to_wire
from .info import Counts, MeshWarning, checksum_from_proto, counts_from_proto
from .v1 import edits_pb2


@dataclass(frozen=True)
class Refusal:
    """Why an item of an operator was passed over.

    Attributes
    ----------
    index : int
        The item, in the arrays that the operator was given.
    reason : str
        "LINK_CONDITION", "WOULD_INVERT", ...
    message : str
    metadata : dict of str to str
        ``kind`` and ``ids`` of what stands in the way, among others.
    """

    index: int
    reason: str
    message: str
    metadata: dict[str, str]


@dataclass(frozen=True)
class Lineage:
    """Elements that an operator made, in order, and those whose places they took, which are of the same kinds.

    An element may have been replaced again by a later item: walk in order, ``origin[element] = origin.get(parent,
    parent)``, to find what each came from.

    Attributes
    ----------
    kinds : uint8[n]
        Dimensions: 1 wire edges, 2 faces, 3 cells.
    elements : uint32[n]
    parents : uint32[n]
    """

    kinds: NDArray[np.uint8]
    elements: Ids
    parents: Ids


@dataclass(frozen=True)
class EditResult:
    """What a batch did or, if it was only validated, would have done.

    Attributes
    ----------
    revision : int
        After the batch; of ``validate_only`` the revision that it was checked against. A batch without effect (whose
        items were all passed over, say) makes a revision too, but `Session.undo` does not count it.
    new_ids : tuple of uint32[n]
        For each edit the ids of what it added, in order.
    new_vertices : uint32[n]
        Ids of the vertices that `add_vertices`, `split_edges` and `split_elements` added, in order; 0xffffffff for
        those of items that were passed over.
    skipped : tuple of uint32[n]
        For each edit the items that were passed over, with ``skip_refused``.
    refusals : tuple of tuple of Refusal
        For each edit why: of the first 100 of the batch.
    lineage : tuple of Lineage
        For each edit which elements it made of which, with ``report_lineage``.
    num_moved : tuple of int
        For each edit how many vertices `smooth_vertices` moved.
    durable_revision : int
        The last revision that is on disk; without durability the last one. With "async" it may be an earlier one.
    batch_number : int
        Tells the batch's handles from those of others.
    """

    revision: int
    new_ids: tuple[Ids, ...]
    new_vertices: Ids
    checksum: Checksum
    counts: Counts
    warnings: tuple[MeshWarning, ...]
    batch_number: int
    skipped: tuple[Ids, ...] = ()
    refusals: tuple[tuple[Refusal, ...], ...] = ()
    lineage: tuple[Lineage, ...] = ()
    num_moved: tuple[int, ...] = ()
    durable_revision: int = 0

    def resolve(self, vertices: ArrayLike) -> Ids:
        """Vertex ids for handles that `EditBatch.add_vertices` gave out; ids stay as they are.

        Parameters
        ----------
        vertices : integers, any shape

        Raises
        ------
        InvalidArgumentError
            FOREIGN_HANDLE: a handle of another batch. BAD_ARGUMENT: what is neither an id nor a handle.
        """
        wire = as_array(to_wire(vertices, self.batch_number), "vertices")
        ids = as_ids(wire.ravel(), "vertices").reshape(wire.shape).copy()
        handles = (ids & NEW_VERTEX) != 0
        places = ids[handles] & ~np.uint32(NEW_VERTEX)
        if places.size and places.max() >= len(self.new_vertices):
            raise bad_argument("vertices", f"vertices: the batch has added {len(self.new_vertices)}, and not all of these")
        ids[handles] = self.new_vertices[places]
        return ids


@dataclass(frozen=True)
class HistoryResult:
    """What undoing or redoing batches did or, if it was only validated, would have done.

    Attributes
    ----------
    revision : int
        After it; of ``validate_only`` the revision before.
    count : int
        Batches that were undone or redone.
    checksum, counts : Checksum, Counts
        Of the session then; of ``validate_only`` what they would be.
    undoable_batches, redoable_batches : int
        What can be undone and redone then; of ``validate_only`` before.
    durable_revision : int
        As in `EditResult`.
    """

    revision: int
    count: int
    checksum: Checksum
    counts: Counts
    undoable_batches: int
    redoable_batches: int
    durable_revision: int

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON; the checksum is a hexadecimal string."""
        return asdict(self) | {"checksum": str(self.checksum), "counts": self.counts._asdict()}


def history_from_proto(reply: edits_pb2.UndoEditsResponse | edits_pb2.RedoEditsResponse) -> HistoryResult:
    """The answer to UndoEdits or RedoEdits."""
    return HistoryResult(
        revision=reply.revision,
        count=reply.count,
        checksum=checksum_from_proto(reply.checksum),
        counts=counts_from_proto(reply.counts),
        undoable_batches=reply.undoable_batches,
        redoable_batches=reply.redoable_batches,
        durable_revision=reply.durable_revision,
    )


def refusal_from_proto(item: edits_pb2.SkippedItem) -> Refusal:
    """Why an item was passed over."""
    return Refusal(item.index, item.error.reason, item.error.message, dict(item.error.metadata))


def lineage_from_proto(result: edits_pb2.EditResult) -> Lineage:
    """What an edit made of what."""
    kinds = from_bytes(result.element_kinds, "u1")
    return Lineage(kinds - 1, from_bytes(result.element_ids, "<u4"), from_bytes(result.parent_ids, "<u4"))
