"""Jobs as the API sees them: a row of the job engine and a folder."""

import asyncio
import time
import uuid
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import aclosing
from datetime import UTC, datetime
from typing import Any

from dbos import DBOSClient, EnqueueOptions, WorkflowSerializationFormat, WorkflowStatus
from dbos import error as dbos_error

from service.artifacts import capture_summary, format_rows, list_artifacts
from service.database import APPLICATION, EXPORT_WORKFLOW, PROGRESS_STREAM, QUEUE, WORKFLOW
from service.errors import JobBusy, JobInterrupted, JobNotFound, JobUnfinished
from service.job_folder import JOB_ID, JobFolder
from service.problems import problem_of
from service.settings import ServiceSettings

STATES = {
    "DELAYED": "queued",
    "ENQUEUED": "queued",
    "PENDING": "running",
    "SUCCESS": "succeeded",
    "ERROR": "failed",
    "MAX_RECOVERY_ATTEMPTS_EXCEEDED": "failed",
    "CANCELLED": "cancelled",
}
NO_PROGRESS: dict[str, Any] = {"stage": None, "fraction": 0.0, "psnr": None, "preview": False}
ENDED = ("succeeded", "failed", "cancelled")
UNENDED = ("DELAYED", "ENQUEUED", "PENDING")
MAX_EXPORTS = 500  # that a list of jobs looks at
# A worker looks once a second whether its job was cancelled; ten times that means it hangs.
RELEASE_TIMEOUT_S = 10.0
RELEASE_POLL_S = 0.05


class Jobs:
    """The job engine's client. It never runs a job; workers do."""

    def __init__(self, settings: ServiceSettings) -> None:
        self._settings = settings
        self._client = DBOSClient(system_database_url=settings.database_url, application_name=APPLICATION)

    def close(self) -> None:
        self._client.destroy()

    async def enqueue(self, folder: JobFolder) -> None:
        """Hands a new job to the workers. Only its id goes through the engine."""
        await self._client.enqueue_async(_place(WORKFLOW, folder.id), folder.id)

    async def export(self, job_id: str, formats: Sequence[str]) -> dict[str, Any]:
        """Hands an export of a job that has succeeded to the workers; returns the job.

        Raises:
            JobNotFound
            JobUnfinished: it has no scene.glb.
            JobBusy: an export of it is waiting or in work.
        """
        state = (await self.get(job_id))["state"]
        if state != "succeeded":
            remedy = (
                "Wait until it has succeeded." if state in ("queued", "running") else "Only jobs that succeeded can."
            )
            raise JobUnfinished(f"job {job_id}", "must have succeeded to be exported", f"one that is {state}", remedy)
        # The engine lets one export of a job in at a time.
        place = _place(EXPORT_WORKFLOW, f"{job_id}-{uuid.uuid4().hex[:8]}")
        place["deduplication_id"] = job_id
        try:
            await self._client.enqueue_async(place, job_id, list(formats))
        except dbos_error.DBOSQueueDeduplicatedError:
            remedy = "Wait until it is done, or cancel it."
            raise JobBusy(f"job {job_id}", "must have no export in work", "one that is", remedy) from None
        return await self.get(job_id)

    async def list(self, limit: int = 200) -> list[dict[str, Any]]:
        """The newest jobs first."""
        rows = await self._client.list_workflows_async(name=WORKFLOW, sort_desc=True, limit=limit, load_input=False)
        exports = {_job_of(row): row for row in reversed(await self._exports(limit=MAX_EXPORTS))}
        return await asyncio.to_thread(lambda: [self._view(row, exports.get(row.workflow_id)) for row in rows])

    async def get(self, job_id: str) -> dict[str, Any]:
        """One job.

        Raises:
            JobNotFound
        """
        row = await self._row(job_id)
        latest = await self._exports(workflow_id_prefix=job_id, limit=1)
        return await asyncio.to_thread(self._view, row, *latest)

    async def cancel(self, job_id: str) -> dict[str, Any]:
        """Stops a job; of one that has ended, its export. Returns when its trainer is gone: within about a second.

        Raises:
            JobNotFound
            JobBusy: its trainer does not end.
        """
        if (await self.get(job_id))["state"] not in ENDED:
            await self._client.cancel_workflow_async(job_id)
            await _when_released(self._folder(job_id), JobFolder.drop_inputs)
            return await self.get(job_id)
        for row in await self._exports(workflow_id_prefix=job_id, status=list(UNENDED)):
            await self._client.cancel_workflow_async(row.workflow_id)
            await _when_released(self._folder(job_id), lambda folder: None)
        return await self.get(job_id)

    async def delete(self, job_id: str) -> None:
        """Stops a job and removes everything of it.

        Raises:
            JobNotFound
            JobBusy: its trainer does not end.
        """
        await self.cancel(job_id)
        # The rows go last: a worker learns from them that its job is cancelled.
        await _when_released(self._folder(job_id), JobFolder.remove)
        for row in await self._exports(workflow_id_prefix=job_id):
            await self._client.delete_workflow_async(row.workflow_id)
        await self._client.delete_workflow_async(job_id)

    async def reports(self, job_id: str, after: int = 0) -> AsyncIterator[tuple[int, dict[str, Any]]]:
        """The job's reports from number `after` + 1 on, as they come, with their numbers; ends with the job."""
        stream = self._client.read_stream_async(job_id, PROGRESS_STREAM, offset=after, polling_interval_sec=0.5)
        async with aclosing(stream):  # type: ignore[type-var]
            async for report in stream:
                after += 1
                yield after, report

    def folder(self, job_id: str) -> JobFolder:
        """The folder of an id that may be wrong.

        Raises:
            JobNotFound
        """
        folder = self._folder(job_id)
        if not folder.path.is_dir():
            raise _unknown(job_id)
        return folder

    def _folder(self, job_id: str) -> JobFolder:
        if not JOB_ID.fullmatch(job_id):
            raise _unknown(job_id)
        return JobFolder(self._settings.jobs / job_id)

    async def _row(self, job_id: str) -> WorkflowStatus:
        self._folder(job_id)
        rows = await self._client.list_workflows_async(workflow_ids=[job_id], load_input=False)
        if not rows:
            raise _unknown(job_id)
        return rows[0]

    async def _exports(self, **chosen: Any) -> Sequence[WorkflowStatus]:
        """Newest first."""
        return await self._client.list_workflows_async(name=EXPORT_WORKFLOW, sort_desc=True, **chosen)

    def _view(self, row: WorkflowStatus, export: WorkflowStatus | None = None) -> dict[str, Any]:
        folder = self._folder(row.workflow_id)
        request = folder.request()
        problem = _problem(row)
        return {
            "id": folder.id,
            "name": request.get("name", ""),
            "state": "failed" if problem else STATES[row.status],
            "created": _time_text(row.created_at),
            "started": _time_text(row.dequeued_at),
            "ended": _time_text(row.completed_at),
            "options": request.get("options", {}),
            **(folder.progress() or NO_PROGRESS),
            "capture": capture_summary(folder),
            "problem": problem,
            "artifacts": list_artifacts(folder),
            "formats": format_rows(folder),
            "export": _export_view(export, folder) if export else None,
        }


