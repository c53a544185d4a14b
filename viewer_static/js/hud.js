// The viewer's controls and figures. It knows the stage, the stage does not know it.

import { describePages, factsOf } from "./asset-facts.js";
import { formatBytes, formatCount } from "./format.js";
import { showNote } from "./message.js";

const BACKGROUNDS = { dark: [0.07, 0.08, 0.1], light: [0.97, 0.97, 0.98], none: null };
const WHOLE = "whole"; // the view that no photo was taken from
const FIGURES_MS = 250; // figures that change at every frame cannot be read
const byId = (id) => document.getElementById(id);

export class Hud {
  #stage;
  #fileBytes = 0;
  #showing = null; // the timer of the next change of figures

  constructor(stage) {
    this.#stage = stage;
    stage.onFrame = () => {
      this.#showing ??= setTimeout(() => {
        this.#showing = null;
        this.#showTimes();
      }, FIGURES_MS);
    };
    this.#listen();
    this.#openPanel(matchMedia("(min-width: 44rem)").matches);
  }

  /** @param {{name: string, url: string}} source of the asset on the stage */
  setAsset(source, fileBytes) {
    const { gltf } = this.#stage;
    this.#fileBytes = fileBytes;
    document.title = `${source.name} · Polyfield`;
    byId("name").textContent = source.name;
    byId("download").href = source.url;
    byId("download").download = source.name.endsWith(".glb") ? source.name : `${source.name}.glb`;
    for (const input of modeInputs()) {
      input.disabled = !gltf.neural && input.value !== "plain";
      input.checked = input.value === this.#stage.mode;
    }
    showNote(gltf.neural ? "" : "This file has no neural material: shown as any glTF viewer shows it.");
    this.#fillViews();
    this.#setBackground();
    this.#showFacts();
    byId("pill").hidden = false;
  }

  #listen() {
    const stage = this.#stage;
    for (const input of modeInputs()) input.addEventListener("change", () => this.#setMode(input.value));
    byId("view").addEventListener("change", () => this.#goToView());
    byId("previous-view").addEventListener("click", () => this.#stepView(-1));
    byId("next-view").addEventListener("click", () => this.#stepView(1));
    byId("scale").addEventListener("change", () => stage.setScale(Number(byId("scale").value)));
    byId("background").addEventListener("change", () => this.#setBackground());
    byId("continuous").addEventListener("change", () => stage.setContinuous(byId("continuous").checked));
    byId("save-picture").addEventListener("click", () => this.#savePicture());
    byId("toggle-panel").addEventListener("click", () => this.#openPanel(byId("panel").hidden));
    window.addEventListener("keydown", (event) => this.#onKey(event));
  }

  #onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches("select, input")) return;
    const mode = { 1: "deferred", 2: "forward", 3: "plain" }[event.key];
    const input = modeInputs().find(({ value }) => value === mode);
    if (input && !input.disabled) {
      input.checked = true;
      this.#setMode(mode);
    } else if (event.key === "[") this.#stepView(-1);
    else if (event.key === "]") this.#stepView(1);
    else if (event.key === "r") this.#goToView();
    else if (event.key === "h") this.#openPanel(byId("panel").hidden);
  }

  #setMode(mode) {
    if (!this.#stage.gltf) return;
    this.#stage.setMode(mode);
    this.#showFacts();
  }

  #fillViews() {
    const views = this.#stage.gltf.neural?.views ?? [];
    const options = [new Option("overview", WHOLE), ...views.map((view, i) => new Option(view.name, String(i)))];
    byId("view").replaceChildren(...options);
    byId("view").value = views.length > 0 ? String(this.#stage.gltf.neural.startView ?? 0) : WHOLE;
    for (const id of ["view", "previous-view", "next-view"]) byId(id).disabled = views.length === 0;
    this.#goToView();
  }

  #goToView() {
    const { gltf, rig } = this.#stage;
    if (!gltf) return;
    const value = byId("view").value;
    if (value === WHOLE) rig.frameScene();
    else rig.standAt(gltf.neural.views[Number(value)], gltf.neural.parts[0].mesh);
    this.#stage.refit();
  }

  #stepView(by) {
    const select = byId("view");
    if (select.disabled) return;
    const count = select.options.length;
    select.selectedIndex = (select.selectedIndex + by + count) % count;
    this.#goToView();
  }

  #setBackground() {
    const choice = byId("background").value;
    const ofAsset = this.#stage.gltf?.neural?.background ?? [1, 1, 1];
    this.#stage.setBackground(choice === "asset" ? ofAsset : BACKGROUNDS[choice]);
  }

  #openPanel(open) {
    byId("panel").hidden = !open;
    byId("toggle-panel").setAttribute("aria-expanded", String(open));
  }

  #savePicture() {
    this.#stage.drawNow(); // the canvas is only readable in the task that drew it
    this.#stage.canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${byId("name").textContent.replace(/\.glb$/, "")}.png`;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    }, "image/png");
  }

  #showTimes() {
    const { frameMs, gpuMs } = this.#stage.times;
    this.#showFacts({ frameMs, gpuMs });
    if (Number.isNaN(frameMs)) return;
    // In a short run, frames queue up before the graphics processor and seem to take less than they do.
    const shownMs = gpuMs > frameMs ? gpuMs : frameMs;
    byId("pill").textContent = `${shownMs.toFixed(1)} ms · ${Math.round(1000 / shownMs)} fps`;
  }

  #showFacts({ frameMs, gpuMs } = this.#stage.times) {
    if (!this.#stage.gltf) return;
    const { triangles, pages, textureBytes } = factsOf(this.#stage.gltf);
    const { width, height } = this.#stage.size;
    const rows = [
      ["Triangles", formatCount(triangles)],
      ["Pages", pages.length > 0 && `${describePages(pages)} (${formatBytes(textureBytes)})`],
      ["File", formatBytes(this.#fileBytes)],
      ["Picture", `${width} × ${height} px`],
      ["Frame", Number.isFinite(frameMs) ? `${frameMs.toFixed(1)} ms` : "–"],
      ["GPU", Number.isFinite(gpuMs) && `${gpuMs.toFixed(1)} ms`],
    ];
    byId("facts").replaceChildren(...rows.filter(([, value]) => value).flatMap(([term, value]) => [node("dt", term), node("dd", value)]));
  }
}

const modeInputs = () => [...document.querySelectorAll("#modes input")];

function node(tag, text) {
  const element = document.createElement(tag);
  element.textContent = text;
  return element;
}
