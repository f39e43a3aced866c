// The controls: what to start from, the question, the mission's sliders, and places.
import {button, decimal, grouped, make} from "./drawing.js";
import {ARROWS, points} from "./handles.js";
import {Tabs} from "./layout.js";
import {DEFAULTS, brief} from "./state.js";

const PLACES = ["device", "laser", "roof"];
const LONG_STEP = 10; // Steps, by Shift and an arrow
const NUMBER = {type: "text", inputmode: "decimal", autocomplete: "off"};
let instances = 0;

export class Controls {
  form = make("form", {class: "controls panel", "aria-label": "Question and mission"});
  #session;
  #fields = new Map();
  #sections = {};
  #tabs = new Tabs((name) => this.#show(name));
  #lent = "";
  #id = `optuav-${++instances}`;

  constructor(session) {
    this.#session = session;
    this.form.addEventListener("submit", (event) => event.preventDefault());
  }

  get(name) {
    return this.#fields.get(name)?.element;
  }

  names() {
    return [...this.#fields.keys()];
  }

  // Fills all fields but the one that is being changed; or all.
  fill(all) {
    const {shown: answer, state} = this.#session;
    if (!this.#fields.size) this.#build(answer);
    const active = all ? null : this.form.getRootNode().activeElement;
    const free = (input) => !this.#session.waiting && active !== input;
    for (const control of answer.controls) this.#fillSlider(control, free);
    const whys = fixed(state);
    for (const name of Object.keys(WORDS.titles).filter((known) => this.#fields.has(known))) {
      this.#fillChoice(name, answer.options[name], whys[name] || "");
    }
    if (!answer.stored) this.#fillPlaces(free);
    this.#compareSliders();
    this.#fields.get("start").inputs[0].value = presetOf(state, answer.presets);
  }

  #build({options: known, controls, presets, stored}) {
    this.#section("Start", "Start from", this.#starts(presets));
    const asked = Object.keys(WORDS.titles).filter((name) => known[name]);
    this.#section("Question", "Question", ...asked.map((name) => this.#choice(name, known[name])));
    this.#section("Mission", "Mission", ...controls.map((control) => this.#slider(control)));
    if (!stored) this.#section("Places", "Places, m", ...PLACES.map((name) => this.#place(name)));
    this.#tabs.element.classList.add("sections");
    this.form.append(this.#tabs.element, ...Object.values(this.#sections));
    this.#show("Mission");
  }

  #section(name, title, ...content) {
    this.#sections[name] = make("section", {"data-section": name}, make("h2", {}, title), ...content);
  }

  #show(name) {
    for (const [own, {classList}] of Object.entries(this.#sections)) classList.toggle("on", own === name);
    this.#tabs.show(Object.keys(this.#sections), name);
  }

  // What to start from.

  #starts(presets) {
    const select = make("select", {"aria-label": "Start from"});
    const go = (value) => this.#session.begin(presets[value].state);
    const step = (by) => {
      const now = Math.max(0, Number(select.value || 0));
      go((now + by + presets.length) % presets.length);
    };
    select.append(...presets.map(({words}, value) => make("option", {value}, words)));
    select.append(make("option", {value: "", hidden: ""}, "your own"));
    select.addEventListener("change", () => go(select.value));
    this.#fields.set("start", {inputs: [select]});
    const back = button("‹", () => step(-1), {"aria-label": "previous"});
    const next = button("›", () => step(1), {"aria-label": "next"});
    return make("div", {class: "start"}, back, select, next);
  }

  // The question.

  #choice(name, values) {
    const title = WORDS.titles[name];
    const select = make("select", {id: `${this.#id}-${name}`});
    const mark = make("span");
    const note = make("div", {class: "note"});
    const differs = make("div", {class: "differs"});
    const choose = (value) => this.#choose(name, value);
    options(select, name, values);
    select.addEventListener("change", () => choose(select.value || null));
    const segments = (WORDS.segments[name] ?? []).map((value) =>
      button(worded(name, value), () => choose(value), {value, "aria-pressed": "false"}));
    const group = {class: "segments", role: "group", "aria-label": `${title}: one of`};
    const label = make("label", {for: select.id}, title, mark);
    const parts = [label, select, make("span", group, ...segments), note, differs];
    const element = make("div", {class: "choice", "data-name": name}, ...parts);
    this.#fields.set(name, {key: name, element, inputs: [select], mark, note, differs, segments});
    return element;
  }

  #choose(name, value) {
    const changes = {[name]: value};
    if (name === "building" && value) Object.assign(changes, {trajectory: null, problem: null});
    if (name === "problem") changes.building = null;
    if (value === "P3") Object.assign(changes, {trajectory: null, order: null});
    if (value === "direct") changes.order = null;
    this.#session.last = name;
    this.#session.change(changes);
  }

