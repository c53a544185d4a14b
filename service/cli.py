"""The command line: `polyfield convert | export | check | serve | worker | sample | demo`.

Exit status: 0 done; 1 failed; 2 the input or an option cannot be used; 130 stopped with Ctrl-C.
"""

import argparse
import sys
from collections.abc import Sequence

from core.errors import InputError, PolyfieldError
from service.commands import check, convert, demo, export, sample, serve, worker

COMMANDS = (convert, export, check, serve, worker, sample, demo)
INTERRUPTED = 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs a command and returns its exit status. What a person can act on is one line on stderr, never a traceback."""
    parsed = _parser().parse_args(arguments)
    try:
        return parsed.run(parsed)
    except InputError as error:
        print(_line(error), file=sys.stderr)
        return 2
    except PolyfieldError as error:
        print(_line(error), file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("stopped", file=sys.stderr)
        return INTERRUPTED


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="polyfield", description="Photos in, a .glb with view-dependent appearance out."
    )
    subparsers = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add_parser(subparsers)
    return parser


def _line(error: PolyfieldError) -> str:
    return f"error [{error.code}]: {error}"


if __name__ == "__main__":
    sys.exit(main())
