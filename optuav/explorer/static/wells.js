// Charge in both wells over time, the phases above it, the levels that matter, and the playhead.
import {casing, colour, grouped, line, picture, place, steps, wide, write} from "./drawing.js";

const NARROW_WELLS_PX = 560;
const HEADROOM = 1.1; // Of the axis of the charge, for words above the full battery

export function drawWells(draw, answer, {axes, size, u}) {
  const width = draw.clientWidth, height = draw.clientHeight, {wells, verdict} = answer;
  if (!wells) return draw.replaceChildren(Object.assign(document.createElement("p"), {textContent: "There is no plan to fly."}));
  const narrow = width < NARROW_WELLS_PX * u, strip = 1.55 * size, top = 8 + strip + 4;
  const [end, most] = axes ?? wells.axes, low = Math.min(0, d3.min(wells.total_As));
  const rows = wells.time_s.map((time, k) => ({
    time, bound: wells.bound_As[k], total: wells.total_As[k], upper: wells.upper_As[k], there: Math.min(wells.bound_As[k], Math.max(0, wells.total_As[k])),
  }));
  const {full_As: full, least_As: least, dry_s: dry, overfull_s: overfull} = wells;
  const rule = (mark, at, role, options = {}) => [casing(role, u), line(role, u)].map((look) => mark([at], {...look, ...options}));
  const after = rows.filter(({time}) => dry !== null && time > dry), late = after.length ? [{time: dry, bound: after[0].bound, total: after[0].bound}, ...after] : [];
  const hours = steps(end, 7, narrow), levels = steps(most, 5, height < 11 * size);
  const plot = picture({
    width, height, size, marginLeft: Math.max(4.3 * size, wide(grouped(most), size) + 8), marginRight: 12 * u, marginTop: top, marginBottom: 2.2 * size,
    label: "Charge in both wells over time: " +
      wells.phases.map(({kind, at, start_s}) => `${kind} ${kind === "flight" ? "to" : "at"} ${at} from ${start_s.toFixed(0)} s`).join("; ") + `. ${verdict.text}`,
    x: {domain: [0, end], axis: null},
    y: {domain: [low, HEADROOM * most], axis: null},
    clip: true,
    marks: [
      Plot.gridY(levels, {stroke: colour("faint"), strokeOpacity: 1}),
      Plot.areaY(rows, {x: "time", y1: 0, y2: "bound", fill: colour("bound")}),
      Plot.areaY(rows, {x: "time", y1: "bound", y2: "upper", fill: colour("available")}),
      late.length > 1 ? Plot.areaY(late, {x: "time", y1: "total", y2: "bound", fill: colour("dry")}) : null,
      Plot.line(rows, {x: "time", y: "upper", stroke: colour("rim"), strokeWidth: 1.25 * u}),
      rule(Plot.ruleY, full, "overfull"),
      rule(Plot.ruleY, least, "charge"),
      wells.deadline_s <= end ? rule(Plot.ruleX, wells.deadline_s, "deadline", {insetTop: -top + 8, clip: false}) : null,
      dry === null && overfull === null && verdict.good ? Plot.dot(wells.empty_s, {
        x: (at) => at, y: (at) => rows[d3.minIndex(rows, ({time}) => Math.abs(time - at))].bound,
        r: 5 * u, fill: colour("panel"), stroke: colour("dry"), strokeWidth: 2.5 * u,
      }) : null,
      overfull === null ? null : rule(Plot.ruleX, overfull, "overfull", {insetTop: -4, clip: false}),
      dry === null ? null : rule(Plot.ruleX, dry, "dry", {insetTop: -4, clip: false}),
    ],
  });
  draw.replaceChildren(plot);
  const x = place(plot, "x"), y = place(plot, "y"), ground = y(low), muted = {size: size - 1, fill: "muted", halo: false};
  for (const value of levels) if (y(value) > y(HEADROOM * most) + 1.6 * size) write(plot, {x: x(0) - 5, y: y(value) + size / 3, words: grouped(value), anchor: "end", ...muted});
  write(plot, {x: x(0) - 5, y: y(HEADROOM * most) + size * 0.7, words: "A s", anchor: "end", ...muted});
  hours.forEach((value, k) => write(plot, {
    x: x(value), y: ground + size + 3, words: k === hours.length - 1 ? `${grouped(value)} s` : grouped(value), anchor: value === end ? "end" : "middle", ...muted,
  }));
  drawPhases(plot, wells.phases, x, strip, size);
  drawWords(plot, answer, {x, y, size, u, narrow, end, rows});
  return (moment) => drawPlayhead(plot, {at: moment === null ? null : x(moment), from: 8 + strip, to: ground, hidden: moment === dry, u});
}

