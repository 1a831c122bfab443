#!/usr/bin/env python3
"""Makes tables with ratios and targets of the reports of the benchmarks.

usage: table.py REPORTS CORE_JSON RESULTS_MD

REPORTS holds family.mesh.order.json as Google Benchmark wrote them. CORE_JSON gets all of them in one, RESULTS_MD
the tables; what misses its target is printed too. Times are medians of CPU time.
"""
import datetime
import json
import pathlib
import subprocess
import sys

import report
import targets


def machine():
    info = pathlib.Path("/proc/cpuinfo").read_text().splitlines()
    models = [line.split(":", 1)[1].strip() for line in info if line.startswith("model name")]
    return f"{models[0] if models else 'unknown processor'}, {len(models)} cores"


def commit():
    head = subprocess.run(["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    changed = subprocess.run(["git", "status", "--porcelain", "--untracked-files=no"], capture_output=True, text=True)
    edited = [line for line in changed.stdout.splitlines() if not line.endswith("RESULTS.md")]
    return (head or "unknown") + (" with changes" if edited else "")


def main(reports, core_json, results):
    runs = report.read_runs(pathlib.Path(reports))
    pathlib.Path(core_json).write_text(json.dumps({"runs": [run.as_json() for run in runs]}, indent=1))
    verdicts = targets.table(runs)
    text = "\n".join([
        "# Results of `make bench`", "",
        f"{machine()}; one thread; commit {commit()}; {datetime.date.today()}.", "",
        "Medians of CPU time, through the daemon of wall time; every ratio is of two figures of one process. `limit` is a loop over plain arrays, or",
        "the builder of such arrays: see [limit/](limit). Whatever has a figure gave the same answer as its limit,",
        "checked row by row before it was timed. On demand over all rows goes through `ForEachRow(mesh, relation,",
        "fn)`; relations that a mesh always has count as stored.", "",
        "## Targets", "", verdicts, "", report.details(runs), "", report.memory(runs), ""])
    pathlib.Path(results).write_text(text)
    print(verdicts)
    print(f"\nAll tables: {results}")


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
