"""Checks of shapes and topology: settings of a session, and reports."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arguments import as_number, bad_argument
from .arrays import Ids, concatenate, from_bytes
from .errors import InternalError
from .kinds import EntityKind
from .progress import Progress
from .v1 import checks_pb2, types_pb2

_PREFIX = "CHECK_KIND_"
SEVERITIES = {
    "off": types_pb2.CHECK_SEVERITY_OFF,
    "warn": types_pb2.CHECK_SEVERITY_WARN,
    "reject": types_pb2.CHECK_SEVERITY_REJECT,
}
_SEVERITY_NAMES = {number: name for name, number in SEVERITIES.items()}

# Names of all checks by number; proto/dynmesh/v1/types.proto says what each measures, and its default threshold.
_NAMES = {n: name.removeprefix(_PREFIX).lower() for name, n in types_pb2.CheckKind.items() if n}
CHECKS = tuple(_NAMES.values())


class CheckSetting(NamedTuple):
    """How a check is made."""

    severity: str  # "off", "warn" or "reject"
    threshold: float


# A severity alone takes the check's own threshold.
CheckSettings = Mapping[str, str | tuple[str, float]]


class Findings(NamedTuple):
    """Entities of one kind that a check found bad.

    Attributes
    ----------
    ids : uint32[n]
    values : float64[n]
        What was measured there.
    """

    ids: Ids
    values: NDArray[np.float64]


@dataclass(frozen=True)
class CheckResult:
    """What one check found.

    Attributes
    ----------
    severity : "warn" or "reject"
    threshold : float
    measured, bad : int
        Entities that it looked at, and how many are bad; of the mesh as a whole 1, and 0 or 1.
    lowest, highest : float
        Of all that was measured; inf and -inf where nothing was.
    findings : dict of EntityKind to Findings
        The first bad entities of each kind, at most ``max_findings``.
    """

    name: str
    severity: str
    threshold: float
    measured: int
    bad: int
    lowest: float
    highest: float
    findings: dict[EntityKind, Findings]

    @property
    def ids(self) -> Ids:
        """Bad entities, of all kinds in turn: for checks of a single kind."""
        return concatenate([found.ids for found in self.findings.values()], np.uint32)

    @property
    def values(self) -> NDArray[np.float64]:
        """What was measured at `ids`."""
        return concatenate([found.values for found in self.findings.values()], np.float64)

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON; numbers that are not finite are null."""
        return {
            "severity": self.severity,
            "threshold": self.threshold,
            "measured": self.measured,
            "bad": self.bad,
            "lowest": _finite(self.lowest),
            "highest": _finite(self.highest),
            "findings": {
                str(kind): {"ids": found.ids.tolist(), "values": [_finite(x) for x in found.values.tolist()]}
                for kind, found in self.findings.items()
            },
        }


class SurfaceTopology(NamedTuple):
    """What some faces are as surfaces, cut where more than two meet at an edge."""

    pieces: int
    non_manifold: int
    non_orientable: int
    holes: int
    genus: int
    euler_characteristic: int


