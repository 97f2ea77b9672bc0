"""Whether this machine has what lightgauge needs, in words."""

import argparse

from comparisons.options import Commands, Say, add_store


def register(commands: Commands) -> None:
    add_store(commands.add("doctor", examine, "can this machine render?", "lightgauge doctor"))


def examine(options: argparse.Namespace, say: Say) -> int:
    from comparisons.doctor import findings
    from scenes.errors import MachineError

    status = 0
    for finding in findings(options.store):
        say(f"{'ok' if finding.is_fine else 'WRONG':6}{finding.what:16}{finding.detail}")
        if not finding.is_fine:
            status = MachineError.exit_status
    return status
