"""`polyfield worker`: runs the jobs of a service."""

import argparse
import signal

from service.commands.common import add_service, settings_of, start_log
from service.parent import end_with_parent


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("worker", help="run jobs; `serve` starts one by itself")
    add_service(parser)
    parser.add_argument("--id", default="", help="name among the workers; default: the host's name and -0")
    parser.add_argument("--parent", type=int, default=0, help=argparse.SUPPRESS)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    if arguments.parent:
        end_with_parent(arguments.parent, signal.SIGTERM)
    start_log(arguments, "worker")
    from service.worker import run_worker

    run_worker(settings_of(arguments, arguments.id))
    return 0
