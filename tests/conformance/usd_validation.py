"""What OpenUSD's own validators say of an asset."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pxr import Usd, UsdUtils, UsdValidation

from tests.parity.usd_materialx import standard_library

# Errors that are suppressed, each with its reason; all of one validator.
SUPPRESSED_VALIDATOR = "usdShadeValidators:ShaderSdrCompliance"
UNKNOWN_SOURCE_TYPE = "MissingSourceTypeInRegistry"
UNKNOWN_SHADER_ID = "MissingShaderIdInRegistry"
SUPPRESSED = {
    UNKNOWN_SOURCE_TYPE: "of 'glslfx' alone: usd-core comes without Storm, hence without the parser of its shaders",
    UNKNOWN_SHADER_ID: "of MaterialX's nodes alone, where PyPI's MaterialX knows the node: usd-core comes without them",
}


@dataclass(frozen=True)
class Findings:
    """What all of OpenUSD's validators say, as "name: message".

    Attributes:
        suppressed: name to how often, of those in SUPPRESSED.
        validators: how many were asked.
    """

    errors: tuple[str, ...]
    warnings: tuple[str, ...]
    suppressed: Mapping[str, int]
    validators: int


def findings(files: Mapping[str, bytes], folder: Path, suppress: bool = True) -> Findings:
    """Asks all validators about files, which are put into a folder."""
    for name, data in files.items():
        (folder / name).write_bytes(data)
    (layer,) = [name for name in files if Path(name).suffix in (".usdc", ".usda", ".usdz")]
    stage = Usd.Stage.Open(str(folder / layer))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) >= 30
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    left_out = [error for error in found if suppress and is_suppressed(error)]
    texts: dict[bool, list[str]] = {True: [], False: []}
    for error in found:
        if not (suppress and is_suppressed(error)):
            is_error = error.GetType() == UsdValidation.ValidationErrorType.Error
            texts[is_error].append(f"{error.GetName()}: {error.GetMessage()}")
    suppressed = Counter(str(error.GetName()) for error in left_out)
    return Findings(tuple(texts[True]), tuple(texts[False]), dict(suppressed), len(validators))


def errors_of(files: Mapping[str, bytes], folder: Path, suppress: bool = True) -> list[str]:
    """Errors and warnings of all of OpenUSD's validators, but for those above."""
    found = findings(files, folder, suppress)
    return [*found.errors, *found.warnings]


def is_suppressed(error: UsdValidation.ValidationError) -> bool:
    message = error.GetMessage()
    if error.GetValidator().GetMetadata().name != SUPPRESSED_VALIDATOR:
        return False
    if error.GetName() == UNKNOWN_SOURCE_TYPE:
        return "'glslfx'" in message
    if error.GetName() == UNKNOWN_SHADER_ID:
        return standard_library().getNodeDef(message.split("'")[1]) is not None
    return False


def resolves_everything(path: Path) -> bool:
    """Whether every asset that a file refers to is there."""
    _, _, unresolved = UsdUtils.ComputeAllDependencies(str(path))
    return not unresolved
