// The state of the page: what is asked and answered, pinned and locked, and the axes that stand still.
const QUESTION = {problem: "P1", perspective: "available", trajectory: "optimal"};
export const DEFAULTS = {...QUESTION, building: "", order: ""};
const PATIENCE_MS = 15000; // With a question that cannot be given up
const PATIENCE_WHILE_MOVED_MS = 2000; // With one that is given up where another waits
const TELL_MS = 500; // After which it is told that an answer takes time
const STILL_MS = 5000; // And that it takes long
const KEYS_MS = 800; // After the last key, a control is let go
const LONGEST_TRAIL = 7; // The optimum, and the six before it
const ELSEWHERE = 0.004; // Share of the axes by which an optimum has moved

// Values with listeners, as anywidget has them.
export class Model {
  #values;
  #listeners = {};

  constructor(values) {
    this.#values = values;
  }

  get(name) {
    return this.#values[name];
  }

  set(name, value) {
    this.#values[name] = value;
    for (const listener of this.#listeners[`change:${name}`] ?? []) listener();
  }

  on(event, listener) {
    (this.#listeners[event] ??= []).push(listener);
  }
}

// Questions are asked one at a time, the last state always; `view` draws what is answered.
export class Session {
  shown = null; // The last answer that was no fault
  pinnedAnswer = null;
  axes = {plane: null, picture: null, wells: null, map: null}; // Ends of those that are drawn
  locked = false;
  trail = []; // The last optima, all by moves of one control
  last = null; // What was changed last
  #cause = null; // Of the trail
  #view;
  #model;
  #held = false; // Whether a control is moved
  #letGo = null;
  #asked = null; // The question that is open
  #later = null; // What to ask after it
  #number = Date.now() % 1e9; // So that no two answers of a notebook are alike
  #touched = false;
  #kept; // Faults of the address, which are told until something is changed
  #ticking = null;

  constructor(model, view) {
    this.#model = model;
    this.#view = view;
    this.state = {changes: {}, ...model.get("state")};
    this.good = this.state; // The last state that was answered without a fault
    this.pinned = model.get("pinned") ?? null;
    this.#kept = model.get("faults") ?? [];
  }

  start() {
    const answer = this.#model.get("answer");
    this.#model.on("change:answer", () => this.#received(this.#model.get("answer")));
    if (this.pinned) this.#ask("pinned");
    else if (answer?.controls) this.#received(answer);
    else this.#ask("now");
  }

  end() {
    clearInterval(this.#ticking);
    clearTimeout(this.#letGo);
  }

  get stored() {
    return Boolean(this.shown?.stored);
  }

  get waiting() {
    return Boolean(this.#later);
  }

  // Questions and answers.

  #ask(kind, more = {}) {
    const patience = this.#model.give_up ? PATIENCE_WHILE_MOVED_MS : PATIENCE_MS;
    if (this.#asked && performance.now() - this.#asked.moment < patience) {
      this.#later = {kind, more};
      return;
    }
    this.#model.give_up?.();
    const stated = kind === "pinned" ? {...this.pinned, picture: this.state.picture} : this.state;
    const still = this.#held || this.locked || this.pinned;
    const axes = still && this.axes.plane ? {axes: this.axes.plane} : {};
    const number = ++this.#number;
    this.#asked = {kind, stated, ...more, number, moment: performance.now()};
    clearInterval(this.#ticking);
    this.#ticking = setInterval(() => this.#tell(), TELL_MS);
    this.#view.busy(true);
    this.#model.set("state", {...stated, ...axes, ...more, number});
    this.#model.save_changes();
  }

  #askLater() {
    if (!this.#later) return;
    const {kind, more} = this.#later;
    this.#later = null;
    this.#ask(kind, more);
  }

  #tell() {
    this.#askLater();
    const long = performance.now() - this.#asked.moment >= STILL_MS;
    this.#view.busy(true, long ? "still computing …" : "computing …");
  }

  #received(answer) {
    if (!answer || (this.#asked && answer.number !== this.#asked.number)) return;
    const foreign = !this.#asked; // By another view of a notebook, or the notebook itself
    if (foreign) this.state = {changes: {}, ...this.#model.get("state"), axes: []};
    const asked = this.#asked ?? {kind: "now", stated: this.state};
    this.#asked = null;
    clearInterval(this.#ticking);
    this.#view.busy(false);
    if (answer.faults) return this.#refused(asked.kind, answer.faults);
    const before = this.shown;
    if (asked.kind === "pinned") this.pinnedAnswer = answer;
    else this.#accept(answer, asked);
    if (!this.shown) return this.#ask("now");
    const redone = this.settle();
    if (asked.kind === "now") this.#follow(answer, before);
    this.#view.answered(foreign);
    this.#view.told(this.#kept, false);
    if (redone) this.#later ??= {kind: redone, more: {}};
    this.#askLater();
  }

  #accept(answer, {stated, file}) {
    this.shown = answer;
    this.good = stated;
    if (this.#touched) this.link();
    if (file && answer.file) this.#view.save(answer.file);
  }

  #refused(kind, faults) {
    if (kind === "pinned") {
      this.#kept = [{key: "", words: "The pinned plan of the address is left out:"}, ...faults];
      this.pinned = null;
      this.#model.set("pinned", null);
      return this.#ask("now");
    }
    if (!this.shown && JSON.stringify(brief(this.state)) !== JSON.stringify({changes: {}})) {
      const words = "The mission is shown as it is, as what the address states is refused:";
      this.#kept = [...this.#kept, {key: "", words}, ...faults];
      this.state = {changes: {}};
      return this.#ask("now");
    }
    this.#view.told([...this.#kept, ...faults], true);
    this.#askLater();
  }

  // Axes.

  // Sets round axes for both columns, unless a control is moved; returns whose answer has others.
  settle() {
    const both = [this.shown, this.pinnedAnswer].filter(Boolean);
    const windows = both.map(({map}) => map.window);
    const ends = {
      plane: furthest(both.map(({plane}) => plane.round_s)),
      picture: furthest(both.map(({picture}) => picture?.name === this.state.picture && picture?.axes)),
      wells: furthest(both.map(({wells}) => wells?.axes)),
      map: [
        [0, 1].map((k) => d3.min(windows, ([low]) => low[k])),
        [0, 1].map((k) => d3.max(windows, ([, high]) => high[k])),
      ],
    };
    const still = this.#held || this.locked;
    for (const name of Object.keys(ends)) {
      if (!still || !this.axes[name]) this.axes[name] = ends[name] ?? this.axes[name];
    }
    if (this.stored || !this.axes.plane) return null;
    if (this.#endsElsewhere(this.shown)) return "now";
    return this.#endsElsewhere(this.pinnedAnswer) ? "pinned" : null;
  }

  // Ends of the axes of an answer's picture; none while another one is asked for.
  endsOf({picture}) {
    return picture.name === this.state.picture ? this.axes.picture : null;
  }

  // Whether the plane ends elsewhere, or another picture stands in its place.
  #endsElsewhere(answer) {
    const {rest_s, hover_s} = answer?.plane ?? {};
    const picture = answer?.picture?.name ?? null;
    if (answer && picture !== (this.state.picture ?? null)) return true;
    return rest_s && (rest_s[1] !== this.axes.plane[0] || hover_s[1] !== this.axes.plane[1]);
  }

  hold() {
    clearTimeout(this.#letGo);
    this.#held = true;
  }

  holdByKey() {
    this.hold();
    this.#letGo = setTimeout(() => this.release(), KEYS_MS);
  }

  release() {
    if (!this.#held) return;
    clearTimeout(this.#letGo);
    this.#held = false;
    this.resettle();
  }

  resettle() {
    if (!this.shown) return;
    const redone = this.settle();
    this.#view.draw();
    if (redone) this.#ask(redone);
  }

  lock(on) {
    this.locked = on;
    if (!on) this.resettle();
  }

  // Another control begins the trail anew, where the plan was before its move.
  #follow(answer, before) {
    const {best} = answer.plane;
    if (this.#cause !== this.last) {
      this.trail = this.last && before?.plane.best ? [this.#point(before)] : [];
      this.#cause = this.last;
    }
    if (!best || !this.axes.plane) return;
    const was = this.trail.at(-1);
    const far = (k) => Math.abs(was.best[k] - best[k]) > ELSEWHERE * this.axes.plane[k];
    if (was && !far(0) && !far(1)) was.best = best;
    else this.trail.push(this.#point(answer));
    this.trail = this.trail.slice(-LONGEST_TRAIL);
  }

  #point({plane, controls}) {
    const control = controls.find(({key, axis}) => `${key}|${axis}` === this.last);
    return {best: plane.best, from: control && [control.value, control.unit]};
  }

  // Changes. The address has states that were answered alone: a link opens what was seen.

  link() {
    return this.#model.get("link")?.({state: brief(this.good), pinned: this.pinned && brief(this.pinned)});
  }

  change(changes) {
    this.state = {...this.state, ...changes};
    this.#kept = [];
    this.#touched = true;
    this.#ask("now");
  }

  changeKey(key, value, axis = null) {
    this.last = `${key}|${axis}`;
    this.change({changes: {...this.state.changes, [key]: value}});
  }

  // A picture in place of the plane; none for the plane itself.
  open(name) {
    const picture = name === "plane" ? null : name;
    if (picture === (this.state.picture ?? null)) return;
    this.axes.picture = null;
    this.change({picture});
  }

  file(file) {
    this.#ask("now", {file});
  }

  repairs() {
    this.#ask("now", {repairs: true});
  }

  begin(state) {
    this.trail = [];
    this.last = null;
    this.change({...DEFAULTS, building: null, order: null, changes: {}, ...state});
  }

  reset() {
    this.locked = false;
    if (this.pinned) this.#setPin(null, null);
    this.begin({picture: null});
  }

  pin() {
    if (this.pinned) this.#setPin(null, null);
    else this.#setPin({...this.good}, this.shown);
    this.#touched = true;
    this.link();
    this.resettle();
  }

  #setPin(state, answer) {
    this.pinned = state;
    this.pinnedAnswer = answer;
    this.#model.set("pinned", state && brief(state));
  }
}

// The highest of each end, of those that have ends.
function furthest(rows) {
  const known = rows.filter(Boolean);
  return known.length ? d3.transpose(known).map((ends) => d3.max(ends)) : null;
}

// What of a state a link has.
export function brief(state) {
  const {number, file, repairs, axes, ...kept} = state;
  const stated = Object.entries(kept).filter(([name, value]) => value && value !== DEFAULTS[name]);
  return Object.fromEntries(stated);
}
