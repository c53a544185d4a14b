// The frame the viewer works in: upright as the asset, of order 1, the point of interest at its origin.
//
// An asset may be micrometres or kilometres wide and stand anywhere. Orbit controls and depth planes have thresholds of
// their own, and single precision ends at a ten-millionth; matrices are multiplied in double precision until then.

import { Box3, Group, Sphere, Vector3 } from "three";
import { worldFromCamera } from "./capture-view.js";

const SHORTEST = 1e-4; // of the bounding radius: what a point of interest may be away from its camera

/**
 * Places an asset in the viewing frame.
 *
 * @param {object} gltf of loadGlb; its scene must not have a parent yet
 * @returns {{root: Group, radius: number, centre: Vector3, surrounds: boolean}} what to draw; its bounding sphere in the
 *   viewing frame; whether the scene surrounds its cameras, so that it is seen from within
 */
export function inViewingFrame(gltf) {
  gltf.scene.updateMatrixWorld(true);
  const bounds = new Box3().setFromObject(gltf.scene, true).getBoundingSphere(new Sphere());
  if (!(bounds.radius > 0)) bounds.radius = 1;
  const interest = interestOf(gltf, bounds.radius) ?? { centre: bounds.center, unit: bounds.radius };
  const root = new Group();
  root.name = "viewing frame";
  root.scale.setScalar(1 / interest.unit);
  root.position.copy(interest.centre).multiplyScalar(-1 / interest.unit);
  root.add(gltf.scene);
  root.updateMatrixWorld(true);
  const centre = bounds.center.sub(interest.centre).divideScalar(interest.unit);
  return { root, radius: bounds.radius / interest.unit, centre, surrounds: gltf.neural?.startView != null };
}

/** Of a scene with a view to start from: the object frame's origin, and how far from the view it is. Else null. */
function interestOf({ neural }, radius) {
  if (neural?.startView == null) return null;
  const { mesh } = neural.parts[0];
  const centre = new Vector3().setFromMatrixPosition(mesh.matrixWorld);
  const position = new Vector3().setFromMatrixPosition(worldFromCamera(neural.views[neural.startView], mesh));
  const distance = position.distanceTo(centre);
  return distance >= SHORTEST * radius ? { centre, unit: Math.min(distance, radius) } : null;
}
