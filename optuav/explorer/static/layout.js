// Columns of pictures, and tabs of a narrow screen.
import {button, make} from "./drawing.js";
import {drawDrone, drawHandles, drawMap} from "./map.js";
import {drawPicture} from "./pictures.js";
import {drawPlane} from "./plane.js";
import {outcome} from "./saying.js";
import {drawWells} from "./wells.js";

const TALL = 1.2; // Height over width of a mission
const WIDE = 1.6; // Width over height
const LEAST_PX = 60; // Of a picture, to be drawn
const LABEL_PX = 12.6; // Of labels beside lines of plain width

export class Column {
  moment = null; // Of the playhead
  tick = () => {}; // Moves what moves in flight

  constructor(session, kind, title, element) {
    Object.assign(this, {session, kind, element});
    element.classList.add(kind);
    element.setAttribute("aria-label", title);
    this.slots = element.querySelector(".slots");
    this.slots.addEventListener("change", () => this.draw());
    this.play = element.querySelector(".play");
    this.tabs = element.querySelector(".tabs");
    if (kind === "pinned") this.tabs.remove();
  }

  get answer() {
    return this.session[this.kind]?.answer;
  }

  draw() {
    const {answer, session, element} = this;
    if (!answer) return;
    this.#title(answer);
    const [map, plane, wells] = element.querySelectorAll(".draw");
    const lecture = element.closest(".lecture");
    const size = parseFloat(getComputedStyle(map).fontSize);
    const symbols = Boolean(element.closest(".symbols"));
    const look = ({clientWidth: width, clientHeight: height}, axes) =>
      ({width, height, axes, size, symbols, u: lecture ? size / LABEL_PX : 1});
    const picture = seen(map) && drawMap(map, answer, {...look(map, session.axes.map), all: !lecture});
    if (picture && this.kind === "now" && !session.stored) drawHandles(map, picture, answer.map, session);
    if (seen(plane)) this.#drawPlane(plane, answer, look);
    const clock = seen(wells) && (answer.wells
      ? drawWells(wells, answer, look(wells, session.axes.wells))
      : explain(wells, "No route can be flown."));
    this.tick = () => {
      if (clock) clock(this.moment);
      if (picture) drawDrone(picture, answer, this.moment);
    };
    this.tick();
  }

  #drawPlane(draw, answer, look) {
    const {session: {axes, trail, stored}, kind} = this;
    const {words} = answer.picture ?? answer.plane;
    if (words) return explain(draw, words);
    if (answer.picture) return drawPicture(draw, answer, look(draw, axes[answer.picture.name]));
    const slots = this.slots.firstChild.checked;
    const own = {trail: kind === "now" ? trail : [], slots};
    drawPlane(draw, answer, {...look(draw, stored ? null : axes.plane), ...own});
  }

  #title({plane: {route, chosen}, picture, pictures, verdict, wells}) {
    const alone = !this.session.pinned?.answer;
    const [map, plane, charge] = this.element.querySelectorAll("figcaption");
    this.slots.hidden = Boolean(picture);
    showTabs(this.tabs, ["plane", ...pictures], picture?.name ?? "plane", (name) => this.session.open(name));
    const [long, ...brief] = picture ? [picture.title ?? WORDS.pictures[picture.name]] : WORDS.plane;
    fit(plane.children[0], alone || picture ? [long] : brief);
    const way = route?.join(" → ");
    const between = route?.slice(1, -1).join(" → ");
    const ways = chosen ? [way, between] : [`shortest flight: ${way}`, "shortest flight"];
    fit(plane.children[1], alone && route && !picture ? [...ways, ""] : [""]);
    map.children[1].textContent = alone && !this.session.stored ? "drag a ring, or arrows" : "";
    this.play.hidden = !wells;
    fit(charge.children[1], wells?.alone ? WORDS.alone : [""]);
    const promise = verdict.promise ? `${verdict.promise.replace(/ of hover.*/, "")}, ` : "";
    const heading = this.element.querySelector(".title");
    const name = this.kind === "now" ? "Now" : "Pinned";
    heading.replaceChildren(`${name}: ${promise}`, outcome(verdict), make("span", {}, verdict.binds));
    heading.classList.toggle("good", verdict.good);
  }

  // The arrangement of the pictures by the mission's shape.
  shape([[x1, y1], [x2, y2]]) {
    if (this.element.firstElementChild.className) return; // It stays as it was on loading
    const [across, up] = [x2 - x1, y2 - y1];
    const kind = up > TALL * across ? "tall" : across > WIDE * up ? "wide" : "even";
    this.element.firstElementChild.className = kind;
    const share = Math.min(1.2, Math.max(0.5, (across + 0.25 * up) / (1.09 * up)));
    this.element.style.setProperty("--shape", share);
  }
}

function seen(draw) {
  return Math.min(draw.clientWidth, draw.clientHeight) > LEAST_PX;
}

// Words in place of a picture.
function explain(draw, words) {
  draw.replaceChildren(make("p", {}, words));
}

// The longest of some texts that a caption has room for.
function fit(note, texts) {
  for (const words of texts) {
    note.textContent = words;
    if (words === texts.at(-1) || note.scrollWidth <= note.clientWidth) return;
  }
}

// A row of tabs, one of which is open; the tabs stay while they are the same, as one may have the focus.
export function showTabs(row, names, opened, open) {
  row.hidden = names.length < 2;
  const words = (name) => WORDS.tabs[name] ?? WORDS.pictures[name] ?? name;
  d3.select(row).selectAll("button").data(names, (name) => name)
    .join((enter) => enter.append((name) => button(words(name), () => open(name), {role: "tab"})))
    .attr("data-tab", (name) => name)
    .attr("aria-selected", (name) => name === opened);
}
