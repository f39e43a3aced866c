// Files that are saved: the pictures as they are seen, in the colours of paper, and what the answer holds.
export function save(name, blob) {
  const link = document.createElement("a");
  Object.assign(link, {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

export function drawing(root, title) {
  const plans = root.querySelector(".plans"), {left, top, width, height} = plans.getBoundingClientRect(), head = 34;
  const whole = d3.create("svg:svg").attr("xmlns", "http://www.w3.org/2000/svg").attr("font-family", "system-ui, sans-serif")
    .attr("width", width).attr("height", height + head).attr("viewBox", [0, 0, width, height + head]);
  whole.append("rect").attr("width", "100%").attr("height", "100%").attr("fill", "var(--panel)");
  const write = (words, x, y, size) => whole.append("text").attr("x", x).attr("y", y).attr("font-size", size).attr("font-weight", 600).attr("fill", "var(--ink)").text(words);
  write(title, 10, 22, 16);
  for (const each of plans.querySelectorAll("figcaption, h2.title, .draw > svg:first-child")) {
    const box = each.getBoundingClientRect();
    if (!box.width) continue;
    if (each.tagName === "svg") {
      const copy = each.cloneNode(true);
      for (const [name, value] of Object.entries({x: box.left - left, y: box.top - top + head})) copy.setAttribute(name, value);
      if (!root.classList.contains("symbols")) copy.querySelectorAll(".sym").forEach((symbol) => symbol.remove());
      whole.node().append(copy);
    } else write(each.firstChild.textContent + (each.tagName === "H2" ? each.children[0].textContent : ""), box.left - left + 10, box.top - top + head + 20, 14);
  }
  return new XMLSerializer().serializeToString(whole.node()).replaceAll(/var\(--([\w-]+)\)/g, (_, role) => LOOKS[role].light);
}

export async function raster(svg) {
  const image = new Image(), address = URL.createObjectURL(new Blob([svg], {type: "image/svg+xml"}));
  image.src = address;
  await image.decode();
  const canvas = new OffscreenCanvas(2 * image.width, 2 * image.height), context = canvas.getContext("2d");
  context.scale(2, 2);
  context.drawImage(image, 0, 0);
  URL.revokeObjectURL(address);
  return canvas.convertToBlob();
}
