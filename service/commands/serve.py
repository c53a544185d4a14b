"""`polyfield serve`: the API, the pages and one worker."""

import argparse
import os
import sys

from service.commands.common import add_service, settings_of, start_log
from service.supervisor import Supervisor

# Open event streams never end by themselves.
SHUTDOWN_S = 2


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    parser = subparsers.add_parser("serve", help="serve the API and the web pages, with one worker")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=8000)
    add_service(parser)
    parser.add_argument("--no-worker", action="store_true", help="workers are started elsewhere")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    import uvicorn

    from service.app import create_app
    from service.database import prepare

    start_log(arguments, "server")
    settings = settings_of(arguments)
    prepare(settings)
    supervisor = None if arguments.no_worker else Supervisor(_worker_command(arguments))
    if supervisor:
        supervisor.start()
    try:
        print(f"Polyfield: http://{arguments.host}:{arguments.port}", flush=True)
        uvicorn.run(
            create_app(settings),
            host=arguments.host,
            port=arguments.port,
            log_level="warning",
            timeout_graceful_shutdown=SHUTDOWN_S,
        )
    finally:
        if supervisor:
            supervisor.stop()
    return 0


def _worker_command(arguments: argparse.Namespace) -> list[str]:
    command = [sys.executable, "-m", "service.cli", "worker", "--data", str(arguments.data)]
    command += ["--log-level", arguments.log_level]
    command += ["--database-url", arguments.database_url] if arguments.database_url else []
    command += ["--keep-days", str(arguments.keep_days)] if arguments.keep_days is not None else []
    return [*command, "--parent", str(os.getpid())]