function drawPhases(plot, phases, x, strip, size) {
  const group = d3.select(plot).append("g").attr("class", "phases");
  for (const {kind, at, start_s, end_s} of phases) {
    const left = x(start_s), across = Math.min(x(end_s), x.most ?? Infinity) - left;
    group.append("rect").attr("x", left + 0.5).attr("y", 8).attr("width", Math.max(1, across - 1)).attr("height", strip).attr("fill", colour(kind))
      .append("title").text(`${kind} ${at}, ${(end_s - start_s).toFixed(1)} s`);
    const words = [kind === "rest" ? `rest at ${at}` : kind, kind].find((each) => wide(each, size, 600) < across - 4);
    if (words && kind !== "flight") {
      write(group.node(), {x: left + across / 2, y: 8 + strip / 2 + size * 0.36, words, size, anchor: "middle", weight: 600, fill: "on-fill", halo: false});
    }
  }
}

function drawWords(plot, {wells, verdict}, {x, y, size, u, narrow, end, rows}) {
  const {full_As: full, least_As: least, dry_s: dry, overfull_s: overfull} = wells;
  const last = Math.min(rows.at(-1).time, end), strong = {size, weight: 600}, plain = {...strong, halo: false};
  const row = (time) => rows[d3.bisector((each) => each.time).left(rows, time, 0, rows.length - 1)];
  const room = (from, across, tall) => d3.range(from, x(last) - across, 12).find((px) => [0, 0.5, 1].every((share) => tall(row(x.invert(px + share * across)))));
  const inWell = room(x(0) + 40 * u, wide("available well", size, 600), ({upper, bound}) => y(bound) - y(upper) > 2.2 * size);
  const marks = [dry, overfull].filter((each) => each !== null).map(x);
  const clear = (px, across) => (marks.some((at) => at > px - 8 && at < px + across + 8) ? d3.max(marks.filter((at) => at < px + across + 8)) + 12 : px);
  const left = inWell === undefined ? undefined : clear(inWell, wide("available well", size, 600));
  const narrowest = left === undefined ? null : row(x.invert(left + wide("available well", size, 600)));
  if (narrowest) write(plot, {x: left, y: y((narrowest.bound + narrowest.upper) / 2) + size / 3, words: "available well", fill: "on-dark", ...plain});
  const [across, words] = [wide("bound well", size, 600), [`${wells.least} of the charge must stay`, `${wells.least} must stay`].find((each) => wide(each, size, 600) < 0.4 * x(last)) ?? ""];
  const bound = left ?? clear(x(0) + 40 * u, across), band = y(least) - y(row(x.invert(bound)).bound), high = y(least) - Math.max(1, (band - 0.72 * size) / 2);
  if (band > 0.8 * size) {
    if (bound + across < x(last)) write(plot, {x: bound, y: high, words: "bound well", fill: "on-fill", ...plain});
    const rings = dry === null && verdict.good ? wells.empty_s.map((time) => x(time)) : [], reach = wide(words, size, 600);
    const at = [0.45, 0.3, 0.6, 0].map((share) => Math.max(bound + across + 2 * size, x(share * end)))
      .find((left) => left + reach < x(dry ?? last) && rings.every((ring) => ring < left - 9 * u || ring > left + reach + 9 * u));
    if (words && least > 0 && at) write(plot, {x: at, y: high, words, fill: "on-fill", ...plain});
  } else if (least > 0) {
    const stay = {x: narrowest ? left + wide("available well", size, 600) + 2 * size : x(0) + 6, y: y(least) - 6, words: `${wells.least} must stay`};
    const inside = y(row(x.invert(stay.x + wide(stay.words, size, 600))).upper) < stay.y - size; // Of the available well
    write(plot, {...stay, ...(inside ? {fill: "on-dark", ...plain} : {fill: "charge", ...strong})});
  }
  const over = y(full) - 1.55 * size - 8 > 1.3 * size; // Whether words have room between the phases and a full battery
  if (over) write(plot, {x: x(end) - 8 * u, y: y(full) - 6 * u, words: "full", anchor: "end", fill: "overfull", symbol: "B", ...strong});
  if (overfull !== null && over) {
    const long = `past full from ${overfull.toFixed(0)} s`, fits = x(overfull) + wide(long, size, 600) < x(end) - 4 * size;
    write(plot, {x: x(overfull) + 6 * u, y: y(full) - 6 * u, words: fits && !narrow ? long : "past full", fill: "overfull", ...strong});
  }
  if (dry !== null) {
    const at = x(dry), anchor = at - x(0) > size * 14 ? "end" : "start", dx = (anchor === "end" ? -8 : 8) * u, level = Math.max(y(full), 8 + 1.55 * size) + 1.7 * size;
    write(plot, {x: at + dx, y: level, words: `✕ ${verdict.event}`, size: 1.08 * size, anchor, weight: 700, fill: "dry"});
    const free = anchor === "start" || y(row(x.invert(at + dx - wide(verdict.reason, size))).upper) > level + 1.5 * size;
    if (!narrow && free) write(plot, {x: at + dx, y: level + 1.3 * size, words: verdict.reason, size, anchor, fill: "dry"});
    if (x(last) - at > wide("not there", size, 600) + 16 * u && wells.lacks) write(plot, {x: x(last) - 6, y: y(row(dry).bound) - 6 * u, words: "not there", anchor: "end", fill: "dry", ...strong});
  } else if (verdict.good && wells.empty_s.length) {
    const times = wells.empty_s.length > 1 ? ", twice" : "", words = narrow ? "empty, just landed" : `empty exactly on landing${times}`;
    const half = wide(words, size, 600) / 2, at = Math.min(x(wells.empty_s.at(-1)), x(Math.min(end, wells.deadline_s)) - half - 6);
    const under = rows.filter(({time}) => x(time) > at - half && x(time) < at + half);
    write(plot, {x: at, y: y(d3.max(under, ({upper}) => upper) ?? 0) - 10 * u, words, anchor: "middle", fill: "dry", ...strong});
  }
  const spare = [`${wells.spare_s.toFixed(0)} s before the deadline`, `${wells.spare_s.toFixed(0)} s to spare`].slice(narrow ? 1 : 0);
  const left_s = spare.find((each) => wide(each, size) < x(end) - x(last) - 16 * u);
  if (wells.spare_s > 0.5 && left_s) {
    write(plot, {x: x(Math.min(end, wells.deadline_s)) - 10 * u, y: y(0.62 * full), words: left_s, anchor: "end", size, fill: "muted"});
  }
}

function drawPlayhead(plot, {at, from, to, hidden, u}) {
  d3.select(plot).selectAll(".playhead").remove();
  if (at === null) return;
  const group = d3.select(plot).append("g").attr("class", "playhead");
  if (!hidden) group.append("line").attr("x1", at).attr("x2", at).attr("y1", 2).attr("y2", to).attr("stroke", colour("ink")).attr("stroke-width", 1.5 * u);
  group.append("path").attr("d", "M-7,-2L7,-2L0,9Z").attr("transform", `translate(${at} ${from}) scale(${u})`).attr("fill", colour("ink")).attr("stroke", colour("panel"));
}
