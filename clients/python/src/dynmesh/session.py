"""One named session: reading, editing, following, importing and exporting it."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterable
from typing import TYPE_CHECKING

import grpc
from google.protobuf import field_mask_pb2
from numpy.typing import ArrayLike

from ._calls import Caller
from .arguments import (
    INT32,
    as_int64,
    as_number,
    as_request_id,
    as_revision,
    as_text,
    as_word,
    bad_argument,
)
from .delta import HAS_NATIVE
from .edit import EditBatch, Transaction, as_batch
from .edit_result import EditResult
from .edit_stream import EditStream
from .errors import UnimplementedError
from .files import PathLike, read_mesh
from .info import SessionInfo, info_from_proto
from .meshes import Cells, as_mesh_data
from .mirror import Mirror, Update
from .mirror_state import MirrorState
from .progress import Progress
from .relations import RelationLike, relations_to_proto
from .session_history import SessionHistory
from .session_reader import FOREVER
from .transfer import ImportResult, import_requests, read_import
from .v1 import edits_pb2, sessions_pb2, subscriptions_pb2, subscriptions_pb2_grpc

if TYPE_CHECKING:
    import meshio

_MAX_INTERVAL_S = 3600

_SLOT_ORDERS = {"caller": sessions_pb2.SLOT_ORDER_CALLER, "hilbert": sessions_pb2.SLOT_ORDER_HILBERT}
_CONFLICT_POLICIES = {
    "ignore": edits_pb2.CONFLICT_POLICY_UNSPECIFIED,
    "touched": edits_pb2.CONFLICT_POLICY_TOUCHED,
}
_CODECS = {
    "auto": subscriptions_pb2.DELTA_CODEC_UNSPECIFIED,
    "raw": subscriptions_pb2.DELTA_CODEC_RAW,
    "zstd": subscriptions_pb2.DELTA_CODEC_ZSTD,
    "draco": subscriptions_pb2.DELTA_CODEC_DRACO,
}


class Session(SessionHistory):
    """A session by its name; made by `Client.session` and `Client.create_session`.

    Costs nothing to make and holds nothing of the mesh: each method is a call. ``timeout`` is in seconds;
    None means the client's. Errors are `DynmeshError`, first of all `NotFoundError` when the session is gone.
    Thread safety: everything may be called from any thread.
    """

    def __init__(self, name: str, channel: grpc.Channel, caller: Caller) -> None:
        super().__init__(name, channel, caller)
        self._subscriptions = subscriptions_pb2_grpc.SubscriptionServiceStub(channel)

    def __repr__(self) -> str:
        return f"<dynmesh.Session {self.name!r}>"

    def validate(self, *, timeout: float | None = None) -> list[str]:
        """Broken invariants of the server's data structure; empty when it is sound. Slow."""
        request = sessions_pb2.ValidateSessionRequest(session=self.name)
        reply = self._caller.unary(self._sessions.ValidateSession, request, timeout, repeatable=True)
        return list(reply.violations)

    def delete(self, *, etag: str = "", timeout: float | None = None) -> int:
        """Deletes the session and ends its mirrors; returns its last revision.

        With `etag` (`SessionInfo.etag`) only if it has not changed since: else `AbortedError`.
        """
        request = sessions_pb2.DeleteSessionRequest(name=self.name, etag=as_text(etag, "etag"))
        return self._caller.unary(self._sessions.DeleteSession, request, timeout, repeatable=False).revision

    def store_relations(
        self, relations: Iterable[RelationLike], *, etag: str = "", timeout: float | None = None
    ) -> SessionInfo:
        """Keeps just these relations as tables from now on, current with every edit.

        Queries over them are faster, edits slower, and memory more (`SessionInfo.stored_relations`). Answers are
        the same either way. Takes a moment for each relation that is switched on; no revision is made.

        Parameters
        ----------
        relations : iterable of (kind, kind)
            Of ("cell", "edge"), ("vertex", "cell"), ("edge", "cell"), ("vertex", "face"), ("cell", "cell"),
            ("vertex", "vertex"); none for none.
        etag : str, optional
            As in `delete`.

        Raises
        ------
        InvalidArgumentError
            Another relation, or one that is named twice.
        ResourceExhaustedError
            LIMIT_EXCEEDED ``max_session_bytes``; nothing is switched then.
        """
        settings = sessions_pb2.SessionSettings(stored_relations=relations_to_proto(relations))
        request = sessions_pb2.UpdateSessionRequest(
            session=sessions_pb2.Session(name=self.name, etag=as_text(etag, "etag"), settings=settings),
            update_mask=field_mask_pb2.FieldMask(paths=["settings.stored_relations"]),
        )
        # An update changes the etag: one that was made, but not answered, would refuse its own repetition.
        reply = self._caller.unary(self._sessions.UpdateSession, request, timeout, repeatable=not etag)
        return info_from_proto(reply.session)

    # ---- Writing ----

    def import_mesh(
        self,
        mesh: meshio.Mesh | PathLike | ArrayLike,
        cells: Cells | None = None,
        *,
        attributes: Collection[str] | None = None,
        slot_order: str = "caller",
        validate_only: bool = False,
        author: str | None = None,
        message: str | None = None,
        progress: bool | None = None,
        timeout: float | None = None,
    ) -> ImportResult:
        """Fills this empty session with a mesh, as revision 1.

        Vertex i gets id i; element i of all blocks of a kind gets id i of that kind. Nothing is merged,
        reordered or repaired, unless ``slot_order`` asks for it. Nobody sees anything before the result.

        Parameters
        ----------
        mesh : meshio.Mesh, file name, or float[n, 3]
            See `dynmesh.meshes.from_meshio` for what becomes of a mesh's data; with an array, `cells` holds
            the elements.
        cells : mapping or iterable of (type, int[m, k]), optional
        attributes : collection of str, optional
            Names of the point and cell data to take. Default: all.
        slot_order : "caller" or "hilbert"
            "hilbert" gives ids along a space-filling curve: queries over neighbours are up to ten times faster
            then, and deltas up to four times smaller, than with ids that are scattered in space.
            `ImportResult.slots` tells the ids.
        validate_only : bool
            Everything is checked and the result computed, but the session stays empty.
        author, message
            As in `edit`.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        FailedPreconditionError
            SESSION_NOT_EMPTY.
        InvalidArgumentError
            ``metadata["index"]`` is the position in the mesh.
        """
        if isinstance(mesh, (str, bytes)) or hasattr(mesh, "__fspath__"):
            mesh = read_mesh(os.fsdecode(mesh))  # type: ignore[arg-type]
        order = _SLOT_ORDERS[as_word(slot_order, _SLOT_ORDERS, "slot_order")]
        data = as_mesh_data(mesh, cells, attributes)
        header = sessions_pb2.ImportHeader(
            session=self.name,
            validate_only=bool(validate_only),
            request_id=as_request_id(None),
            slot_order=order,
            note=self._caller.note(author, message),
        )
        requests = import_requests(header, data)
        with Progress("importing", progress) as bar:
            return read_import(
                self._caller.stream(
                    self._sessions.ImportMesh, requests, FOREVER if timeout is None else timeout
                ),
                bar,
            )

    def edit(
        self,
        *,
        as_of_revision: int = 0,
        if_revision: int | None = None,
        request_id: str | None = None,
        validate_only: bool = False,
        skip_refused: bool = False,
        report_lineage: bool = False,
        conflict_policy: str = "ignore",
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> Transaction:
        """A batch of edits, sent as one revision when its ``with`` block ends without an exception.

        The server limits its size: 4 MiB unless told otherwise, which is some 200,000 tetrahedra. What operators and
        checks look at is limited, too, to 200,000,000 entities each (LIMIT_EXCEEDED max_batch_work), as nobody else
        can edit meanwhile: name fewer items, smooth in fewer iterations, or make several batches of it.

        Parameters
        ----------
        as_of_revision : int
            As in `neighbors`.
        if_revision : int, optional
            Refused with `AbortedError` REVISION_MISMATCH unless the session is at this revision.
        request_id : str, optional
            A retry with the same id and content gets the first answer. Default: a new one, so that the
            client itself may repeat the call when the connection breaks.
        validate_only : bool
            Check, and compute the result, but change nothing.
        skip_refused : bool
            Pass over items of operators, from `split_edges` to `smooth_vertices`, that the mesh refuses: see
            `EditResult.skipped`. Other edits stay all or nothing.
        report_lineage : bool
            Tell which elements operators made of which: see `EditResult.lineage`.
        conflict_policy : "ignore" or "touched"
            "touched": refused with `ConflictError` when another batch changed, after ``as_of_revision``, what this
            one touches: what it removes, moves or sets attributes of, and vertices of elements that it adds. So
            editors in different regions never refuse each other, and in the same one no change is overwritten. Your
            own batches count as others, too: go on with the revision of the last one. An edge named by its ends
            that is gone is `NotFoundError` UNKNOWN_ENTITY all the same.
            With ``skip_refused``, items of operators that conflict are passed over.
        author : str, optional
            Who makes the revision, at most 256 bytes; nobody checks that. Default: that of the client.
        message : str, optional
            Why, at most 4096 bytes. `revisions` tells both again, of sessions that are kept on disk.
        """
        options = {
            "as_of_revision": as_of_revision,
            "if_revision": if_revision,
            "request_id": request_id,
            "validate_only": validate_only,
            "skip_refused": skip_refused,
            "report_lineage": report_lineage,
            "conflict_policy": conflict_policy,
            "author": author,
            "message": message,
        }
        return Transaction(lambda batch: self.apply(batch, timeout=timeout, **options))  # type: ignore[arg-type]

    def apply(
        self,
        batch: EditBatch,
        *,
        as_of_revision: int = 0,
        if_revision: int | None = None,
        request_id: str | None = None,
        validate_only: bool = False,
        skip_refused: bool = False,
        report_lineage: bool = False,
        conflict_policy: str = "ignore",
        author: str | None = None,
        message: str | None = None,
        timeout: float | None = None,
    ) -> EditResult:
        """Sends a batch that was collected without a ``with`` block. Parameters as in `edit`."""
        request = edits_pb2.ApplyEditsRequest(
            session=self.name,
            edits=as_batch(batch).edits(),
            as_of_revision=as_int64(as_of_revision, "as_of_revision"),
            if_revision=as_revision(if_revision),
            request_id=as_request_id(request_id),
            validate_only=bool(validate_only),
            skip_refused=bool(skip_refused),
            report_lineage=bool(report_lineage),
            conflict_policy=_conflict_policy(conflict_policy),
            note=self._caller.note(author, message),
        )
        return batch.read(self._caller.unary(self._edits.ApplyEdits, request, timeout, repeatable=True))

    def edit_stream(
        self,
        *,
        as_of_revision: int = 0,
        skip_refused: bool = False,
        report_lineage: bool = False,
        conflict_policy: str = "ignore",
        author: str | None = None,
        message: str | None = None,
        window: int = 64,
    ) -> EditStream:
        """Pipelined edits: up to `window` batches are on their way at once. Other parameters as in `edit`.

        `message` is that of batches which `EditStream.submit` gives no other.
        """
        read_at = as_int64(as_of_revision, "as_of_revision")
        policy = _conflict_policy(conflict_policy)
        note = self._caller.note(author, message)

        def make_request(batch: EditBatch, said: str | None) -> edits_pb2.ApplyEditsRequest:
            return edits_pb2.ApplyEditsRequest(
                session=self.name,
                edits=batch.edits(),
                as_of_revision=read_at,
                request_id=as_request_id(None),
                skip_refused=bool(skip_refused),
                report_lineage=bool(report_lineage),
                conflict_policy=policy,
                note=note if said is None else self._caller.note(author, said),
            )

        return EditStream(self._edits.StreamEdits, make_request, window, self._caller.check_size)

    # ---- Following ----

    def mirror(
        self,
        *,
        codec: str = "auto",
        position_bits: int = 0,
        min_interval: float = 0.0,
        from_mirror: Mirror | None = None,
        on_delta: Callable[[Update], None] | None = None,
    ) -> Mirror:
        """A live copy that follows this session until it is closed. Returns at once: see `Mirror.wait`.

        Parameters
        ----------
        codec : "auto", "draco", "zstd" or "raw"
            How deltas are packed; "auto": whatever is smallest. Without dynmesh's native module only "raw"
            can be decoded, and is what "auto" means.
        position_bits : int
            0: positions are exact. 1-30: on a grid of that many bits for each axis; such a mirror proves its
            topology only.
        min_interval : float
            At least so many seconds between updates.
        from_mirror : Mirror, optional
            Goes on from a copy of what that mirror has.
        on_delta : callable, optional
            Called with each `Update` in the mirror's thread.
        """
        request = subscriptions_pb2.SubscribeRequest(
            session=self.name,
            codec=_codec(codec),
            position_bits=as_int64(position_bits, "position_bits", *INT32),
            min_interval_ms=_milliseconds(min_interval),
        )
        if from_mirror is not None and not isinstance(from_mirror, Mirror):
            raise bad_argument("from_mirror", f"from_mirror is no mirror: {from_mirror!r}")
        if on_delta is not None and not callable(on_delta):
            raise bad_argument("on_delta", f"on_delta cannot be called: {on_delta!r}")
        state = from_mirror.state() if from_mirror else MirrorState()
        return Mirror(self._subscriptions.Subscribe, request, state, on_delta)


def _conflict_policy(name: str) -> int:
    return _CONFLICT_POLICIES[as_word(name, _CONFLICT_POLICIES, "conflict_policy")]


def _milliseconds(seconds: float) -> int:
    if not 0 <= as_number(seconds, "min_interval") <= _MAX_INTERVAL_S:  # NaN too
        raise bad_argument("min_interval", f"min_interval is from 0 to {_MAX_INTERVAL_S} seconds, not {seconds}")
    return round(seconds * 1000)


def _codec(name: str) -> int:
    as_word(name, _CODECS, "codec")
    if HAS_NATIVE or name == "raw":
        return _CODECS[name]
    if name == "auto":
        return _CODECS["raw"]
    raise UnimplementedError(f"codec {name} needs dynmesh's native module", reason="NO_NATIVE_MODULE")
