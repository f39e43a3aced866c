// The controls: what to start from, the question, the mission's sliders, and places.
import {button, decimal, grouped, make} from "./drawing.js";
import {points} from "./map.js";
import {DEFAULTS, brief} from "./state.js";

let instances = 0;

export function worded(name, value) { return WORDS.values[value] ?? (value || WORDS.any[name] || value); }

// A number as a control shows it: a share in percent.
function shown({value, unit}, number = value) { return unit === "%" ? Number((100 * number).toPrecision(8)) : Number(Number(number).toPrecision(8)); }

// Over which values a control changes nothing, and why.
function stillness(control, {low, high, words}) {
  const said = (number) => `${grouped(Number(shown(control, number).toPrecision(3)))} ${control.unit}`;
  if (high === null && low <= control.low) return `changes nothing: ${words}`;
  if (high === null) return `changes nothing from ${said(Math.ceil(low / control.step - 1e-9) * control.step)} up: ${words}`;
  return `changes nothing ${high > control.value ? `up to ${said(high)}` : `down to ${said(Math.ceil(low))}`}: ${words}`;
}

export class Controls {
  form = make("form", {class: "controls panel", "aria-label": "Question and mission"});
  #session;
  #fields = new Map();
  #sections = {};
  #id = `optuav-${++instances}`;
  constructor(session) {
    this.#session = session;
    this.form.addEventListener("submit", (event) => event.preventDefault());
  }
  get(name) { return this.#fields.get(name)?.element; }
  names() { return [...this.#fields.keys()]; }
  fill(all) {
    const {shown: answer, state} = this.#session;
    if (!this.#fields.size) this.#build(answer);
    const active = all ? null : this.form.getRootNode().activeElement; // Is being changed
    const free = (input) => !this.#session.waiting && active !== input;
    for (const control of answer.controls) this.#fillSlider(control, free);
    const names = ["", ...(answer.options.building ?? [])], building = this.#fields.get("building")?.inputs[0];
    if (building && building.options.length !== names.length) options(building, "building", names);
    for (const name of Object.keys(WORDS.titles)) {
      const [select] = this.#fields.get(name)?.inputs ?? [{}];
      select.value = state[name] ?? DEFAULTS[name];
      select.title = WORDS.hints[select.value] ?? "";
      for (const each of this.#fields.get(name)?.segments ?? []) each.setAttribute("aria-pressed", each.value === select.value);
    }
    if (!answer.stored) this.#fillPlaces(free);
    const problem = state.problem ?? "P1", direct = problem === "P3" || state.trajectory === "direct";
    this.#disable("problem", state.building && "the building is chosen");
    this.#disable("trajectory", state.building ? `by ${state.building}` : problem === "P3" && "the way is direct");
    this.#disable("building", problem !== "P1" && "not in this question");
    this.#disable("order", direct && !state.building && "without a rest, none");
    this.#compare();
    this.#fields.get("start").inputs[0].value = presetOf(state, answer.presets);
  }
  // What changes nothing says why.
  #disable(name, why) {
    const field = this.#fields.get(name);
    if (!field) return;
    field.inputs[0].disabled = Boolean(why);
    field.note.textContent = why || "";
  }
  #fillSlider(control, free) {
    const field = this.#fields.get(`${control.key}|${control.axis}`), [slider, value] = field.inputs, idle = control.idle;
    const low = Math.min(control.low, control.value), high = Math.max(control.high, control.value);
    const share = (number) => `${100 * Math.min(1, Math.max(0, (number - low) / (high - low)))}%`;
    Object.assign(slider, {min: low, max: high, step: control.step});
    slider.setAttribute("aria-valuetext", `${shown(control)} ${control.unit}`);
    if (free(slider)) slider.value = control.value;
    if (free(value)) value.value = control.step < 1 && control.unit !== "%" && Number.isInteger(control.value) ? control.value.toFixed(1) : grouped(shown(control));
    field.control = control;
    field.element.style.setProperty("--at", share(control.value));
    field.element.classList.toggle("idle", Boolean(idle));
    field.element.style.setProperty("--from", share(idle?.low ?? 0));
    field.element.style.setProperty("--to", share(idle?.high ?? high));
    field.note.textContent = idle ? stillness(control, idle) : "";
    slider.setAttribute("aria-description", field.note.textContent);
  }
  // What the pinned plan has else: a mark beside a choice, a dashed thumb on a slider.
  #compare() {
    const {pinned, pinnedAnswer, state} = this.#session;
    for (const name of Object.keys(WORDS.titles)) {
      const field = this.#fields.get(name), other = pinned && (pinned[name] ?? DEFAULTS[name]), differs = pinned && other !== (state[name] ?? DEFAULTS[name]);
      if (!field) continue;
      field.mark.textContent = differs ? " •" : "";
      field.differs.textContent = differs ? `• pinned: ${worded(name, other)}` : "";
    }
    for (const {element, control} of this.#fields.values()) {
      if (!control) continue;
      const ghost = element.querySelector(".ghost");
      const other = pinnedAnswer?.controls.find(({key, axis}) => key === control.key && axis === control.axis);
      ghost.hidden = !other || other.value === control.value;
      if (other) ghost.style.left = `${100 * Math.min(1, Math.max(0, (other.value - control.low) / (control.high - control.low)))}%`;
    }
  }
  #build({options: known, controls, presets, stored}) {
    const section = (name, title) => (this.#sections[name] = make("section", {"data-section": name}, make("h2", {}, title)));
    const start = section("Start", "Start from"), question = section("Question", "Question"), mission = section("Mission", "Mission");
    start.append(this.#starts(presets));
    for (const name of Object.keys(WORDS.titles).filter((each) => known[each])) question.append(this.#choice(name, known[name]));
    for (const control of controls) mission.append(this.#slider(control));
    if (!stored) this.#places(section("Places", "Places, m"));
    const tabs = make("div", {class: "tabs sections", role: "tablist"});
    for (const name of WORDS.sections.filter((each) => this.#sections[each])) tabs.append(button(name, () => this.show(name), {role: "tab", "data-tab": name}));
    this.form.append(tabs, ...Object.values(this.#sections));
    this.show("Mission");
  }
  show(name) {
    for (const [own, element] of Object.entries(this.#sections)) element.classList.toggle("on", own === name);
    for (const tab of this.form.querySelectorAll(".sections [role=tab]")) tab.setAttribute("aria-selected", tab.dataset.tab === name);
  }
  #starts(presets) {
    const select = make("select", {"aria-label": "Start from"});
    select.append(...presets.map(({words}, value) => make("option", {value}, words)), make("option", {value: "", hidden: ""}, "your own"));
    const go = (value) => this.#session.begin(presets[value].state);
    const step = (by) => go((Math.max(0, Number(select.value || 0)) + by + presets.length) % presets.length);
    select.addEventListener("change", () => go(select.value));
    this.#fields.set("start", {inputs: [select]});
    const arrow = (words, label, by) => button(words, () => step(by), {"aria-label": label});
    return make("div", {class: "start"}, arrow("‹", "previous", -1), select, arrow("›", "next", 1));
  }
  #choice(name, values) {
    const select = make("select", {id: `${this.#id}-${name}`}), mark = make("span"), note = make("div", {class: "note"}), differs = make("div", {class: "differs"});
    options(select, name, DEFAULTS[name] ? values : ["", ...values]);
    select.addEventListener("change", () => this.#choose(name, select.value || null));
    const segments = (WORDS.segments[name] ?? []).map((value) => button(worded(name, value), () => this.#choose(name, value), {value, "aria-pressed": "false"}));
    const element = make("div", {class: "choice", "data-name": name}, make("label", {for: select.id}, WORDS.titles[name], mark), select, make("span", {class: "segments", role: "group", "aria-label": `${WORDS.titles[name]}: one of`}, ...segments), note, differs);
    this.#fields.set(name, {key: name, element, inputs: [select], mark, note, differs, segments});
    return element;
  }
  #choose(name, value) {
    const changes = {[name]: value};
    if (name === "building" && value) Object.assign(changes, {trajectory: null, problem: null});
    if (name === "problem") Object.assign(changes, {building: null});
    if (value === "P3") Object.assign(changes, {trajectory: null, order: null});
    if (value === "direct") changes.order = null;
    this.#session.last = name;
    this.#session.change(changes);
  }
  #slider(control) {
    const name = `${control.key}|${control.axis}`, own = `${this.#id}-${this.#fields.size}`, words = `${control.label} [${control.unit}]`;
    const range = make("input", {type: "range", id: own, min: control.low, max: control.high, step: control.step, "aria-label": `${words}, slider`});
    const field = make("input", {type: "text", inputmode: "decimal", class: "value", "aria-label": `${words}, value`, autocomplete: "off"});
    range.dataset.key = field.dataset.key = name;
    const factor = control.unit === "%" ? 100 : 1;
    range.addEventListener("input", () => {
      field.value = grouped(shown(control, Number(range.value)));
      this.#state(control, Number(range.value));
    });
    range.addEventListener("pointerdown", () => this.#session.hold());
    for (const end of ["pointerup", "pointercancel"]) range.addEventListener(end, () => this.#session.release());
    range.addEventListener("keydown", (event) => event.key !== "Tab" && this.#session.holdByKey());
    for (const input of [range, field]) input.addEventListener("focus", () => this.#hand(name));
    field.addEventListener("blur", () => field.ariaInvalid !== "true" && this.fill(false));
    field.addEventListener("input", () => {
      const value = decimal(field.value.trim());
      this.#state(control, typeof value === "number" ? value / factor : value);
    });
    const symbol = make("i", {class: "sym"}, control.symbol), note = make("div", {class: "note"});
    const label = make("label", {for: own, title: `${control.symbol}: ${control.key} [${control.unit}]`}, control.label, symbol);
    const row = make("div", {class: "row"}, label, make("span", {class: "number"}, field, make("span", {class: "unit"}, control.unit)));
    const parts = ["reached", "inert", "ghost"].map((each) => make("i", {class: each}));
    const element = make("div", {class: "slider"}, row, make("div", {class: "track"}, ...parts, range), note);
    this.#fields.set(name, {key: control.key, element, inputs: [range, field], note, control});
    return element;
  }
  // The control in hand is the one that a sheet of least height shows.
  #hand(name) { for (const [own, {element}] of this.#fields) element?.classList.toggle("in-hand", own === name); }
  #state(control, value) {
    if (control.axis === null) return this.#session.changeKey(control.key, value);
    const current = this.#session.shown.controls.find((each) => each.key === control.key).whole;
    const whole = [...(this.#session.state.changes[control.key] ?? current)];
    whole[control.axis] = value;
    this.#session.changeKey(control.key, whole, control.axis);
  }
  // Device, laser and the building that is chosen, by numbers, which follow a drag.
  #places(section) {
    for (const name of ["device", "laser", "roof"]) {
      const element = make("div", {class: "place"}, make("span"));
      const inputs = [0, 1].map((axis) => {
        const input = make("input", {type: "text", inputmode: "decimal", class: "num", "data-place": `${name}|${axis}`, autocomplete: "off"});
        input.addEventListener("input", () => {
          const {key, at} = this.#fields.get(`place ${name}`), stated = [...(this.#session.state.changes[key] ?? at)];
          stated[axis] = decimal(input.value.trim());
          this.#session.changeKey(key, stated);
        });
        return input;
      });
      element.append(...inputs);
      this.#fields.set(`place ${name}`, {element, inputs});
      section.append(element);
    }
    return section;
  }
  #fillPlaces(free) {
    const {shown: {map}, state} = this.#session;
    const keys = {device: "link.device_m", laser: "laser.position_m", roof: `buildings.${state.building}.position_m`};
    for (const [name, key] of Object.entries(keys)) {
      const place = this.#fields.get(`place ${name}`), point = points(map).find((each) => each.key === key);
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
  // In a lecture some fields stand in a bar of their own, and go back to where they were.
  lend(names, bar) {
    for (const {element, home} of this.#fields.values()) if (home) home.replaceWith(element);
    for (const field of this.#fields.values()) field.home = null;
    for (const name of names) {
      const field = this.#fields.get(name);
      field.home = document.createComment(name);
      field.element.replaceWith(field.home);
      bar.append(field.element);
    }
  }
  // Faults mark their fields.
  mark(keys) {
    for (const field of this.#fields.values()) {
      const wrong = keys.has(field.key);
      for (const input of field.inputs) input.setAttribute("aria-invalid", wrong);
      field.element?.classList.toggle("wrong", wrong);
    }
  }
  title(key) {
    return this.#session.shown?.controls.find((each) => each.key === key)?.label.replace(/, \w+ward$/, "") ?? WORDS.titles[key];
  }
}

export function presetOf(state, presets) {
  const bare = (each) => JSON.stringify(Object.entries({changes: {}, ...brief(each)}).sort());
  const found = presets.findIndex((each) => bare(each.state) === bare(state));
  return found < 0 ? "" : found;
}

function options(select, name, values) {
  select.replaceChildren(...values.map((value) => make("option", {value, title: WORDS.hints[value] ?? ""}, worded(name, value))));
}
