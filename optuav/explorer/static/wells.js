// Charge in both wells over time, the phases above it, the levels that matter, and the playhead.
import {GRID, NUMBERS, cased, colour, explain, grouped, picture} from "./drawing.js";
import {place, shape, steps, wide, write} from "./drawing.js";

const NARROW_WELLS_PX = 560;
const HEADROOM = 1.1; // Of the axis of the charge, for words above the full battery
const TOP_PX = 8; // Above the phases
const STRONG = {weight: 600};
const ON_FILL = {...STRONG, halo: false};

export function drawWells(draw, answer, {axes, size, u}) {
  const {wells} = answer;
  if (!wells) return explain(draw, "There is no plan to fly.");
  const [width, height] = [draw.clientWidth, draw.clientHeight];
  const narrow = width < NARROW_WELLS_PX * u;
  const [end, most] = axes ?? wells.axes;
  const strip = 1.55 * size; // Height of the phases
  const top = TOP_PX + strip + 4;
  const rows = d3.transpose([wells.time_s, wells.bound_As, wells.total_As, wells.upper_As])
    .map(([time, bound, total, upper]) => ({time, bound, total, upper}));
  const low = Math.min(0, d3.min(wells.total_As));
  const levels = steps(most, 5, height < 11 * size);
  const highest = HEADROOM * most * (1 - (1.6 * size) / (height - top - 2.2 * size)); // Below the unit
  const plot = picture({
    width,
    height,
    size,
    marginLeft: Math.max(4.3 * size, wide(grouped(most), size) + 8),
    marginRight: 12 * u,
    marginTop: top,
    marginBottom: 2.2 * size,
    label: wellsWords(answer),
    x: {domain: [0, end], axis: null},
    y: {domain: [low, HEADROOM * most], axis: null},
    clip: true,
    marks: [
      Plot.gridY(levels, GRID),
      Plot.axisY(levels.filter((level) => level < highest), NUMBERS),
      charges(wells, rows),
      limits(answer, rows, {end, top, u}),
    ],
  });
  draw.replaceChildren(plot);
  const [x, y] = [place(plot, "x"), place(plot, "y")];
  const view = {plot, x, y, size, u, narrow, end, rows, strip, last: Math.min(rows.at(-1).time, end)};
  writeUnits(view, steps(end, 7, narrow), top, y(low));
  drawPhases(view, wells.phases);
  nameAll(view, answer);
  return (moment) => drawPlayhead(view, moment, y(low), moment === wells.dry_s);
}

function wellsWords({wells, verdict}) {
  const phases = wells.phases.map(({kind, at, start_s}) =>
    `${kind} ${kind === "flight" ? "to" : "at"} ${at} from ${start_s.toFixed(0)} s`);
  return `Charge in both wells over time: ${phases.join("; ")}. ${verdict.text}`;
}

// Both wells; and what the available one lacks once it is empty.
function charges({dry_s: dry}, rows) {
  const after = rows.filter(({time}) => dry !== null && time > dry);
  const late = after.length ? [{time: dry, bound: after[0].bound, total: after[0].bound}, ...after] : [];
  return [
    Plot.areaY(rows, {x: "time", y1: 0, y2: "bound", fill: colour("bound")}),
    Plot.areaY(rows, {x: "time", y1: "bound", y2: "upper", fill: colour("available")}),
    late.length > 1 && Plot.areaY(late, {x: "time", y1: "total", y2: "bound", fill: colour("dry")}),
  ];
}

// Levels and moments that matter, and rings where the available well is just empty.
function limits({wells, verdict}, rows, {end, top, u}) {
  const {dry_s: dry, overfull_s: overfull, deadline_s: deadline} = wells;
  const rule = (mark, at, role, options) => cased(role, u).map((look) => mark([at], {...look, ...options}));
  const over = {insetTop: -4, clip: false};
  const empty = wells.empty_s.map((time) => [time, nearest(rows, time).bound]);
  const rings = {r: 5 * u, fill: colour("panel"), stroke: colour("dry"), strokeWidth: 2.5 * u};
  return [
    Plot.line(rows, {x: "time", y: "upper", stroke: colour("rim"), strokeWidth: 1.25 * u}),
    rule(Plot.ruleY, wells.full_As, "overfull"),
    rule(Plot.ruleY, wells.least_As, "charge"),
    deadline <= end && rule(Plot.ruleX, deadline, "deadline", {insetTop: TOP_PX - top, clip: false}),
    dry === null && overfull === null && verdict.good && Plot.dot(empty, rings),
    overfull !== null && rule(Plot.ruleX, overfull, "overfull", over),
    dry !== null && rule(Plot.ruleX, dry, "dry", over),
  ];
}

function nearest(rows, moment) {
  return d3.least(rows, ({time}) => Math.abs(time - moment));
}

