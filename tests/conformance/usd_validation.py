"""What OpenUSD's own validators say of an asset."""

from collections.abc import Mapping
from pathlib import Path

from pxr import Usd, UsdUtils, UsdValidation

from tests.parity.usd_materialx import standard_library

# Errors that are suppressed, each with its reason.
# Storm's own shaders: usd-core comes without Storm, hence without its parser.
UNKNOWN_SOURCE_TYPE = "MissingSourceTypeInRegistry"
# MaterialX's nodes: usd-core comes without their registry. PyPI's MaterialX must know them instead.
UNKNOWN_SHADER_ID = "MissingShaderIdInRegistry"


def errors_of(files: Mapping[str, bytes], folder: Path, suppress: bool = True) -> list[str]:
    """Errors and warnings of all of OpenUSD's validators, but for those above."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    (layer,) = [name for name in files if Path(name).suffix in (".usdc", ".usda", ".usdz")]
    stage = Usd.Stage.Open(str(folder / layer))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) >= 30
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    return [f"{error.GetName()}: {error.GetMessage()}" for error in found if not (suppress and is_suppressed(error))]


def is_suppressed(error: UsdValidation.ValidationError) -> bool:
    message = error.GetMessage()
    if error.GetName() == UNKNOWN_SOURCE_TYPE:
        return "'glslfx'" in message
    if error.GetName() == UNKNOWN_SHADER_ID:
        return standard_library().getNodeDef(message.split("'")[1]) is not None
    return False


def resolves_everything(path: Path) -> bool:
    """Whether every asset that a file refers to is there."""
    _, _, unresolved = UsdUtils.ComputeAllDependencies(str(path))
    return not unresolved
