"""Reports of Google Benchmark, and tables of what they hold."""
import dataclasses
import json

NANOSECONDS = {"ns": 1.0, "us": 1e3, "ms": 1e6, "s": 1e9}
TYPES = {"tetrahedron": "tetrahedra", "hexahedron": "hexahedra", "triangle": "triangles", "none": "no mesh"}


@dataclasses.dataclass
class Run:
    """One program on one mesh in one order."""

    family: str  # core, memory, service, scale or store
    mesh: str
    order: str
    context: dict
    benchmarks: dict  # name -> what Google Benchmark reports, of the median

    @property
    def type(self):
        return self.context["type"]

    @property
    def elements(self):
        return int(self.context["elements"])

    def ns(self, name):
        """Nanoseconds of CPU time, or None."""
        found = self.benchmarks.get(name)
        return found and found["cpu_time"] * NANOSECONDS[found["time_unit"]]

    def rate(self, name):
        """Items a second, or None."""
        found = self.benchmarks.get(name)
        return found and found.get("items_per_second")

    def ratio(self, name, base):
        """Time of one by that of the other; None where one is missing or was too short to be a time."""
        time, base_time = self.ns(name), self.ns(base)
        return time / base_time if time is not None and base_time is not None and base_time > 5 else None

    def as_json(self):
        return {"family": self.family, "mesh": self.mesh, "order": self.order, "context": self.context,
                "benchmarks": list(self.benchmarks.values())}


def _plain_name(entry):
    return "/".join(part for part in entry["run_name"].split("/") if not part.startswith("iterations:") and part != "real_time")


def _place(name):
    """Sorts names of tasks: as a table reads best, whatever order they ran in."""
    def key(part):
        if len(part) == 3 and part[1] == "_":
            return ("vefc".index(part[0]), "vefc".index(part[2])), part
        ways = ("limit", "limit_warm", "stored", "on_demand", "one_edit", "1_percent", "all", "bulk", "one_by_one")
        return (ways.index(part) if part in ways else len(ways), 0), part
    return [key(part) for part in name.split("/")]


def read_runs(folder):
    runs = []
    for path in sorted(folder.glob("*.json")):
        content = json.loads(path.read_text())
        entries = content["benchmarks"]
        medians = {_plain_name(e): e for e in entries if e.get("aggregate_name") == "median"}
        singles = {_plain_name(e): e for e in entries if e.get("run_type") == "iteration"}
        found = medians or singles
        # Of the machine only what the head of the results says: no paths, no host.
        kept = ("type", "elements", "vertices", "order", "num_cpus", "mhz_per_cpu")
        context = {key: content["context"][key] for key in kept}
        runs.append(Run(*path.name.split(".")[:3], context, {name: found[name] for name in sorted(found, key=_place)}))
    return sorted(runs, key=lambda run: (list(TYPES).index(run.type), run.order, run.elements))


