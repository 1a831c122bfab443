"""What the benchmarks should reach, and whether they do."""
import report


class Table:
    """Rows of: what, wanted, measured for each order, verdict."""

    def __init__(self):
        self.rows = []

    def at_most(self, what, value, limit, text=report.ratio_text):
        self._add(what, f"<= {text(limit)}", value, text, value is not None and value <= limit)

    def at_least(self, what, value, limit, text=report.rate_text):
        self._add(what, f">= {text(limit)}", value, text, value is not None and value >= limit)

    def _add(self, what, wanted, value, text, reached):
        verdict = "not measured" if value is None else "pass" if reached else "**miss**"
        self.rows.append([what, wanted, text(value), verdict])


def _build(table, run):
    where = f"{run.order} order"
    table.at_most(f"bulk build / limit builder of the default relations, {where}",
                  run.ratio("build/bulk", "build/limit"), 1.3)
    table.at_most(f"bulk build / CGAL TDS_3 build by our sorting, {where}",
                  run.ratio("build/bulk", "peer/cgal_tds3/build"), 1.0)
    table.at_most(f"bulk build / CGAL TDS_3 build by hashing, as CGAL does, {where}",
                  run.ratio("build/bulk", "peer/cgal_tds3/build_by_hash"), 1.0)
    if run.order == "hilbert":
        table.at_most(f"one by one / bulk build, {where}", run.ratio("build/one_by_one", "build/bulk"), 2.0)


def _relations(table, run):
    where = f"{run.order} order"
    table.at_most(f"paper's task, stored / limit, {where}", run.ratio("paper_task/stored", "paper_task/limit"), 1.3)
    table.at_most(f"paper's task, on demand / stored, {where}", run.ratio("paper_task/on_demand", "paper_task/stored"),
                  3.0 if run.order == "hilbert" else 8.0)
    for task in dict.fromkeys(n.rsplit("/", 1)[0] for n in run.benchmarks if n.startswith("relation/")):
        name = task.split("/")[1]
        if name == "c_e":
            continue  # the paper's task
        if f"{task}/stored" in run.benchmarks:
            table.at_most(f"{name} stored / limit, {where}", run.ratio(task + "/stored", task + "/limit"), 1.5)
        if run.order == "hilbert":
            table.at_most(f"{name} on demand / limit, {where}", run.ratio(task + "/on_demand", task + "/limit"),
                          12.0 if name == "v_c" else 6.0)


def _boundary_and_diff(table, run):
    where = f"{run.order} order"
    for task in ("boundary/faces", "boundary/vertices"):
        for way in ("collect", "list"):
            table.at_most(f"{task}, {way} / summing an array of its output, {where}",
                          run.ratio(f"{task}/{way}", f"{task}/limit"), 2.0)
        table.at_most(f"{task}, looking up positions: from the set / from an array, {where}",
                      run.ratio(f"{task}_used/collect", f"{task}_used/limit"), 2.0)
    table.at_most(f"diff after one edit, {where}", run.ns("diff/one_edit/on_demand"), 50e3, report.time_text)
    table.at_most(f"diff of everything / memcpy into new memory, {where}",
                  run.ratio("diff/all/on_demand", "diff/all/limit"), 2.0)


def _edits(table, run):
    wanted = {"remove_cells/random": 0.8e6, "add_cells/random": 0.5e6,
              "remove_cells/neighbouring": 1.5e6, "add_cells/neighbouring": 1.0e6}
    for name, rate in wanted.items():
        table.at_least(f"{name}, {run.order} order", run.rate(f"edit/{name}"), rate)


def _operators(table, run):
    for name in report.operators(run):
        what, rate = f"{name}, {run.type}, {run.order} order", run.rate(name)
        table.at_least(f"{what}: rate / by removing and adding elements",
                       rate / run.rate(name + "/by_elements"), 3.0, report.ratio_text)
        for peer in run.benchmarks:
            if peer.startswith("peer/") and peer.split("/", 2)[2] == name:
                wanted = 0.4 if "cgal_tds3" in peer else 0.5
                table.at_least(f"{what}: rate / {peer.split('/')[1]}", rate / run.rate(peer), wanted, report.ratio_text)
        if name == "edit/collapse" and run.type == "tetrahedron":
            table.at_least(what, rate, 60e3)


def _service(table, run, core):
    rate = core and core.rate("edit/split/batches")
    table.at_least(f"split, {run.mesh}: rate through the daemon in batches of 10,000 / in process",
                   run.rate("rpc/split/10000") / rate if rate else None, 0.7, report.ratio_text)
    for name in ("adapt/half", "adapt/double"):
        found = run.benchmarks.get(name)
        if found:
            table.at_least(f"{name}, {run.mesh}: smallest angle after / before",
                           found["angle"] / found["angle_before"], 1.0, report.ratio_text)


def _locality(table, run):
    fresh = [name for name in run.benchmarks if name.startswith("locality/fresh/")]
    for name in fresh:
        replaced = name.replace("fresh", "replaced_25_percent")
        table.at_most(f"{name.split('/')[2]} on demand, 25% replaced / fresh, {run.order} order",
                      run.ratio(replaced, name), 1.5)


def _memory(table, run):
    resident = run.benchmarks["memory/bytes_per_cell/default"].get("resident")
    table.at_most("resident bytes a tetrahedron, default relations", resident, 240.0, lambda b: f"{b:.0f}")


def _scale(table, runs):
    runs = sorted(runs, key=lambda run: run.elements)
    for name in runs[0].benchmarks if runs else ():
        costs = [run.ns(name) / run.elements for run in runs if run.ns(name)]
        table.at_most(f"{name}: cost a tetrahedron, {runs[-1].elements} / {runs[0].elements}",
                      costs[-1] / costs[0], 1.5)


def _store(table, run):
    one = run.rate("store/sync/one_editor")
    table.at_least("synced appends of one editor: rate / bare RocksDB", one / run.rate("store/sync/limit"), 0.8,
                   report.ratio_text)
    table.at_least("synced appends: rate of 64 editors / of one", run.rate("store/sync/editors/64") / one, 15.0,
                   report.ratio_text)


def table(runs):
    """Of the tetrahedra, for which the targets were set; as Markdown."""
    result = Table()
    of_tets = [run for run in runs if run.type == "tetrahedron"]
    core = [run for run in of_tets if run.family == "core"]
    for part in (_build, _relations, _boundary_and_diff, _edits, _locality):
        for run in sorted(core, key=lambda run: run.order, reverse=True):
            part(result, run)
    for run in runs:
        if run.family == "core" and run.order == "hilbert":
            _operators(result, run)
    for run in of_tets:
        if run.family == "memory":
            _memory(result, run)
    for run in runs:
        if run.family == "service":
            _service(result, run, next((c for c in runs if (c.family, c.mesh, c.order) == ("core", run.mesh, run.order)),
                                       None))
    for run in runs:
        if run.family == "store":
            _store(result, run)
    _scale(result, [run for run in of_tets if run.family == "scale"])
    mesh = core[0].mesh if core else "tetrahedra"
    return report.markdown([f"{mesh}", "wanted", "measured", ""], result.rows)