def _export_view(row: WorkflowStatus, folder: JobFolder) -> dict[str, Any]:
    """The latest export of a job."""
    problem = _problem(row)
    progress = folder.export_progress()
    reported = progress if progress.get("id") == row.workflow_id else {}
    return {
        "state": "failed" if problem else STATES[row.status],
        "formats": row.input["args"][1] if row.input else [],
        "stage": reported.get("stage"),
        "fraction": reported.get("fraction", 0.0),
        "problem": problem,
    }


def _place(workflow: str, workflow_id: str) -> EnqueueOptions:
    """Where in the engine something waits."""
    return {
        "workflow_name": workflow,
        "queue_name": QUEUE,
        "workflow_id": workflow_id,
        "application_name": APPLICATION,
        "serialization_type": WorkflowSerializationFormat.PORTABLE,
    }


def _job_of(export: WorkflowStatus) -> str:
    return export.workflow_id.partition("-")[0]


def _problem(row: WorkflowStatus) -> dict[str, Any] | None:
    """Why the job failed: what its trainer refused, else that it never came to an end."""
    if row.status == "SUCCESS":
        return (row.output or {}).get("problem")
    if STATES[row.status] != "failed":
        return None
    rule = "must reach its end"
    received = "a trainer that crashed or hung at each attempt"
    remedy = "See trainer.log in the job's folder; a smaller preset or more downscaling needs less memory."
    return problem_of(JobInterrupted("job", rule, received, remedy))


async def _when_released(folder: JobFolder, act: Callable[[JobFolder], None]) -> None:
    """Acts on a job's folder once its trainer is gone.

    Raises:
        JobBusy
    """
    deadline = time.monotonic() + RELEASE_TIMEOUT_S
    # The waiting is done here, not in a thread: there are few of those, and all other answers need them.
    while not await asyncio.to_thread(_acted, folder, act):
        if time.monotonic() > deadline:
            raise JobBusy(f"job {folder.id}", "must be let go by its worker", "", "Try again in a minute.")
        await asyncio.sleep(RELEASE_POLL_S)


def _acted(folder: JobFolder, act: Callable[[JobFolder], None]) -> bool:
    try:
        with folder.lock():
            act(folder)
    except BlockingIOError:
        return False
    except FileNotFoundError:
        pass  # somebody else has removed it
    return True


def _unknown(job_id: str) -> JobNotFound:
    return JobNotFound(f"job {job_id[:64]!r}", "must exist", "no such job", "GET /jobs lists them.")


def _time_text(milliseconds: int | None) -> str | None:
    if milliseconds is None:
        return None
    return datetime.fromtimestamp(milliseconds / 1e3, UTC).isoformat(timespec="milliseconds")
