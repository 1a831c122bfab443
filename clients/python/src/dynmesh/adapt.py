"""Adaptation of a session's mesh to a target edge length: what it tells."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from .arguments import as_count, as_number, as_text, bad_argument
from .errors import InternalError, InvalidArgumentError
from .progress import Progress
from .v1 import adapt_pb2


@dataclass(frozen=True)
class AdaptProgress:
    """How far an adaptation has come.

    Attributes
    ----------
    revision : int
        The session's, after the last step.
    pass_number : int
        From 1.
    phase : str
        "collapse", "split", "swap", "smooth"; after the last pass "improve", then "done".
    done, total : int
        Edges, elements or vertices of the phase that were looked at, and all; these may become more.
    elements : int
        Triangles or tetrahedra.
    smallest_angle : float
        Degrees: dihedral, of triangles between edges. After the last pass that ended.
    """

    revision: int
    pass_number: int
    phase: str
    done: int
    total: int
    elements: int
    smallest_angle: float


@dataclass(frozen=True)
class MeshShape:
    """How good a mesh is.

    Attributes
    ----------
    edges, elements : int
    min_length, mean_length, max_length : float
        Of edges.
    share_in_band : float
        Of the edges, 0 to 1: those with 0.7 to 1.4 of the target length.
    smallest_angle : float
        Degrees: dihedral, of triangles between edges.
    least_quality : float
        Mean ratio, 0 to 1 (regular).
    """

    edges: int
    elements: int
    min_length: float
    mean_length: float
    max_length: float
    share_in_band: float
    smallest_angle: float
    least_quality: float


@dataclass(frozen=True)
class AdaptResult:
    """What an adaptation did.

    Attributes
    ----------
    revision : int
        The session's when the result was measured.
    end : {"converged", "max_passes", "max_elements"}
        Why it ended. "converged": the last pass split and collapsed fewer than one edge in 500, so edges have the
        target length but for some that may not be changed and a few more; elements below ``min_quality`` may be left.
        "max_passes": the last pass still did more. "max_elements": splits were left out.
    passes, splits, collapses, swaps, moves : int
        Operations that were carried out.
    refusals : dict of str to int
        Operations that were tried and not carried out, by reason.
    before, after : MeshShape
    durable_revision : int
        As in `EditResult`.
    """

    revision: int
    end: str
    passes: int
    splits: int
    collapses: int
    swaps: int
    moves: int
    refusals: dict[str, int]
    before: MeshShape
    after: MeshShape
    durable_revision: int = 0


def adapt_request(
    session: str,
    target_length: float | None,
    size_attribute: str | None,
    min_quality: float,
    feature_angle: float,
    max_passes: int,
    max_elements: int | None,
) -> adapt_pb2.AdaptSessionRequest:
    """The request of `Session.adapt`, whose parameters these are."""
    if (target_length is None) == (size_attribute is None):
        raise InvalidArgumentError("say either target_length or size_attribute", reason="BAD_ARGUMENT")
    length = None if target_length is None else as_number(target_length, "target_length")
    if length == 0:  # which the message has for none
        raise bad_argument("target_length", "a target length is positive and finite")
    return adapt_pb2.AdaptSessionRequest(
        session=session,
        target_length=length,
        size_attribute=None if size_attribute is None else as_text(size_attribute, "size_attribute"),
        min_quality=as_number(min_quality, "min_quality"),
        feature_angle=as_number(feature_angle, "feature_angle"),
        max_passes=as_count(max_passes, "max_passes"),
        max_elements=None if max_elements is None else as_count(max_elements, "max_elements"),
    )


def read_adaptation(
    replies: Iterable[adapt_pb2.AdaptSessionResponse], bar: Progress, listen: Callable[[AdaptProgress], None] | None
) -> AdaptResult:
    """Follows an adaptation to its result."""
    for reply in replies:
        if reply.WhichOneof("part") == "result":
            return _result(reply.result)
        progress = _progress(reply.progress)
        bar.set(f"pass {progress.pass_number} {progress.phase}", progress.done, progress.total)
        if listen is not None:
            listen(progress)
    raise InternalError("the adaptation ended without a result")


def _progress(message: adapt_pb2.AdaptProgress) -> AdaptProgress:
    return AdaptProgress(
        revision=message.revision,
        pass_number=getattr(message, "pass"),
        phase=message.phase,
        done=message.done,
        total=message.total,
        elements=message.elements,
        smallest_angle=message.smallest_angle,
    )


def _shape(message: adapt_pb2.MeshShape) -> MeshShape:
    return MeshShape(**{field: getattr(message, field) for field in MeshShape.__dataclass_fields__})


def _result(message: adapt_pb2.AdaptResult) -> AdaptResult:
    return AdaptResult(
        revision=message.revision,
        end=adapt_pb2.AdaptEnd.Name(message.end).removeprefix("ADAPT_END_").lower(),
        passes=message.passes,
        splits=message.splits,
        collapses=message.collapses,
        swaps=message.swaps,
        moves=message.moves,
        refusals=dict(message.refusals),
        before=_shape(message.before),
        after=_shape(message.after),
        durable_revision=message.durable_revision,
    )