@dataclass(frozen=True)
class MeshTopology:
    """What a mesh is as a whole.

    Attributes
    ----------
    euler_characteristic : int
        V - E + F - C.
    components, isolated_vertices : int
        Parts that no edge connects; vertices without edges, which are none.
    bodies, non_orientable_bodies : int
        Of cells that hang together through faces of just two.
    surface, shells : SurfaceTopology
        Of the faces that are elements; of the faces of just one cell.
    """

    euler_characteristic: int
    components: int
    isolated_vertices: int
    bodies: int
    non_orientable_bodies: int
    surface: SurfaceTopology
    shells: SurfaceTopology

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON."""
        return {**vars(self), "surface": self.surface._asdict(), "shells": self.shells._asdict()}


@dataclass(frozen=True)
class CheckReport:
    """What checks found in a session.

    >>> report["min_dihedral"].ids, report["min_dihedral"].values, report.topology.surface.genus

    Attributes
    ----------
    revision : int
    results : dict of str to CheckResult
        One for each check that was made.
    topology : MeshTopology or None
        None when only some entities were looked at.
    """

    revision: int
    results: dict[str, CheckResult]
    topology: MeshTopology | None

    def __getitem__(self, name: str) -> CheckResult:
        return self.results[name]

    def bad(self, severity: str | None = None) -> list[str]:
        """Names of the checks that found something bad; of one severity only, if given."""
        return [
            name
            for name, result in self.results.items()
            if result.bad and severity in (None, result.severity)
        ]

    def to_dict(self) -> dict[str, Any]:
        """The same in the types of JSON."""
        return {
            "revision": self.revision,
            "checks": {name: result.to_dict() for name, result in self.results.items()},
            "topology": None if self.topology is None else self.topology.to_dict(),
        }


def checks_to_proto(checks: CheckSettings) -> list[types_pb2.CheckSetting]:
    """Settings by name as messages. Raises `InvalidArgumentError`."""
    if not isinstance(checks, Mapping):
        raise bad_argument("checks", f'checks are a mapping such as {{"inverted": "reject"}}, not {checks!r}')
    return [_setting_to_proto(name, value) for name, value in checks.items()]


def checks_from_proto(messages: Iterable[types_pb2.CheckSetting]) -> dict[str, CheckSetting]:
    """Messages as settings by name."""
    return {
        check_name(message.check): CheckSetting(_SEVERITY_NAMES.get(message.severity, "warn"), message.threshold)
        for message in messages
    }


def check_name(number: int) -> str:
    """ "min_dihedral", ... or the number of a check that this client does not know."""
    return _NAMES.get(number, str(number))


def read_report(replies: Iterable[checks_pb2.CheckSessionResponse], progress: Progress) -> CheckReport:
    """Follows a report to its summary."""
    pieces: dict[tuple[int, int], list[checks_pb2.CheckFindings]] = defaultdict(list)
    for reply in replies:
        part = reply.WhichOneof("part")
        if part == "progress":
            progress.set(f"checking: {reply.progress.phase}", reply.progress.done, reply.progress.total)
        elif part == "findings":
            pieces[reply.findings.check, reply.findings.kind].append(reply.findings)
        elif part == "summary":
            results = [_result(tally, pieces) for tally in reply.summary.tallies]
            topology = _topology(reply.summary.topology) if reply.summary.HasField("topology") else None
            return CheckReport(reply.revision, {result.name: result for result in results}, topology)
    raise InternalError("the report ended without a summary")


def _setting_to_proto(name: str, value: str | tuple[str, float]) -> types_pb2.CheckSetting:
    if name not in CHECKS:
        raise bad_argument("checks", f"a check is one of {', '.join(CHECKS)}, not {name!r}")
    severity, threshold = (value, None) if isinstance(value, str) else _pair(name, value)
    if severity not in SEVERITIES:
        raise bad_argument("checks", f'a severity is "off", "warn" or "reject", not {severity!r}')
    return types_pb2.CheckSetting(
        check=types_pb2.CheckKind.Value(_PREFIX + name.upper()),
        severity=SEVERITIES[severity],
        threshold=None if threshold is None else as_number(threshold, f"threshold of {name}"),
    )


def _pair(name: str, value: Any) -> tuple[str, float]:
    if isinstance(value, (tuple, list)) and len(value) == 2 and isinstance(value[0], str):
        return value[0], value[1]
    raise bad_argument("checks", f'{name} is set to "warn", ("warn", 5.0) or the like, not {value!r}')


def _result(
    tally: checks_pb2.CheckTally, pieces: Mapping[tuple[int, int], list[checks_pb2.CheckFindings]]
) -> CheckResult:
    check = tally.setting.check
    findings = {
        EntityKind(kind): _join(chunks) for (of_check, kind), chunks in pieces.items() if of_check == check
    }
    severity = _SEVERITY_NAMES.get(tally.setting.severity, "warn")
    return CheckResult(
        check_name(check),
        severity,
        tally.setting.threshold,
        tally.measured,
        tally.bad,
        tally.lowest,
        tally.highest,
        findings,
    )


def _join(chunks: list[checks_pb2.CheckFindings]) -> Findings:
    return Findings(
        concatenate([from_bytes(chunk.ids, "<u4") for chunk in chunks], np.uint32),
        concatenate([from_bytes(chunk.values, "<f8") for chunk in chunks], np.float64),
    )


def _topology(message: checks_pb2.MeshTopology) -> MeshTopology:
    return MeshTopology(
        message.euler_characteristic,
        message.components,
        message.isolated_vertices,
        message.bodies,
        message.non_orientable_bodies,
        _surface(message.surface),
        _surface(message.shells),
    )


def _surface(message: checks_pb2.SurfaceTopology) -> SurfaceTopology:
    return SurfaceTopology(*(getattr(message, name) for name in SurfaceTopology._fields))


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
