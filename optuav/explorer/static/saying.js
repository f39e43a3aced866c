// What the page says: the verdict and its reason, how far a pinned plan differs, what binds, and tables.
import {button, formula, line, make} from "./drawing.js";
import {brief} from "./state.js";

const LIMITS = ["charge", "deadline", "dry", "overfull"];
const SYMBOLIC = ["as stated", "value"]; // Columns of formulas
const EQUAL = 0.005; // Seconds by which plans are as long

// How a plan ends, by sign and word.
export function outcome({event, good}) {
  return make("b", {class: good ? "flies" : "falls"}, `${good ? "✓" : "✕"} ${event}`);
}

export function sayVerdict(header, session, lecture) {
  const {shown: {verdict, plane, stored}, pinned} = session;
  const [says, why] = header.querySelectorAll(".verdict, .why");
  header.classList.toggle("good", verdict.good);
  if (verdict.promise && pinned?.answer?.verdict.promise) return sayDifference(says, why, session);
  const [time, what] = verdict.promise?.split(" of ") ?? [];
  const promise = verdict.promise ? [make("span", {class: "n"}, time), ` of ${what}; `] : [];
  says.title = verdict.text; // Where there is no room for all
  says.replaceChildren(...promise, outcome(verdict), verdict.reason ? `: ${verdict.reason}` : "");
  const kept = plane.words ?? "No combination of rest and hover times meets every limit.";
  const told = lecture || stored ? kept : "Details show which single change would make a plan possible.";
  const binds = [make("b", {}, verdict.binds), make("span", {class: "route"}, ` ${verdict.route}`)];
  why.replaceChildren(...(verdict.promise ? binds : [told]));
}

// With a pin, how much longer the other plan is, whether it lands, and in what it differs.
function sayDifference(says, why, session) {
  const [now, other] = [session.shown.verdict, session.pinned.answer.verdict];
  const trips = !other.hover_s && !now.hover_s;
  const time = trips ? "time_s" : "hover_s";
  says.replaceChildren(
    `The pinned plan ${trips ? "travels" : "hovers"} `,
    make("span", {class: "n"}, than(other[time] - now[time], 2)),
    ", ",
    make("b", {class: other.good ? "flies" : "falls"}, lands(now, other)),
  );
  const names = differences(session).join(" and ");
  const differs = names ? `Differs in ${names}. ` : "The settings are the same. ";
  why.replaceChildren(make("b", {}, differs), other.rest_s || now.rest_s ? restDiffers(now, other) : "");
}

function than(more, digits) {
  if (Math.abs(more) < EQUAL) return "just as long";
  return `${Math.abs(more).toFixed(digits)} s ${more > 0 ? "more" : "less"}`;
}

function lands(now, other) {
  if (other.good === now.good) return now.good ? "and both land" : "and neither can be flown";
  return other.good ? "and it lands" : "and it cannot be flown";
}

function restDiffers(now, other) {
  const roof = ({stops}) => stops.find(([kind]) => kind === "rest")?.[1] ?? "";
  const first = ({stops}) => stops[0]?.[0];
  const [here, there] = [roof(now), roof(other)];
  const moved = here && there && here !== there ? `, at ${there} instead of ${here}` : "";
  const turned = first(other) && first(other) !== first(now) ? `, and ${first(other)}s first` : "";
  return `It rests ${than(other.rest_s - now.rest_s, 1)}${moved}${turned}.`;
}

// In what the state of the pinned plan differs.
function differences({now, pinned}) {
  const [here, there] = [now.state, pinned.state].map((state) => ({changes: {}, ...brief(state)}));
  const differs = (name) => JSON.stringify(here[name]) !== JSON.stringify(there[name]);
  return Object.keys(WORDS.differs).filter(differs).map((name) => WORDS.differs[name]);
}

// What binds, in words, with the line of each role; and what more would bring, or what binds a pinned plan.
export function sayBinding(binding, {shown, pinned}) {
  const separator = make("span", {class: "sep"});
  const parts = (shown.verdict.worth ?? "").split(/([\d.]+ s)(?= of|[,.])/);
  const worth = parts.map((words, k) => (k % 2 ? make("b", {}, words) : words));
  const other = pinned?.answer;
  const more = [make("span", {class: "worth"}, ...worth)];
  const title = make("b", {}, other ? "Binds now" : "What binds");
  const beside = other ? [separator, make("b", {}, "Binds pinned"), ...chips(other)] : more;
  binding.replaceChildren(title, ...chips(shown), ...(other || shown.verdict.worth ? beside : []));
}

function chips({binding, verdict}) {
  const byRole = d3.group(binding, ({role}) => role);
  const roles = LIMITS.filter((role) => byRole.has(role));
  if (!roles.length) return [make("span", {}, verdict.promise ? "nothing" : verdict.reason)];
  return roles.map((role) => {
    const words = byRole.get(role).map((limit, k) => briefly(limit.words, k, roles.length > 1));
    return make("span", {class: "chip"}, swatch(role), make("span", {}, words.join(", ")));
  });
}

// The line of a role as a small picture.
function swatch(role) {
  const mark = Plot.ruleY([0], {...line(role), ariaHidden: "true"});
  return Plot.plot({width: 30, height: 10, margin: 2, axis: null, marks: [mark]});
}

// Words of a limit without what those before it say, or what there is no room for.
function briefly(words, k, several) {
  if (!k && !several) return words.replace("available ", "");
  const well = /^available (well (?:empty|past full))(?: on landing)? /;
  const short = words.replace(well, (_, state) => (k ? "and " : `${state} `));
  return short.replace("at the destination", "at the end");
}

// Tables below the screen, and above the reasons for no plan a button that asks for repairs.
export function tables({tables: all, repairable}, askRepairs) {
  const asked = repairable ? [button("Which change would make a plan possible?", askRepairs)] : [];
  return [...asked, ...all.map(folded)];
}

function folded({title, heads = [], rows = [], note = "", lines = []}) {
  const symbols = new Set(heads.flatMap((name, k) => (SYMBOLIC.includes(name) ? [k] : [])));
  const words = (cell, k) => (symbols.has(k) ? formula(cell) : [cell]);
  const cells = (tag) => (row) => make("tr", {}, ...row.map((cell, k) => make(tag, {}, ...words(cell, k))));
  const head = heads.length ? [heads].map(cells("th")) : [];
  const label = heads.filter(Boolean).join(", ") || "facts";
  const scrolls = {class: "scrolls", tabindex: 0, role: "group", "aria-label": label};
  const table = make("div", scrolls, make("table", {}, ...head, ...rows.map(cells("td"))));
  const list = make("ul", {}, ...lines.map((text) => make("li", {}, text)));
  const parts = [...(rows.length ? [table] : []), note, ...(lines.length ? [list] : [])];
  return make("details", {open: ""}, make("summary", {}, ...formula(title)), ...parts);
}
