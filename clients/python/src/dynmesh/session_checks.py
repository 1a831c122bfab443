"""The part of a session that checks shapes and topology."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import grpc
from google.protobuf import field_mask_pb2
from numpy.typing import ArrayLike

from ._calls import Caller
from .arguments import as_int64, as_list, as_text, as_word, bad_argument
from .checks import CHECKS, CheckReport, CheckSettings, checks_to_proto, read_report
from .info import SessionInfo, info_from_proto
from .kinds import KindLike, as_kind
from .places import box_message
from .progress import Progress
from .queries import Selection, selections_of
from .session_reader import FOREVER, SessionReader
from .v1 import checks_pb2, checks_pb2_grpc, sessions_pb2

_MAX_FINDINGS = 1_000_000


class SessionChecks(SessionReader):
    """Checks one session: its batches from now on, or all of it once."""

    def __init__(self, name: str, channel: grpc.Channel, caller: Caller) -> None:
        super().__init__(name, channel, caller)
        self._checks = checks_pb2_grpc.CheckServiceStub(channel)

    def set_checks(
        self, checks: CheckSettings, *, etag: str = "", timeout: float | None = None
    ) -> SessionInfo:
        """Makes just these checks on each batch of edits from now on; no revision is made.

        Only what a batch touches is looked at. What is bad there is warned of (`EditResult.warnings`), or the batch
        is refused with `FailedPreconditionError` CHECK_FAILED, whose metadata has ``check``, ``kind``, ``ids``,
        ``value`` and ``threshold``. Imports are not checked: see `check`.

        >>> session.set_checks({"inverted": "reject", "min_dihedral": ("warn", 5.0)})

        Parameters
        ----------
        checks : mapping of str to severity, or to (severity, threshold)
            Names of `CHECKS` up to "isolated_vertex"; the others speak of the mesh as a whole. Severities are
            "off", "warn" and "reject". Without a threshold the check takes its own.
        etag : str, optional
            As in `Session.delete`.

        Raises
        ------
        InvalidArgumentError
            BAD_ARGUMENT: no such check or severity, or a threshold that makes no sense. Nothing changed then.
        """
        settings = sessions_pb2.SessionSettings(checks=checks_to_proto(checks))
        request = sessions_pb2.UpdateSessionRequest(
            session=sessions_pb2.Session(name=self.name, etag=as_text(etag, "etag"), settings=settings),
            update_mask=field_mask_pb2.FieldMask(paths=["settings.checks"]),
        )
        # As in store_relations: an update changes the etag.
        reply = self._caller.unary(self._sessions.UpdateSession, request, timeout, repeatable=not etag)
        return info_from_proto(reply.session)

    def check(
        self,
        checks: CheckSettings | Iterable[str] | None = None,
        *,
        kind: KindLike | None = None,
        ids: Selection = None,
        boundary_only: bool = False,
        box: ArrayLike | None = None,
        max_findings: int = 1000,
        as_of_revision: int = 0,
        progress: bool | None = None,
        timeout: float | None = None,
    ) -> CheckReport:
        """Checks the session at its present revision. Takes a few microseconds an entity with all checks.

        Parameters
        ----------
        checks : mapping as in `set_checks`, iterable of names, or None
            Names are checked as the session is set to, or else as "warn" with their own thresholds; None means all.
            Those of the mesh as a whole can be named, too.
        kind, ids, boundary_only, box, as_of_revision
            As in `Session.neighbors`: with `kind`, just these entities are looked at, and not the mesh as a whole.
        max_findings : int
            So many bad entities are named for each check and kind, 0 to 1,000,000; all are counted.
        progress : bool, optional
            Whether to show a bar; default: on a terminal.
        timeout : float, optional
            Default: none, as it takes as long as it takes.

        Raises
        ------
        InvalidArgumentError
            BAD_ARGUMENT as in `set_checks`; BAD_ENTITY_KIND.
        NotFoundError
            ENTITY_REMOVED, UNKNOWN_ENTITY: `ids` that are not live.
        """
        request = checks_pb2.CheckSessionRequest(
            session=self.name,
            checks=[] if checks is None else checks_to_proto(self._settings_of(checks)),
            max_findings=as_int64(max_findings, "max_findings", 0, _MAX_FINDINGS),
            as_of_revision=as_int64(as_of_revision, "as_of_revision"),
        )
        if kind is not None:
            filters = {"boundary_only": bool(boundary_only), "box": None if box is None else box_message(box)}
            _select(request, kind, selections_of(ids, **filters))
        elif ids is not None or boundary_only or box is not None:
            raise bad_argument("kind", "ids, boundary_only and box are of a kind, which is not given")
        with Progress("checking", progress) as bar:
            wait = FOREVER if timeout is None else timeout
            return read_report(self._caller.stream(self._checks.CheckSession, request, wait), bar)

    def _settings_of(self, checks: CheckSettings | Iterable[str]) -> CheckSettings:
        if isinstance(checks, Mapping):
            return _some(checks)
        given = [checks] if isinstance(checks, str) else as_list(checks, "checks")
        names = [as_word(name, CHECKS, "checks") for name in given]
        present = self.info().checks
        return _some({name: present.get(name, "warn") for name in names})


def _some(checks: CheckSettings) -> CheckSettings:
    """`checks`, unless there are none: on the wire that would mean all."""
    if checks:
        return checks
    raise bad_argument("checks", "no check is named")


def _select(request: checks_pb2.CheckSessionRequest, kind: KindLike, selections: list[Any]) -> None:
    if len(selections) > 1:
        raise bad_argument("ids", "ids are too many for one report: ask for ranges, or for all")
    request.kind = int(as_kind(kind))
    request.selection.CopyFrom(selections[0])