  // With a mark where the pinned plan has else, and why it changes nothing.
  #fillChoice(name, values, why) {
    const {pinned, state} = this.#session;
    const {inputs: [select], segments, mark, note, differs} = this.#fields.get(name);
    const value = state[name] ?? DEFAULTS[name];
    const other = pinned ? pinned[name] ?? DEFAULTS[name] : value;
    if (name === "building" && select.options.length !== values.length + 1) options(select, name, values);
    select.value = value;
    select.title = WORDS.hints[value] ?? "";
    select.disabled = Boolean(why);
    for (const segment of segments) segment.setAttribute("aria-pressed", segment.value === value);
    note.textContent = why;
    mark.textContent = other === value ? "" : " •";
    differs.textContent = other === value ? "" : `• pinned: ${worded(name, other)}`;
  }

  // Sliders of the mission.

  #slider(control) {
    const name = nameOf(control);
    const id = `${this.#id}-${this.#fields.size}`;
    const words = `${control.label} [${control.unit}]`;
    const spoken = (kind) => ({"data-key": name, "aria-label": `${words}, ${kind}`});
    const range = make("input", {type: "range", id, ...spoken("slider")});
    const field = make("input", {...NUMBER, class: "value", ...spoken("value")});
    this.#listenRange(range, field, control);
    this.#listenField(field, control);
    for (const input of [range, field]) input.addEventListener("focus", () => this.#hand(name));
    const title = `${control.symbol}: ${control.key} [${control.unit}]`;
    const label = make("label", {for: id, title}, control.label, make("i", {class: "sym"}, control.symbol));
    const unit = make("span", {class: "unit"}, control.unit);
    const row = make("div", {class: "row"}, label, make("span", {class: "number"}, field, unit));
    const [reached, inert, ghost] = ["reached", "inert", "ghost"].map((part) => make("i", {class: part}));
    const track = make("div", {class: "track"}, reached, inert, ghost, range);
    const note = make("div", {class: "note"});
    const element = make("div", {class: "slider"}, row, track, note);
    this.#fields.set(name, {key: control.key, element, inputs: [range, field], note, ghost, control});
    return element;
  }

  #listenRange(range, field, control) {
    range.addEventListener("input", () => {
      field.value = grouped(shown(control, Number(range.value)));
      this.#state(control, Number(range.value));
    });
    range.addEventListener("pointerdown", () => this.#session.hold());
    for (const end of ["pointerup", "pointercancel"]) {
      range.addEventListener(end, () => this.#session.release());
    }
    range.addEventListener("keydown", (event) => {
      if (event.key !== "Tab") this.#session.holdByKey();
      if (!event.shiftKey || !ARROWS[event.key]) return;
      event.preventDefault();
      range.stepUp(LONG_STEP * d3.sum(ARROWS[event.key]));
      range.dispatchEvent(new Event("input"));
    });
  }

  #listenField(field, control) {
    const factor = control.unit === "%" ? 100 : 1;
    field.addEventListener("blur", () => field.ariaInvalid !== "true" && this.fill(false));
    field.addEventListener("input", () => {
      const value = decimal(field.value.trim());
      this.#state(control, typeof value === "number" ? value / factor : value);
    });
  }

  // The control in hand is the one that a sheet of least height shows.
  #hand(name) {
    for (const [own, {element}] of this.#fields) element?.classList.toggle("in-hand", own === name);
  }

  #state(control, value) {
    if (control.axis === null) return this.#session.changeKey(control.key, value);
    const current = this.#session.shown.controls.find(({key}) => key === control.key).whole;
    const whole = [...(this.#session.state.changes[control.key] ?? current)];
    whole[control.axis] = value;
    this.#session.changeKey(control.key, whole, control.axis);
  }

  #fillSlider(control, free) {
    const field = this.#fields.get(nameOf(control));
    const [slider, value] = field.inputs;
    const {idle} = control;
    const range = {low: Math.min(control.low, control.value), high: Math.max(control.high, control.value)};
    Object.assign(slider, {min: range.low, max: range.high, step: control.step});
    slider.setAttribute("aria-valuetext", `${shown(control)} ${control.unit}`);
    if (free(slider)) slider.value = control.value;
    if (free(value)) value.value = written(control);
    field.control = control;
    const {style, classList} = field.element;
    style.setProperty("--at", share(control.value, range));
    style.setProperty("--from", share(idle?.low ?? 0, range));
    style.setProperty("--to", share(idle?.high ?? range.high, range));
    classList.toggle("idle", Boolean(idle));
    field.note.textContent = idle ? stillness(control, idle) : "";
    slider.setAttribute("aria-description", field.note.textContent);
  }

  // A dashed thumb where the pinned plan has another value.
  #compareSliders() {
    const {pinnedAnswer} = this.#session;
    for (const {control, ghost} of this.#fields.values()) {
      if (!control) continue;
      const other = pinnedAnswer?.controls.find((pinned) => nameOf(pinned) === nameOf(control));
      ghost.hidden = !other || other.value === control.value;
      if (other) ghost.style.left = share(other.value, control);
    }
  }

  // Device, laser and the building that is chosen, by numbers, which follow a drag.

  #place(name) {
    const inputs = [0, 1].map((axis) => {
      const input = make("input", {...NUMBER, class: "num", "data-place": `${name}|${axis}`});
      input.addEventListener("input", () => {
        const {key, at} = this.#fields.get(`place ${name}`);
        const stated = [...(this.#session.state.changes[key] ?? at)];
        stated[axis] = decimal(input.value.trim());
        this.#session.changeKey(key, stated);
      });
      return input;
    });
    const element = make("div", {class: "place"}, make("span"), ...inputs);
    this.#fields.set(`place ${name}`, {element, inputs});
    return element;
  }

  #fillPlaces(free) {
    const {shown: {map}, state} = this.#session;
    const keys = {
      device: "link.device_m",
      laser: "laser.position_m",
      roof: `buildings.${state.building}.position_m`,
    };
    for (const [name, key] of Object.entries(keys)) {
      const place = this.#fields.get(`place ${name}`);
      const point = points(map).find((movable) => movable.key === key);
      place.element.hidden = !point;
      Object.assign(place, {key, at: point?.at});
      if (!point) continue;
      place.element.firstChild.textContent = point.name;
      place.inputs.forEach((input, axis) => {
        input.setAttribute("aria-label", `${point.name}, ${"xy"[axis]} [m]`);
        if (free(input)) input.value = point.at[axis];
      });
    }
  }

  // In a lecture some fields stand in a bar of their own, and go back to where they were. A field that
  // is moved loses the focus.
  lend(names, bar) {
    if (names.join() === this.#lent) return;
    this.#lent = names.join();
    for (const field of this.#fields.values()) {
      field.home?.replaceWith(field.element);
      field.home = null;
    }
    for (const name of names) {
      const field = this.#fields.get(name);
      field.home = document.createComment(name);
      field.element.replaceWith(field.home);
      bar.append(field.element);
    }
  }

  // Faults mark their fields.
  mark(keys) {
    for (const {key, inputs, element} of this.#fields.values()) {
      const wrong = keys.has(key);
      for (const input of inputs) input.setAttribute("aria-invalid", wrong);
      element?.classList.toggle("wrong", wrong);
    }
  }

  title(key) {
    const control = this.#session.shown?.controls.find((known) => known.key === key);
    return control?.label.replace(/, \w+ward$/, "") ?? WORDS.titles[key];
  }
}

