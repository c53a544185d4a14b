"""Scenes from files: whatever Polyfield can read back."""

from pathlib import Path

from core.baked import BakedScene
from core.errors import AssetInvalid
from service.capture_source import opened_capture

# What a folder is searched for, in this order. MobileNeRF's layout is known by its network.
MLP = "mlp.json"
MAIN_FILES = (MLP, "*.glb", "*.gltf", "*.usdc", "*.usda", "*.usdz")
GIVE = "Give a .glb, .gltf or USD file, or a folder or .zip of one of them or of MobileNeRF's layout."


def read_scene(path: Path) -> BakedScene:
    """The scene in a .glb, .gltf, .usdz, .usdc or .usda, or in a folder or .zip of one, or of MobileNeRF's layout.

    USD is for files of known origin: OpenUSD's reader of .usdc trusts them.

    Raises:
        CaptureNotFound: there is nothing.
        AssetInvalid: it holds no scene that can be read.
        ArchiveInvalid, ArchiveUnsafe, ArchiveTooLarge
    """
    with opened_capture(path) as source:
        return _read(_main_file(source) if source.is_dir() else source)


def _main_file(folder: Path) -> Path:
    for pattern in MAIN_FILES:
        for path in sorted(folder.rglob(pattern)):
            return path
    raise AssetInvalid(folder.name, "must hold a scene", "no file that names one", GIVE)


def _read(main: Path) -> BakedScene:
    suffix = main.suffix.lower()
    if suffix == ".glb":
        from exporters.gltf import read_glb

        return read_glb(main.read_bytes())
    if main.name == MLP:
        from exporters.mobilenerf import read_mobilenerf

        return read_mobilenerf(_with_files_beside(main, ".obj", ".png"))
    if suffix == ".gltf":
        from exporters.gltf import read_gltf

        return read_gltf(_with_files_beside(main, ".bin", ".png", ".webp"))
    if suffix in (".usdc", ".usda", ".usdz"):
        from exporters.usd import read_usd

        return read_usd(_with_files_beside(main, *(() if suffix == ".usdz" else (".png",))))
    raise AssetInvalid(main.name, "must be a scene", f"a {suffix or 'nameless'} file", GIVE)


def _with_files_beside(main: Path, *suffixes: str) -> dict[str, bytes]:
    beside = [path for path in sorted(main.parent.iterdir()) if path.suffix.lower() in suffixes and path.is_file()]
    return {path.name: path.read_bytes() for path in (main, *beside)}
