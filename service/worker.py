"""A worker: takes jobs off the queue, one at a time, and the jobs of workers that died."""

import logging
import os
import signal
import threading
import time
from types import FrameType

from dbos import DBOS

from service.database import APPLICATION, EXPORT_WORKFLOW, PIPELINE_VERSION, QUEUE, prepare
from service.errors import WorkerRunning
from service.job_folder import JobFolder
from service.liveness import WorkerLock, worker_lock
from service.pipeline import register_pipeline
from service.retention import expired, sweep
from service.settings import ServiceSettings

# A predecessor that was just killed may take a moment to be gone.
NAME_TIMEOUT_S = 10.0

log = logging.getLogger(__name__)


def run_worker(settings: ServiceSettings) -> None:
    """Works until SIGTERM or SIGINT, then ends the process at once.

    An orderly end is the same as a crash: the job in work stays with this worker's name and goes on from its checkpoint
    when the name is back, or another worker takes it over. So there is one way of recovery, always in use.

    Raises:
        WorkerRunning: the name is taken by a living worker.
    """
    prepare(settings)
    lock = _take_name(settings)
    stopping = threading.Event()
    _on_signals(stopping)
    _launch(settings)
    log.info("worker %s is ready", settings.worker_id)
    _attend(settings, lock, stopping)
    logging.shutdown()
    os._exit(0)  # the trainer, if any, ends with us


def _take_name(settings: ServiceSettings) -> WorkerLock:
    lock = worker_lock(settings, settings.worker_id)
    deadline = time.monotonic() + NAME_TIMEOUT_S
    while not lock.take():
        if time.monotonic() > deadline:
            remedy = "Give each worker a name of its own."
            raise WorkerRunning(f"worker {settings.worker_id}", "must be the only one of its name", "a second", remedy)
        time.sleep(0.2)
    return lock


def _on_signals(stopping: threading.Event) -> None:
    def stop(_number: int, _frame: FrameType | None) -> None:
        stopping.set()

    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, stop)


def _launch(settings: ServiceSettings) -> None:
    logging.getLogger("dbos").addFilter(_without_traceback)
    DBOS(
        config={
            "name": APPLICATION,
            "system_database_url": settings.database_url,
            "application_version": PIPELINE_VERSION,
            "executor_id": settings.worker_id,
            "log_level": "WARNING",
            "notification_listener_polling_interval_sec": 1.0,
        }
    )
    register_pipeline(settings)
    DBOS.listen_queues([QUEUE])
    DBOS.launch()
    DBOS.register_queue(QUEUE, worker_concurrency=1, polling_interval_sec=settings.poll_s, on_conflict="always_update")


def _without_traceback(record: logging.LogRecord) -> bool:
    # Fifty lines of the engine's inside for every job that is cancelled or crashes; the trainer's log has the reason.
    if record.exc_info and record.exc_info[1] is not None:
        record.msg, record.args = f"{record.getMessage()} {record.exc_info[1]}", ()
    record.exc_info = record.exc_text = None
    return True


def _attend(settings: ServiceSettings, lock: WorkerLock, stopping: threading.Event) -> None:
    suspects: set[str] = set()
    swept = -settings.sweep_s
    while True:
        try:
            if lock.keep():
                suspects = take_over(settings, suspects)
            if time.monotonic() - swept > settings.sweep_s:
                swept = time.monotonic()
                _clean(settings)
        except Exception:  # the database may be away for a while
            log.exception("worker %s: will try again", settings.worker_id)
        if stopping.wait(settings.takeover_s):
            return


def take_over(settings: ServiceSettings, suspects: set[str]) -> set[str]:
    """Recovers the running jobs of workers that were dead at the last look and still are; returns those dead now.

    Two looks, so that a worker that is just starting again keeps its own jobs.
    """
    running = DBOS.list_workflows(status="PENDING", load_input=False, load_output=False)
    others = {row.executor_id for row in running if row.executor_id} - {settings.worker_id}
    dead = set()
    for worker_id in others:
        lock = worker_lock(settings, worker_id)
        if not lock.take():
            continue
        try:
            dead.add(worker_id)
            if worker_id in suspects:
                log.warning("worker %s: takes over from %s", settings.worker_id, worker_id)
                # Private, and the only way: a test holds its contract.
                DBOS._recover_pending_workflows([worker_id])
        finally:
            lock.release()
    return dead


def _clean(settings: ServiceSettings) -> None:
    rows = DBOS.list_workflows(load_input=False, load_output=False)
    exports = [row for row in rows if row.name == EXPORT_WORKFLOW and row.completed_at is None]
    in_export = {row.workflow_id.partition("-")[0] for row in exports}
    ended = {row.workflow_id: row.completed_at for row in rows if row.workflow_id not in in_export}
    old = expired(ended, settings.keep_days, time.time())
    for job_id in old:
        JobFolder(settings.jobs / job_id).remove()
    if old:
        DBOS.delete_workflows(old)
    sweep(settings, {row.workflow_id: row.status for row in rows})
