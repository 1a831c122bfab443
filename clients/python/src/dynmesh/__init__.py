"""dynmesh: named mesh sessions in a daemon, edited and followed from Python.

>>> import dynmesh
>>> with dynmesh.launch() as daemon:
...     session = daemon.client.create_session("part")
...     session.import_mesh("part.vtu")
...     stars = session.neighbors("vertex", "cell", session.boundary("vertex"))
...     with session.edit() as tx:
...         tx.move_vertices([0], [[0.0, 0.0, 0.1]])
...     with session.mirror() as mirror:
...         mirror.wait(tx.result.revision)
"""

from .adapt import AdaptProgress, AdaptResult, MeshShape
from .backups import BackupResult, RestoredBackup
from .checks import (
    CHECKS,
    CheckReport,
    CheckResult,
    CheckSetting,
    Findings,
    MeshTopology,
    SurfaceTopology,
)
from .checksum import Checksum
from .client import Client, connect
from .daemon import Daemon, launch
from .delta import Delta
from .edit import EditBatch, Transaction
from .edit_result import EditResult, HistoryResult, Lineage, Refusal
from .edit_stream import EditStream
from .errors import (
    AbortedError,
    AlreadyExistsError,
    CancelledError,
    ConflictError,
    DataLossError,
    DeadlineExceededError,
    DynmeshError,
    FailedPreconditionError,
    FileFormatError,
    InternalError,
    InvalidArgumentError,
    LaunchError,
    MirrorError,
    NotFoundError,
    OutOfRangeError,
    PermissionDeniedError,
    ResourceExhaustedError,
    UnauthenticatedError,
    UnavailableError,
    UnimplementedError,
)
from .info import AttributeSpec, Counts, MeshWarning, SessionInfo
from .kinds import ElementType, EntityKind
from .mirror import Elements, Mirror, Update
from .mirror_stats import MirrorStats
from .places import Located, NearestVertices, RayHits
from .queries import Csr, Entities, Surface
from .repairs import RepairFinding, RepairResult, RepairStepResult
from .retention import Retention
from .revisions import RestoreResult, Revision, SnapshotInfo
from .session import Session
from .snapshot import Attribute, Block, Snapshot
from .transfer import ImportResult

__version__ = "0.1.0"

__all__ = [
    "CHECKS",
    "AbortedError",
    "AdaptProgress",
    "AdaptResult",
    "AlreadyExistsError",
    "Attribute",
    "AttributeSpec",
    "BackupResult",
    "Block",
    "CancelledError",
    "CheckReport",
    "CheckResult",
    "CheckSetting",
    "Checksum",
    "Client",
    "ConflictError",
    "Counts",
    "Csr",
    "Daemon",
    "DataLossError",
    "DeadlineExceededError",
    "Delta",
    "DynmeshError",
    "EditBatch",
    "EditResult",
    "EditStream",
    "ElementType",
    "Elements",
    "Entities",
    "EntityKind",
    "FailedPreconditionError",
    "FileFormatError",
    "Findings",
    "HistoryResult",
    "ImportResult",
    "InternalError",
    "InvalidArgumentError",
    "LaunchError",
    "Lineage",
    "Located",
    "MeshShape",
    "MeshTopology",
    "MeshWarning",
    "Mirror",
    "MirrorError",
    "MirrorStats",
    "NearestVertices",
    "NotFoundError",
    "OutOfRangeError",
    "PermissionDeniedError",
    "RayHits",
    "Refusal",
    "RepairFinding",
    "RepairResult",
    "RepairStepResult",
    "ResourceExhaustedError",
    "RestoreResult",
    "RestoredBackup",
    "Retention",
    "Revision",
    "Session",
    "SessionInfo",
    "Snapshot",
    "SnapshotInfo",
    "Surface",
    "SurfaceTopology",
    "Transaction",
    "UnauthenticatedError",
    "UnavailableError",
    "UnimplementedError",
    "Update",
    "connect",
    "launch",
]
