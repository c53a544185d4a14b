"""How a server or a worker is set up."""

import socket
import sys
from dataclasses import dataclass, field
from pathlib import Path

from core.errors import OptionInvalid

MIB = 1 << 20
GIB = 1 << 30
PACKAGE_PARENT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Limits:
    """The most that is accepted. Each bound is checked while bytes arrive, never after.

    Attributes:
        upload_bytes: of one request's body.
        file_bytes: of one file, as sent or once inflated. A 100 megapixel PNG stays below it.
        files: in one capture.
        archive_bytes: of everything in an archive, inflated.
        archive_ratio: inflated to packed size. Photos pack to no less than a tenth; a bomb to a thousandth.
        ratio_free_bytes: below this inflated size the ratio is not looked at: a small blank mask packs as well.
        field_bytes: of one form field that is not a file.
    """

    upload_bytes: int = 4 * GIB
    file_bytes: int = 512 * MIB
    files: int = 5000
    archive_bytes: int = 8 * GIB
    archive_ratio: float = 100.0
    ratio_free_bytes: int = MIB
    field_bytes: int = 64 * 1024


@dataclass(frozen=True)
class ServiceSettings:
    """One installation. The server and its workers are given the same.

    Attributes:
        data: folder of everything the service writes; made when missing.
        database_url: of the job engine; empty means an SQLite file in `data`, which must then be on a local disk. A
            `postgresql://` URL lets workers run on several machines that share `data`.
        worker_id: names a worker; unique among those alive. A worker started again under the same name goes on at
            once with what it was doing.
        viewer: folder of the web pages, or None to serve none.
        limits: on uploads.
        trainer: command that runs one job, to which the job's folder is appended.
        stall_s: a trainer silent for so long is taken for hung and started again.
        takeover_s: how often a worker looks for jobs of workers that died.
        sweep_s: how often a worker removes what ended jobs left behind.
        poll_s: how often a worker looks for a new job.
        keep_days: ended jobs are deleted after so many days, with their files; None keeps them.
    """

    data: Path = Path("data")
    database_url: str = ""
    worker_id: str = field(default_factory=lambda: f"{socket.gethostname()}-0")
    viewer: Path | None = PACKAGE_PARENT / "viewer_static"
    limits: Limits = field(default_factory=Limits)
    trainer: tuple[str, ...] = (sys.executable, "-m", "service.trainer")
    stall_s: float = 600.0
    takeover_s: float = 5.0
    sweep_s: float = 600.0
    poll_s: float = 0.5
    keep_days: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "data", Path(self.data).resolve())
        known = self.database_url.startswith(("sqlite:///", "postgresql://"))
        if self.database_url and not known:
            rule = "must start with sqlite:/// or postgresql://"
            raise OptionInvalid("database URL", rule, self.database_url.split("://")[0])
        if not self.database_url:
            object.__setattr__(self, "database_url", f"sqlite:///{self.data / 'jobs.sqlite'}")

    @property
    def jobs(self) -> Path:
        """Folder of the jobs' folders."""
        return self.data / "jobs"

    @property
    def incoming(self) -> Path:
        """Folder of uploads that are not accepted yet; on the file system of `jobs`, so that they can be renamed."""
        return self.data / "incoming"

    @property
    def locks(self) -> Path:
        """Folder of the workers' locks."""
        return self.data / "locks"