function writeUnits({plot, x, size, end}, hours, top, ground) {
  const muted = {size: size - 1, fill: "muted", halo: false};
  write(plot, {x: x(0) - 5, y: top + 0.7 * size, words: "A s", anchor: "end", ...muted});
  for (const hour of hours) {
    const words = hour === hours.at(-1) ? `${grouped(hour)} s` : grouped(hour);
    const anchor = hour === end ? "end" : "middle"; // Not beyond the picture
    write(plot, {x: x(hour), y: ground + size + 3, words, anchor, ...muted});
  }
}

function drawPhases({plot, x, size, strip}, phases) {
  const group = shape(plot, "g", {class: "phases"});
  for (const {kind, at, start_s, end_s} of phases) {
    const left = x(start_s);
    const across = Math.min(x(end_s), x.most) - left;
    const box = {x: left + 0.5, y: TOP_PX, width: Math.max(1, across - 1), height: strip};
    const bar = shape(group, "rect", {...box, fill: colour(kind)});
    shape(bar, "title", {}, `${kind} ${at}, ${(end_s - start_s).toFixed(1)} s`);
    const choices = kind === "flight" ? [] : [kind === "rest" ? `rest at ${at}` : kind, kind];
    const words = choices.find((choice) => wide(choice, size, 600) < across - 4);
    if (!words) continue;
    const middle = {x: left + across / 2, y: TOP_PX + strip / 2 + size * 0.36, anchor: "middle"};
    write(group, {...middle, words, size, fill: "on-fill", ...ON_FILL});
  }
}

function nameAll(view, answer) {
  const {wells, verdict} = answer;
  nameWells(view, answer);
  nameFull(view, wells);
  if (wells.dry_s !== null) nameDry(view, wells, verdict);
  else if (verdict.good && wells.empty_s.length) nameEmpty(view, wells);
  nameSpare(view, wells);
}

// The row at a moment, or the first after it.
function rowAt({rows}, time) {
  return rows[d3.bisector((row) => row.time).left(rows, time, 0, rows.length - 1)];
}

// The first place from a pixel on where a stretch lies in the available well.
function roomInWell({x, y, last, size, ...view}, from, across) {
  const tall = ({upper, bound}) => y(bound) - y(upper) > 2.2 * size;
  const holds = (px) => [0, 0.5, 1].every((share) => tall(rowAt(view, x.invert(px + share * across))));
  return d3.range(from, x(last) - across, 12).find(holds);
}

// The place itself, or the first behind the lines at which the plan falls or overfills.
function behindLines({x}, {dry_s, overfull_s}, px, across) {
  const lines = [dry_s, overfull_s].filter((time) => time !== null).map(x);
  const met = lines.some((at) => at > px - 8 && at < px + across + 8);
  return met ? d3.max(lines.filter((at) => at < px + across + 8)) + 12 : px;
}

// Names of both wells, and the charge that must stay.
function nameWells(view, answer) {
  const {plot, x, y, size, u} = view;
  const {wells} = answer;
  const across = wide("available well", size, 600);
  const room = roomInWell(view, x(0) + 40 * u, across);
  const left = room === undefined ? null : behindLines(view, wells, room, across);
  if (left !== null) {
    const {bound, upper} = rowAt(view, x.invert(left + across));
    const middle = y((bound + upper) / 2) + size / 3;
    write(plot, {x: left, y: middle, words: "available well", size, fill: "on-dark", ...ON_FILL});
  }
  const start = left ?? behindLines(view, wells, x(0) + 40 * u, wide("bound well", size, 600));
  const band = y(wells.least_As) - y(rowAt(view, x.invert(start)).bound);
  if (band > 0.8 * size) nameInBand(view, answer, start, band);
  else if (wells.least_As > 0) nameStay(view, wells, left === null ? x(0) + 6 : left + across + 2 * size);
}

// Where the bound well is high enough, its name and the charge that must stay are in it.
function nameInBand({plot, x, y, size, u, end, last}, {wells, verdict}, start, band) {
  const middle = y(wells.least_As) - Math.max(1, (band - 0.72 * size) / 2);
  const inside = {y: middle, size, fill: "on-fill", ...ON_FILL};
  const behind = start + wide("bound well", size, 600);
  if (behind < x(last)) write(plot, {x: start, words: "bound well", ...inside});
  const choices = [`${wells.least} of the charge must stay`, `${wells.least} must stay`];
  const words = choices.find((choice) => wide(choice, size, 600) < 0.4 * x(last));
  if (!words || wells.least_As <= 0) return;
  const across = wide(words, size, 600);
  const rings = wells.dry_s === null && verdict.good ? wells.empty_s.map(x) : [];
  const clear = (left) => rings.every((ring) => ring < left - 9 * u || ring > left + across + 9 * u);
  const at = [0.45, 0.3, 0.6, 0]
    .map((share) => Math.max(behind + 2 * size, x(share * end)))
    .find((left) => left + across < x(wells.dry_s ?? last) && clear(left));
  if (at) write(plot, {x: at, words, ...inside});
}

