"""What the server says of a session, as values."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Ids, Points, from_bytes
from .attribute_types import POLICIES, SCALARS, Policy, default_policy, row_from_bytes
from .checks import CheckSetting, check_name, checks_from_proto
from .checksum import Checksum
from .durability import durability_name, state_name
from .kinds import EntityKind
from .relations import Relation, relation_from_proto
from .retention import Retention, retention_from_proto
from .v1 import sessions_pb2, types_pb2


class Counts(NamedTuple):
    """Number of live entities of each kind."""

    vertices: int
    edges: int
    faces: int
    cells: int


class AttributeSpec(NamedTuple):
    """What a column of values is."""

    name: str
    kind: EntityKind
    dtype: str  # "float64", "float32", "int64", "int32" or "uint8"
    components: int
    policy: Policy  # what operators make of rows: `EditBatch.add_attribute`
    default: tuple[float, ...]  # the row of entities for which none was set


@dataclass(frozen=True)
class MeshWarning:
    """Something that was accepted but deserves a look.

    Attributes
    ----------
    reason : str
        "DEGENERATE_ELEMENT", "DUPLICATE_ELEMENT", ...
    kind : EntityKind
    ids : uint32[n]
        The first entities that it concerns, at most 1024.
    count : int
        How many it concerns in all.
    check, threshold, values : str, float, float64[n]
        Of "CHECK_FAILED": which check of `Session.set_checks`, and what it measured at `ids`. Else "", 0.0 and
        nothing.
    """

    reason: str
    message: str
    kind: EntityKind
    ids: Ids
    count: int
    check: str = ""
    threshold: float = 0.0
    values: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    def __str__(self) -> str:
        return f"{self.message} [{self.reason}] ({self.count} {self.kind}(s))"

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON."""
        return {
            "reason": self.reason,
            "message": self.message,
            "kind": str(self.kind),
            "ids": self.ids.tolist(),
            "count": self.count,
            "check": self.check,
            "threshold": self.threshold,
            "values": self.values.tolist(),
        }


