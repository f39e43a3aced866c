// What is asked and answered, pinned and locked, and the axes that stand still.
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
  #heard = d3.dispatch("change:answer");
  #values;

  constructor(entries) {
    this.#values = new Map(entries);
  }

  get(name) {
    return this.#values.get(name);
  }

  set(name, value) {
    this.#values.set(name, value);
    if (name === "answer") this.#heard.call("change:answer");
  }

  on(event, listener) {
    this.#heard.on(event, listener);
  }
}

// Questions are asked one at a time, the last state always; `view` draws what is answered.
// A plan has its state, the state that was asked, its answer, and the good state that was answered.
export class Session {
  now;
  pinned = null;
  axes = {}; // Ends of those that are drawn: plane, wells, map, and pictures by name
  locked = false;
  trail = []; // The last optima, all by moves of one control
  last = null; // What was changed last
  #cause = null; // Of the trail
  #view;
  #model;
  #held = false; // Whether a control is moved
  #letGo = null;
  #open = null; // The question that is not answered yet
  #number = Date.now() % 1e9; // So that no two answers of a notebook are alike
  #touched = false;
  #kept; // Faults of the address, which are told until something is changed
  #ticking = null;

  constructor(model, view) {
    this.#model = model;
    this.#view = view;
    this.now = {state: {changes: {}, ...model.get("state")}};
    if (model.get("pinned")) this.pinned = {state: model.get("pinned")};
    this.#kept = model.get("faults") ?? [];
  }

  start() {
    const answer = this.#model.get("answer");
    this.#model.on("change:answer", () => this.#received(this.#model.get("answer")));
    if (answer?.controls && !this.pinned) this.#received(answer);
    else this.#ask();
  }