// Else the charge that must stay is named on its line.
function nameStay(view, wells, left) {
  const {plot, x, y, size} = view;
  const words = `${wells.least} must stay`;
  const level = y(wells.least_As) - 6;
  const inside = y(rowAt(view, x.invert(left + wide(words, size, 600))).upper) < level - size;
  const look = inside ? {fill: "on-dark", ...ON_FILL} : {fill: "charge", ...STRONG};
  write(plot, {x: left, y: level, words, size, ...look});
}

// The full battery and the moment past it, where words have room below the phases.
function nameFull({plot, x, y, size, u, narrow, end, strip}, {full_As, overfull_s}) {
  if (y(full_As) - strip - TOP_PX <= 1.3 * size) return;
  const above = {y: y(full_As) - 6 * u, size, fill: "overfull", ...STRONG};
  write(plot, {x: x(end) - 8 * u, words: "full", anchor: "end", symbol: "B", ...above});
  if (overfull_s === null) return;
  const long = `past full from ${overfull_s.toFixed(0)} s`;
  const fits = !narrow && x(overfull_s) + wide(long, size, 600) < x(end) - 4 * size;
  write(plot, {x: x(overfull_s) + 6 * u, words: fits ? long : "past full", ...above});
}

// Where the available well is empty, and why; and the charge that is not there.
function nameDry(view, wells, verdict) {
  const {plot, x, y, size, u, narrow, strip, last} = view;
  const at = x(wells.dry_s);
  const before = at - x(0) > size * 14;
  const beside = {x: at + (before ? -8 : 8) * u, anchor: before ? "end" : "start", fill: "dry"};
  const level = Math.max(y(wells.full_As), TOP_PX + strip) + 1.7 * size;
  write(plot, {...beside, y: level, words: `✕ ${verdict.event}`, size: 1.08 * size, weight: 700});
  const reach = x.invert(beside.x - wide(verdict.reason, size));
  const free = !before || y(rowAt(view, reach).upper) > level + 1.5 * size;
  if (!narrow && free) write(plot, {...beside, y: level + 1.3 * size, words: verdict.reason, size});
  if (!wells.lacks || x(last) - at <= wide("not there", size, 600) + 16 * u) return;
  const above = y(rowAt(view, wells.dry_s).bound) - 6 * u;
  write(plot, {x: x(last) - 6, y: above, words: "not there", size, anchor: "end", fill: "dry", ...STRONG});
}

// A plan that flies lands as its available well is empty: above the charge.
function nameEmpty({plot, x, y, size, u, narrow, end, rows}, {empty_s, deadline_s}) {
  const long = `empty exactly on landing${empty_s.length > 1 ? ", twice" : ""}`;
  const words = narrow ? "empty, just landed" : long;
  const half = wide(words, size, 600) / 2;
  const at = Math.min(x(empty_s.at(-1)), x(Math.min(end, deadline_s)) - half - 6);
  const under = rows.filter(({time}) => x(time) > at - half && x(time) < at + half);
  const level = y(d3.max(under, ({upper}) => upper) ?? 0) - 10 * u;
  write(plot, {x: at, y: level, words, size, anchor: "middle", fill: "dry", ...STRONG});
}

function nameSpare({plot, x, y, size, u, narrow, end, last}, {spare_s, full_As, deadline_s}) {
  const choices = [`${spare_s.toFixed(0)} s before the deadline`, `${spare_s.toFixed(0)} s to spare`];
  const margin = (narrow ? 4 : 10) * u;
  const room = x(end) - x(last) - 1.5 * margin;
  const words = choices.slice(narrow ? 1 : 0).find((choice) => wide(choice, size) < room);
  const low = y(0) - y(full_As) < 6 * size; // Too low for words beside those on the charge
  if (spare_s <= 0.5 || !words || low) return;
  const left = x(Math.min(end, deadline_s)) - margin;
  write(plot, {x: left, y: y(0.62 * full_As), words, anchor: "end", size, fill: "muted"});
}

function drawPlayhead({plot, x, u, strip}, moment, ground, hidden) {
  d3.select(plot).selectAll(".playhead").remove();
  if (moment === null) return;
  const at = x(moment);
  const group = shape(plot, "g", {class: "playhead"});
  const stroke = {stroke: colour("ink"), "stroke-width": 1.5 * u};
  if (!hidden) shape(group, "line", {x1: at, x2: at, y1: 2, y2: ground, ...stroke});
  const transform = `translate(${at} ${TOP_PX + strip}) scale(${u})`;
  const look = {fill: colour("ink"), stroke: colour("panel")};
  shape(group, "path", {d: "M-7,-2L7,-2L0,9Z", transform, ...look});
}
