"""Starting Warp without its chatter. The package does so when it is imported."""

import os
import sys
import tempfile

import warp as wp

# Printed by Warp's native part, which knows no log level. On a machine without a GPU it tells nothing new.
NO_DRIVER = b"Could not find or load the NVIDIA CUDA driver"


def start_warp() -> None:
    """Initialises Warp, passing on what its native part says on standard error, except that there is no driver."""
    wp.config.log_level = wp.LOG_WARNING  # no banner, no compile messages
    try:
        stderr = os.dup(2)
    except OSError:  # no standard error to keep clean
        wp.init()
        return
    with tempfile.TemporaryFile() as said:
        try:
            os.dup2(said.fileno(), 2)
            wp.init()
        finally:
            os.dup2(stderr, 2)
            os.close(stderr)
        said.seek(0)
        lines = [line for line in said if NO_DRIVER not in line]
    if sys.stderr is not None:
        sys.stderr.write(b"".join(lines).decode(errors="replace"))
