// SPDX-License-Identifier: MIT
// The panel, loading, and the hook for tests.
const opened = performance.now();
let viewer, around, place = scene.start, loadedAfter;

function say(text) {
  element("note").textContent = text;
  element("note").hidden = false;
}

function fail(error) {
  element("loading").hidden = true;
  say("Cannot show this scene: " + error.message + "." + (around ? " Below is a picture of it, in which you can look around." : ""));
  if (around) element("panel").hidden = true;
}

function firstPicture() {
  loadedAfter = performance.now() - opened;
  element("poster").classList.add("gone");
  around?.leave(viewer);
  element("loading").hidden = !viewer.stream?.missing;
}

function goTo(index) {
  if (viewer.walker) switchMode();
  place = (index + scene.cameras.length) % scene.cameras.length;
  element("camera").textContent = scene.cameras[place].name;
  viewer.jumpTo(scene.cameras[place], true);
}

// Orbit, fly, and walk where the page has ground.
function switchMode() {
  const walker = viewer.walker ? null : viewer.flying && scene.collider && (viewer.kept ??= new Walker(viewer));
  viewer.flying = !viewer.flying || !!walker;
  viewer.walker = walker && walker.begin() ? walker : null;
  if (walker && !viewer.walker) viewer.flying = false;
  if (viewer.kept) viewer.kept.element.hidden = !viewer.walker || !matchMedia("(any-pointer: coarse)").matches;
  element("mode").textContent = viewer.walker ? "Walk" : viewer.flying ? "Fly" : "Orbit";
  viewer.changed();
}

function switchFullScreen() {
  const root = document.documentElement;
  if (document.fullscreenElement) document.exitFullscreen();
  else root.requestFullscreen?.().catch(() => say("This browser refuses full screen."));
}

function wirePanel() {
  element("bookmarks").hidden = scene.cameras.length < 2;
  element("camera").textContent = scene.cameras[place].name;
  element("full").hidden = !document.documentElement.requestFullscreen;
  const actions = {
    ArrowLeft: () => goTo(place - 1), ArrowRight: () => goTo(place + 1), 0: () => goTo(place), o: switchMode,
    f: switchFullScreen, "?": () => element("help").showModal(), h: () => element("help").showModal(),
  };
  for (const [id, key] of [["previous", "ArrowLeft"], ["next", "ArrowRight"], ["camera", "0"], ["mode", "o"], ["full", "f"], ["ask", "?"]])
    element(id).onclick = actions[key];
  if (scene.notes) actions.n = () => viewer.notes.step(1);
  if (scene.collider) element("mode").title = "Orbit, fly or walk (O)";
  listenToPointers(viewer);
  listenToKeys(viewer, actions);
  element("facts").textContent = scene.facts;
}

// #camera=NAME or its number, from 1, in the address.
function cameraOfAddress() {
  const wanted = new URLSearchParams(location.hash.slice(1)).get("camera");
  if (wanted === null) return;
  const named = scene.cameras.findIndex(c => c.name === wanted), number = /^\d+$/.test(wanted) ? Number(wanted) - 1 : -1;
  if (scene.cameras[named >= 0 ? named : number]) place = scene.start = named >= 0 ? named : number;
}

async function start() {
  cameraOfAddress();
  if (scene.around) around = new Around();
  const canvas = element("view");
  canvas.addEventListener("webglcontextlost", () => say("The browser took the graphics memory back. Load the page again to go on."));
  const renderer = new Renderer(canvas);
  if (renderer.coarse) say("This device blends in 8 bits: colours show steps.");
  viewer = new Viewer(canvas, renderer);
  if (place !== Number(scene.poster)) element("poster").hidden = true;
  wirePanel();
  if (scene.notes) viewer.notes = new Notes(viewer);
  viewer.notes?.ofAddress();
  addEventListener("hashchange", () => {
    if (/^#note=/.test(location.hash)) return viewer.notes?.ofAddress();
    cameraOfAddress();
    goTo(place);
  });
  await openSplats(viewer);
}

const ready = start();
ready.catch(fail);

// For tests. A camera is {width, height, fx, fy, cx, cy, eye, axes}, axes right, down, forward; or a bookmark's number.
const cameraOf = c => typeof c === "number" ? scene.cameras[c] : c;
window.darb = {
  ready, scene, fewSplats,
  // level: of splats, 0 has all; fine: at rest
  picture: async (camera, fine, level) => { await ready; viewer.fine = fine; return viewer.picture(cameraOf(camera), level); },
  get state() { return {shown: !!viewer?.shown, loadedAfter, camera: viewer?.camera, distance: viewer?.distance, format: viewer?.format, place, step: viewer?.step, levels: viewer?.renderer.levels.length, ...viewer?.stream?.state}; },
  // From the ground below a point of the scene, legs of [u, v, seconds]: the level directions of Ground.
  walk: (from, legs) => {
    const walker = new Walker(viewer);
    viewer.camera.eye = from;
    const begun = walker.begin() && {feet: [...walker.feet]}, found = begun && [begun, ...walker.path(legs)];
    walker.element.remove();
    return found;
  },
  around: () => around,
  // Frames a second of a turn about the focus, and the step of `paces` it ends at.
  turn: async seconds => {
    await ready;
    const frames = viewer.frames, start = performance.now(), end = start + 1000 * seconds;
    await new Promise(done => {
      viewer.flight = now => {
        turnCamera(viewer.camera, scene.up, 0.02, viewer.focus);
        if (now >= end) done();
        return now < end;
      };
      viewer.changed();
    });
    return {rate: (viewer.frames - frames) / (performance.now() - start) * 1000, step: viewer.step, pace: paces[viewer.step]};
  },
};
