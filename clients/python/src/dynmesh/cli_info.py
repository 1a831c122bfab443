"""``dynmesh info`` and ``dynmesh ls``: what a session is and holds."""

from __future__ import annotations

from .info import SessionInfo


def info_row(info: SessionInfo) -> str:
    """A line of ``dynmesh ls``."""
    if info.state != "loaded":
        return f"{info.name:24} {info.revision:9} {info.state} {info.state_message}".rstrip()
    counts = " ".join(f"{count:10}" for count in info.counts)
    return f"{info.name:24} {info.revision:9} {counts}"


def describe_info(info: SessionInfo) -> str:
    """An aligned listing for humans."""
    lines = [f"{info.name} at revision {info.revision}, changed {info.update_time:%Y-%m-%d %H:%M:%S} UTC", ""]
    lines.append(f"{'':10} {'vertices':>12} {'edges':>12} {'faces':>12} {'cells':>12}")
    for title, counts in (
        ("live", info.counts),
        ("estimated", info.estimated_counts),
        ("boundary", info.boundary_counts),
        ("elements", info.element_counts),
    ):
        lines.append(f"{title:10} " + " ".join(f"{count:12}" for count in counts))
    lines += ["", f"checksum   {info.checksum}", f"Euler      {info.euler_characteristic}"]
    memory = f"memory     {info.memory_bytes / 2**20:.1f} MiB"
    if info.index_bytes:
        memory += f", and {info.index_bytes / 2**20:.1f} MiB of spatial indices"
    if info.history_bytes:
        memory += f", and {info.history_bytes / 2**20:.1f} MiB of history"
    lines += [memory, f"durability {info.durability}, revision {info.durable_revision} is on disk"]
    if info.durability == "none":
        lines[-1] = "durability none: it ends with the daemon"
    else:
        lines.append(f"retention  {info.retention}")
    lines.append(f"followers  {info.followers}")
    lines.append(f"history    {info.undoable_batches} batches to undo, {info.redoable_batches} to redo")
    if info.bounds is not None:
        low, high = (" ".join(f"{x:g}" for x in corner) for corner in info.bounds)
        lines.append(f"bounds     ({low}) to ({high})")
    for (source, target), size in info.stored_relations.items():
        lines.append(f"stored     {source}-{target}: {size / 2**20:.1f} MiB")
    for name, (severity, threshold) in info.checks.items():
        lines.append(f"check      {name}: {severity}, threshold {threshold:g}")
    for spec in info.attributes:
        lines.append(f"attribute  {spec.name}: {spec.dtype}[{spec.components}] of {spec.kind}, {spec.policy}")
    return "\n".join(lines)
