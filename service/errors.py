"""What only the service can refuse, as branches of core's tree; `status` is the HTTP status of the problem.

PolyfieldError
|- JobNotFound              job-not-found
|- ArtifactNotFound         artifact-not-found
|- JobBusy                  job-busy               its worker has not let go of it yet
|- JobInterrupted           job-interrupted        its trainer ended without a result, again and again
|- RequestInvalid           request-invalid        not a form, or a field of the wrong type
|- StorageFull              storage-full
`- WorkerRunning            worker-running         two workers may not share a name
"""

from typing import ClassVar

from core.errors import InputError, PolyfieldError


class JobNotFound(PolyfieldError):
    code: ClassVar[str] = "job-not-found"


class ArtifactNotFound(PolyfieldError):
    code: ClassVar[str] = "artifact-not-found"


class JobBusy(PolyfieldError):
    code: ClassVar[str] = "job-busy"


class JobInterrupted(PolyfieldError):
    code: ClassVar[str] = "job-interrupted"


class RequestInvalid(InputError):
    code: ClassVar[str] = "request-invalid"


class StorageFull(PolyfieldError):
    code: ClassVar[str] = "storage-full"


class WorkerRunning(PolyfieldError):
    code: ClassVar[str] = "worker-running"
