// Charge in both wells over time, the phases above it, the levels that matter, and the playhead.
import {GRID, NUMBERS, ON_FILL, Picture, STRONG, cased} from "./drawing.js";
import {colour, dots, grouped, shape, steps, wide} from "./drawing.js";

const NARROW_WELLS_PX = 560;
const HEADROOM = 1.1; // Of the axis of the charge, for words above the full battery
const TOP_PX = 8; // Above the phases
const ON_DARK = {...ON_FILL, fill: "on-dark"};
const SPARE_S = 0.5; // Before the deadline, that is told

export function drawWells(draw, {wells, verdict}, {axes, ...look}) {
  const {width, height, size, u} = look;
  const [end, most] = axes ?? wells.axes;
  const strip = 1.55 * size; // Height of the phases
  const top = TOP_PX + strip + 4;
  const rows = d3.transpose([wells.time_s, wells.bound_Ah, wells.total_Ah, wells.upper_Ah])
    .map(([time, bound, total, upper]) => ({time, bound, total, upper}));
  const levels = steps(most, 5, height < 11 * size);
  const lowest = Math.min(0, d3.min(wells.total_Ah));
  const most_y = HEADROOM * most;
  const highest = most_y - ((most_y - lowest) * 1.6 * size) / (height - top - 2.2 * size); // Below the unit
  const rings = verdict.good ? wells.empty_s.filter((time) => time <= end) : [];
  const phases = wells.phases.map(({kind, at, start_s}) =>
    `${kind} ${kind === "flight" ? "to" : "at"} ${at} from ${start_s.toFixed(0)} s`);
  const picture = new Picture(look, {
    margins: [top, 12 * u, 2.2 * size, Math.max(4.3 * size, wide(grouped(most), size) + 8)],
    label: `Charge in both wells over time: ${phases.join("; ")}. ${verdict.text}`,
    x: {domain: [0, end]},
    y: {domain: [lowest, most_y]},
    clip: true,
    marks: [
      Plot.gridY(levels, GRID),
      Plot.axisY(levels.filter((level) => level < highest), NUMBERS),
      charges(wells, rows),
      limits(wells, rows, rings, {end, top, u}),
    ],
  });
  draw.replaceChildren(picture.plot);
  const narrow = width < NARROW_WELLS_PX * u;
  writeUnits(picture, steps(end, 7, narrow), end);
  drawPhases(picture, wells.phases, strip);
  nameAll({picture, wells, rows, rings, end, narrow, last: Math.min(rows.at(-1).time, end)});
  return (moment) => drawPlayhead(picture, moment, strip, moment === wells.dry_s);
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
function limits(wells, rows, rings, {end, top, u}) {
  const {dry_s, overfull_s, deadline_s, full_Ah, least_Ah, holds_s, low} = wells;
  const rule = (mark, at, role, options) => cased(role, u).map((look) => mark([at], {...look, ...options}));
  const over = {insetTop: -4, clip: false};
  const empty = rings.map((time) => [time, rowAt(rows, time).bound]);
  return [
    Plot.line(rows, {x: "time", y: "upper", stroke: colour("rim"), strokeWidth: 1.25 * u}),
    rule(Plot.ruleY, full_Ah, "overfull"),
    cased("charge", u).map((look) => Plot.line(holds_s.map((time) => [time, least_Ah]), look)),
    deadline_s <= end && rule(Plot.ruleX, deadline_s, "deadline", {insetTop: TOP_PX - top, clip: false}),
    Plot.dot(low, {x: "time_s", y: "charge_Ah", r: 5 * u, fill: colour("dry")}),
    Plot.dot(empty, {r: 5 * u, fill: colour("panel"), stroke: colour("dry"), strokeWidth: 2.5 * u}),
    overfull_s !== null && rule(Plot.ruleX, overfull_s, "overfull", over),
    dry_s !== null && rule(Plot.ruleX, dry_s, "dry", over),
  ];
}

// The row that is nearest to a moment.
function rowAt(rows, moment) {
  return rows[d3.bisector((row) => row.time).center(rows, moment)];
}

function writeUnits(picture, hours, end) {
  const {x, top, bottom, size, axis} = picture;
  picture.write({x: x(0) - 5, y: top + 0.7 * size, words: "Ah", anchor: "end", ...axis});
  for (const hour of hours) {
    const words = hour === hours.at(-1) ? `${grouped(hour)} s` : grouped(hour);
    const anchor = hour === end ? "end" : "middle"; // Not beyond the picture
    picture.write({x: x(hour), y: bottom + size + 3, words, anchor, ...axis});
  }
}

function drawPhases(picture, phases, strip) {
  const {plot, x, right, size} = picture;
  const parent = shape(plot, "g", {class: "phases"});
  for (const {kind, at, start_s, end_s} of phases) {
    const left = x(start_s);
    const across = Math.min(x(end_s), right) - left;
    const box = {x: left + 0.5, y: TOP_PX, width: Math.max(1, across - 1), height: strip};
    const bar = shape(parent, "rect", {...box, fill: colour(kind)});
    shape(bar, "title", {}, `${kind} ${at}, ${(end_s - start_s).toFixed(1)} s`);
    const longer = at === kind ? [] : [`${kind} at ${at}`, ...(kind === "hover" ? [at] : [])];
    const choices = kind === "flight" ? [] : [...longer, kind];
    const words = choices.find((choice) => wide(choice, size, 600) < across - 4);
    const middle = {x: left + across / 2, y: TOP_PX + strip / 2 + size * 0.36, anchor: "middle"};
    if (words) picture.write({...middle, parent, words, ...ON_FILL});
  }
}

// Words keep off the lines of moments, the edge of the charge and its rings.
function nameAll(view) {
  const {picture, wells, rows, rings, end} = view;
  const {x, y, top, bottom, u} = picture;
  for (const time of [wells.dry_s, wells.overfull_s, wells.deadline_s]) {
    if (time !== null && time <= end) picture.keep([x(time), (top + bottom) / 2], 7 * u, (bottom - top) / 2);
  }
  for (const time of rings) picture.keep([x(time), y(rowAt(rows, time).bound)], 9 * u, 16 * u);
  nameCut(view);
  nameFull(view);
  picture.avoid(dots(rows.map(({time, upper}) => [x(time), y(upper)])));
  if (wells.dry_s !== null) nameDry(view);
  else if (rings.length) nameEmpty(view);
  if (wells.low.length) nameLow(view);
  nameWells(view);
  nameSpare(view);
}

// What lies beyond the axes: the highest charge, and the end of the plan.
function nameCut({picture, rows, end}) {
  const {x, y, top, right, size, u} = picture;
  const highest = d3.greatest(rows.filter(({time}) => time <= end), ({upper}) => upper);
  if (y(highest.upper) < top - 1) {
    const words = `up to ${grouped(Number(highest.upper.toPrecision(3)))} Ah`;
    picture.beyond([Math.max(x(highest.time), x(0) + 4 * size), y(highest.upper)], words, {fill: "overfull"});
  }
  const {time} = rows.at(-1);
  if (x(time) > right + 1) {
    picture.beyond([x(time), top + 3 * size * u], `until ${grouped(Math.round(time))} s`, {fill: "ink"});
  }
}

// Writes words between two levels of the charge that are so many lines apart, as near to a pixel as it can.
function nameBand({picture, rows}, words, {lower, upper, apart, ...look}, near, until) {
  const {x, y, size} = picture;
  const across = wide(words, size, 600);
  const spots = d3.range(x(0) + 6, x(until) - across, 10).flatMap((left) => {
    const met = [0, 0.5, 1].map((share) => rowAt(rows, x.invert(left + share * across)));
    const [high, low] = [d3.max(met, (row) => y(upper(row))), d3.min(met, (row) => y(lower(row)))];
    const at = {x: left, y: (high + low) / 2 + 0.3 * size, anchor: "start", cost: Math.abs(left - near)};
    return low - high > apart * size ? [at] : [];
  });
  return picture.put([words], spots, {...look, needed: false});
}

// Names of both wells, and the charge that must stay: in the bound well, or else on its line.
function nameWells(view) {
  const {picture, wells: {least, least_Ah, always, holds_s, dry_s}, last, end} = view;
  const {x, y, u, size} = picture;
  const inWell = {lower: ({bound}) => bound, upper: ({upper}) => upper, apart: 2.6, ...ON_DARK};
  const inBound = {lower: () => least_Ah, upper: ({bound}) => bound, apart: 0.8, ...ON_FILL};
  const start = x(0) + 40 * u;
  const well = nameBand(view, "available well", inWell, start, last);
  nameBand(view, "bound well", inBound, well?.x ?? start, last);
  if (least_Ah <= 0) return;
  const when = always ? "at every landing" : "at the end";
  const short = `${least} must remain`;
  const choices = [`${least} of the charge must remain ${when}`, `${short} ${when}`, short];
  const until = dry_s ?? last;
  const near = always ? x(0.45 * end) : x(holds_s[0]);
  for (const words of choices) if (nameBand(view, words, inBound, near, until)) return;
  const level = {y: y(least_Ah) - 6, anchor: always ? "start" : "end"};
  const until_px = x(Math.min(holds_s[1], end));
  const from = always ? x(0) + 6 : until_px;
  const on = d3.range(until_px, x(0) + 6, -20).map((px) => ({...level, x: px, cost: Math.abs(px - from)}));
  const look = {...STRONG, fill: "charge"};
  if (picture.put([short], on, {...look, needed: false})) return;
  const beyond = {x: until_px + 8 * u, y: level.y - 1.25 * size, anchor: "start"};
  picture.put([least, "must remain"], [beyond, ...on], look);
}

// The full battery and the moment past it, where words have room below the phases.
function nameFull({picture, rows, wells: {full_Ah, overfull_s}, end, narrow}) {
  const {x, y, top, size, u} = picture;
  if (y(full_Ah) - top <= size) return;
  const look = {...STRONG, fill: "overfull", needed: false};
  const spot = (px, anchor) => ({x: px, y: y(full_Ah) - 6 * u, anchor, cost: x(end) - px});
  const spots = d3.range(x(end) - 8 * u, x(0), -size).map((px) => spot(px, "end"));
  picture.put(["full"], spots, {...look, symbol: "B"});
  if (overfull_s === null) return;
  for (const words of [`past full from ${overfull_s.toFixed(0)} s`, "past full"].slice(narrow ? 1 : 0)) {
    const beside = spot(x(overfull_s) + 6 * u, "start");
    const ends_s = x.invert(beside.x + wide(words, size, 600));
    const under = rows.filter(({time}) => time >= overfull_s && time <= ends_s);
    const above = Math.min(beside.y, ...under.map(({upper}) => y(upper) - 6 * u));
    if (picture.put([words], [{...beside, y: above}], look)) return;
  }
}

// Where the available well is empty, and why.
function nameDry({picture, wells, rows, narrow}) {
  const {x, y, top, size, u} = picture;
  const {event, reason} = wells;
  const at = x(wells.dry_s);
  const side = at - x(0) > size * 14 ? {x: at - 8 * u, anchor: "end"} : {x: at + 8 * u, anchor: "start"};
  const spot = {...side, y: Math.max(y(wells.full_Ah), top) + 1.7 * size};
  const reach = x.invert(side.x - wide(reason, size));
  const free = side.anchor === "start" || y(rowAt(rows, reach).upper) > spot.y + 1.5 * size;
  picture.put([`✕ ${event}`, ...(narrow || !free ? [] : [reason])], [spot], {fill: "dry", weight: 700});
}

// A plan that flies lands as its available well is empty: above the charge.
function nameEmpty({picture, wells: {deadline_s}, rows, rings, end, narrow}) {
  const {x, y, top, size, u} = picture;
  const long = `empty exactly on landing${rings.length > 1 ? ", twice" : ""}`;
  const words = narrow ? "empty, just landed" : long;
  const half = wide(words, size, 600) / 2;
  const at = Math.min(x(rings.at(-1)), x(Math.min(end, deadline_s)) - half - 6);
  const under = rows.filter(({time}) => Math.abs(x(time) - at) < half);
  const above = y(d3.max(under, ({upper}) => upper) ?? 0) - 10 * u;
  const spot = {x: at, y: Math.max(above, top + size), anchor: "middle"};
  picture.put([words], [spot], {...STRONG, fill: "dry"});
}

// A landing with less than the reserve, the first of several.
function nameLow({picture, wells: {low: [{time_s, charge_Ah, words}]}, narrow}) {
  const {x, y, size, u} = picture;
  const said = narrow ? words.split("; ")[0] : words;
  const starts = x(time_s) + wide(said, size, 600) < picture.right;
  const side = starts ? {x: x(time_s) + 8 * u, anchor: "start"} : {x: x(time_s) - 8 * u, anchor: "end"};
  const spot = {...side, y: y(charge_Ah) - 10 * u};
  picture.put([said], [spot], {...STRONG, fill: "dry"});
}

// The time before the deadline, where no other words are.
function nameSpare({picture, wells: {spare_s, full_Ah, deadline_s}, end, last, narrow}) {
  const {x, y, size, u} = picture;
  if (spare_s < -SPARE_S) return nameLate(picture, -spare_s, x(Math.min(end, deadline_s)));
  if (spare_s <= SPARE_S || deadline_s > end) return;
  const margin = (narrow ? 4 : 10) * u;
  const spot = {x: x(Math.min(end, deadline_s)) - margin, y: y(0.62 * full_Ah), anchor: "end"};
  const choices = [`${spare_s.toFixed(0)} s before the deadline`, `${spare_s.toFixed(0)} s to spare`];
  const words = choices.slice(narrow ? 1 : 0)
    .find((choice) => wide(choice, size) < x(end) - x(last) - 1.5 * margin);
  if (words) picture.put([words], [spot], {fill: "muted", needed: false});
}

// A flight that is too long for the deadline.
function nameLate(picture, late_s, at) {
  const {top, size, u} = picture;
  const spot = {x: at - 8 * u, y: top + 1.7 * size, anchor: "end"};
  picture.put([`✕ ${late_s.toFixed(0)} s after the deadline`], [spot], {...STRONG, fill: "deadline"});
}

// Behind words, so that they are read where it stands.
function drawPlayhead({plot, x, bottom, u}, moment, strip, hidden) {
  d3.select(plot).selectAll(".playhead").remove();
  if (moment === null) return;
  const group = d3.select(plot).insert("g", ":scope > text").attr("class", "playhead").node();
  const at = x(moment);
  const stroke = {stroke: colour("ink"), "stroke-width": 1.5 * u};
  if (!hidden) shape(group, "line", {x1: at, x2: at, y1: 2, y2: bottom, ...stroke});
  const transform = `translate(${at} ${TOP_PX + strip}) scale(${u})`;
  const look = {fill: colour("ink"), stroke: colour("panel")};
  shape(group, "path", {d: "M-7,-2L7,-2L0,9Z", transform, ...look});
}
