// The rays of a camera's pixels, in the object frame.

import { Matrix3, Matrix4 } from "three";

/**
 * The matrix M with direction = normalize(M * (ndc.x, ndc.y, 1)), as the extension's README defines it.
 *
 * @param {Camera} camera with an up-to-date matrixWorldInverse
 * @param {Object3D} object with an up-to-date matrixWorld
 * @param {Matrix3} out
 */
export function objectRayFromNdc(camera, object, out = new Matrix3()) {
  const viewFromObject = new Matrix4().multiplyMatrices(camera.matrixWorldInverse, object.matrixWorld);
  const p = camera.projectionMatrix.elements; // column-major: p[8] is row 0, column 2
  const viewRayFromNdc = new Matrix3().set(1 / p[0], 0, p[8] / p[0], 0, 1 / p[5], p[9] / p[5], 0, 0, -1);
  return out.setFromMatrix4(viewFromObject).invert().multiply(viewRayFromNdc);
}