def markdown(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def time_text(ns):
    if ns is None:
        return "-"
    for unit in ("ns", "us", "ms"):
        if ns < 1000 or unit == "ms":
            return f"{ns:.3g} {unit}" if ns < 1000 else f"{ns:.0f} {unit}"
        ns /= 1000
    return None


def ratio_text(ratio):
    return "-" if ratio is None else f"{ratio:.2f}"


def rate_text(rate):
    return "-" if rate is None else f"{rate / 1e6:.2f} M/s"


def _tasks(run, prefix):
    """Tasks under a prefix, in the order of the report: what stands before the last part of the name."""
    names = [name.rsplit("/", 1)[0] for name in run.benchmarks if name.startswith(prefix)]
    return list(dict.fromkeys(names))


def _relations(run):
    rows = []
    for task in _tasks(run, "paper_task") + _tasks(run, "relation/"):
        times = {way: run.ns(f"{task}/{way}") for way in ("limit", "stored", "on_demand")}
        peers = [f"{name.split('/')[1]} {ratio_text(run.ratio(name, task + '/on_demand'))}"
                 for name in run.benchmarks if name.startswith("peer/") and name.split("/", 2)[2] == task]
        rows.append([task.replace("relation/", ""), time_text(times["limit"]), time_text(times["stored"]),
                     ratio_text(run.ratio(task + "/stored", task + "/limit")), time_text(times["on_demand"]),
                     ratio_text(run.ratio(task + "/on_demand", task + "/limit")), ", ".join(peers) or "-"])
    return markdown(["all rows of", "limit", "stored", "x limit", "on demand", "x limit",
                     "peers, x on demand"], rows)


def _builds(run):
    rows = []
    for name in run.benchmarks:
        if not name.startswith("build/") and "/build" not in name:
            continue
        rows.append([name, time_text(run.ns(name)), f"{run.ns(name) / run.elements:.0f}",
                     ratio_text(run.ratio(name, "build/limit")),
                     ratio_text(run.ratio(name, "build/limit_all_relations"))])
    return markdown(["build", "time", "ns an element", "x limit (default relations)", "x limit (all)"], rows)


def _edits(run):
    rows = [[name, time_text(run.ns(name)), rate_text(run.rate(name))]
            for name in run.benchmarks if name.startswith(("edit/add_", "edit/remove_"))]
    return markdown(["a tenth of the elements, in one batch", "time", "elements"], rows)


def operators(run):
    """Names of the benchmarks of edit operators."""
    return [name for name in run.benchmarks
            if name.startswith("edit/") and name + "/by_elements" in run.benchmarks]


def _operators(run):
    rows = []
    for name in operators(run):
        peers = [f"{peer.split('/')[1]} {ratio_text(run.rate(name) / run.rate(peer))}"
                 for peer in run.benchmarks if peer.startswith("peer/") and peer.split("/", 2)[2] == name]
        by_elements = run.rate(name + "/by_elements")
        rows.append([name, f"{run.rate(name) / 1e3:.0f} K/s", ratio_text(run.rate(name) / by_elements),
                     ", ".join(peers) or "-"])
    return markdown(["operator, at random places", "rate", "x rate by elements", "x rate of peers"], rows)


def _service(run):
    rows = []
    for name, found in run.benchmarks.items():
        if name.startswith("rpc/"):
            rows.append([name, f"{run.rate(name) / 1e3:.2f} K/s", "-"])
        else:
            angle = f"{found['angle']:.1f} degrees, {found['elements']} elements"
            rows.append([name, time_text(run.ns(name)), angle])
    return markdown(["operator and size of a batch, adaptation", "rate or time", "smallest angle"], rows)


def _store(run):
    rows = [[name.removeprefix("store/"), f"{run.rate(name):.0f}/s", ratio_text(run.rate(name) / run.rate(limit))]
            for name in run.benchmarks for limit in [name.split("/")[0] + "/" + name.split("/")[1] + "/limit"]]
    return markdown(["appends of 2 KiB, one waited for after another or 256 at once", "rate", "x bare RocksDB"], rows)


def _against_limit(run, prefix):
    rows = []
    for task in _tasks(run, prefix):
        for name in run.benchmarks:
            if name.rsplit("/", 1)[0] != task:
                continue
            rows.append([name, time_text(run.ns(name)), ratio_text(run.ratio(name, task + "/limit")),
                         ratio_text(run.ratio(name, task + "/limit_warm"))])
    for name in run.benchmarks:
        if name.startswith("peer/") and name.split("/", 2)[2].startswith(prefix):
            rows.append([name, time_text(run.ns(name)), "-", "-"])
    return rows


def _locality(run):
    rows = []
    for name in run.benchmarks:
        if name.startswith("locality/fresh/"):
            replaced = name.replace("fresh", "replaced_25_percent")
            rows.append([name.split("/")[2], time_text(run.ns(name)), time_text(run.ns(replaced)),
                         ratio_text(run.ratio(replaced, name))])
    return markdown(["on demand", "fresh", "25% replaced", "ratio"], rows)


def _scale(runs):
    names = list(dict.fromkeys(name for run in runs for name in run.benchmarks))
    rows = [[name] + [f"{run.ns(name) / run.elements:.2f}" for run in runs] for name in names]
    return markdown(["ns a tetrahedron, generated, Hilbert order"] + [f"{run.elements}" for run in runs], rows)


def details(runs):
    parts = []
    for run in runs:
        if run.family != "core":
            continue
        parts += [f"## {run.mesh}: {run.elements} {TYPES[run.type]}, {run.order} order", "", _builds(run), "",
                  _relations(run), "",
                  markdown(["boundary and diff", "time", "x limit", "x warm limit"],
                           _against_limit(run, "boundary/") + _against_limit(run, "diff/")), "",
                  _edits(run), "", _operators(run), "", _locality(run), ""]
    for run in runs:
        if run.family == "service":
            parts += [f"## {run.mesh} through the daemon: {run.elements} {TYPES[run.type]}", "", _service(run), ""]
    for run in runs:
        if run.family == "store":
            parts += ["## Store, wall time", "", _store(run), ""]
    scale = sorted((run for run in runs if run.family == "scale"), key=lambda run: run.elements)
    return "\n".join(parts + ["## Scale", "", _scale(scale)])


def memory(runs):
    """What each array costs, by element type."""
    runs = [run for run in runs if run.family == "memory"]
    figures = {run: {} for run in map(id, runs)}
    for run in runs:
        of_all = run.benchmarks["memory/bytes_per_cell/all_stored"]
        for name in (n for n in of_all if n.startswith("array ")):
            figures[id(run)][name[6:]] = of_all[name]
        for case in ("default", "all_stored", "limit"):
            entry = run.benchmarks[f"memory/bytes_per_cell/{case}"]
            for what in ("counted", "resident"):
                if what in entry:
                    figures[id(run)][f"**{case.replace('_', ' ')}, {what}**"] = entry[what]
    names = list(dict.fromkeys(name for of_run in figures.values() for name in of_run))
    rows = [[name] + [f"{figures[id(run)].get(name, 0):.2f}" for run in runs] for name in names]
    head = ["array"] + [f"{TYPES[run.type]} ({run.mesh})" for run in runs]
    rows.sort(key=lambda row: row[0].startswith("**"))
    return "## Memory, bytes an element\n\n" + markdown(head, rows)
