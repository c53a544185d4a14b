"""The capture's cameras as UsdGeomCameras, with their exact numbers beside them."""

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from core.camera import Camera
from exporters.gltf.placement import nearest_rotation
from exporters.usd import schema
from exporters.usd.matrices import from_usd, to_usd

APERTURE = 0.36  # width of the film: 36 mm, in tenths of a metre
NEAR_SHARE, FAR_SHARE = 1e-3, 1e2  # of the scene's diagonal


def add_camera(stage: Usd.Stage, path: Sdf.Path, camera: Camera, scale: float, diagonal: float) -> Usd.Prim:
    """A camera below the object.

    Args:
        scale: of the object in the asset, which the camera undoes: renderers disagree on what a scaled camera is.
        diagonal: the scene's size, object frame.
    """
    width, height = camera.size_px
    (fx, fy), (cx, cy) = camera.focal_px, camera.centre_px
    prim = UsdGeom.Camera.Define(stage, path)
    place = np.eye(4)
    place[:3, :3] = nearest_rotation(camera.world_from_camera[:3, :3]) / scale
    place[:3, 3] = camera.position
    prim.AddTransformOp().Set(to_usd(place))
    focal = APERTURE * fx / width
    prim.CreateFocalLengthAttr(focal)
    prim.CreateHorizontalApertureAttr(APERTURE)
    prim.CreateVerticalApertureAttr(focal * height / fy)
    prim.CreateHorizontalApertureOffsetAttr(focal * (width / 2 - cx) / fx)
    prim.CreateVerticalApertureOffsetAttr(focal * (cy - height / 2) / fy)
    prim.CreateClippingRangeAttr(Gf.Vec2f(NEAR_SHARE * diagonal * scale, FAR_SHARE * diagonal * scale))
    _write_exactly(prim.GetPrim(), camera)
    return prim.GetPrim()


def camera_of(prim: Usd.Prim) -> Camera:
    """The camera, exactly.

    Raises:
        PosesInvalid, PoseNotRigid, PoseNotFinite; TypeError where properties are missing.
    """
    values = (prim.GetAttribute(name).Get() for name in (schema.FOCAL_LENGTH, schema.PRINCIPAL_POINT))
    (fx, fy), (cx, cy) = values
    width, height = prim.GetAttribute(schema.IMAGE_SIZE).Get()
    pose = from_usd(prim.GetAttribute(schema.OBJECT_FROM_CAMERA).Get())
    return Camera(prim.GetAttribute(schema.PHOTO).Get(), pose, (fx, fy), (cx, cy), (width, height))


def _write_exactly(prim: Usd.Prim, camera: Camera) -> None:
    prim.AddAppliedSchema(schema.VIEW_API)
    types = Sdf.ValueTypeNames
    values = (
        (schema.PHOTO, types.String, camera.name),
        (schema.IMAGE_SIZE, types.Int2, Gf.Vec2i(*(int(n) for n in camera.size_px))),
        (schema.FOCAL_LENGTH, types.Double2, Gf.Vec2d(*camera.focal_px)),
        (schema.PRINCIPAL_POINT, types.Double2, Gf.Vec2d(*camera.centre_px)),
        (schema.OBJECT_FROM_CAMERA, types.Matrix4d, to_usd(camera.world_from_camera)),
    )
    for name, kind, value in values:
        prim.CreateAttribute(name, kind, False, Sdf.VariabilityUniform).Set(value)
