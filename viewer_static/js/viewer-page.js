// The viewer: one asset on a stage, with its controls.

import { sourceOfAddress, sourceOfFile } from "./asset-source.js";
import { hideMessage, showLoading, showMessage, showNote } from "./message.js";
import { hasWebGL2 } from "./webgl2.js";

const byId = (id) => document.getElementById(id);
let viewer = null; // a promise, once WebGL2 is there

/** For tests and measurements; `ready` resolves when the address's asset is on the stage. */
window.polyfield = { ready: start() };

async function start() {
  if (!hasWebGL2()) {
    showMessage({
      title: "WebGL2 is missing",
      text:
        "The viewer draws with WebGL2, which this browser does not offer.\n" +
        "Update the browser, or turn on “graphics acceleration” in its settings, then load this page again.",
      canOpen: false,
    });
    return;
  }
  viewer = makeViewer();
  listenForFiles();
  const source = await sourceOfAddress();
  if (source) await show(source);
  else await viewer.then(invite, (error) => showMessage({ title: "The viewer cannot start", text: error.message }));
}

function invite() {
  showMessage({ title: "Open an asset", text: "Choose a .glb file, or drop one on this page." });
}

// three.js is fetched only where it can run.
async function makeViewer() {
  const [{ Stage }, { Hud }, { PixelProbe }, { loadGlb }, { decodesExactly }] = await Promise.all([
    import("./stage.js"),
    import("./hud.js"),
    import("./pixel-probe.js"),
    import("./neural-loader.js"),
    import("./decoder-check.js"),
  ]);
  const stage = new Stage(byId("canvas"));
  const probe = new PixelProbe(stage);
  window.polyfield.renderToPixels = (...args) => probe.renderToPixels(...args);
  window.polyfield.readFeatureTexture = (...args) => probe.readFeatureTexture(...args);
  window.polyfield.stage = stage;
  byId("canvas").addEventListener("webglcontextlost", onContextLost);
  return { stage, hud: new Hud(stage), loadGlb, exact: await decodesExactly(stage.webgl) };
}

async function show(source) {
  showLoading(NaN);
  try {
    const [{ stage, hud, loadGlb, exact }, bytes] = await Promise.all([viewer, source.read(showLoading)]);
    showLoading(NaN);
    const gltf = await loadGlb(bytes);
    hideMessage();
    stage.setAsset(gltf);
    hud.setAsset(source, bytes.byteLength);
    if (gltf.neural && !exact) showNote("This browser alters the asset's data: colours may be wrong. Try another one.");
  } catch (error) {
    showMessage({ title: "This asset cannot be shown", text: [error.message, error.remedy].filter(Boolean).join("\n") });
  } finally {
    showLoading(null);
  }
}

function listenForFiles() {
  const veil = byId("drop-veil");
  const open = (file) => file && show(sourceOfFile(file));
  byId("pick-glb").addEventListener("change", (event) => open(event.target.files[0]));
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    veil.classList.add("over");
  });
  window.addEventListener("dragleave", (event) => event.relatedTarget || veil.classList.remove("over"));
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    veil.classList.remove("over");
    open(event.dataTransfer.files[0]);
  });
}

function onContextLost(event) {
  event.preventDefault();
  showMessage({
    title: "The graphics processor gave up",
    text: "It ran out of memory or was reset. Load this page again, perhaps at a lower resolution.",
    canOpen: false,
  });
}
