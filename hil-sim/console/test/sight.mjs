// What a person sees of a page: what is cut, lies over something else or beyond the window, and what is too pale to read.

/** Text that is cut, lies over other text, or is beyond the window's right or left edge: each in words. */
const MISPLACED = `(() => {
  const room = document.documentElement.clientWidth;
  const found = [];
  if (document.documentElement.scrollWidth > room) found.push("the page is " + document.documentElement.scrollWidth + " px wide in " + room);
  const name = (e) => e.tagName.toLowerCase() + (e.id ? "#" + e.id : "") + (typeof e.className === "string" && e.className ? "." + e.className.replaceAll(" ", ".") : "") + " '" + (e.textContent ?? "").trim().slice(0, 30) + "'";
  const ancestors = (e) => { const all = []; for (let up = e.parentElement; up && up !== document.body; up = up.parentElement) all.push(up); return all; };
  const lines = [];
  for (const e of document.body.querySelectorAll("*")) {
    if (!e.checkVisibility({ visibilityProperty: true })) continue;
    const style = getComputedStyle(e);
    const above = ancestors(e);
    const scrolls = above.some((up) => getComputedStyle(up).overflowX !== "visible");
    const box = e.getBoundingClientRect();
    if (!scrolls && box.width > 0 && (box.right > room + 1 || box.left < -1)) found.push(name(e) + " is beyond the edge: " + box.left.toFixed(0) + " to " + box.right.toFixed(0));
    if (e.innerText?.trim() && style.overflowX !== "auto" && style.overflowX !== "scroll" && e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0 && style.display !== "inline") found.push(name(e) + " is cut: " + e.scrollWidth + " px in " + e.clientWidth);
    if (e.innerText?.trim() && style.overflowY === "hidden" && e.scrollHeight > e.clientHeight + 2) found.push(name(e) + " is cut below: " + e.scrollHeight + " px in " + e.clientHeight);
    // A log and a table of many columns scroll sideways by themselves; nothing else does.
    if (["auto", "scroll"].includes(style.overflowX) && e.scrollWidth > e.clientWidth + 1 && !e.matches("pre, .wide")) found.push(name(e) + " scrolls sideways: " + e.scrollWidth + " px in " + e.clientWidth);
    // What stands over the page or scrolls within it covers text by its nature; options are drawn by the browser.
    if (scrolls || [e, ...above].some((up) => ["fixed", "sticky"].includes(getComputedStyle(up).position)) || e.closest("select, .u-wrap")) continue;
    for (const node of e.childNodes) {
      if (node.nodeType !== 3 || !node.textContent.trim()) continue;
      const range = document.createRange();
      range.selectNodeContents(node);
      for (const line of range.getClientRects()) lines.push([e, line]);
    }
  }
  for (const [n, [one, a]] of lines.entries()) {
    for (const [other, b] of lines.slice(n + 1)) {
      const [across, down] = [Math.min(a.right, b.right) - Math.max(a.left, b.left), Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top)];
      if (one !== other && across > 3 && down > 6) found.push(name(one) + " lies over " + name(other));
    }
  }
  return [...new Set(found)];
})()`;

/**
 * What has less contrast than WCAG 2 asks for: 4.5 for text (3 where it is large), 3 for the edges of controls and for the
 * colours that draw. Controls that are out of use are exempt.
 */
