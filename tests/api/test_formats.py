"""Every deliverable: written, read again, and measured on what was written."""

import zipfile
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from core.baked import BakedScene
from core.capture import View
from core.errors import AssetInvalid, SceneInvalid
from core.progress import Progress
from core.render.composite import over, quantised
from core.render.raster import Rasteriser
from exporters.gltf import Provenance
from exporters.viewer.bundle import VIEWER
from service.errors import UnknownFormat
from service.formats import FORMATS, formats_of
from service.formats.colours import Coloured, ColourRenderer, scene_of_colours
from service.formats.exporting import NO_VIEWS, exported
from service.formats.measure import BEST_PSNR, Measure, in_frame
from service.formats.provenance import in_glb
from service.formats.source import Source
from tests.scenes import look_at_camera

EXACT = ("glb", "gltf", "usd")
NEARLY_EXACT = ("web", "mobilenerf", "viewer", "html")
NEURAL = (*EXACT, *NEARLY_EXACT, "lq")
COLOURS = ("quicklook", "obj", "ply")
NEARLY_EXACT_DB = 33.0  # quantised features; the scene's random texels are the hardest there are
needs_viewer = pytest.mark.skipif(not (VIEWER / "node_modules" / "three").is_dir(), reason="three.js is not installed")


def parameter(name: str) -> object:
    return pytest.param(name, marks=needs_viewer) if name in ("viewer", "html") else name


@pytest.fixture(scope="module")
def views(scene: BakedScene) -> tuple[View, ...]:
    """Photos of the scene as it is rendered."""
    rasteriser = Rasteriser(scene)
    images = [quantised(over(rasteriser.deferred(camera), scene.background)) for camera in scene.cameras]
    return tuple(View(camera, image) for camera, image in zip(scene.cameras, images, strict=True))


@pytest.fixture
def measure(scene: BakedScene, views: tuple[View, ...]) -> Measure:
    return Measure(views, scene.user_from_object, scene.background)


def flat(scene: BakedScene) -> BakedScene:
    """The scene with one colour a quad for programs without the network: nothing to blur."""
    return replace(scene, pages=tuple(replace(p, colors_u8=np.full_like(p.colors_u8, 120)) for p in scene.pages))


# Choosing


@pytest.mark.parametrize(
    ("words", "names"),
    [
        ("all", tuple(FORMATS)),
        ("web", ("web",)),
        (" usd , web,,web", ("web", "usd")),
        (["html", "glb,lq"], ("glb", "lq", "html")),
        (["all", "web"], tuple(FORMATS)),
    ],
)
def test_words_choose_formats_once_in_order(words: str | list[str], names: tuple[str, ...]) -> None:
    assert formats_of(words) == names


@pytest.mark.parametrize("words", ["", "fbx", "web,fbx", "WEB", [], [","]])
def test_unknown_word_or_none_is_refused(words: str | list[str]) -> None:
    with pytest.raises(UnknownFormat, match="must be all, or some of glb, web"):
        formats_of(words)


def test_names_and_files_are_unlike() -> None:
    assert all(name == form.name for name, form in FORMATS.items())
    assert len({form.file for form in FORMATS.values()}) == len(FORMATS)


# Writing and reading


@pytest.mark.parametrize("name", [parameter(name) for name in FORMATS])
def test_format_is_read_again_and_shows_the_scene(name: str, scene: BakedScene, measure: Measure) -> None:
    source = Source(scene, "A <vase>")
    held = FORMATS[name].read(FORMATS[name].write(source))
    found = measure.psnr(held, scene)
    if name in EXACT:
        assert found == BEST_PSNR
    elif name in NEARLY_EXACT:
        assert found > NEARLY_EXACT_DB
    else:
        assert found > 10.0  # something of the right shape at the right place


@pytest.mark.parametrize("name", COLOURS)
def test_colours_are_where_the_scene_has_them(name: str, scene: BakedScene) -> None:
    """In the right frame, every pixel that the scene covers shows its one colour."""
    plain = flat(scene)
    held = FORMATS[name].read(FORMATS[name].write(Source(plain)))
    assert isinstance(held, Coloured)
    user_from_held = plain.user_from_object
    if held.frame == "asset":
        user_from_held = user_from_held @ np.linalg.inv(plain.asset_from_object)
    renderer = ColourRenderer(held)
    blank = tuple(View(c, np.zeros((*c.size_px[::-1], 3), np.uint8)) for c in plain.cameras)
    for view, camera in zip(in_frame(blank, plain.user_from_object, user_from_held), plain.cameras, strict=True):
        image = renderer.image(view.camera)
        inside = image[..., 3] == 1
        assert np.abs(image[inside][:, :3] * 255 - 120).max() <= 1.0
        covered = Rasteriser(plain).deferred(camera)[..., 3]
        # Decimation and pieces of triangles move edges by parts of a pixel.
        assert np.abs(covered - image[..., 3]).mean() < 0.06


