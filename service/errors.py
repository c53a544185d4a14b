"""What only the service can refuse, as branches of core's tree; `status` is the HTTP status of the problem.

PolyfieldError
|- JobNotFound              job-not-found
|- ArtifactNotFound         artifact-not-found
|- JobBusy                  job-busy               its worker has not let go of it yet
|- JobInterrupted           job-interrupted        its trainer ended without a result, again and again
|- JobUnfinished            job-unfinished         it has no scene.glb to export again
|- RequestInvalid           request-invalid        not a form, or a field of the wrong type
|- UnknownFormat            unknown-format
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


class JobUnfinished(PolyfieldError):
    code: ClassVar[str] = "job-unfinished"


class RequestInvalid(InputError):
    code: ClassVar[str] = "request-invalid"


class UnknownFormat(InputError):
    code: ClassVar[str] = "unknown-format"


class StorageFull(PolyfieldError):
    code: ClassVar[str] = "storage-full"


class WorkerRunning(PolyfieldError):
    code: ClassVar[str] = "worker-running"
