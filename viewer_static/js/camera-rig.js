// The camera a person steers: orbit, pan and zoom by mouse, touch and keyboard.

import { Box3, MathUtils, PerspectiveCamera, Quaternion, Sphere, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { verticalFov, worldFromCamera } from "./capture-view.js";

const DEFAULT_FOV = 40; // degrees
const MARGIN = 1.02; // of the bounding sphere, so that nothing is clipped by rounding
const TIGHTER = 0.85; // the sphere about the bounding box is wider than what is in it
const NEAREST = 1e-3; // of the sphere's radius

export class CameraRig {
  #camera = new PerspectiveCamera(DEFAULT_FOV);
  #controls;
  #bounds = new Sphere(new Vector3(), 1);
  #frame = { fov: DEFAULT_FOV, aspect: 1 };
  #start = null;

  /**
   * @param {HTMLElement} element takes the pointers and the arrow keys
   * @param {() => void} onMove
   */
  constructor(element, onMove) {
    this.#controls = new OrbitControls(this.#camera, element);
    this.#controls.enableDamping = true;
    this.#controls.dampingFactor = 0.12;
    this.#controls.zoomToCursor = true;
    this.#controls.addEventListener("change", onMove);
    this.#controls.listenToKeyEvents(element);
  }

  get camera() {
    return this.#camera;
  }

  /** Nearest and farthest depth of the scene for any camera at `position`, in world units. */
  depthRange(position = this.#camera.position) {
    const { center, radius } = this.#bounds;
    const distance = position.distanceTo(center);
    return {
      near: Math.max(distance - MARGIN * radius, NEAREST * radius),
      far: Math.max(distance + MARGIN * radius, 2 * NEAREST * radius),
    };
  }

  /** Sets the scene that is looked at. */
  setScene(scene) {
    this.#bounds = new Box3().setFromObject(scene, true).getBoundingSphere(new Sphere());
    if (!(this.#bounds.radius > 0)) this.#bounds.radius = 1;
    this.#controls.minDistance = 0.02 * this.#bounds.radius;
    this.#controls.maxDistance = 40 * this.#bounds.radius;
  }

  /** Looks at the whole scene from the front, slightly from above. */
  frameScene() {
    const { center, radius } = this.#bounds;
    this.#frame = { fov: DEFAULT_FOV, aspect: 1 };
    const distance = (TIGHTER * radius) / Math.sin(MathUtils.degToRad(DEFAULT_FOV / 2));
    this.#camera.position.copy(center).addScaledVector(new Vector3(0.35, 0.4, 0.85).normalize(), distance);
    this.#controls.target.copy(center);
    this.#settle();
  }

  /** Stands where a photo was taken; the whole photo is in sight. `object` is a mesh of the asset. */
  standAt(view, object) {
    const matrix = worldFromCamera(view, object);
    this.#frame = { fov: verticalFov(view), aspect: view.imageSize[0] / view.imageSize[1] };
    const rotation = new Quaternion();
    matrix.decompose(this.#camera.position, rotation, new Vector3());
    const forward = new Vector3(0, 0, -1).applyQuaternion(rotation);
    // Orbit about the point of the line of sight that is nearest to the scene's centre.
    const along = forward.dot(this.#bounds.center.clone().sub(this.#camera.position));
    const depth = Math.max(along, 0.1 * this.#bounds.radius);
    this.#controls.target.copy(this.#camera.position).addScaledVector(forward, depth);
    this.#settle();
  }

  /** Back to the last place that was asked for. */
  reset() {
    if (!this.#start) return;
    this.#camera.position.copy(this.#start.position);
    this.#controls.target.copy(this.#start.target);
    this.#controls.update();
  }

  /** Fits the framed picture into a canvas of this aspect ratio (width / height). */
  setAspect(aspect) {
    const half = Math.tan(MathUtils.degToRad(this.#frame.fov / 2));
    this.#camera.aspect = aspect;
    this.#camera.fov = MathUtils.radToDeg(2 * Math.atan(half * Math.max(1, this.#frame.aspect / aspect)));
  }

  /** Moves on by one frame. */
  update() {
    this.#controls.update();
    Object.assign(this.#camera, this.depthRange());
    this.#camera.updateProjectionMatrix();
    this.#camera.updateMatrixWorld(true);
  }

  #settle() {
    this.setAspect(this.#camera.aspect);
    this.#start = { position: this.#camera.position.clone(), target: this.#controls.target.clone() };
    this.#controls.update();
  }
}
