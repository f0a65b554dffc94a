"""`vistel replay --verify`: runs the world again on a log and compares every state bit for bit."""

from vistel.wire.log import LogReader
from vistel_cli.log.study import reading
from vistel_cli.terminal import FAILED, out, print_error
from vistel_cli.waiting import waiting

VERIFIED_TOPICS = (
    "participant",
    "motion",
    "motion_thin",
    "command",
    "world_inputs",
    "world_state",
    "world_key",
    "world_detail",
    "hand_force",
)


def verify_log(reader: LogReader, as_json: bool) -> int:
    """Run the world again on the log. Returns the exit code."""
    with waiting("loading"):
        from vistel.messages.world.verify import verify  # its kernels take a second

    with reading(reader):
        report = verify((r.topic.name, r.names, r.message, r.log_ns) for r in reader.records(topics=VERIFIED_TOPICS))
    if as_json:
        out.print_json(
            data={
                "steps": report.steps,
                "hand_forces": report.hand_forces,
                "equal": report.equal,
                "difference": report.difference,
                "skipped": report.skipped,
                "skipped_because": report.skipped_because,
            }
        )
    elif report.equal:
        felt = f" and {report.hand_forces} hand forces" if report.hand_forces else ""
        out.print(f"{report.steps} world states{felt} re-run and compared: every one is equal, bit for bit")
    else:
        print_error(report.difference)
    if not as_json:
        for why, count in report.skipped_because.items():
            out.print(f"{count} states not compared: {why}")
    return 0 if report.equal else FAILED
