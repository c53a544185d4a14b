"""The workflows that the job engine runs: a conversion, and an export of one that has succeeded. Each is one step."""

import asyncio
import logging
from typing import Any

from dbos import DBOS, WorkflowSerializationFormat

from service.database import EXPORT_WORKFLOW, PROGRESS_STREAM, WORKFLOW
from service.errors import JobNotFound
from service.job_folder import JobFolder
from service.problems import problem_of
from service.settings import ServiceSettings
from service.trainer_process import run_trainer

# Each dispatch counts, also those after an orderly restart of the worker.
MAX_RECOVERIES = 20
MAX_ATTEMPTS = 3

log = logging.getLogger(__name__)


def register_pipeline(settings: ServiceSettings) -> None:
    """Tells the job engine the workflows; before its launch, once in a process."""
    _register_conversion(settings)
    _register_export(settings)


def _register_conversion(settings: ServiceSettings) -> None:

    async def publish(folder: JobFolder, report: dict[str, Any]) -> None:
        await asyncio.to_thread(folder.write_progress, report)
        # This write also fences: it fails for a worker whose job was given to another.
        await DBOS.write_stream_async(PROGRESS_STREAM, report)

    # Only an async step can be cancelled midway. It returns plain values, because the engine pickles them.
    @DBOS.step(name="train", preemptible=True, retries_allowed=True, max_attempts=MAX_ATTEMPTS)
    async def train(job_id: str) -> dict[str, Any] | None:
        folder = JobFolder(settings.jobs / job_id)
        try:
            log.info("job %s: starts", job_id)
            problem = await run_trainer(
                settings.trainer, folder, lambda report: publish(folder, report), settings.stall_s
            )
        except Exception as error:
            log.warning("job %s: %s", job_id, error)
            raise
        log.info("job %s: %s", job_id, f"refused, {problem['code']}" if problem else "done")
        if problem:
            folder.drop_inputs()
        else:
            folder.drop_checkpoint()
        return problem

    @DBOS.workflow(
        name=WORKFLOW,
        max_recovery_attempts=MAX_RECOVERIES,
        serialization_type=WorkflowSerializationFormat.PORTABLE,
    )
    async def convert(job_id: str) -> dict[str, Any]:
        """The outcome: `{"problem": {...} or None}`. A refusal is a result; only a crash is an error."""
        return {"problem": await train(job_id)}


def _register_export(settings: ServiceSettings) -> None:
    async def publish(folder: JobFolder, report: dict[str, Any]) -> None:
        progress = {"id": DBOS.workflow_id, **report}
        await asyncio.to_thread(folder.write_export_progress, progress)
        await DBOS.write_stream_async(PROGRESS_STREAM, report)  # fences, as above

    @DBOS.step(name="export", preemptible=True, retries_allowed=True, max_attempts=MAX_ATTEMPTS)
    async def write_formats(job_id: str, formats: list[str]) -> dict[str, Any] | None:
        folder = JobFolder(settings.jobs / job_id)
        if not folder.path.is_dir():
            return problem_of(JobNotFound(f"job {job_id}", "must exist", "one that was deleted"))
        log.info("job %s: exports %s", job_id, ", ".join(formats))
        words = ("--formats", ",".join(formats))
        try:
            return await run_trainer(
                settings.trainer, folder, lambda report: publish(folder, report), settings.stall_s, *words
            )
        except Exception as error:
            log.warning("job %s: export: %s", job_id, error)
            raise

    @DBOS.workflow(
        name=EXPORT_WORKFLOW,
        max_recovery_attempts=MAX_RECOVERIES,
        serialization_type=WorkflowSerializationFormat.PORTABLE,
    )
    async def export(job_id: str, formats: list[str]) -> dict[str, Any]:
        """As `convert`; done again from the start where it was cut off, since each format takes seconds."""
        return {"problem": await write_formats(job_id, formats)}
