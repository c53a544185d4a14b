"""Names of the codeless API schemas (docs/usd/polyfield) and of all properties they define.

The schemas are applied by name: neither writing nor opening an asset needs their plug-in.
"""

SCENE_API = "PolyfieldSceneAPI"
NETWORK_API = "PolyfieldNetworkAPI"
VIEW_API = "PolyfieldViewAPI"

# PolyfieldSceneAPI, on the root prim.
BACKGROUND = "polyfield:scene:background"
USER_FROM_OBJECT = "polyfield:scene:userFromObject"
START_VIEW = "polyfield:scene:startView"

# PolyfieldNetworkAPI, on materials.
WEIGHTS = tuple(f"polyfield:network:weights{layer}" for layer in range(3))
BIASES = tuple(f"polyfield:network:bias{layer}" for layer in range(3))
ACTIVATIONS = "polyfield:network:activations"
CODING = "polyfield:network:coding"

# PolyfieldViewAPI, on cameras.
IMAGE_SIZE = "polyfield:view:imageSize"
FOCAL_LENGTH = "polyfield:view:focalLength"
PRINCIPAL_POINT = "polyfield:view:principalPoint"
OBJECT_FROM_CAMERA = "polyfield:view:objectFromCamera"
PHOTO = "polyfield:view:photo"

UNORM8 = "unorm8"
RELU_RELU_SIGMOID = ("relu", "relu", "sigmoid")
