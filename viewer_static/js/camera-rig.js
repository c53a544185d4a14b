// The camera a person steers: orbit, pan and zoom by mouse, touch and keyboard. All in the viewing frame.

import { MathUtils, PerspectiveCamera, Quaternion, Vector3 } from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { verticalFov, worldFromCamera } from "./capture-view.js";

const DEFAULT_FOV = 40; // degrees
const MARGIN = 1.02; // of the bounding sphere, so that nothing is clipped by rounding
const TIGHTER = 0.85; // the sphere about the bounding box is wider than what is in it
const NEAREST = 1e-3; // of the distance that is looked at
const NEAREST_TARGET = 0.1; // the viewing frame's unit is the distance of interest

export class CameraRig {
  #camera = new PerspectiveCamera(DEFAULT_FOV);
  #controls;
  #scene = { centre: new Vector3(), radius: 1, surrounds: false };
  #frame = { fov: DEFAULT_FOV, aspect: 1, filled: false };
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

  /**
   * Nearest and farthest depth of the scene for a camera at `position`.
   *
   * @param {Vector3} position
   * @param {number} focus distance of what is looked at
   */
  depthRange(position, focus = 1) {
    const { centre, radius } = this.#scene;
    const distance = position.distanceTo(centre);
    const nearest = NEAREST * Math.min(focus, radius);
    return {
      near: Math.max(distance - MARGIN * radius, nearest),
      far: Math.max(distance + MARGIN * radius, 2 * nearest),
    };
  }

  /** Sets the scene that is looked at, as inViewingFrame describes it. */
  setScene(scene) {
    this.#scene = scene;
    this.#controls.minDistance = 0.02;
    // There is nothing to see of surroundings from outside.
    this.#controls.maxDistance = scene.surrounds ? Math.max(scene.radius, 4) : 40 * scene.radius;
  }

  /** Looks at the whole scene from the front, slightly from above. */
  frameScene() {
    const { centre, radius } = this.#scene;
    this.#frame = { fov: DEFAULT_FOV, aspect: 1, filled: false };
    const distance = (TIGHTER * radius) / Math.sin(MathUtils.degToRad(DEFAULT_FOV / 2));
    this.#controls.maxDistance = Math.max(this.#controls.maxDistance, distance);
    this.#camera.position.copy(centre).addScaledVector(new Vector3(0.35, 0.4, 0.85).normalize(), distance);
    this.#controls.target.copy(centre);
    this.#settle();
  }

  /**
   * Stands where a photo was taken. Of an object, the whole photo is in sight; of surroundings, nothing beyond it, where
   * there may be nothing. `object` is a mesh of the asset.
   */
  standAt(view, object) {
    const matrix = worldFromCamera(view, object);
    const { surrounds } = this.#scene;
    this.#frame = { fov: verticalFov(view), aspect: view.imageSize[0] / view.imageSize[1], filled: surrounds };
    const rotation = new Quaternion();
    matrix.decompose(this.#camera.position, rotation, new Vector3());
    const forward = new Vector3(0, 0, -1).applyQuaternion(rotation);
    // Orbit about the point of the line of sight that is nearest to the point of interest, the origin.
    const depth = Math.max(-forward.dot(this.#camera.position), NEAREST_TARGET);
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

  /** Fits the framed picture into a canvas of this aspect ratio (width / height), or fills the canvas with it. */
  setAspect(aspect) {
    const half = Math.tan(MathUtils.degToRad(this.#frame.fov / 2));
    const ratio = this.#frame.aspect / aspect;
    const share = this.#frame.filled ? Math.min(1, ratio) : Math.max(1, ratio);
    this.#camera.aspect = aspect;
    this.#camera.fov = MathUtils.radToDeg(2 * Math.atan(half * share));
  }

  /** Moves on by one frame. */
  update() {
    this.#controls.update();
    const { position } = this.#camera;
    Object.assign(this.#camera, this.depthRange(position, position.distanceTo(this.#controls.target)));
    this.#camera.updateProjectionMatrix();
    this.#camera.updateMatrixWorld(true);
  }

  #settle() {
    this.setAspect(this.#camera.aspect);
    this.#start = { position: this.#camera.position.clone(), target: this.#controls.target.clone() };
    this.#controls.update();
  }
}
