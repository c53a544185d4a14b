"""Layers and packages as bytes. OpenUSD reads and writes files only, so there is a folder for a moment."""

import os
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from pxr import Sdf, Tf, Usd

from exporters.invalid import invalid

_EPOCH = 315_532_800  # 1980-01-01, where a zip's time starts: the same scene gives the same bytes


def layer_bytes(stage: Usd.Stage, form: str) -> bytes:
    """The root layer of a stage as .usda or .usdc."""
    with TemporaryDirectory() as folder:
        path = Path(folder, f"layer.{form}")
        stage.GetRootLayer().Export(str(path))
        return path.read_bytes()


def package_bytes(files: Mapping[str, bytes]) -> bytes:
    """A .usdz of files by name, in order, the layer first: stored, not compressed, aligned to 64 bytes."""
    with TemporaryDirectory() as folder:
        package = Path(folder, "package.usdz")
        writer = Sdf.ZipFileWriter.CreateNew(str(package))
        for name, data in files.items():
            path = Path(folder, name)
            path.write_bytes(data)
            os.utime(path, (_EPOCH, _EPOCH))
            writer.AddFile(str(path), name)
        writer.Save()
        return package.read_bytes()


def stage_of(name: str, data: bytes) -> Usd.Stage:
    """A stage of one layer's bytes; `name` has its suffix. Nothing else is opened: other layers are refused.

    Raises:
        AssetInvalid
    """
    with TemporaryDirectory() as folder:
        path = Path(folder, f"layer{Path(name).suffix}")
        path.write_bytes(data)
        layer = Sdf.Layer.CreateAnonymous(path.suffix)
        try:
            ok = layer.Import(str(path))
        except Tf.ErrorException as error:
            raise invalid(name, "must be a USD layer", str(error)[:120]) from error
    if not ok:
        raise invalid(name, "must be a USD layer", "another file, or a damaged one")
    if layer.GetCompositionAssetDependencies():
        others = ", ".join(layer.GetCompositionAssetDependencies())
        raise invalid(name, "must not refer to other layers", others[:80])
    return Usd.Stage.Open(layer, Usd.Stage.LoadAll)
