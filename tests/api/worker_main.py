"""A worker with settings of the test's choice: `python -m tests.api.worker_main '{"data": ...}'`."""

import json
import sys

from service.settings import ServiceSettings
from service.worker import run_worker

if __name__ == "__main__":
    given = json.loads(sys.argv[1])
    if "trainer" in given:
        given["trainer"] = tuple(given["trainer"])
    run_worker(ServiceSettings(**given))
