// SPDX-License-Identifier: MIT
// Notes at places of the scene: numbered buttons over the picture, and a card with the text of one. Nothing hides them,
// but those farther off are fainter. Text stays text.
function make(tag, properties, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

class Notes {
  constructor(viewer) {
    this.viewer = viewer;
    this.open = -1;
    this.pins = scene.notes.map((note, i) => make("button", {className: "pin", textContent: i + 1, title: note.title, ariaLabel: `Note ${i + 1}: ${note.title}`, onclick: () => this.show(i, true)}));
    this.heading = make("h2", {id: "heading", tabIndex: -1});
    this.text = make("p", {});
    const step = (by, text, name) => make("button", {textContent: text, ariaLabel: name, title: name, onclick: () => this.step(by)});
    this.card = make("section", {id: "card", hidden: true}, this.heading, this.text,
      make("div", {}, step(-1, "\u2039", "Note before"), step(1, "\u203a", "Next note (N)"), make("button", {textContent: "Close", onclick: () => this.close()})));
    this.card.setAttribute("aria-labelledby", "heading");
    const layer = make("div", {id: "pins"}, ...this.pins);
    layer.setAttribute("role", "group");
    layer.setAttribute("aria-label", "Notes");
    element("view").after(layer, this.card);
    // A note that is reached by the keyboard comes into view.
    this.pins.forEach((pin, i) => pin.addEventListener("focus", () => { if (pin.classList.contains("away")) this.look(i); }));
    this.card.addEventListener("keydown", event => { if (event.key === "Escape") this.close(); });
    const row = document.querySelector("#help table").insertRow();
    row.append(make("th", {textContent: "N, Tab"}), make("td", {textContent: "next note"}));
  }

  step(by) { this.show((Math.max(0, this.open + by + (this.open < 0 ? 0 : this.pins.length))) % this.pins.length, true); }

  // By the note's own camera, else from where one stands, but not farther than the scene is wide.
  look(i) {
    const {viewer} = this, {at, camera} = scene.notes[i];
    if (camera) return viewer.jumpTo(camera, true);
    const from = copyCamera(viewer.camera), distance = Math.min(Math.hypot(...add(at, from.eye, -1)), scene.radius) || scene.radius;
    from.eye = add(at, from.axes[2], -distance);
    from.pivot = distance;
    viewer.jumpTo(from, true);
  }

  show(i, move) {
    this.open = i;
    this.pins.forEach((pin, k) => { pin.ariaExpanded = String(k === i); });
    this.heading.textContent = `${i + 1}. ${scene.notes[i].title}`;
    this.text.textContent = scene.notes[i].text;
    this.card.hidden = false;
    this.heading.focus({preventScroll: true});
    if (move) this.look(i);
    try { history.replaceState(null, "", "#note=" + (i + 1)); } catch { /* not everywhere from disk */ }
  }

  close() {
    this.card.hidden = true;
    this.pins[this.open]?.focus({preventScroll: true});
    this.pins[this.open].ariaExpanded = "false";
    this.open = -1;
    try { history.replaceState(null, "", "#"); } catch { /* as above */ }
  }

  // #note=2 in the address.
  ofAddress() {
    const number = Number(new URLSearchParams(location.hash.slice(1)).get("note"));
    if (scene.notes[number - 1]) this.show(number - 1, true);
  }

  place(camera) {
    this.pins.forEach((pin, i) => {
      const d = add(scene.notes[i].at, camera.eye, -1), [x, y, z] = camera.axes.map(axis => dot(axis, d));
      const left = camera.fx * x / z + camera.cx, top = camera.fy * y / z + camera.cy;
      const away = !(z > scene.near && left >= 0 && top >= 0 && left <= camera.width && top <= camera.height);
      pin.classList.toggle("away", away);
      if (away) return;
      pin.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px) translate(-50%, -50%)`;
      pin.style.opacity = Math.max(0.35, Math.min(1, 1.5 * this.viewer.distance / z)).toFixed(2);
      pin.style.zIndex = Math.max(1, 10000 - Math.round(1000 * z / scene.radius));
    });
  }
}
