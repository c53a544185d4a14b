"""Everything Polyfield can refuse, as one tree. `code` is stable: the API, the CLI and the tests rely on it.

PolyfieldError
|- InputError                what the user gave cannot be used (HTTP 4xx, CLI exit status 2)
|  |- CaptureNotFound        capture-not-found
|  |- NoImages               no-images
|  |- PosesMissing           poses-missing
|  |- PosesNotFound          poses-not-found         the photos' cameras could not be estimated from the photos
|  |- PosesInvalid           poses-invalid           not JSON, fields missing, no intrinsics
|  |- PoseNotFinite          pose-not-finite
|  |- PoseNotRigid           pose-not-rigid
|  |- ImageMissing           image-missing           the pose file names it, the capture lacks it
|  |- ImageUndecodable       image-undecodable       truncated, or not an image at all
|  |- ImageTooLarge          image-too-large         refused from its header, before decoding
|  |- ImageSizeMismatch      image-size-mismatch
|  |- TooFewImages           too-few-images
|  |- CaptureEmpty           capture-empty           every photo is fully transparent
|  |- ArchiveInvalid         archive-invalid
|  |- ArchiveUnsafe          archive-unsafe          absolute names, "..", links
|  |- ArchiveTooLarge        archive-too-large       a zip bomb, or simply more than is allowed
|  |- UploadTooLarge         upload-too-large
|  |- UnknownPreset          unknown-preset
|  |- OptionInvalid          option-invalid
|  `- AssetInvalid           asset-invalid           a .glb that cannot be read back
|- SceneInvalid              scene-invalid           a BakedScene that breaks its own rules
|- CheckpointInvalid         checkpoint-invalid
|- ViewerMissing             viewer-missing          the viewer's files, which a bundle is made of, are not installed
|- PosingFailed              posing-failed           COLMAP crashed, again and again
`- TrainingFailed            training-failed         diverged, or the field came out empty
"""

from typing import ClassVar


class PolyfieldError(Exception):
    """What was refused, the rule it broke, what was received, and what to do about it.

    Args:
        subject: the thing at fault, as the user knows it (a file name, a field).
        rule: what must hold.
        received: what was found instead.
        remedy: what the user can do.
    """

    code: ClassVar[str] = "internal"

    def __init__(self, subject: str, rule: str, received: str = "", remedy: str = "") -> None:
        self.subject, self.rule, self.received, self.remedy = subject, rule, received, remedy
        super().__init__(str(self))

    def __str__(self) -> str:
        text = f"{self.subject}: {self.rule}"
        if self.received:
            text += f", but got {self.received}"
        return f"{text}. {self.remedy}" if self.remedy else f"{text}."

    def __reduce__(self) -> tuple[type, tuple[str, str, str, str]]:
        return type(self), (self.subject, self.rule, self.received, self.remedy)


class InputError(PolyfieldError):
    code = "input-invalid"


class CaptureNotFound(InputError):
    code = "capture-not-found"


class NoImages(InputError):
    code = "no-images"


class PosesMissing(InputError):
    code = "poses-missing"


class PosesNotFound(InputError):
    code = "poses-not-found"


class PosesInvalid(InputError):
    code = "poses-invalid"


class PoseNotFinite(InputError):
    code = "pose-not-finite"


class PoseNotRigid(InputError):
    code = "pose-not-rigid"


class ImageMissing(InputError):
    code = "image-missing"


class ImageUndecodable(InputError):
    code = "image-undecodable"


class ImageTooLarge(InputError):
    code = "image-too-large"


class ImageSizeMismatch(InputError):
    code = "image-size-mismatch"


class TooFewImages(InputError):
    code = "too-few-images"


class CaptureEmpty(InputError):
    code = "capture-empty"


class ArchiveInvalid(InputError):
    code = "archive-invalid"


class ArchiveUnsafe(InputError):
    code = "archive-unsafe"


class ArchiveTooLarge(InputError):
    code = "archive-too-large"


class UploadTooLarge(InputError):
    code = "upload-too-large"


class UnknownPreset(InputError):
    code = "unknown-preset"


class OptionInvalid(InputError):
    code = "option-invalid"


class AssetInvalid(InputError):
    code = "asset-invalid"


class SceneInvalid(PolyfieldError):
    code = "scene-invalid"


class ViewerMissing(PolyfieldError):
    code = "viewer-missing"


class CheckpointInvalid(PolyfieldError):
    code = "checkpoint-invalid"


class PosingFailed(PolyfieldError):
    code = "posing-failed"


class TrainingFailed(PolyfieldError):
    code = "training-failed"
