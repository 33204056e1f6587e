"use strict";
// Redraws each figure of curves at the width that there is: zoom, pan, values under the pointer.
for (const figure of document.querySelectorAll("figure.curves")) {
  const panels = JSON.parse(figure.querySelector("script").textContent);
  const hidden = new Set(), live = document.createElement("div"), bar = document.createElement("div");
  const ends = panels.flatMap((p) => p.lines.flatMap((l) => [l.x[0], l.x[l.x.length - 1]]));
  const all = [Math.min(...ends), Math.max(...ends)];
  let shown = all.slice(), at = null, left = 56, wide = 0;
  live.className = "live";
  bar.className = "names";
  figure.prepend(bar, live);
  figure.classList.add("scripted");

  const button = (text, label, act, colour) => {
    const made = document.createElement("button");
    made.type = "button";
    made.textContent = text;
    made.title = label;
    if (colour) made.style.setProperty("--colour", colour);
    made.addEventListener("click", () => { act(made); draw(); });
    bar.append(made);
  };
  const names = new Map(panels.flatMap((p) => p.lines.map((l) => [l.name, l.colour])));
  for (const [name, colour] of names) {
    button(name, "show or hide", (made) => {
      if (!hidden.delete(name)) hidden.add(name);
      made.classList.toggle("off", hidden.has(name));
    }, colour);
  }
  const zoom = (factor, where) => {
    const [a, b] = shown, size = Math.min(all[1] - all[0], Math.max((b - a) * factor, (all[1] - all[0]) / 2e3));
    move(where - (where - a) * size / (b - a), size);
  };
  const move = (start, size) => {
    const first = Math.min(all[1] - size, Math.max(all[0], start));
    shown = [first, first + size];
  };
  const middle = () => 0.5 * (shown[0] + shown[1]);
  button("+", "closer", () => zoom(0.5, middle()));
  button("−", "farther", () => zoom(2, middle()));
  button("all", "all of it", () => { shown = all.slice(); });

  const ticks = (low, high, most) => {
    const raw = (high - low) / most, ten = 10 ** Math.floor(Math.log10(raw));
    const step = ten * [1, 2, 5, 10].find((m) => m * ten >= raw), found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(v);
    return [found, Math.max(0, -Math.floor(Math.log10(step) + 1e-9))];
  };
  const text = (value) => String(value).replace(/-/g, "−");
  const safe = (value) => value.replace(/[&<>"]/g, (c) => `&#${c.charCodeAt(0)};`);
  const nearest = (x, value) => {
    let low = 0, high = x.length - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (x[mid] < value) low = mid; else high = mid; }
    return value - x[low] < x[high] - value ? low : high;
  };

  function panel(own, last) {
    const tall = 150, top = 24, low = top + tall, full = low + (last ? 34 : 8);
    const lines = own.lines.filter((l) => !hidden.has(l.name));
    const range = [own.noise ? -2 * own.noise : Infinity, own.noise ? 2 * own.noise : -Infinity];
    for (const l of lines) l.x.forEach((x, k) => {
      if (l.y[k] !== null && x >= shown[0] && x <= shown[1]) { range[0] = Math.min(range[0], l.y[k]); range[1] = Math.max(range[1], l.y[k]); }
    });
    if (!(range[1] > range[0])) { const v = Number.isFinite(range[0]) ? range[0] : 0; range[0] = v - 1; range[1] = v + 1; }
    const room = 0.06 * (range[1] - range[0]), [y0, y1] = [range[0] - room, range[1] + room];
    const px = (x) => left + (wide - left - 6) * (x - shown[0]) / (shown[1] - shown[0]);
    const py = (y) => low - tall * (y - y0) / (y1 - y0);
    let inside = "", marks = "", read = "";
    for (const [a, b] of own.spans) inside += `<rect class="span" x="${px(a)}" width="${px(b) - px(a)}" y="${top}" height="${tall}"/>`;
    if (own.noise) inside += `<rect class="noise" x="${left}" width="${wide}" y="${py(2 * own.noise)}" height="${py(-2 * own.noise) - py(2 * own.noise)}"/>`;
    const [ys, digits] = ticks(y0, y1, 4), [xs, places] = ticks(shown[0], shown[1], Math.max(3, wide / 110));
    for (const y of ys) marks += `<path class="grid" d="M${left} ${py(y)}H${wide - 6}"/><text x="${left - 6}" y="${py(y) + 4}" text-anchor="end">${text(y.toFixed(digits))}</text>`;
    for (const x of xs) {
      marks += `<path class="grid" d="M${px(x)} ${top}V${low}"/>`;
      if (last) marks += `<text x="${px(x)}" y="${low + 15}" text-anchor="middle">${text(x.toFixed(places))}</text>`;
    }
    for (const l of lines) {
      let d = "", pen = "M";
      l.x.forEach((x, k) => { if (l.y[k] === null) pen = "M"; else { d += `${pen}${px(x).toFixed(1)} ${py(l.y[k]).toFixed(1)}`; pen = "L"; } });
      inside += `<path d="${d}" fill="none" stroke="${l.colour}" stroke-width="${l.width}"${l.dashed ? ' stroke-dasharray="6 3"' : ""}/>`;
      if (at === null) continue;
      const k = nearest(l.x, at);
      if (l.y[k] === null) continue;
      inside += `<circle cx="${px(l.x[k])}" cy="${py(l.y[k])}" r="3.5" fill="${l.colour}"/>`;
      read += `<tspan fill="${l.colour}">  ${text(l.y[k].toPrecision(4))}</tspan>`;
    }
    if (at !== null) inside += `<path class="at" d="M${px(at)} ${top}V${low}"/>`;
    const end = last ? `<text x="${0.5 * (left + wide)}" y="${low + 30}" text-anchor="middle">time [s]</text>` : "";
    const when = at === null ? "" : `<text x="${wide - 6}" y="15" text-anchor="end">${text(at.toFixed(places + 1))} s${read}</text>`;
    return `<svg viewBox="0 0 ${wide} ${full}" width="${wide}" height="${full}"><text class="title" x="${wide < 560 && at !== null ? -999 : left}" y="15">${safe(own.title)}</text>${when}${marks}<svg x="${left}" y="${top}" width="${wide - left - 6}" height="${tall}" viewBox="${left} ${top} ${wide - left - 6} ${tall}">${inside}</svg>${end}</svg>`;
  }
  function draw() {
    wide = live.clientWidth;
    live.innerHTML = panels.map((p, k) => panel(p, k === panels.length - 1)).join("");
  }
  const time = (event) => {
    const part = (event.clientX - live.getBoundingClientRect().left - left) / (wide - left - 6);
    return shown[0] + Math.min(1, Math.max(0, part)) * (shown[1] - shown[0]);
  };
  let held = null;
  live.addEventListener("pointerdown", (event) => { held = [event.clientX, shown[0]]; live.setPointerCapture(event.pointerId); });
  live.addEventListener("pointerup", () => { held = null; });
  live.addEventListener("pointermove", (event) => {
    const size = shown[1] - shown[0];
    if (held) move(held[1] - (event.clientX - held[0]) / (wide - left - 6) * size, size);
    at = time(event);
    draw();
  });
  live.addEventListener("pointerleave", () => { if (!held) { at = null; draw(); } });
  live.addEventListener("dblclick", () => { shown = all.slice(); draw(); });
  live.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && !event.metaKey) return; // the page scrolls
    event.preventDefault();
    zoom(event.deltaY < 0 ? 0.8 : 1.25, time(event));
    draw();
  }, { passive: false });
  new ResizeObserver(() => { if (live.clientWidth !== wide) draw(); }).observe(live);
}
