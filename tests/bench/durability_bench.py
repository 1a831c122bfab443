#!/usr/bin/env python3
"""What durability costs through a daemon: loading, editing, and checkpoints beside edits. Prints ratios.

usage: durability_bench.py DAEMON MESH DIRECTORY

MESH is any file of triangles or tetrahedra that meshio reads; data directories are made in DIRECTORY, on the disk that
is meant. An edit splits four edges at random places. Sessions take turns edit by edit, so that noise hits all of them.
"""
from __future__ import annotations

import argparse
import statistics
import tempfile
import time

import dynmesh
import meshio
import numpy as np

EDITS = 1500  # of each session in a round
ROUNDS = 3
PLACES = 4  # edges split by one edit
FIRST = 20_000  # edges split before, so that arrays have grown
OFTEN = 100_000  # bytes of log: checkpoints follow each other
NEVER = 1 << 50


class Editor:
    """Edits one session and keeps how long each edit took."""

    def __init__(self, client, name, mesh, durability):
        self.session = client.create_session(name, durability=durability)
        started = time.perf_counter()
        self.session.import_mesh(mesh, slot_order="hilbert", progress=False)
        self.import_seconds = time.perf_counter() - started
        self.edges = self.session.info().counts.edges
        self.seconds = []
        self._split(np.random.default_rng(0).choice(self.edges, min(FIRST, self.edges), replace=False))

    def edit(self, rng):
        started = time.perf_counter()
        self._split(rng.integers(0, self.edges, PLACES))
        self.seconds.append(time.perf_counter() - started)

    def _split(self, edges):
        with self.session.edit(skip_refused=True) as batch:
            batch.split_edges([int(edge) for edge in edges])


def print_line(what, value, unit, wanted=None):
    verdict = "" if wanted is None else f"   wanted <= {wanted}{unit}: {'pass' if value <= wanted else 'MISS'}"
    print(f"{what:62} {value:9.2f}{unit}{verdict}", flush=True)


def time_loading(daemon, mesh, directory):
    with tempfile.TemporaryDirectory(dir=directory) as data:
        with dynmesh.launch(daemon, data_dir=data) as first:
            imported = Editor(first.client, "part", mesh, "sync").import_seconds
        with dynmesh.launch(daemon, data_dir=data) as second:
            started = time.perf_counter()
            second.client.session("part").info()
            loaded = time.perf_counter() - started
    print_line("loading after a restart / importing", loaded / imported, "x", 2.0)


def time_editing(daemon, mesh, directory):
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory(dir=directory) as data, dynmesh.launch(daemon, data_dir=data) as running:
        editors = {each: Editor(running.client, each, mesh, each) for each in ("none", "async", "sync")}
        for _ in range(EDITS):
            for editor in editors.values():
                editor.edit(rng)
    medians = {name: statistics.median(editor.seconds) for name, editor in editors.items()}
    print_line("one edit without durability, median", medians["none"] * 1e6, " us")
    print_line("one edit, async / none, medians", medians["async"] / medians["none"], "x", 1.15)
    print_line("one edit, sync / none, medians", medians["sync"] / medians["none"], "x")


def time_checkpoints(daemon, mesh, directory):
    slowest = {NEVER: [], OFTEN: []}
    for round_ in range(ROUNDS):
        for log_bytes, quantiles in slowest.items():
            rng = np.random.default_rng(round_)
            with tempfile.TemporaryDirectory(dir=directory) as data, dynmesh.launch(
                    daemon, data_dir=data, flags=[f"--checkpoint_bytes={log_bytes}"]) as running:
                editor = Editor(running.client, "part", mesh, "async")
                for _ in range(EDITS):
                    editor.edit(rng)
            quantiles.append(np.quantile(editor.seconds, 0.99) * 1e3)
    never, often = (statistics.median(quantiles) for quantiles in slowest.values())
    print_line("p99 of async edits, no checkpoints", never, " ms")
    print_line("p99 that checkpoints one after the other add", often - never, " ms", 5.0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for argument in ("daemon", "mesh", "directory"):
        parser.add_argument(argument)
    args = parser.parse_args()
    mesh = meshio.read(args.mesh)
    mesh = meshio.Mesh(mesh.points, [block for block in mesh.cells if block.type in ("tetra", "triangle")])
    for measure in (time_loading, time_editing, time_checkpoints):
        measure(args.daemon, mesh, args.directory)


if __name__ == "__main__":
    main()
