// What the page says: the verdict and its reason, how far a pinned plan differs, and what binds.
import {LIMITS, make, swatch} from "./drawing.js";
import {DEFAULTS} from "./state.js";

const EQUAL = 0.005; // Seconds by which plans are as long

// How a plan ends, by sign and word.
export function outcome({event, good}) {
  return make("b", {class: good ? "flies" : "falls"}, `${good ? "✓" : "✕"} ${event}`);
}

export function sayVerdict(header, session, lecture) {
  const {shown: {verdict, plane}, pinnedAnswer: other} = session;
  const [line, why] = header.querySelectorAll(".verdict, .why");
  header.classList.toggle("good", verdict.good);
  if (other && verdict.promise && other.verdict.promise) return sayDifference(line, why, session);
  const [time, what] = verdict.promise?.split(" of ") ?? [];
  const promise = verdict.promise ? [make("span", {class: "n"}, time), ` of ${what}; `] : [];
  line.replaceChildren(...promise, outcome(verdict), verdict.reason ? `: ${verdict.reason}` : "");
  if (verdict.promise) {
    why.replaceChildren(make("b", {}, verdict.binds), make("span", {class: "route"}, ` ${verdict.route}`));
    return;
  }
  const kept = plane.words ?? "No times of rest and hover keep every limit.";
  why.replaceChildren(lecture ? kept : "Details show which single change would make a plan possible.");
}

// With a pin, how much longer the other plan is, whether it lands, and in what it differs.
function sayDifference(line, why, session) {
  const now = session.shown.verdict;
  const other = session.pinnedAnswer.verdict;
  const trips = !other.hover_s && !now.hover_s;
  const time = trips ? "time_s" : "hover_s";
  line.replaceChildren(
    `The pinned plan ${trips ? "travels" : "hovers"} `,
    make("span", {class: "n"}, than(other[time] - now[time], 2)),
    ", ",
    make("b", {class: other.good ? "flies" : "falls"}, lands(now, other)),
  );
  const names = differences(session).join(" and ");
  const differs = names ? `Differs in ${names}. ` : "Nothing is set otherwise. ";
  why.replaceChildren(make("b", {}, differs), other.rest_s || now.rest_s ? restDiffers(now, other) : "");
}

function than(more, digits) {
  if (Math.abs(more) < EQUAL) return "as long";
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
  const moved = here && there && here !== there ? `, at ${there} in place of ${here}` : "";
  const turned = first(other) && first(other) !== first(now) ? `, and ${first(other)}s first` : "";
  return `It rests ${than(other.rest_s - now.rest_s, 1)}${moved}${turned}.`;
}

// In what the state of the pinned plan differs.
function differences({state, pinned}) {
  const value = (from, name) => from[name] ?? DEFAULTS[name];
  const options = Object.keys(WORDS.titles).filter((name) => value(pinned, name) !== value(state, name));
  const changes = (from) => JSON.stringify(from.changes ?? {});
  const mission = changes(pinned) === changes(state) ? [] : ["the mission"];
  return [...options.map((name) => WORDS.differs[name]), ...mission];
}

// What binds, in words, with the line of each role; and what more would bring.
export function sayBinding(foot, {shown, pinnedAnswer}, details) {
  const separator = make("span", {class: "sep"});
  const worth = make("span", {class: "worth"});
  const parts = (shown.verdict.worth ?? "").split(/([\d.]+ s)(?= of|[,.])/);
  worth.append(...parts.map((words, k) => (k % 2 ? make("b", {}, words) : words)));
  const other = pinnedAnswer && [separator, make("b", {}, "Binds pinned"), ...chips(pinnedAnswer)];
  const rest = other ?? (worth.textContent ? [separator, worth] : []);
  const title = make("b", {}, pinnedAnswer ? "Binds now" : "What binds");
  foot.replaceChildren(title, ...chips(shown), ...rest, details);
}

function chips({constraints, verdict}) {
  const binding = d3.group(constraints.filter(({binds}) => binds), ({role}) => role);
  const roles = LIMITS.filter((role) => role !== "bounds" && binding.has(role));
  if (!roles.length) return [make("span", {}, verdict.promise ? "nothing" : verdict.reason)];
  return roles.map((role) => {
    const words = binding.get(role).map((limit, k) => briefly(limit.words, k, roles.length > 1));
    return make("span", {class: "chip"}, swatch(role), make("span", {}, words.join(", ")));
  });
}

// Words of a limit without what those before it say, or what there is no room for.
function briefly(words, k, several) {
  if (!k && !several) return words.replace("available ", "");
  const well = /^available (well (?:empty|past full))(?: on landing)? /;
  const short = words.replace(well, (_, state) => (k ? "and " : `${state} `));
  return short.replace("at the destination", "at the end");
}