function nameOf({key, axis}) {
  return `${key}|${axis}`;
}

function worded(name, value) {
  return WORDS.values[value] ?? (value || WORDS.any[name] || value);
}

function options(select, name, values) {
  const all = DEFAULTS[name] ? values : ["", ...values];
  select.replaceChildren(...all.map((value) =>
    make("option", {value, title: WORDS.hints[value] ?? ""}, worded(name, value))));
}

// Why a choice of a question changes nothing.
function fixed({problem, building, trajectory}) {
  const direct = problem === "P3" || trajectory === "direct";
  return {
    problem: building && "the building is chosen",
    trajectory: building ? `by ${building}` : problem === "P3" && "the way is direct",
    building: problem && problem !== "P1" && "not in this question",
    order: direct && !building && "without a rest, none",
  };
}

// A number as a control shows it: a share in percent.
function shown({value, unit}, number = value) {
  return Number(Number(unit === "%" ? 100 * number : number).toPrecision(8));
}

// As a field has it: whole numbers of finer controls with a decimal.
function written(control) {
  const finer = control.step < 1 && control.unit !== "%" && Number.isInteger(control.value);
  return finer ? control.value.toFixed(1) : grouped(shown(control));
}

// Where a number is on a slider.
function share(number, {low, high}) {
  return `${100 * Math.min(1, Math.max(0, (number - low) / (high - low)))}%`;
}

// Over which values a control changes nothing, and why.
function stillness(control, {low, high, words}) {
  const said = (number) => `${grouped(Number(shown(control, number).toPrecision(3)))} ${control.unit}`;
  if (high === null && low <= control.low) return `changes nothing: ${words}`;
  if (high === null) {
    const step = Math.ceil(low / control.step - 1e-9) * control.step;
    return `changes nothing from ${said(step)} up: ${words}`;
  }
  const range = high > control.value ? `up to ${said(high)}` : `down to ${said(Math.ceil(low))}`;
  return `changes nothing ${range}: ${words}`;
}

// Which preset a state is; an empty text if none.
export function presetOf(state, presets) {
  const bare = ({picture, ...asked}) => JSON.stringify(Object.entries({changes: {}, ...brief(asked)}).sort());
  const found = presets.findIndex((preset) => bare(preset.state) === bare(state));
  return found < 0 ? "" : found;
}
