"""``dynmesh check``: a report, and an exit code for scripts. ``dynmesh set-checks``: what each batch is checked for."""

from __future__ import annotations

import argparse
from typing import Any

from .checks import CHECKS, SEVERITIES, CheckReport, CheckResult, SurfaceTopology
from .errors import InvalidArgumentError
from .session import Session

# Exit codes.
CHECK_FOUND, CHECK_FAILED = 1, 2

_SHOWN_IDS = 8


def add_check(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments."""
    parser.epilog = (
        "Exit code: 0 if nothing is bad that the session rejects, or that --fail-on names; 1 if something is; "
        "2 if the session could not be checked, or for wrong usage."
    )
    parser.add_argument("name", metavar="NAME")
    parser.add_argument(
        "--only", metavar="CHECKS", type=_check_names, help="separated by commas (default: all): " + ", ".join(CHECKS)
    )
    parser.add_argument(
        "--fail-on",
        metavar="CHECKS",
        type=_check_names,
        help="for the exit code (default: those that the session rejects)",
    )
    parser.add_argument(
        "--max-findings", metavar="N", type=int, default=1000, help="entities named for each check and kind (1000)"
    )


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Adds the arguments of ``set-checks``."""
    parser.epilog = (
        "What each check measures, and its own threshold, is said in proto/dynmesh/v1/types.proto. Checks: "
        + ", ".join(CHECKS)
    )
    parser.add_argument("name", metavar="NAME")
    parser.add_argument(
        "checks",
        metavar="CHECK=SEVERITY[:THRESHOLD]",
        nargs="+",
        type=_check_setting,
        help="severities are warn, reject and off: inverted=reject, min_dihedral=warn:5; or none",
    )


def run_check(session: Session, args: argparse.Namespace) -> tuple[CheckReport, list[str]]:
    """The report, and the names of the checks for which the command fails.

    Raises `InvalidArgumentError` for a check of ``--fail-on`` that ``--only`` leaves out.
    """
    left_out = [name for name in args.fail_on or () if args.only is not None and name not in args.only]
    if left_out:
        raise InvalidArgumentError(f"--fail-on names what --only leaves out: {', '.join(left_out)}")
    report = session.check(args.only, max_findings=args.max_findings)
    if args.fail_on is None:
        return report, report.bad("reject")
    return report, [name for name in report.bad() if name in args.fail_on]


def describe_report(report: CheckReport) -> str:
    """An aligned listing for humans."""
    lines = [f"revision {report.revision}", ""]
    lines.append(f"{'':17} {'severity':8} {'bad':>9} {'of':>10} {'lowest':>10} {'highest':>10} {'threshold':>10}")
    for name, result in report.results.items():
        range_ = f"{result.lowest:10.4g} {result.highest:10.4g}" if result.measured else f"{'-':>10} {'-':>10}"
        lines.append(
            f"{name:17} {result.severity:8} {result.bad:9} {result.measured:10} {range_} {result.threshold:10.4g}"
            f"{_first_ids(result)}"
        )
    if report.topology is not None:
        topology = report.topology
        lines += ["", f"Euler characteristic {topology.euler_characteristic}, {topology.components} component(s), "
                      f"{topology.isolated_vertices} isolated vertices, {topology.bodies} bodies"]
        lines += [_surface("surface", topology.surface), _surface("shells", topology.shells)]
    return "\n".join(lines)


def _first_ids(result: CheckResult) -> str:
    text = ""
    for kind, found in result.findings.items():
        more = ", ..." if len(found.ids) > _SHOWN_IDS else ""
        text += f"  {kind} {', '.join(map(str, found.ids[:_SHOWN_IDS]))}{more}"
    return text


def _surface(title: str, surface: SurfaceTopology) -> str:
    parts: dict[str, Any] = surface._asdict()
    return f"{title}: " + ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in parts.items())


def _check_setting(text: str) -> tuple[str, str | tuple[str, float]] | None:
    if text == "none":
        return None
    name, _, value = text.partition("=")
    severity, colon, threshold = value.partition(":")
    if name not in CHECKS or severity not in SEVERITIES:
        raise argparse.ArgumentTypeError(f"{text} is not a check and a severity such as inverted=reject")
    try:
        return name, (severity, float(threshold)) if colon else severity
    except ValueError:
        raise argparse.ArgumentTypeError(f"{threshold} in {text} is not a number") from None


def _check_names(text: str) -> list[str]:
    names = [name for name in text.split(",") if name]
    unknown = [name for name in names if name not in CHECKS]
    if unknown or not names:
        raise argparse.ArgumentTypeError(f"{', '.join(unknown) or 'nothing'} is none of {', '.join(CHECKS)}")
    return names