@dataclass(frozen=True)
class SessionInfo:
    """What a session is and held at `revision`.

    Attributes
    ----------
    counts, estimated_counts, boundary_counts, element_counts : Counts
        Live entities; what Euler's formula estimates for them; those on the boundary; those that users
        inserted (wire edges, dangling faces, cells).
    durable_revision : int
        The last one that is on disk; followers are told of no later one. Without durability, `revision`.
    durability : "none", "async" or "sync"
        When edits are acknowledged: `Client.create_session`.
    state : "loaded", "stored" or "damaged"
        Whether it is in memory; of a stored one, which is loaded when it is used, and of a damaged one only
        name, uid, revisions, settings and times are known.
    state_message : str
        Why it is damaged.
    uid : str
        Tells this session from an earlier or later one of the same name.
    euler_characteristic : int
        V - E + F - C.
    memory_bytes, index_bytes : int
        Of the mesh; of the spatial indices, which queries by place make.
    undoable_batches, redoable_batches, history_bytes : int
        Batches that `Session.undo` and `Session.redo` can take back and do again, and what these occupy.
    stored_relations : dict of (EntityKind, EntityKind) to int
        Relations that are kept as tables, and the bytes of each, which are part of `memory_bytes`.
    checks : dict of str to CheckSetting
        Checks that are made on each batch: `Session.set_checks`.
    retention : Retention
        Which earlier revisions stay: `Session.set_retention`. Of no effect without durability.
    bounds : float64[2, 3] or None
        Smallest and largest coordinates; None without vertices.
    """

    name: str
    uid: str
    revision: int
    etag: str
    duplicates: str  # "keep" or "refuse"
    durability: str
    durable_revision: int
    state: str
    state_message: str
    create_time: datetime
    update_time: datetime
    counts: Counts
    estimated_counts: Counts
    boundary_counts: Counts
    element_counts: Counts
    euler_characteristic: int
    checksum: Checksum
    memory_bytes: int
    index_bytes: int
    undoable_batches: int
    redoable_batches: int
    history_bytes: int
    followers: int
    attributes: tuple[AttributeSpec, ...]
    stored_relations: dict[Relation, int]
    checks: dict[str, CheckSetting]
    retention: Retention
    bounds: Points | None

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON; checksums are hexadecimal strings."""
        return {
            "name": self.name,
            "uid": self.uid,
            "revision": self.revision,
            "etag": self.etag,
            "duplicates": self.duplicates,
            "durability": self.durability,
            "durable_revision": self.durable_revision,
            "state": self.state,
            "state_message": self.state_message,
            "create_time": self.create_time.isoformat(),
            "update_time": self.update_time.isoformat(),
            "counts": self.counts._asdict(),
            "estimated_counts": self.estimated_counts._asdict(),
            "boundary_counts": self.boundary_counts._asdict(),
            "element_counts": self.element_counts._asdict(),
            "euler_characteristic": self.euler_characteristic,
            "checksum": str(self.checksum),
            "memory_bytes": self.memory_bytes,
            "index_bytes": self.index_bytes,
            "undoable_batches": self.undoable_batches,
            "redoable_batches": self.redoable_batches,
            "history_bytes": self.history_bytes,
            "followers": self.followers,
            "attributes": [{**spec._asdict(), "kind": str(spec.kind)} for spec in self.attributes],
            "stored_relations": {
                f"{source}-{target}": size for (source, target), size in self.stored_relations.items()
            },
            "checks": {name: setting._asdict() for name, setting in self.checks.items()},
            "retention": self.retention._asdict(),
            "bounds": None if self.bounds is None else self.bounds.tolist(),
        }


def counts_from_proto(message: types_pb2.EntityCounts) -> Counts:
    """EntityCounts as `Counts`."""
    return Counts(message.vertices, message.edges, message.faces, message.cells)


def checksum_from_proto(message: types_pb2.Checksum) -> Checksum:
    """Checksum message as `Checksum`."""
    return Checksum(message.topology, message.geometry)


def warning_from_proto(message: types_pb2.Warning) -> MeshWarning:
    """Warning message as `MeshWarning`."""
    kind = EntityKind(message.kind or EntityKind.CELL)
    return MeshWarning(
        message.reason,
        message.message,
        kind,
        from_bytes(message.ids, "<u4"),
        message.count,
        check_name(message.check) if message.check else "",
        message.threshold,
        from_bytes(message.values, "<f8"),
    )


def info_from_proto(message: sessions_pb2.Session) -> SessionInfo:
    """Session message as `SessionInfo`."""
    refuses = message.settings.duplicate_policy == sessions_pb2.DUPLICATE_POLICY_REFUSE
    return SessionInfo(
        name=message.name,
        uid=message.uid,
        revision=message.revision,
        etag=message.etag,
        duplicates="refuse" if refuses else "keep",
        durability=durability_name(message.settings.durability),
        durable_revision=message.durable_revision,
        state=state_name(message.state),
        state_message=message.state_message,
        create_time=message.create_time.ToDatetime(timezone.utc),
        update_time=message.update_time.ToDatetime(timezone.utc),
        counts=counts_from_proto(message.counts),
        estimated_counts=counts_from_proto(message.estimated_counts),
        boundary_counts=counts_from_proto(message.boundary_counts),
        element_counts=counts_from_proto(message.element_counts),
        euler_characteristic=message.euler_characteristic,
        checksum=checksum_from_proto(message.checksum),
        memory_bytes=message.memory_bytes,
        index_bytes=message.index_bytes,
        undoable_batches=message.undoable_batches,
        redoable_batches=message.redoable_batches,
        history_bytes=message.history_bytes,
        followers=message.followers,
        attributes=tuple(_spec_from_proto(spec) for spec in message.attributes),
        stored_relations={
            relation_from_proto(stored.relation): stored.memory_bytes
            for stored in message.stored_relations
        },
        checks=checks_from_proto(message.settings.checks),
        retention=retention_from_proto(message.settings.retention),
        bounds=_bounds(message),
    )


def _spec_from_proto(spec: types_pb2.AttributeSpec) -> AttributeSpec:
    components = spec.components or 1
    default = row_from_bytes(spec.default_row, spec.type, components)
    return AttributeSpec(
        name=spec.name,
        kind=EntityKind(spec.kind),
        dtype=SCALARS[spec.type].name,
        components=components,
        policy=POLICIES.get(spec.policy, default_policy(spec.type)),
        default=tuple(default.tolist()),
    )


def _bounds(message: sessions_pb2.Session) -> Points | None:
    if not message.bounds_low:
        return None
    return from_bytes(message.bounds_low + message.bounds_high, "<f8").reshape(2, 3)
