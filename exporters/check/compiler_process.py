"""The other side of `isolated_compiler`: `python -m exporters.check.compiler_process`.

Says "ready" in a line of JSON, then answers each pair [vertex, fragment] with the driver's objection.
"""

import json
import os
import sys

from exporters.check.compiler import gl_compiler


def main() -> int:
    """1 where there is no OpenGL."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # drivers print
    compiler = gl_compiler()
    if compiler is None:
        return 1
    print(json.dumps("ready"), file=answers, flush=True)
    for line in sys.stdin:
        print(json.dumps(compiler(*json.loads(line))), file=answers, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