@pytest.mark.parametrize("name", [parameter(name) for name in FORMATS])
def test_writing_twice_gives_the_same_bytes(name: str, scene: BakedScene) -> None:
    assert FORMATS[name].write(Source(scene)) == FORMATS[name].write(Source(scene))


@pytest.mark.parametrize("name", [name for name, form in FORMATS.items() if form.file.endswith(".zip")])
def test_archives_hold_flat_or_relative_names(name: str, scene: BakedScene) -> None:
    if name == "viewer" and not (VIEWER / "node_modules" / "three").is_dir():
        pytest.skip("three.js is not installed")
    with zipfile.ZipFile(BytesIO(FORMATS[name].write(Source(scene)))) as opened:
        assert opened.testzip() is None
        assert not any(entry.startswith("/") or ".." in entry for entry in opened.namelist())


@pytest.mark.parametrize("name", [parameter(name) for name in FORMATS])
def test_damaged_file_is_invalid(name: str, scene: BakedScene) -> None:
    """What is reported as there can be read."""
    data = FORMATS[name].write(Source(scene))
    for damaged in (data[: len(data) // 2], data[:-100], b"", b"x" * 500):
        with pytest.raises((AssetInvalid, SceneInvalid)):
            FORMATS[name].read(damaged)


def test_provenance_is_read_as_it_was_written(scene: BakedScene) -> None:
    known = Provenance("Büste", "museum.zip", "A. Photographer", "CC0", "2030-01-02", "1.2", {"seed": 0})
    for provenance in (known, Provenance(), Provenance(title="Vase")):
        assert in_glb(FORMATS["glb"].write(Source(scene, provenance=provenance))) == provenance
    assert in_glb(FORMATS["glb"].write(Source(scene))) is None
    assert in_glb(b"glTF") is None


# Exporting


def rows_of(source: Source, names: list[str], folder: Path, measure: Measure | None = None) -> dict[str, object]:
    return dict(exported(source, names, folder, measure))


def failing(name: str, error: Exception) -> dict[str, object]:
    def write(source: Source) -> bytes:
        raise error

    return {**FORMATS, name: replace(FORMATS[name], write=write)}


def test_row_says_what_was_written(scene: BakedScene, tmp_path: Path, measure: Measure) -> None:
    row = rows_of(Source(scene), ["gltf"], tmp_path, measure)["gltf"]
    assert (row.file, row.psnr, row.note, row.problem) == ("scene.gltf.zip", BEST_PSNR, "", "")
    assert row.bytes == (tmp_path / "scene.gltf.zip").stat().st_size
    assert [path.name for path in tmp_path.iterdir()] == ["scene.gltf.zip"]


def test_without_views_nothing_is_measured_and_the_row_says_so(scene: BakedScene, tmp_path: Path) -> None:
    row = rows_of(Source(scene), ["lq"], tmp_path)["lq"]
    assert (row.psnr, row.note) == (None, NO_VIEWS)
    assert row.bytes > 0


@pytest.mark.parametrize(
    ("error", "problem"),
    [
        (SceneInvalid("scene", "must be smaller"), "scene-invalid: scene: must be smaller."),
        (ValueError("/secret/path"), "internal: something went wrong inside Polyfield (ValueError)"),
        (MemoryError(), "internal: something went wrong inside Polyfield (MemoryError)"),
    ],
)
def test_format_that_fails_is_a_row_and_the_others_are_there(
    scene: BakedScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception, problem: str
) -> None:
    (tmp_path / "scene.lq.glb").write_bytes(b"of an earlier scene")
    monkeypatch.setattr("service.formats.exporting.FORMATS", failing("lq", error))
    rows = rows_of(Source(scene), ["glb", "lq", "mobilenerf"], tmp_path)
    assert rows["lq"].problem.startswith(problem)
    assert "/secret" not in rows["lq"].problem
    assert (rows["lq"].bytes, rows["lq"].psnr) == (None, None)
    assert {path.name for path in tmp_path.iterdir()} == {"scene.glb", "scene.mobilenerf.zip"}


def test_file_that_cannot_be_read_again_does_not_appear(
    scene: BakedScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = {**FORMATS, "web": replace(FORMATS["web"], write=lambda source: b"glTF")}
    monkeypatch.setattr("service.formats.exporting.FORMATS", broken)
    rows = rows_of(Source(scene), ["web"], tmp_path)
    assert rows["web"].problem.startswith("asset-invalid: ")
    assert list(tmp_path.iterdir()) == []


def test_scene_s_own_file_is_measured_and_never_written_or_removed(
    scene: BakedScene, tmp_path: Path, measure: Measure, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = tmp_path / "scene.glb"
    own.write_bytes(FORMATS["glb"].write(Source(scene)))
    before = own.stat()
    assert rows_of(Source(scene, file=own), ["glb"], tmp_path, measure)["glb"].psnr == BEST_PSNR
    unreadable = {**FORMATS, "glb": replace(FORMATS["glb"], read=FORMATS["usd"].read)}
    monkeypatch.setattr("service.formats.exporting.FORMATS", unreadable)
    assert rows_of(Source(scene, file=own), ["glb"], tmp_path, measure)["glb"].problem
    assert (own.stat().st_ino, own.stat().st_mtime_ns) == (before.st_ino, before.st_mtime_ns)


def test_progress_of_each_format_runs_from_0_to_1(scene: BakedScene, tmp_path: Path, measure: Measure) -> None:
    reports: list[Progress] = []
    names = ["lq", "ply"]
    list(exported(Source(scene), names, tmp_path, measure, lambda name: reports.append))
    for name in names:
        fractions = [report.fraction for report in reports if report.stage == f"export {name}"]
        assert fractions == sorted(fractions)
        assert (fractions[0], fractions[-1]) == (0.0, 1.0)
        assert len(fractions) == 2 + len(scene.cameras)


# Measuring


def test_equal_scenes_are_rendered_once(scene: BakedScene, measure: Measure, monkeypatch: pytest.MonkeyPatch) -> None:
    measure.remember(scene, 31.5)
    monkeypatch.setattr("service.formats.measure.evaluate", lambda *_, **__: pytest.fail("rendered"))
    assert measure.psnr(FORMATS["gltf"].read(FORMATS["gltf"].write(Source(scene))), scene) == 31.5


def test_scene_that_differs_in_a_byte_is_rendered_again(scene: BakedScene, measure: Measure) -> None:
    measure.remember(scene, 99.0)
    page = scene.pages[0]
    features_u8 = page.features_u8.copy()
    features_u8[features_u8[..., 0] > 0, 1] ^= 255
    changed = replace(scene, pages=(replace(page, features_u8=features_u8), *scene.pages[1:]))
    assert measure.psnr(changed, scene) < 99.0


def test_measure_does_not_depend_on_the_frame(scene: BakedScene, views: tuple[View, ...]) -> None:
    """Photos of a capture in a frame of its own, as an export command finds them."""
    turn = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    other = np.eye(4)
    other[:3, :3], other[:3, 3] = 3.7 * turn, (5.0, -3.0, 0.4)
    moved = in_frame(views, scene.user_from_object, scene.user_from_object @ np.linalg.inv(other))
    measure = Measure(moved, scene.user_from_object @ np.linalg.inv(other), scene.background)
    assert measure.psnr(scene, scene) > 60  # rounding flips single pixels


def test_background_is_the_one_of_the_photos(scene: BakedScene, views: tuple[View, ...]) -> None:
    asset = replace(scene, background=(0.0, 0.0, 0.0))
    assert Measure(views, scene.user_from_object, scene.background).psnr(asset, asset) == BEST_PSNR


# Colours


def square(texture: np.ndarray) -> Coloured:
    """A square of side 2 in the plane x = 0 that faces +x, textured."""
    positions = np.array([[0, -1, 1], [0, 1, 1], [0, 1, -1], [0, -1, -1]], np.float32)
    texcoords = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
    return Coloured(scene_of_colours([(texture, positions, texcoords, triangles)], np.eye(4)), "object")


def test_texture_is_interpolated_in_linear_light(scene: BakedScene) -> None:
    texture = np.full((1, 2, 4), 255, np.uint8)
    texture[0, 0, :3] = 0
    camera = look_at_camera("front", (3.0, 0.0, 0.0), size_px=(64, 64))
    image = ColourRenderer(square(texture)).image(camera)[32, :, :3].mean(-1)
    assert image[31] == pytest.approx(0.735, abs=0.03)  # half of white, encoded; in sRGB it would be 0.5
    nearest = ColourRenderer(replace(square(texture), smooth=False)).image(camera)
    assert set(np.unique(nearest[32, 20:30, 0])) == {0.0}


def test_transparent_texels_are_holes(scene: BakedScene) -> None:
    texture = np.full((2, 2, 4), 255, np.uint8)
    texture[:, 0, 3] = 0
    camera = look_at_camera("front", (3.0, 0.0, 0.0), size_px=(64, 64))
    coverage = ColourRenderer(square(texture)).image(camera)[..., 3]
    assert coverage[32, 20] == 0
    assert coverage[32, 44] == 1
