"""A triangle mesh of NumPy arrays as a UsdGeomMesh, and back."""

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdShade, Vt

from exporters.invalid import invalid


def add_mesh(
    stage: Usd.Stage,
    path: Sdf.Path,
    mesh: tuple[np.ndarray, np.ndarray, np.ndarray],
    material: UsdShade.Material,
) -> UsdGeom.Mesh:
    """A mesh at `path`, bound to a material.

    Args:
        mesh: positions float32 [V, 3]; texcoords float32 [V, 2], (0, 0) at the top left corner; triangles [T, 3].
    """
    positions, texcoords, triangles = mesh
    prim = UsdGeom.Mesh.Define(stage, path)
    prim.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(positions, np.float32)))
    prim.CreateFaceVertexCountsAttr(Vt.IntArray(len(triangles), 3))
    prim.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(triangles.ravel(), np.int32)))
    prim.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    prim.CreateDoubleSidedAttr(True)
    prim.CreateExtentAttr(UsdGeom.Mesh.ComputeExtent(prim.GetPointsAttr().Get()))
    coordinates = UsdGeom.PrimvarsAPI(prim).CreatePrimvar(
        "st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex
    )
    coordinates.Set(Vt.Vec2fArray.FromNumpy(upside_down(texcoords)))
    UsdShade.MaterialBindingAPI.Apply(prim.GetPrim()).Bind(material)
    return prim


def mesh_of(mesh: UsdGeom.Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `add_mesh` was given. Texture coordinates: exactly where they are multiples of 2⁻²⁴, as on pages.

    Raises:
        AssetInvalid: not a mesh of triangles, or without texture coordinates.
    """
    subject = str(mesh.GetPath())
    counts = np.asarray(mesh.GetFaceVertexCountsAttr().Get())
    indices = np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
    if not (counts == 3).all() or indices.size != 3 * counts.size:
        raise invalid(subject, "must be of triangles", f"{counts.size} faces with {indices.size} corners")
    if indices.size and indices.min() < 0:
        raise invalid(subject, "must have indices from 0", str(indices.min()))
    texcoords = UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st")
    if not texcoords or texcoords.GetInterpolation() != UsdGeom.Tokens.vertex:
        raise invalid(subject, "must have a primvar st per vertex", "none")
    positions = np.asarray(mesh.GetPointsAttr().Get(), np.float32)
    st = np.asarray(texcoords.Get(), np.float32)
    return positions, upside_down(st), indices.astype(np.uint32).reshape(-1, 3)


def upside_down(texcoords: np.ndarray) -> np.ndarray:
    """float32 [V, 2]: texture coordinates from the top left corner from those from the bottom left, or the reverse."""
    return np.stack([texcoords[:, 0], np.float32(1) - texcoords[:, 1]], -1).astype(np.float32)
