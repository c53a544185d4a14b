"""Axes, pixels, colours and feature coding: the one place where they are decided.

User frame      that of the capture's files, right-handed; any size, place and (LLFF, COLMAP) orientation.
Object frame    the user's frame, normalised (core/normalisation.py): +z up, origin at what the cameras look at, median
                camera distance 1. Every vertex, camera and view direction is in it. `asset_from_object` places it in
                glTF's frame (right-handed, +y up), `user_from_object` leads back to the user's.
Camera frame    OpenGL's and glTF's: +x right, +y up, looking along -z.
Pixel           (0, 0) is the top left pixel; its centre is at (0.5, 0.5).
Colour          sRGB-encoded, [0, 1], exactly as in the photos. The network outputs it; nothing is linearised.
Direction       unit vector from the camera to the point seen, in the object frame, so that a rotated object keeps its
                shading.
Feature byte    f = byte / 255. Channel 0 doubles as the opacity: 0 is a hole, 1..255 is opaque.
Page            an 8-channel image, row 0 at the top; texture coordinate (0, 0) is its top left corner (as in glTF).
Lookup          nearest texel: floor(texcoord * size).
"""

import numpy as np

FEATURE_CHANNELS = 8
NETWORK_INPUTS = FEATURE_CHANNELS + 3
NETWORK_HIDDEN = 16
NETWORK_OUTPUTS = 3
MAX_PAGE_SIZE_PX = 4096  # the largest texture every WebGL2 phone accepts (supplement F)

# The anti-aliased pixel. A pixel has four sub-pixels, at these offsets from its centre (pixels). Its features are the
# mean over the *covered* sub-pixels, it is shaded once with the ray through its centre, and it covers the background by
# the covered share. Training, reference renderer and shaders all use this one definition.
SUBPIXEL_OFFSETS_PX = np.array([[-0.25, -0.25], [0.25, -0.25], [-0.25, 0.25], [0.25, 0.25]])

# The object frame of NeRF-synthetic and nerfstudio captures has +z up: (x, y, z) -> (x, z, -y).
ASSET_FROM_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def feature_from_byte(byte: np.ndarray) -> np.ndarray:
    """Features in [0, 1] from stored bytes in 0..255, same shape, float64."""
    return np.asarray(byte, np.float64) / 255.0


def bytes_from_features(features: np.ndarray, opaque: np.ndarray) -> np.ndarray:
    """Stored bytes [..., 8] (uint8) from features [..., 8] in [0, 1] and opacity [...] (bool).

    Opaque texels keep channel 0 within 1..255; holes are zero in every channel, which compresses best.
    """
    byte = np.rint(np.clip(features, 0.0, 1.0) * 255.0).astype(np.uint8)
    byte[..., 0] = np.maximum(byte[..., 0], 1)
    return np.where(opaque[..., None], byte, np.uint8(0))


def is_opaque(features_u8: np.ndarray) -> np.ndarray:
    """Opacity [...] (bool) of stored features [..., 8] (uint8)."""
    return features_u8[..., 0] > 0
