#!/usr/bin/env python3
"""Times edit operators through a daemon, and adaptations beside gmsh's own optimiser.

usage: service_bench.py DAEMON MESH REPORT [--repetitions N]

MESH is any file of triangles or tetrahedra that meshio reads; REPORT gets medians as Google Benchmark would write
them. `rpc/split/100` is edges split a second in batches of 100, one call each, each waited for, after a first batch
that is not timed; the times are those of the wall, client included, as daemon and client take turns. In process
`edit/split/batches` of core_bench does the same as `rpc/split/10000`.
"""
from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

import dynmesh
import meshio
import numpy as np

BATCHES = {1: 300, 100: 30, 10_000: 5}  # items of a batch, and how many batches
FIRST = 10_000  # items of the batch before those
ADAPTED = 100_000  # elements: larger meshes take minutes
GMSH = "gmsh"


def operators():
    """What to do with edges, by name."""
    return {"split": lambda tx, edges: tx.split_edges(edges),
            "collapse": lambda tx, edges: tx.collapse_edges(edges, parameters=0.0),
            "swap_edge": lambda tx, edges: tx.swap_edges(edges)}


def make_room(session, operate, edges):
    """The first edit after an import moves all arrays to where they can grow, which no other one does."""
    with session.edit(skip_refused=True) as tx:
        operate(tx, edges)


def time_batches(session, operate, edges, size):
    """Items that were accepted a second; edges that are gone or refused are passed over."""
    accepted, started = 0, time.perf_counter()
    for begin in range(0, len(edges), size):
        with session.edit(skip_refused=True) as tx:
            operate(tx, edges[begin:begin + size])
        accepted += min(size, len(edges) - begin) - sum(map(len, tx.result.skipped))
    return accepted / (time.perf_counter() - started)


def time_operators(client, mesh, repetitions):
    """Rates by name, each measured on a session of its own."""
    rates = {}
    rng = np.random.default_rng(1)
    for name, operate in operators().items():
        for size, count in BATCHES.items():
            found = []
            for _ in range(repetitions):
                session = client.create_session("timed")
                session.import_mesh(mesh, slot_order="hilbert", progress=False)
                live = session.info().counts.edges
                edges = rng.choice(live, min(live, FIRST + size * count), replace=False)
                make_room(session, operate, edges[:FIRST])
                found.append(time_batches(session, operate, edges[FIRST:], size))
                session.delete()
            rates[f"rpc/{name}/{size}"] = statistics.median(found)
    return rates


def mean_edge_length(session):
    snapshot = session.snapshot(progress=False)
    points = np.zeros((int(snapshot.vertex_ids.max()) + 1, 3))
    points[snapshot.vertex_ids] = snapshot.positions
    ends = session.neighbors("edge", "vertex").neighbors.reshape(-1, 2)
    return float(np.linalg.norm(points[ends[:, 0]] - points[ends[:, 1]], axis=1).mean())


def smallest_dihedral(session):
    """In degrees; of surfaces the smallest angle of a triangle."""
    report = session.check({"min_dihedral": ("warn", 180.0), "min_face_angle": ("warn", 180.0)}, progress=False)
    name = "min_dihedral" if session.info().element_counts.cells else "min_face_angle"
    return float(report[name].lowest)


def time_adaptation(client, mesh):
    """Seconds and smallest angles of adaptations to half and to double the mean edge length."""
    entries = {}
    for name, factor in (("half", 0.5), ("double", 2.0)):
        session = client.create_session("adapted")
        session.import_mesh(mesh, slot_order="hilbert", progress=False)
        before, target = smallest_dihedral(session), factor * mean_edge_length(session)
        started = time.perf_counter()
        session.adapt(target, progress=False)
        entries[f"adapt/{name}"] = {
            "seconds": time.perf_counter() - started, "angle_before": before,
            "angle": smallest_dihedral(session), "elements": elements_of(session)}
        session.delete()
    return entries


def time_gmsh(client, mesh):
    """The same of gmsh's optimiser, which keeps the number of vertices; nothing without gmsh."""
    if shutil.which(GMSH) is None:
        return {}
    with tempfile.TemporaryDirectory() as folder:
        source, result = Path(folder, "in.msh"), Path(folder, "out.msh")
        meshio.write(source, meshio.Mesh(mesh.points, mesh.cells), file_format="gmsh22", binary=True)
        started = time.perf_counter()
        subprocess.run([GMSH, source, "-optimize", "-save", "-o", result], check=True, stdout=subprocess.DEVNULL)
        seconds = time.perf_counter() - started
        session = client.create_session("optimized")
        session.import_mesh(meshio.read(result), progress=False)
        entry = {"seconds": seconds, "angle": smallest_dihedral(session), "elements": elements_of(session)}
        session.delete()
    return {"adapt/gmsh_optimize": entry}


def elements_of(session):
    counts = session.info().element_counts
    return counts.cells or counts.faces


def entry(name, **figures):
    return {"name": name, "run_name": name, "run_type": "iteration", "time_unit": "s", **figures}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for argument in ("daemon", "mesh", "report"):
        parser.add_argument(argument)
    parser.add_argument("--repetitions", type=int, default=3)
    args = parser.parse_args()
    mesh = meshio.read(args.mesh)
    mesh = meshio.Mesh(mesh.points, [b for b in mesh.cells if b.type in ("tetra", "triangle")])
    with dynmesh.launch(args.daemon) as daemon:
        rates = time_operators(daemon.client, mesh, args.repetitions)
        count = sum(len(block.data) for block in mesh.cells)
        adapted = time_adaptation(daemon.client, mesh) | time_gmsh(daemon.client, mesh) if count <= ADAPTED else {}
    entries = [entry(name, cpu_time=1 / rate, items_per_second=rate) for name, rate in rates.items()]
    entries += [entry(name, cpu_time=figures.pop("seconds"), **figures) for name, figures in adapted.items()]
    is_volume = any(block.type == "tetra" for block in mesh.cells)
    context = {"type": "tetrahedron" if is_volume else "triangle", "elements": str(count),
               "vertices": str(len(mesh.points)), "order": "hilbert", "num_cpus": os.cpu_count(), "mhz_per_cpu": 0}
    Path(args.report).write_text(json.dumps({"context": context, "benchmarks": entries}, indent=1))


if __name__ == "__main__":
    main()
