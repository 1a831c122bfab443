"""The part of a session that changes all of it: repairs, adaptations, undo and redo."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import grpc

from ._calls import Caller
from .adapt import AdaptProgress, AdaptResult, adapt_request, read_adaptation
from .arguments import as_count, as_request_id, as_revision
from .edit_result import HistoryResult, history_from_proto
from .progress import Progress
from .repairs import RepairResult, RepairStep, choose_steps, read_repair
from .session_checks import SessionChecks
from .session_reader import FOREVER
from .v1 import adapt_pb2_grpc, edits_pb2, edits_pb2_grpc, repairs_pb2, repairs_pb2_grpc


class SessionChanges(SessionChecks):
    """Repairs and adapts one session, and takes batches back."""

    def __init__(self, name: str, channel: grpc.Channel, caller: Caller) -> None:
        super().__init__(name, channel, caller)
        self._adapt = adapt_pb2_grpc.AdaptServiceStub(channel)
        self._edits = edits_pb2_grpc.EditServiceStub(channel)
        self._repairs = repairs_pb2_grpc.RepairServiceStub(channel)

    def repair(
        self,
        steps: Iterable[RepairStep] = (),
        *,
        weld: float | None = None,
        remove_duplicates: bool = False,
        split_non_manifold: bool = False,
        orient: bool = False,
        fill_holes: int | None = None,
        if_revision: int | None = None,
        request_id: str | None = None,
        validate_only: bool = False,
        author: str | None = None,
        message: str | None = None,
        progress: bool | None = None,
        timeout: float | None = None,
    ) -> RepairResult:
        """Repairs the mesh as one revision, all or nothing; without one where nothing has to be changed.

        Nobody else can edit the session meanwhile. An interruption ends it without a change.

        Parameters
        ----------
        steps : iterable of Orient, Weld, RemoveDuplicates, SplitNonManifold, FillHoles
            From `dynmesh.repairs`: taken in this order, each on what the one before left.
        weld : float, optional
        remove_duplicates, split_non_manifold, orient : bool
        fill_holes : int, optional
            Instead of `steps`: those that are named, with their defaults, in this order, and `orient` once more
            after holes were filled, as surfaces that are closed can be made to face outwards.
        if_revision, request_id, validate_only, author, message
            As in `edit`.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Examples
        --------
        >>> result = session.repair(weld=1e-6, split_non_manifold=True, orient=True, fill_holes=20)
        >>> result.count("merged"), result.steps[2].findings["not_orientable"].ids
        """
        chosen = choose_steps(
            steps,
            weld=weld,
            remove_duplicates=remove_duplicates,
            split_non_manifold=split_non_manifold,
            orient=orient,
            fill_holes=fill_holes,
        )
        request = repairs_pb2.RepairSessionRequest(
            session=self.name,
            steps=[step.to_proto() for step in chosen],
            if_revision=as_revision(if_revision),
            request_id=as_request_id(request_id),
            validate_only=bool(validate_only),
            note=self._caller.note(author, message),
        )
        seconds = FOREVER if timeout is None else timeout
        with Progress("repairing", progress) as bar:
            return read_repair(self._caller.stream(self._repairs.RepairSession, request, seconds), chosen, bar)

    def undo(
        self,
        count: int = 1,
        *,
        if_revision: int | None = None,
        request_id: str | None = None,
        validate_only: bool = False,
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> HistoryResult:
        """Takes the last `count` batches back, whoever sent them, all or nothing, as one new revision.

        Ids, positions and attributes are as before the batches; columns that they added stay, without their rows.
        Batches that changed nothing made a revision, but do not count.
        `SessionInfo.undoable_batches` says how many there are: 100 unless the server is told otherwise, fewer when
        they are large. A repair is a batch, too; an import cannot be undone.

        Parameters
        ----------
        if_revision, request_id, validate_only, author, message
            As in `edit`. ``if_revision`` makes sure that nobody's batch came last but the one that is meant. With
            ``validate_only`` the result has the checksum and counts that would be, and the revision and the batches
            that can be undone and redone of before.

        Raises
        ------
        FailedPreconditionError
            NOTHING_TO_UNDO: there are fewer than `count`. Nothing is undone then.
        """
        request = edits_pb2.UndoEditsRequest(
            **self._history_fields(count, if_revision, request_id, validate_only),
            note=self._caller.note(author, message),
        )
        return self._move(self._edits.UndoEdits, request, timeout)

    def redo(
        self,
        count: int = 1,
        *,
        if_revision: int | None = None,
        request_id: str | None = None,
        validate_only: bool = False,
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> HistoryResult:
        """Does again the `count` batches that `undo` took back last, as one new revision.

        A new batch ends it. Parameters as in `undo`; `FailedPreconditionError` NOTHING_TO_REDO.
        """
        request = edits_pb2.RedoEditsRequest(
            **self._history_fields(count, if_revision, request_id, validate_only),
            note=self._caller.note(author, message),
        )
        return self._move(self._edits.RedoEdits, request, timeout)

    def _move(self, method: Any, request: Any, timeout: float | None) -> HistoryResult:
        return history_from_proto(self._caller.unary(method, request, timeout, repeatable=True))

    def _history_fields(
        self, count: int, if_revision: int | None, request_id: str | None, validate_only: bool
    ) -> dict[str, Any]:
        return {
            "session": self.name,
            "count": as_count(count, "count"),
            "if_revision": as_revision(if_revision),
            "request_id": as_request_id(request_id),
            "validate_only": bool(validate_only),
        }

    def adapt(
        self,
        target_length: float | None = None,
        *,
        size_attribute: str | None = None,
        min_quality: float = 0.3,
        feature_angle: float = 40.0,
        max_passes: int = 10,
        max_elements: int | None = None,
        author: str | None = None,
        message: str | None = None,
        progress: bool | Callable[[AdaptProgress], None] | None = None,
        timeout: float | None = None,
    ) -> AdaptResult:
        """Brings a mesh of triangles or of tetrahedra to a target edge length and quality.

        By splits, collapses, swaps and moves, in passes. Kept are the topology, the orientation of elements, sharp
        edges and corners with their places, and the form of surfaces up to half of `feature_angle`; and no angle
        gets smaller than the smallest one at the start, or than 12 degrees. Making a curved surface many times
        coarser loses volume, as deviations add up. Each pass is a revision, or several:
        others can edit in between, and mirrors follow. When this is interrupted, what was done until then stays.

        Parameters
        ----------
        target_length : float
            Of edges, in units of the positions. Edges from 4/5 to 4/3 of it are left alone.
        size_attribute : str, optional
            In its place: the vertex attribute (one float64 or float32) that holds it.
        min_quality : float
            Elements below it are worked on, 0 to 1 (regular): the smaller of the mean ratio and of the smallest
            angle over that of the regular element.
        feature_angle : float
            Degrees: an edge of a surface whose faces deviate from one plane by more is kept.
        max_passes : int
        max_elements : int, optional
            No more splits when there are so many.
        author, message
            As in `edit`: of each revision that is made.
        progress : bool or callable, optional
            Whether to show a bar (default: on a terminal); or what is called with each `AdaptProgress`.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        FailedPreconditionError
            NOT_SIMPLEX or ELEMENT_IN_THE_WAY: ``error.ids`` are other elements.
        InvalidArgumentError
            ``metadata["field"]`` makes no sense.
        """
        request = adapt_request(
            self.name, target_length, size_attribute, min_quality, feature_angle, max_passes, max_elements
        )
        request.note.CopyFrom(self._caller.note(author, message))
        listen = progress if callable(progress) else None
        with Progress("adapting", False if callable(progress) else progress) as bar:
            replies = self._caller.stream(
                self._adapt.AdaptSession, request, FOREVER if timeout is None else timeout
            )
            return read_adaptation(replies, bar, listen)
