// The canvas: what is drawn on it, how large, and when.

import { AmbientLight, Color, DirectionalLight, Scene, SRGBColorSpace, WebGLRenderer } from "three";
import { CameraRig } from "./camera-rig.js";
import { DeferredRenderer, SUBPIXELS } from "./deferred-renderer.js";
import { ForwardRenderer } from "./forward-renderer.js";
import { FrameClock } from "./frame-clock.js";
import { GpuTimer } from "./gpu-timer.js";
import { PlainRenderer } from "./plain-renderer.js";
import { inViewingFrame } from "./viewing-frame.js";

const RENDERERS = { deferred: DeferredRenderer, forward: ForwardRenderer, plain: PlainRenderer };
// Full resolution up to this many pixels; beyond it a phone gets warm and nobody sees the difference.
const COMFORTABLE_PX = 2.2e6;
// Drawn when the work per frame changes, so that there is a figure to show; fewer where they take long.
const MEASURED_FRAMES = 20;
const MEASURED_MS = 400;

/** Draws only when something changed, or always while `continuous`. */
export class Stage {
  #renderer;
  #canvas;
  #scene = new Scene();
  #gltf = null;
  #renderers = {};
  #mode = "plain";
  #scale = 1;
  #background = null;
  #unmeasured = 0;
  #measureUntil = 0;
  #requested = false;
  #continuous = false;
  #clock = new FrameClock();
  #gpu;
  onFrame = () => {};

  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ canvas, alpha: true, antialias: false, powerPreference: "high-performance" });
    this.#renderer.autoClear = false;
    this.#renderer.info.autoReset = false;
    this.#gpu = new GpuTimer(this.#renderer.getContext());
    this.rig = new CameraRig(canvas, () => this.draw());
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
  }

  /** Replaces what is shown. @param {object} gltf of loadGlb */
  setAsset(gltf) {
    this.clear();
    this.#gltf = gltf;
    this.#scene = new Scene();
    const framed = inViewingFrame(gltf);
    this.#scene.add(framed.root);
    if (!gltf.neural) this.#scene.add(...plainLights());
    this.#scene.updateMatrixWorld(true);
    for (const { mesh } of gltf.neural?.parts ?? []) mesh.frustumCulled = false;
    this.rig.setScene(framed);
    this.setMode(gltf.neural ? "deferred" : "plain");
  }

  clear() {
    for (const renderer of Object.values(this.#renderers)) renderer.dispose();
    this.#renderers = {};
    for (const { mesh, material } of this.#gltf?.neural?.parts ?? []) {
      mesh.geometry.dispose();
      material.dispose();
    }
    this.#gltf = null;
  }

  /** @param {"deferred" | "forward" | "plain"} mode */
  setMode(mode) {
    this.#mode = mode;
    const renderer = this.rendererOf(mode);
    renderer.load?.().then(() => this.draw());
    this.resetTimes();
  }

  rendererOf(mode) {
    this.#renderers[mode] ??= new RENDERERS[mode](this.#renderer, this.#scene, this.#gltf.neural);
    return this.#renderers[mode];
  }

  get mode() {
    return this.#mode;
  }

  get gltf() {
    return this.#gltf;
  }

  get canvas() {
    return this.#canvas;
  }

  get webgl() {
    return this.#renderer;
  }

  get size() {
    return { width: this.#canvas.width, height: this.#canvas.height };
  }

  /** Median time of recent frames in ms; NaN while unknown. */
  get times() {
    return { frameMs: this.#clock.medianMs, gpuMs: this.#gpu.medianMs };
  }

  /** Fits what the rig frames into the canvas; call after the rig was sent somewhere. */
  refit() {
    this.#resize();
  }

  /** Resolution as a share of the screen's own, per side. */
  setScale(scale) {
    this.#scale = scale;
    this.#resize();
    this.resetTimes();
  }

  /** @param {number[] | null} background sRGB in [0, 1]; null is transparent */
  setBackground(background) {
    this.#background = background;
    this.draw();
  }

  setContinuous(continuous) {
    this.#continuous = continuous;
    this.resetTimes();
  }

  resetTimes() {
    this.#clock.reset();
    this.#gpu.reset();
    this.#unmeasured = MEASURED_FRAMES;
    this.#measureUntil = performance.now() + MEASURED_MS;
    this.draw();
  }

  /** Asks for a frame. */
  draw() {
    if (this.#requested) return;
    this.#requested = true;
    requestAnimationFrame((now) => this.#frame(now));
  }

  /** Draws at once, so that the canvas can be read in the same task. */
  drawNow() {
    const { width, height } = this.size;
    this.rig.update();
    this.#clear();
    if (this.#gltf) this.rendererOf(this.#mode).render(this.rig.camera, null, width, height);
  }

  #frame(now) {
    this.#requested = false;
    this.#unmeasured -= 1;
    this.#clock.tick(now);
    this.#gpu.begin();
    this.drawNow();
    this.#gpu.end();
    this.onFrame();
    // Damped motion asks for its next frame itself, through the rig's change event.
    // On a slow device the time is up before a second frame; without one there is no figure to show.
    const unknown = Number.isNaN(this.#clock.medianMs);
    const measuring = unknown || (this.#unmeasured > 0 && performance.now() < this.#measureUntil);
    if (this.#continuous || measuring) this.draw();
    else if (!this.#requested) this.#clock.pause();
  }

  #clear() {
    const renderer = this.#renderer;
    renderer.setRenderTarget(null);
    // three.js keeps colours linear and converts a clear colour back for the canvas: these bytes arrive as they are.
    const [r, g, b] = this.#background ?? [0, 0, 0];
    renderer.setClearColor(new Color().setRGB(r, g, b, SRGBColorSpace), this.#background ? 1 : 0);
    renderer.clear();
  }

  #resize() {
    const { clientWidth, clientHeight } = this.#canvas;
    if (clientWidth === 0 || clientHeight === 0) return;
    this.#renderer.setPixelRatio(this.#pixelRatio(clientWidth, clientHeight));
    this.#renderer.setSize(clientWidth, clientHeight, false);
    this.rig.setAspect(clientWidth / clientHeight);
    this.draw();
  }

  #pixelRatio(width, height) {
    const comfortable = Math.max(1, Math.sqrt(COMFORTABLE_PX / (width * height)));
    const largest = this.#renderer.capabilities.maxTextureSize / SUBPIXELS / Math.max(width, height);
    return Math.min(this.#scale * Math.min(devicePixelRatio, comfortable), largest);
  }
}

function plainLights() {
  const sun = new DirectionalLight(0xffffff, 2);
  sun.position.set(1, 2, 1.5);
  return [new AmbientLight(0xffffff, 1.5), sun];
}
