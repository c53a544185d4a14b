"""Features in other coordinates, coarser, with the network changed to match.

The network's first layer is linear in the features f, so any affine recoding y = (f A - o) / s of them can be undone in
its weights: the colours stay the same, and so do averages of features over a pixel. A is chosen so that an error in y
means the same error in colour whatever the channel (S = mean of JᵀJ over the surface, J = d colour / d f, eq. 5) and
so that the channels are uncorrelated (the Karhunen-Loève transform of S^½ f). Rounding y to whole numbers is then the
coarsest coding of a given error in colour, and a channel that carries nothing for the eye is constant.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.baked import ShaderNetwork
from core.conventions import FEATURE_CHANNELS, feature_from_byte, is_opaque
from exporters.compaction.surface import SurfacePoints
from exporters.compaction.windows import as_bytes, windows
from exporters.threads import mapped

# Which of the axes, by rising variance, each channel takes. Channel 0 jumps at holes, so it is the quietest; quiet ones
# share a texture, which PNG codes with one table; alpha is below the colours, as no premultiplied image's is.
CHANNEL_ORDER = [0, 2, 3, 1, 5, 6, 7, 4]
_LEVELS = 254  # byte 0 of channel 0 is a hole, and one is left for rounding
# Directions of feature space that hardly change a colour: kept apart from zero, so that A can be inverted.
_LEAST_SENSITIVITY = 1e-5
# A channel whose spread is below this share of a step would be rounded to one level nearly everywhere.
_CARRIES_NOTHING = 0.3
_ROWS_AT_ONCE = 64  # of a page; 10 MB


@dataclass(frozen=True)
class Recoding:
    """Coordinates y = f A of features f in [0, 1], in which distances are distances of colours (RGB in [0, 1]).

    Attributes:
        matrix: A, float64 [8, 8]; channels as CHANNEL_ORDER says.
        mean, deviation, lowest, highest: float64 [8], of y over the surface.
        step: float64 [8], what one level of a byte is worth; 0 for a channel that is left out.
    """

    matrix: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    step: np.ndarray

    @property
    def base(self) -> np.ndarray:
        """[8] the byte of `origin`: channel 0 is never 0, which would be a hole."""
        return np.array([1, *[0] * (FEATURE_CHANNELS - 1)])

    @property
    def origin(self) -> np.ndarray:
        """[8] the y that the byte `base` stands for."""
        return np.where(self.step > 0, self.lowest, self.mean)

    def with_step(self, step: float) -> "Recoding":
        """Rounded to multiples of `step`, or of what 254 levels allow; channels within one step are left out."""
        steps = np.maximum(step, (self.highest - self.lowest) / _LEVELS)
        return replace(self, step=np.where(self.deviation < _CARRIES_NOTHING * step, 0.0, steps))

    def coordinates(self, features_u8: np.ndarray) -> np.ndarray:
        """y [..., 8] of stored features [..., 8], float32."""
        rows = features_u8.reshape(-1, FEATURE_CHANNELS).astype(
            np.float32
        )  # one product: a stack of small ones is slow
        scaled: np.ndarray = rows @ (self.matrix / 255.0).astype(np.float32)
        return scaled.reshape(features_u8.shape)

    def bytes_of(self, y: np.ndarray) -> np.ndarray:
        """uint8 [..., 8] of coordinates.

        A row of all texels of y[i] is gone through at once: arithmetic on rows of eight takes ten times as long.
        """
        inverse = np.divide(1.0, self.step, out=np.zeros(FEATURE_CHANNELS), where=self.step > 0)
        rows = y.reshape(len(y), -1) if len(y) else y.reshape(0, FEATURE_CHANNELS)
        origin, inverse, base = (
            np.tile(each.astype(y.dtype), rows.shape[1] // FEATURE_CHANNELS)
            for each in (self.origin, inverse, self.base)
        )
        levels = rows - origin
        levels *= inverse
        np.rint(levels, out=levels)
        levels += base
        np.maximum(levels, base, out=levels)
        np.minimum(levels, 255, out=levels)
        return levels.astype(np.uint8).reshape(y.shape)

    def squared_error(self) -> float:
        """Expected squared distance of colours, summed over RGB, that the rounding costs."""
        rounding = self.step**2 / 12
        return float(np.where(self.step > 0, np.minimum(rounding, self.deviation**2), self.deviation**2).sum())

    def network(self, network: ShaderNetwork) -> ShaderNetwork:
        """The network that shows bytes of this coding as `network` shows the features they stand for."""
        w0, w1, w2 = network.weights
        b0, b1, b2 = network.biases
        to_y = w0[:, :FEATURE_CHANNELS].astype(np.float64) @ np.linalg.inv(self.matrix).T
        first = np.concatenate([to_y * (255.0 * self.step), w0[:, FEATURE_CHANNELS:]], 1)
        bias = b0 + to_y @ (self.origin - self.step * self.base)
        return ShaderNetwork((first.astype(np.float32), w1, w2), (bias.astype(np.float32), b1, b2))


def recoding_of(network: ShaderNetwork, seen: SurfacePoints) -> Recoding:
    """The coordinates for what is seen; no rounding yet."""
    features = feature_from_byte(seen.features_u8)
    values, vectors = np.linalg.eigh(_sensitivity(network, features, seen.directions))
    scales = np.sqrt(np.maximum(values, _LEAST_SENSITIVITY * max(values.max(), 1e-12)))
    whitened = features @ (vectors * scales) @ vectors.T
    _, axes = np.linalg.eigh(np.cov(whitened.T))
    matrix = (vectors * scales) @ vectors.T @ axes[:, CHANNEL_ORDER]
    y = features @ matrix
    return Recoding(matrix, y.mean(0), y.std(0), y.min(0), y.max(0), np.zeros(FEATURE_CHANNELS))


def widened(recoding: Recoding, features_u8: np.ndarray) -> Recoding:
    """With the range grown to that of the opaque ones among these features [h, w, 8]: what a sample missed."""

    def bounds(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        texels = np.ascontiguousarray(rows).reshape(-1, FEATURE_CHANNELS)
        opaque = as_bytes(windows(texels, 1)[is_opaque(texels)])
        y = (recoding.matrix.T / 255.0).astype(np.float32) @ opaque.T.astype(np.float32, order="C")
        return y.min(1, initial=np.inf), y.max(1, initial=-np.inf)

    lows, highs = zip(*mapped(bounds, np.array_split(features_u8, -(-len(features_u8) // _ROWS_AT_ONCE))), strict=True)
    return replace(
        recoding,
        lowest=np.minimum(recoding.lowest, np.min(lows, 0)),
        highest=np.maximum(recoding.highest, np.max(highs, 0)),
    )


def _sensitivity(network: ShaderNetwork, features: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """S [8, 8]: mean of JᵀJ, J = d colour / d features."""
    (w0, w1, w2), (b0, b1, _) = network.weights, network.biases
    hidden0 = np.concatenate([features, directions], -1) @ w0.T.astype(np.float64) + b0
    hidden1 = np.maximum(hidden0, 0.0) @ w1.T.astype(np.float64) + b1
    colors = network(features, directions)
    jacobian = (colors * (1 - colors))[:, :, None] * w2.astype(np.float64)
    jacobian = (jacobian * (hidden1 > 0)[:, None]) @ w1.astype(np.float64)
    jacobian = (jacobian * (hidden0 > 0)[:, None]) @ w0[:, :FEATURE_CHANNELS].astype(np.float64)
    return np.einsum("nki,nkj->ij", jacobian, jacobian) / max(len(features), 1)
