// Tables below the screen: why there is no plan, limits, worth, and the proof.
import {button, make} from "./drawing.js";

export function tables(answer, askRepairs) {
  const parts = [...reasons(answer, askRepairs)];
  if (answer.constraints.length) parts.push(limitTable(answer.constraints));
  if (answer.prices.length) parts.push(worthTable(answer));
  parts.push(folded("Question, answer and proof", table(["", ""], answer.facts)));
  return parts;
}

function reasons({reasons: words, repairs, stored}, askRepairs) {
  if (!words.length) return [];
  const why = folded("Why there is no plan", list(words));
  if (repairs.length) return [why, folded("Feasible if", table(["change", ""], repairs))];
  return stored ? [why] : [why, button("What would make it feasible?", askRepairs)];
}

function limitTable(constraints) {
  const rows = constraints.map((limit) =>
    [limit.words, limit.label, limit.statement, limit.figures, limit.spare]);
  const heads = ["limit", "constraint", "as stated", "in numbers", "to spare"];
  const title = "Limits; y1_k is the charge in the available well after step k";
  return folded(title, table(heads, rows));
}

function worthTable({prices, objective}) {
  const rows = prices.map(({key, value, less, more}) => [key, value, less, more]);
  const steps = prices.map(({words}) => words).filter(Boolean);
  const whole = steps.length ? ["For whole steps, solved again:", list(steps)] : [];
  const slopes = table(["parameter", "value", "less", "more"], rows, "figures");
  const title = `Worth: ${objective} per unit, as a slope at the margin, the others held`;
  return folded(title, make("div", {}, slopes, ...whole));
}

function list(lines) {
  return make("ul", {}, ...lines.map((words) => make("li", {}, words)));
}

function table(heads, rows, kind = "") {
  const cells = (tag, row) => make("tr", {}, ...row.map((cell) => make(tag, {}, cell)));
  const body = make("table", {class: kind});
  if (heads.some(Boolean)) body.append(cells("th", heads));
  body.append(...rows.map((row) => cells("td", row)));
  const label = heads.filter(Boolean).join(", ") || "facts";
  return make("div", {class: "scrolls", tabindex: 0, role: "group", "aria-label": label}, body);
}

function folded(title, content) {
  return make("details", {open: ""}, make("summary", {}, title), content);
}