  end() {
    clearInterval(this.#ticking);
    clearTimeout(this.#letGo);
  }

  get shown() {
    return this.now.answer;
  }

  get stored() {
    return Boolean(this.shown?.stored);
  }

  // Whether the state has changed since the question that is shown.
  get waiting() {
    return this.now.state !== this.now.good;
  }

  // Questions and answers.

  #ask() {
    const order = this.pinned?.answer ? [this.now, this.pinned] : [this.pinned, this.now];
    const plan = order.find((each) => each && this.#stale(each));
    const patience = this.#model.give_up ? PATIENCE_WHILE_MOVED_MS : PATIENCE_MS;
    if (!plan || (this.#open && performance.now() - this.#open.moment < patience)) return;
    this.#model.give_up?.();
    const still = this.#held || this.locked || this.pinned;
    const axes = still && this.axes.plane ? {axes: this.axes.plane} : {};
    const number = ++this.#number;
    this.#open = {plan, state: plan.state, number, moment: performance.now()};
    Object.assign(plan, {asked: plan.state, refused: false});
    clearInterval(this.#ticking);
    this.#ticking = setInterval(() => this.#tell(), TELL_MS);
    this.#view.busy(true);
    this.#model.set("state", {...plan.state, picture: this.now.state.picture, ...axes, number});
    this.#model.save_changes();
  }

  #stale(plan) {
    if (plan.asked !== plan.state) return true;
    return this.#open?.plan !== plan && !plan.refused && this.#endsElsewhere(plan.answer);
  }

  #tell() {
    this.#ask();
    const long = performance.now() - this.#open.moment >= STILL_MS;
    this.#view.busy(true, long ? "still computing …" : "computing …");
  }

  #received(answer) {
    if (!answer || (this.#open && answer.number !== this.#open.number)) return;
    const foreign = !this.#open; // By another view of a notebook, or the notebook itself
    if (foreign) this.now.asked = this.now.state = {changes: {}, ...brief(this.#model.get("state"))};
    const {plan, state} = this.#open ?? {plan: this.now, state: this.now.state};
    this.#open = null;
    clearInterval(this.#ticking);
    this.#view.busy(false);
    if (answer.faults) this.#refused(plan, answer.faults);
    else this.#accept(plan, state, answer, foreign);
    this.#ask();
  }

  #accept(plan, state, answer, foreign) {
    const before = this.shown;
    Object.assign(plan, {answer, good: state});
    if (!this.shown) return;
    this.#settle();
    if (plan === this.now) this.#follow(answer, before);
    if (plan === this.now && this.#touched) this.link();
    this.#view.answered(foreign);
    this.#view.told(this.#kept, false);
    if (state.file && answer.file) this.#view.save(answer.file);
    state.file = null;
  }

  #refused(plan, faults) {
    plan.refused = true;
    if (plan === this.pinned) {
      this.#kept = [{key: "", words: "The pinned plan in the address was ignored:"}, ...faults];
      this.#setPin(null);
    } else if (!this.shown && JSON.stringify(brief(plan.state)) !== JSON.stringify({changes: {}})) {
      const words = "The address has invalid values, so the mission is shown unchanged:";
      this.#kept = [...this.#kept, {key: "", words}, ...faults];
      plan.state = {changes: {}};
    } else {
      this.#view.told([...this.#kept, ...faults], true);
    }
  }

  // Axes.

  // Sets round axes for both columns, unless a control is moved.
  #settle() {
    const both = [this.now.answer, this.pinned?.answer].filter(Boolean);
    const windows = both.map(({map}) => map.window);
    const {picture: opened} = this.now.state;
    const ends = {
      plane: furthest(both.map(({plane}) => plane.round_s)),
      [opened]: furthest(both.map(({picture}) => picture?.name === opened && picture?.axes)),
      wells: furthest(both.map(({wells}) => wells?.axes)),
      map: [d3.min, d3.max].map((end, k) => [0, 1].map((axis) => end(windows, (each) => each[k][axis]))),
    };
    const still = this.#held || this.locked;
    for (const name of Object.keys(ends)) {
      if (!still || !this.axes[name]) this.axes[name] = ends[name] ?? this.axes[name];
    }
  }

  // Whether the plane ends elsewhere, or another picture stands in its place.
  #endsElsewhere(answer) {
    if (!answer) return true;
    if (this.stored || !this.axes.plane) return false;
    if ((answer.picture?.name ?? null) !== (this.now.state.picture ?? null)) return true;
    const {rest_s, hover_s} = answer.plane;
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
    clearTimeout(this.#letGo);
    if (this.#held) this.#resettle();
  }

  #resettle() {
    this.#held = false;
    if (!this.shown) return;
    this.#settle();
    this.#view.draw();
    this.#ask();
  }

  lock(on) {
    this.locked = on;
    if (!on) this.#resettle();
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
    return {best: plane.best, from: control && [control.value / control.scale, control.unit]};
  }

  // Changes. The address has states that were answered without a fault: a link opens what was seen.

  link() {
    const pinned = this.pinned && brief(this.pinned.state);
    return this.#model.get("link")?.({state: brief(this.now.good), pinned});
  }

  change(changes) {
    this.now.state = {...this.now.state, file: null, repairs: false, ...changes};
    this.#kept = [];
    this.#touched = true;
    this.#ask();
  }

  changeKey(key, value, axis = null) {
    this.last = `${key}|${axis}`;
    this.change({changes: {...this.now.state.changes, [key]: value}});
  }

  // A picture in place of the plane; none for the plane itself.
  open(name) {
    const picture = name === "plane" ? null : name;
    if (picture !== (this.now.state.picture ?? null)) this.change({picture});
  }

  begin(state) {
    this.trail = [];
    this.last = null;
    this.change({...DEFAULTS, building: null, order: null, changes: {}, ...state});
  }

  reset() {
    this.locked = false;
    if (this.pinned) this.#setPin(null);
    this.begin({picture: null});
  }

  pin() {
    const {good} = this.now;
    this.#setPin(this.pinned ? null : {...this.now, state: good, asked: good});
    this.#touched = true;
    this.link();
    this.#resettle();
  }

  #setPin(plan) {
    this.pinned = plan;
    this.#model.set("pinned", plan && brief(plan.state));
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
