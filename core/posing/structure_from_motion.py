"""From photos to a COLMAP model, in three stages that can each be interrupted."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pycolmap

from core.posing.features import write_cameras, write_features
from core.posing.headers import read_headers
from core.posing.lenses import shared_lenses
from core.posing.mapping import mapped, write_model
from core.posing.matching import write_matches
from core.posing.pairs import pairs_to_match
from core.posing.photo_set import PhotoSet, find_photo_set
from core.posing.posing import LeftOut, Posing
from core.posing.workspace import Workspace, identity_of, own_folder
from core.progress import Progress, ProgressCallback, ignore_progress

# The stages' shares of the time, for the progress bar: 50 photos, two cores.
STAGES = {"features": (0.0, 0.25), "matching": (0.25, 0.7), "mapping": (0.7, 1.0)}
GLANCE_SHARE = 0.1  # of matching, for choosing the pairs
UNMATCHED = "without matches with other photos"
UNPOSED = "whose matches fit no pose among the others"
APART = "that could only be posed apart from the others"


def posed_in_this_process(
    photos_folder: Path, work_folder: Path, *, progress: ProgressCallback = ignore_progress, seed: int = 0
) -> Posing:
    """What `pose_photos` does, in this process: COLMAP takes over the signal handlers, and may crash."""
    photos_folder, work_folder = Path(photos_folder).absolute(), Path(work_folder).absolute()
    photos = find_photo_set(photos_folder, without=own_folder(work_folder, photos_folder))
    headers = read_headers(photos)
    workspace = Workspace(work_folder)
    workspace.claim(identity_of(photos, seed=seed))
    workspace.link_photos(photos, headers)
    if (posing := workspace.outcome()) is None:
        pycolmap.logging.minloglevel = int(pycolmap.logging.Level.FATAL)  # refusals are ours to word
        lenses = shared_lenses(photos, headers)
        numbers = dict(enumerate(photos.names, start=1))
        write_cameras(workspace.database, lenses, numbers)
        posing = _Run(photos, numbers, workspace, seed, progress).posing()
        workspace.finish(posing)
    return posing


class _Run:
    """One posing under way."""

    def __init__(
        self, photos: PhotoSet, numbers: dict[int, str], workspace: Workspace, seed: int, progress: ProgressCallback
    ) -> None:
        self.photos, self.numbers, self.workspace, self.seed = photos, numbers, workspace, seed
        self._progress = progress
        self._seconds = workspace.seconds()

    def posing(self) -> Posing:
        database = self.workspace.database
        with self._stage("features") as done:
            faults = write_features(database, self.workspace.images, self.numbers, done)
        with self._stage("matching") as done:
            pairs = pairs_to_match(database, lambda share: done(GLANCE_SHARE * share))
            write_matches(database, pairs, self.seed, lambda share: done(GLANCE_SHARE + (1 - GLANCE_SHARE) * share))
        with self._stage("mapping") as done:
            models = mapped(database, len(self.numbers), self.seed, done)
        return self._outcome(models, faults)

    def _outcome(self, models: list[pycolmap.Reconstruction], faults: dict[int, str]) -> Posing:
        reasons = dict.fromkeys(self.numbers, UNPOSED)
        reasons |= dict.fromkeys(self._unmatched(), UNMATCHED)
        reasons |= {number: APART for model in models[1:] for number in model.reg_image_ids()}
        reasons |= faults
        posed = set(models[0].reg_image_ids()) if models else set()
        left_out = [LeftOut(self.numbers[number], reasons[number]) for number in self.numbers if number not in posed]
        left_out += [LeftOut(name, f"that cannot be read: {why}") for name, why in self.photos.unreadable.items()]
        unposed = tuple(sorted(left_out, key=lambda photo: photo.name))
        registered = tuple(sorted(self.numbers[number] for number in posed))
        if not models:
            return Posing(self.workspace.folder, registered, unposed, seconds=self._seconds)
        model = models[0]
        write_model(model, self.numbers, self.workspace.model)
        return Posing(
            self.workspace.folder,
            registered,
            unposed,
            cameras=len({model.image(number).camera_id for number in posed}),
            points=model.num_points3D(),
            error_px=float(model.compute_mean_reprojection_error()),
            seconds=self._seconds,
        )

    def _unmatched(self) -> set[int]:
        with pycolmap.Database.open(self.workspace.database) as database:
            pairs, inliers = database.read_two_view_geometry_num_inliers()
        verified = [pair for pair, count in zip(pairs, inliers, strict=True) if count > 0]
        return set(self.numbers) - {number for pair in verified for number in pycolmap.pair_id_to_image_pair(pair)}

    @contextmanager
    def _stage(self, name: str) -> Iterator[Callable[[float], None]]:
        start, end = STAGES[name]
        before, began = self._seconds.get(name, 0.0), time.monotonic()

        def done(share: float) -> None:
            self._seconds[name] = before + time.monotonic() - began
            self.workspace.keep_seconds(self._seconds)
            self._progress(Progress(name, start + (end - start) * share))

        done(0.0)
        yield done
        self._seconds[name] = before + time.monotonic() - began
