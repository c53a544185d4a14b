// The capture's cameras as three.js cameras.

import { Camera, Matrix4, Quaternion, Vector3 } from "three";

const UNIT_SCALE = new Vector3(1, 1, 1);

/**
 * The rigid camera pose [4x4] in the world, of a view of the asset that `object` belongs to.
 *
 * @param {{objectFromCamera: number[]}} view
 * @param {Object3D} object a mesh of the asset: its matrixWorld is world from object, rigid with uniform scale
 */
export function worldFromCamera(view, object) {
  const matrix = new Matrix4().fromArray(view.objectFromCamera).premultiply(object.matrixWorld);
  const position = new Vector3();
  const rotation = new Quaternion();
  matrix.decompose(position, rotation, new Vector3());
  return matrix.compose(position, rotation, UNIT_SCALE);
}

/** Vertical field of view in degrees of the whole photo. */
export function verticalFov(view) {
  return (360 / Math.PI) * Math.atan(view.imageSize[1] / 2 / view.focalLength[1]);
}

/**
 * The view's exact camera, principal point included, for a picture of any size; pixels scale about the image's corner.
 *
 * @param {{near: number, far: number}} depth range in world units
 */
export function exactCamera(view, object, { near, far }) {
  const [width, height] = view.imageSize;
  const [fx, fy] = view.focalLength;
  const [cx, cy] = view.principalPoint;
  const camera = new Camera();
  camera.matrixAutoUpdate = false;
  camera.matrix.copy(worldFromCamera(view, object));
  camera.projectionMatrix.set(
    ...[(2 * fx) / width, 0, 1 - (2 * cx) / width, 0],
    ...[0, (2 * fy) / height, (2 * cy) / height - 1, 0],
    ...[0, 0, -(far + near) / (far - near), (-2 * far * near) / (far - near)],
    ...[0, 0, -1, 0],
  );
  camera.projectionMatrixInverse.copy(camera.projectionMatrix).invert();
  camera.updateMatrixWorld(true);
  return camera;
}
