// The page: columns of pictures, tabs of a narrow screen, and the sheet of a phone.
import {button, make} from "./drawing.js";
import {drawDrone} from "./drone.js";
import {Handles} from "./handles.js";
import {drawMap} from "./map.js";
import {drawPicture} from "./pictures.js";
import {drawPlane} from "./plane.js";
import {outcome} from "./saying.js";
import {drawWells} from "./wells.js";

const TALL = 1.2; // Height over width of a mission
const WIDE = 1.6; // Width over height
const LEAST_PX = 60; // Of a picture, to be drawn
const LABEL_PX = 12.6; // Of labels beside lines of plain width
const SHEETS = ["half", "low", "full"];

export class Column {
  moment = null; // Of the playhead
  #figures = {};
  #handles = null;

  constructor(session, kind, title, play) {
    this.session = session;
    this.kind = kind;
    this.heading = make("h2", {class: "panel title"});
    for (const name of Object.keys(WORDS.figures)) this.#figures[name] = figure(name);
    const {plane, wells} = this.#figures;
    this.play = button("▶ Fly it", () => play(this), {key: "Space", class: "play"});
    this.slots = make("input", {type: "checkbox"});
    this.slots.addEventListener("change", () => this.draw());
    wells.caption.append(this.play);
    plane.caption.append(make("label", {class: "slots"}, this.slots, "slots"));
    if (kind === "now") {
      this.tabs = new Tabs((name) => session.open(name));
      plane.caption.append(this.tabs.element);
    }
    this.grid = make("div", {}, this.heading, ...Object.values(this.#figures).map(({element}) => element));
    this.element = make("section", {class: `plan ${kind}`, "aria-label": title}, this.grid);
    if (kind === "now") this.#handles = new Handles(session);
  }

  get answer() {
    return this.kind === "now" ? this.session.shown : this.session.pinnedAnswer;
  }

  draw() {
    const {answer} = this;
    if (!answer) return;
    const {axes, trail, stored} = this.session;
    const {map, plane, wells} = this.#figures;
    const lecture = this.element.closest(".lecture");
    const size = parseFloat(getComputedStyle(map.draw).fontSize);
    const look = {size, u: lecture ? size / LABEL_PX : 1};
    this.#caption(answer);
    const place = seen(map) && drawMap(map.draw, answer, {window: axes.map, all: !lecture, ...look});
    if (place && this.#handles && !stored) this.#handles.draw(map.draw, place, answer.map);
    if (seen(plane)) {
      const own = {axes: stored ? null : axes.plane, trail: this.kind === "now" ? trail : []};
      if (answer.picture) drawPicture(plane.draw, answer, {axes: this.session.endsOf(answer), ...look});
      else drawPlane(plane.draw, answer, {...own, slots: this.slots.checked, ...look});
    }
    const clock = seen(wells) && drawWells(wells.draw, answer, {axes: axes.wells, ...look});
    // What moves in flight
    this.tick = () => {
      if (clock) clock(this.moment);
      if (place) drawDrone(place, answer, this.moment);
    };
    this.tick();
  }

  #caption({plane: {route, chosen}, picture, pictures, verdict, wells}) {
    const {stored, pinnedAnswer} = this.session;
    const alone = !pinnedAnswer;
    const {map, plane} = this.#figures;
    const title = picture ? picture.title ?? WORDS.pictures[picture.name] : WORDS.figures.plane;
    plane.caption.firstChild.textContent = alone || picture ? title : WORDS.briefly.plane;
    this.slots.parentNode.hidden = Boolean(picture);
    this.tabs?.show(["plane", ...pictures], picture?.name ?? "plane");
    const way = route?.join(" → ");
    const between = route?.slice(1, -1).join(" → ");
    const ways = chosen ? [way, between] : [`shortest flight: ${way}`, "shortest flight"];
    fit(plane.note, alone && route && !picture ? [...ways, ""] : [""]);
    map.note.textContent = alone && !stored ? "drag a ring, or arrows" : "";
    this.play.hidden = !wells;
    const promise = verdict.promise ? `${verdict.promise.replace(/ of hover.*/, "")}, ` : "";
    const binds = make("span", {}, lower(verdict.binds));
    const name = this.kind === "now" ? "Now" : "Pinned";
    this.heading.replaceChildren(`${name}: ${promise}`, outcome(verdict), make("br"), binds);
    this.heading.classList.toggle("good", verdict.good);
  }

  // The arrangement of the pictures by the mission's shape.
  shape([[x1, y1], [x2, y2]]) {
    const [across, up] = [x2 - x1, y2 - y1];
    this.grid.className = up > TALL * across ? "tall" : across > WIDE * up ? "wide" : "even";
    const share = Math.min(1.2, Math.max(0.5, (across + 0.25 * up) / (1.09 * up)));
    this.element.style.setProperty("--shape", share);
  }
}

function figure(name) {
  const note = make("span");
  const caption = make("figcaption", {}, make("b", {}, WORDS.figures[name]), note);
  const draw = make("div", {class: "draw"});
  return {caption, note, draw, element: make("figure", {class: `panel ${name}`}, caption, draw)};
}

function seen({draw}) {
  return Math.min(draw.clientWidth, draw.clientHeight) > LEAST_PX;
}

// The longest of some texts that a caption has room for.
function fit(note, texts) {
  for (const words of texts) {
    note.textContent = words;
    if (note.scrollWidth <= note.clientWidth) return;
  }
}

function lower(words) {
  return words ? `${words[0].toLowerCase()}${words.slice(1).replace(/\.$/, "")}` : "";
}

// A row of tabs, one of which is open.
export class Tabs {
  element = make("div", {class: "tabs", role: "tablist"});
  #known = "";

  constructor(open) {
    this.open = open;
  }

  show(names, opened) {
    if (names.join() !== this.#known) {
      this.#known = names.join();
      this.element.hidden = names.length < 2;
      this.element.replaceChildren(...names.map((name) =>
        button(wordOf(name), () => this.open(name), {role: "tab", "data-tab": name})));
    }
    for (const tab of this.element.children) tab.setAttribute("aria-selected", tab.dataset.tab === opened);
  }
}

function wordOf(name) {
  return WORDS.tabs[name] ?? WORDS.pictures[name] ?? name;
}

export function gripOf(root, form) {
  const next = () => {
    root.dataset.sheet = SHEETS[(SHEETS.indexOf(root.dataset.sheet) + 1) % SHEETS.length];
  };
  root.dataset.sheet = SHEETS[0];
  form.prepend(button("", next, {class: "grip", "aria-label": "Height of the controls"}));
}
