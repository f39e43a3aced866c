// Reads pages of LaTeX as JSON and prints, by reader, what KaTeX and MathJax object to.
const fs = require("fs");
const katex = require("katex");
const { mathjax } = require("mathjax-full/js/mathjax.js");
const { TeX } = require("mathjax-full/js/input/tex.js");
const { SVG } = require("mathjax-full/js/output/svg.js");
const { liteAdaptor } = require("mathjax-full/js/adaptors/liteAdaptor.js");
require("mathjax-full/js/input/tex/AllPackages.js");
const { RegisterHTMLHandler } = require("mathjax-full/js/handlers/html.js");

const adaptor = liteAdaptor();
RegisterHTMLHandler(adaptor);
const page = mathjax.document("", {
  InputJax: new TeX({ packages: ["base", "ams"] }),
  OutputJax: new SVG({ fontCache: "none" }),
});
const found = { katex: [], mathjax: [], rendered: 0 };
for (const text of JSON.parse(fs.readFileSync(0, "utf8"))) {
  for (const [block] of text.matchAll(/\\begin\{align\*\}.*?\\end\{align\*\}/gs)) {
    const strict = (code, words) => (found.katex.push(`${code}: ${words}`), "ignore");
    try {
      katex.renderToString(block, { displayMode: true, strict });
    } catch (error) {
      found.katex.push(error.message);
    }
    const html = adaptor.outerHTML(page.convert(block, { display: true }));
    const error = html.match(/data-mjx-error="([^"]*)"/);
    if (error) found.mathjax.push(error[1]);
    // A letter that its fonts lack is a text of the browser's.
    found.mathjax.push(...[...html.matchAll(/<text[^>]*>([^<]+)</g)].map((each) => each[1]));
    found.rendered += 1;
  }
}
console.log(JSON.stringify(found));
