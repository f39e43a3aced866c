// The page: header, columns of pictures, what binds, tables, the bar of a lecture, the sheet of a phone.
import {LIMITS, button, make, swatch} from "./drawing.js";
import {Handles, drawDrone, drawMap} from "./map.js";
import {drawPlane} from "./plane.js";
import {drawWells} from "./wells.js";

const TALL = 1.2, WIDE = 1.6; // Height over width, and width over height, of a mission
const LEAST_PX = 60, LABEL_PX = 12.6; // Of a picture, to be drawn; of labels beside lines of plain width
const SHEETS = ["half", "low", "full"];

export class Column {
  moment = null; // Of the playhead
  #figures = {};
  #handles = null;
  constructor(session, kind, title, play) {
    this.session = session;
    this.kind = kind;
    this.heading = make("h2", {class: "panel title"});
    for (const [name, words] of Object.entries(WORDS.figures)) {
      const note = make("span"), caption = make("figcaption", {}, make("b", {}, words), note), draw = make("div", {class: "draw"});
      if (name === "wells") caption.append(button("▶ Fly it", () => play(this), {key: "Space", class: "play"}));
      if (name === "plane") caption.append(make("label", {class: "slots"}, make("input", {type: "checkbox"}), "slots"));
      this.#figures[name] = {caption, note, draw, element: make("figure", {class: `panel ${name}`}, caption, draw)};
    }
    this.slots = this.#figures.plane.caption.querySelector("input");
    this.slots.addEventListener("change", () => this.draw());
    this.grid = make("div", {}, this.heading, ...Object.values(this.#figures).map(({element}) => element));
    this.element = make("section", {class: `plan ${kind}`, "aria-label": title}, this.grid);
    if (kind === "now") this.#handles = new Handles(session);
  }
  get answer() { return this.kind === "now" ? this.session.shown : this.session.pinnedAnswer; }
  get falls() { return this.answer?.wells?.dry_s ?? null; }
  draw() {
    const {answer, session: {axes, trail, stored, pinnedAnswer}} = this, alone = !pinnedAnswer;
    if (!answer) return;
    const lecture = this.element.closest(".lecture"), size = parseFloat(getComputedStyle(this.#figures.map.draw).fontSize), u = lecture ? size / LABEL_PX : 1;
    const seen = (name) => Math.min(this.#figures[name].draw.clientWidth, this.#figures[name].draw.clientHeight) > LEAST_PX;
    const {map, plane, wells} = this.#figures;
    plane.caption.firstChild.textContent = alone ? WORDS.figures.plane : "Rest and hover";
    const {route, chosen} = answer.plane, [way, stays] = [route, route?.slice(1, -1)].map((each) => each?.join(" → "));
    fit(plane.note, !alone || !route ? [""] : [...(chosen ? [way, stays] : [`shortest flight: ${way}`, "shortest flight"]), ""]);
    map.note.textContent = alone && !stored ? "drag a ring, or arrows" : "";
    this.heading.replaceChildren(`${this.kind === "now" ? "Now" : "Pinned"}: ${answer.verdict.promise ? `${answer.verdict.promise.replace(/ of hover.*/, "")}, ` : ""}`, event(answer.verdict), make("br"), make("span", {}, lower(answer.verdict.binds)));
    this.heading.classList.toggle("good", answer.verdict.good);
    wells.caption.querySelector(".play").hidden = !answer.wells;
    const drawn = seen("map") ? drawMap(map.draw, answer, {window: axes.map, size, u, all: !lecture}) : null;
    if (drawn && this.#handles && !stored) this.#handles.draw(map.draw, drawn, answer.map);
    if (seen("plane")) drawPlane(plane.draw, answer, {axes: stored ? null : axes.plane, trail: this.kind === "now" ? trail : [], size, u, slots: this.slots.checked});
    const clock = seen("wells") ? drawWells(wells.draw, answer, {axes: axes.wells, size, u}) : null;
    this.tick = () => [clock?.(this.moment), drawn && drawDrone(drawn, answer, this.moment, {size, u})]; // What moves in flight
    this.tick();
  }
  shape([[x1, y1], [x2, y2]]) {
    const [across, up] = [x2 - x1, y2 - y1];
    this.grid.className = up > TALL * across ? "tall" : across > WIDE * up ? "wide" : "even";
    this.element.style.setProperty("--shape", Math.min(1.2, Math.max(0.5, (across + 0.25 * up) / (1.09 * up))));
  }
}

function event({event: words, good}) { return make("b", {class: good ? "flies" : "falls"}, `${good ? "✓" : "✕"} ${words}`); }

// The longest of some texts that a caption has room for.
function fit(note, texts) {
  for (const words of texts) {
    note.textContent = words;
    if (note.scrollWidth <= note.clientWidth) return;
  }
}

function lower(words) { return words ? `${words[0].toLowerCase()}${words.slice(1).replace(/\.$/, "")}` : ""; }

// The header says the verdict and its reason; with a pin, how far the plans differ.
export function sayVerdict(header, {shown, pinnedAnswer: other}, differing, lecture) {
  const [verdict, why] = header.querySelectorAll(".verdict, .why"), now = shown.verdict, parts = [];
  header.classList.toggle("good", now.good);
  if (other && now.promise && other.verdict.promise) {
    const trips = !other.verdict.hover_s && !now.hover_s, time = trips ? "time_s" : "hover_s";
    const more = other.verdict[time] - now[time], rest = other.verdict.rest_s - now.rest_s;
    const than = (by, unit = 2) => (Math.abs(by) < 0.005 ? "as long" : `${Math.abs(by).toFixed(unit)} s ${by > 0 ? "more" : "less"}`);
    const lands = other.verdict.good === now.good ? (now.good ? "and both land" : "and neither can be flown") : other.verdict.good ? "and it lands" : "and it cannot be flown";
    verdict.replaceChildren(`The pinned plan ${trips ? "travels" : "hovers"} `, make("span", {class: "n"}, than(more)), ", ", make("b", {class: other.verdict.good ? "flies" : "falls"}, lands));
    const roof = ({stops}) => stops.find(([kind]) => kind === "rest")?.[1] ?? "", [here, there] = [roof(now), roof(other.verdict)];
    const moved = here && there && here !== there ? `, at ${there} in place of ${here}` : "";
    const order = (each) => each.stops[0]?.[0], turned = order(other.verdict) !== order(now) && order(other.verdict) ? `, and ${order(other.verdict)}s first` : "";
    why.replaceChildren(make("b", {}, differing ? `Differs in ${differing}. ` : "Nothing is set otherwise. "), other.verdict.rest_s || now.rest_s ? `It rests ${than(rest, 1)}${moved}${turned}.` : "");
    return;
  }
  if (now.promise) parts.push(make("span", {class: "n"}, now.promise.split(" of ")[0]), ` of ${now.promise.split(" of ")[1]}; `);
  verdict.replaceChildren(...parts, event(now), now.reason ? `: ${now.reason}` : "");
  if (!now.promise) {
    const kept = shown.plane.words ?? "No times of rest and hover keep every limit.";
    return why.replaceChildren(lecture ? kept : "Details show which single change would make a plan possible.");
  }
  why.replaceChildren(make("b", {}, now.binds), make("span", {class: "route"}, ` ${now.route}`));
}

// What binds, in words, with the line of each role; and what more would bring.
export function sayBinding(foot, {shown, pinnedAnswer}, details) {
  const chips = ({constraints, verdict}) => {
    const roles = LIMITS.filter((role) => role !== "bounds" && constraints.some((each) => each.binds && each.role === role));
    if (!roles.length) return [make("span", {}, verdict.promise ? "nothing" : verdict.reason)];
    return roles.map((role) => {
      const words = constraints.filter((each) => each.binds && each.role === role).map((each) => each.words);
      const several = roles.length > 1, brief = words.map((each, k) => (k || several ? each.replace(/^available (well (?:empty|past full))(?: on landing)? /, (_, well) => (k ? "and " : `${well} `)).replace("at the destination", "at the end") : each.replace("available ", "")));
      return make("span", {class: "chip"}, swatch(role), make("span", {}, brief.join(", ")));
    });
  };
  const separator = () => make("span", {class: "sep"}), worth = make("span", {class: "worth"});
  worth.append(...(shown.verdict.worth ?? "").split(/([\d.]+ s)(?= of|[,.])/).map((each, k) => (k % 2 ? make("b", {}, each) : each)));
  const rest = pinnedAnswer ? [separator(), make("b", {}, "Binds pinned"), ...chips(pinnedAnswer)] : worth.textContent ? [separator(), worth] : [];
  foot.replaceChildren(make("b", {}, pinnedAnswer ? "Binds now" : "What binds"), ...chips(shown), ...rest, details);
}

// Tables lie below the screen.
export function tables(answer, askRepairs) {
  const parts = [];
  if (answer.reasons.length) {
    parts.push(folded("Why there is no plan", list(answer.reasons), true));
    if (answer.repairs.length) parts.push(folded("Feasible if", table(["change", ""], answer.repairs), true));
    else if (!answer.stored) parts.push(button("What would make it feasible?", askRepairs));
  }
  if (answer.constraints.length) {
    const rows = answer.constraints.map((each) => [each.words, each.label, each.statement, each.figures, each.spare]);
    parts.push(folded("Limits; y1_k is the charge in the available well after step k", table(["limit", "constraint", "as stated", "in numbers", "to spare"], rows), true));
  }
  if (answer.prices.length) {
    const rows = answer.prices.map((each) => [each.key, each.value, each.less, each.more]);
    const steps = list(answer.prices.map(({words}) => words).filter(Boolean));
    const title = `Worth: ${answer.objective} per unit, as a slope at the margin, the others held`;
    parts.push(folded(title, make("div", {}, table(["parameter", "value", "less", "more"], rows, "figures"), ...(steps.children.length ? ["For whole steps, solved again:", steps] : [])), true));
  }
  parts.push(folded("Question, answer and proof", table(["", ""], answer.facts), true));
  return parts;
}

function list(lines) { return make("ul", {}, ...lines.map((line) => make("li", {}, line))); }

function table(heads, rows, kind = "") {
  const cells = (tag, row) => make("tr", {}, ...row.map((cell) => make(tag, {}, cell)));
  const body = make("table", {class: kind}, ...(heads.some(Boolean) ? [cells("th", heads)] : []), ...rows.map((row) => cells("td", row)));
  return make("div", {class: "scrolls", tabindex: 0, role: "group", "aria-label": heads.filter(Boolean).join(", ") || "facts"}, body);
}

function folded(title, content, open) {
  const element = make("details", {}, make("summary", {}, title), content);
  element.open = open;
  return element;
}

// On a narrow screen one picture at a time, above a sheet of three heights.
export function tabsOf(root, draw) {
  const show = (name) => {
    root.dataset.picture = name;
    draw();
    for (const tab of tabs.children) tab.setAttribute("aria-selected", tab.dataset.tab === name);
  };
  const tabs = make("div", {class: "tabs pictures", role: "tablist"}, ...Object.entries(WORDS.tabs).map(([name, words]) => button(words, () => show(name), {role: "tab", "data-tab": name})));
  show("map");
  return tabs;
}

export function gripOf(root, form) {
  const next = () => (root.dataset.sheet = SHEETS[(SHEETS.indexOf(root.dataset.sheet) + 1) % SHEETS.length]);
  root.dataset.sheet = SHEETS[0];
  form.prepend(button("", next, {class: "grip", "aria-label": "Height of the controls"}));
}
