"""Which workers are alive, without heartbeats: each holds a lock that the system frees when its process ends.

On SQLite, which means one machine, a file lock; on PostgreSQL an advisory lock of a session.
"""

from __future__ import annotations

import fcntl
import re
from pathlib import Path
from typing import IO, Protocol

import sqlalchemy as sa

from service.settings import ServiceSettings

TRY_LOCK = sa.text("select pg_try_advisory_lock(hashtextextended(:name, 7))")
# A dead peer is noticed within about 25 s, so that its session's lock comes free.
KEEPALIVE = {"keepalives_idle": 10, "keepalives_interval": 5, "keepalives_count": 3}


class WorkerLock(Protocol):
    """The lock of one worker's name."""

    def take(self) -> bool:
        """Takes the lock; False when a living worker has it."""

    def keep(self) -> bool:
        """Whether it is still held, taking it anew where the connection to the database was lost."""

    def release(self) -> None: ...


def worker_lock(settings: ServiceSettings, worker_id: str) -> WorkerLock:
    """The lock of a name, not yet taken."""
    if settings.database_url.startswith("postgresql"):
        return _SessionLock(settings.database_url, worker_id)
    return _FileLock(settings.locks / f"{re.sub(r'[^A-Za-z0-9_.-]', '_', worker_id)}.lock")


class _FileLock:
    def __init__(self, path: Path) -> None:
        self._path = path
        self._file: IO[bytes] | None = None

    def take(self) -> bool:
        file = self._path.open("ab")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            return False
        self._file = file
        return True

    def keep(self) -> bool:
        return self._file is not None

    def release(self) -> None:
        if self._file:
            self._file.close()
            self._file = None


class _SessionLock:
    def __init__(self, url: str, name: str) -> None:
        self._name = name
        self._connection: sa.Connection | None = None
        self._engine = sa.create_engine(
            url.replace("postgresql://", "postgresql+psycopg://", 1),
            poolclass=sa.NullPool,
            isolation_level="AUTOCOMMIT",
            connect_args=KEEPALIVE,
        )

    def take(self) -> bool:
        connection = self._engine.connect()
        if not connection.execute(TRY_LOCK, {"name": self._name}).scalar():
            connection.close()
            return False
        self._connection = connection
        return True

    def keep(self) -> bool:
        try:
            if self._connection is not None:
                self._connection.execute(sa.text("select 1"))
                return True
        except sa.exc.DBAPIError:
            self.release()
        return self.take()

    def release(self) -> None:
        if self._connection is not None:
            self._connection.close()
            self._connection = None