const PALE = `(() => {
  const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const colour = (text, filter = "none") => {
    pen.clearRect(0, 0, 1, 1);
    pen.filter = filter;
    pen.fillStyle = text;
    pen.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top, below) => [0, 1, 2].map((n) => top[n] * top[3] + below[n] * (1 - top[3]));
  const ground = (e) => {
    if (!e) return [255, 255, 255];
    const own = colour(getComputedStyle(e).backgroundColor);
    return own[3] === 1 ? own.slice(0, 3) : over(own, ground(e.parentElement));
  };
  /** The colours of an element's text and of what lies below it. A chart may have paper of its own, and a filter over both. */
  const inkAndGround = (e, style) => {
    if (!(e instanceof SVGElement)) return [colour(style.color), ground(e)];
    const drawing = e.ownerSVGElement ?? e;
    const filter = getComputedStyle(drawing).filter;
    const [first, whole] = [drawing.firstElementChild, drawing.getBoundingClientRect()];
    const sheet = first?.tagName === "rect" && first !== e ? first.getBoundingClientRect() : null;
    const covers = sheet && sheet.width >= whole.width - 2 && sheet.height >= whole.height - 2;
    const own = covers ? colour(getComputedStyle(first).fill, filter) : [0, 0, 0, 0];
    return [colour(style.fill, filter), over(own, ground(drawing))];
  };
  const light = (rgb) => {
    const [r, g, b] = rgb.map((each) => each / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (a, b) => { const [x, y] = [light(a), light(b)]; return (Math.max(x, y) + 0.05) / (Math.min(x, y) + 0.05); };
  const found = new Set();
  let texts = 0;
  const judge = (what, value, least) => { if (!(value >= least)) found.add(what + ": contrast " + value.toFixed(2) + " of " + least); };
  for (const e of document.body.querySelectorAll("*")) {
    if (!e.checkVisibility({ visibilityProperty: true }) || e.closest(":disabled, [aria-disabled=true]")) continue;
    const style = getComputedStyle(e);
    const drawn = e instanceof SVGElement;
    const name = e.tagName.toLowerCase() + (e.id ? "#" + e.id : "") + " '" + (e.textContent ?? "").trim().slice(0, 24) + "'";
    const typed = e.matches("input:not([type=range]):not([type=file]), select");
    if (typed || [...e.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim())) {
      if (e.matches("script, style, title, option")) continue;
      texts += 1;
      // A drawing is scaled, and some of its text turned.
      const { a, b } = drawn ? e.getScreenCTM() : { a: 1, b: 0 };
      const size = parseFloat(style.fontSize) * Math.hypot(a, b);
      if (size < SMALLEST_PX) found.add(name + " is " + size.toFixed(1) + " px high");
      const least = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700) ? 3 : 4.5;
      const [ink, paper] = inkAndGround(e, style);
      judge(name, ratio(over(ink, paper), paper), least);
      if (e.placeholder) judge(name + " placeholder", ratio(over(colour(getComputedStyle(e, "::placeholder").color), paper), paper), 4.5);
    }
    // A legend's marker, but for that of the axis, which has none.
    if (e.matches(".u-marker")) {
      const edge = colour(style.borderTopColor);
      if (edge[3] > 0) judge("marker of " + e.parentElement.textContent.trim(), ratio(over(edge, ground(e.parentElement)), ground(e.parentElement)), 3);
    }
    const linkLike = style.backgroundColor === "rgba(0, 0, 0, 0)" && style.borderTopWidth === "0px";
    if ((typed || e.matches("button")) && !linkLike) {
      const around = ground(e.parentElement);
      const edge = parseFloat(style.borderTopWidth) > 0 ? ratio(over(colour(style.borderTopColor), around), around) : 1;
      judge(name + " edge", Math.max(edge, ratio(ground(e), around)), 3);
    }
  }
  const root = getComputedStyle(document.documentElement);
  const value = (variable) => root.getPropertyValue(variable).trim();
  for (const variable of VARIABLES) judge(variable, ratio(colour(value(variable)).slice(0, 3), colour(value("--card")).slice(0, 3)), 3);
  if (texts === 0) found.add("no text on the page");
  return [...found];
})()`;

/** The smallest text, px: less is below what a phone shows at an arm's length. */
const SMALLEST_PX = 10;

/** Everything that is misplaced, too small or too pale on a page as it is now; `colours` are the variables that draw. */
export async function flaws(page, colours = []) {
  const misplaced = await page.value(MISPLACED);
  return [...misplaced, ...(await page.value(PALE.replace("VARIABLES", JSON.stringify(colours)).replace(/SMALLEST_PX/g, SMALLEST_PX)))];
}
