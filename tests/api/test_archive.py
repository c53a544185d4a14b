"""Archives from strangers: nothing leaves the folder, nothing grows beyond the limits."""

import io
import random
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from core.errors import ArchiveInvalid, ArchiveTooLarge, ArchiveUnsafe, InputError
from service.archive import extract
from service.names import safe_relative_path
from service.settings import Limits
from tests.api.captures import capture_files, zipped

PIECES = st.sampled_from(
    ["..", ".", "", "/", "\\", "C:", "a", "images", "r_0.png", "\x00", "é", "~", " ", "\u202e", "CON"]
)
NAMES = st.one_of(st.lists(PIECES, min_size=1, max_size=6).map("/".join), st.text(min_size=1, max_size=40))


@contextmanager
def unpacked(data: bytes, limits: Limits | None = None) -> Iterator[tuple[Path, InputError | None]]:
    """(the folder above the target, the error) of unpacking `data` into `target/`."""
    with TemporaryDirectory() as name:
        above = Path(name)
        (above / "target").mkdir()
        (above / "a.zip").write_bytes(data)
        error: InputError | None = None
        try:
            extract(above / "a.zip", above / "target", limits or Limits())
        except InputError as caught:
            error = caught
        yield above, error


def files_below(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_contents_arrive_unchanged() -> None:
    files = capture_files()
    with unpacked(zipped(files)) as (above, error):
        assert error is None
        assert files_below(above / "target") == files


@given(NAMES)
@example("../x")
@example("a/../../x")
@example("\\\\server\\x")
@example("c:x")
def test_no_name_leaves_the_folder(name: str) -> None:
    try:
        data = zipped({name: b"x"})
    except (ValueError, IndexError):
        return  # not even zipfile writes such a name
    with unpacked(data) as (above, error):
        outside = set(files_below(above)) - {f"target/{path}" for path in files_below(above / "target")}
        assert outside == {"a.zip"}
        assert error is None or isinstance(error, ArchiveUnsafe)


@given(NAMES)
def test_safe_path_is_relative_and_plain(name: str) -> None:
    try:
        path = safe_relative_path(name, "test")
    except ArchiveUnsafe:
        return
    assert not path.is_absolute()
    assert path.parts
    assert not {"..", ".", ""} & set(path.parts)
    assert safe_relative_path(str(path), "test") == path


@pytest.mark.parametrize("name", ["train/r_0.png", "./train//r_0.png", "été/α.png", "a b.png", "..a/b..png"])
def test_harmless_name_is_kept(name: str) -> None:
    assert safe_relative_path(name, "test") == PurePosixPath(
        *(part for part in name.split("/") if part not in ("", "."))
    )


@given(st.integers(0, 2**32), st.integers(1, 20))
def test_damaged_archive_is_refused_or_read_but_never_crashes(seed: int, flips: int) -> None:
    data = bytearray(zipped({"train/r_0.png": bytes(range(256)), "transforms.json": b"{}" * 40}))
    chance = random.Random(seed)
    for _ in range(flips):
        data[chance.randrange(len(data))] = chance.randrange(256)
    with unpacked(bytes(data)) as (above, error):
        assert set(files_below(above)) - {f"target/{path}" for path in files_below(above / "target")} == {"a.zip"}
        assert error is None or isinstance(error, (ArchiveInvalid, ArchiveUnsafe, ArchiveTooLarge))


@pytest.mark.parametrize(
    ("limits", "word"),
    [
        (Limits(files=1), "files"),
        (Limits(archive_bytes=150_000), "inflated"),
        (Limits(file_bytes=90_000), "inflated"),
        (Limits(ratio_free_bytes=1000, archive_ratio=50), "times"),
    ],
)
def test_archive_beyond_a_limit_is_refused(limits: Limits, word: str) -> None:
    with unpacked(zipped({"a.png": bytes(100_000), "b.png": bytes(100_000)}), limits) as (_, error):
        assert isinstance(error, ArchiveTooLarge)
        assert word in str(error)


def test_directory_that_lies_about_sizes_is_refused() -> None:
    """The central directory says 10 bytes; the data inflates to a megabyte."""
    honest = zipped({"a.png": bytes(1 << 20)})
    lying = honest.replace((1 << 20).to_bytes(4, "little"), (10).to_bytes(4, "little"))
    with unpacked(lying) as (above, error):
        assert isinstance(error, ArchiveInvalid)
        assert sum(map(len, files_below(above / "target").values())) <= 10


def test_same_name_in_other_case_is_refused() -> None:
    with unpacked(zipped({"A.png": b"1", "a.png": b"2"})) as (_, error):
        assert isinstance(error, ArchiveInvalid)


def test_name_that_is_file_and_folder_is_refused() -> None:
    with unpacked(zipped({"a": b"1", "a/b.png": b"2"})) as (_, error):
        assert isinstance(error, ArchiveInvalid)


def test_encrypted_archive_is_refused() -> None:
    data = bytearray(zipped({"a.png": b"1"}))
    data[data.index(b"PK\x01\x02") + 8] |= 1  # general purpose bit 0 of the central directory
    with unpacked(bytes(data)) as (_, error):
        assert isinstance(error, ArchiveInvalid)
        assert "encrypted" in str(error)


def test_litter_of_operating_systems_is_left_out() -> None:
    with unpacked(zipped({"__MACOSX/._r_0.png": b"1", "a/.DS_Store": b"2", "r_0.png": b"3"})) as (above, error):
        assert error is None
        assert files_below(above / "target") == {"r_0.png": b"3"}


def test_other_packings_are_refused() -> None:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("a.png", b"1")
    with unpacked(buffer.getvalue()) as (_, error):
        assert isinstance(error, ArchiveInvalid)
