// Shows the frames of the data that the program wrote into the page. Every text becomes a text node, never markup.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const frames = data.frames;
  const $ = (id) => document.getElementById(id);
  const steps = [
    { key: "read_seconds", name: "read", color: "var(--read)" },
    { key: "compute_seconds", name: "compute", color: "var(--compute)" },
    { key: "write_seconds", name: "write", color: "var(--write)" },
  ];
  const layers = ["output", "input", "depth"].filter((key) => data.layers[key]);
  const mapped = layers.filter((key) => data.layers[key].ticks); // in false colour
  const roles = { output: "Result", input: "Input", depth: "Depth" };
  let current = 0;

  const label = (frame) => (is_number(frame.frame) ? String(frame.frame) : frame.name);
  const counted = (count, what) => `${number(count)} ${what}${count === 1 ? "" : "s"}`;

  // "1–3, 7" of frames by their places; those without numbers by name, the first few of them.
  function in_words(places) {
    if (!places.every((i) => is_number(frames[i].frame))) {
      const names = places.slice(0, 6).map((i) => label(frames[i]));
      return names.join(", ") + (places.length > 6 ? `, and ${places.length - 6} more` : "");
    }
    const parts = [];
    for (const i of places) {
      const last = parts[parts.length - 1];
      if (last && last.end === i - 1) last.end = i;
      else parts.push({ begin: i, end: i });
    }
    return parts.map(({ begin, end }) => label(frames[begin]) + (end > begin ? (end > begin + 1 ? "–" : ", ") + label(frames[end]) : "")).join(", ");
  }

  const is_failed = (frame) => Boolean(frame.error);
  const badge_of = (frame) =>
    make("span", { class: `badge ${is_failed(frame) ? "bad" : frame.status === "left out" ? "warn" : frame.status === "made" ? "" : "plain"}` },
      is_failed(frame) ? "failed" : frame.status || "there");

  // ---- The head.
  document.title = `${data.title} · Fathom report`;
  $("title").textContent = data.title;
  {
    const failed = frames.filter(is_failed).length;
    const warned = frames.filter((frame) => frame.warnings && frame.warnings.length).length;
    const parts = [counted(frames.length, "frame")];
    if (data.width) parts.push(`${data.width} × ${data.height}`);
    if (data.command) parts.push(`fathom ${data.command}`);
    const times = frames.filter((frame) => !is_failed(frame)).map((frame) => frame.seconds).filter(is_number);
    if (times.length) parts.push(`${milliseconds(times.reduce((a, b) => a + b, 0) / times.length)} a frame`);
    parts.push(failed ? counted(failed, "failure") : "no failure");
    if (data.has_log) parts.push(warned ? `warnings in ${counted(warned, "frame")}` : "no warning");
    $("summary").textContent = parts.join(" · ");
  }

  // ---- The picture with its handle.
  const stage = $("stage");
  function set_handle() {
    stage.style.setProperty("--at", `${$("compare").value}%`);
    $("compare").setAttribute("aria-valuetext", `input on the left ${Math.round($("compare").value)} %, result on the right`);
  }
  $("compare").addEventListener("input", set_handle);
  set_handle();

  function set_image(image, source, alt) {
    image.hidden = !source;
    if (source) image.src = source;
    else image.removeAttribute("src");
    image.alt = source ? alt : "";
  }

  function show_stage(frame) {
    const images = frame.images || {};
    set_image($("result"), images.output, `Result of frame ${label(frame)}`);
    set_image($("input"), images.input, `Input of frame ${label(frame)}`);
    stage.classList.toggle("single", !images.output || !images.input);
    $("left-label").textContent = `Input: ${data.layers.input ? data.layers.input.name : ""}`;
    $("right-label").textContent = `Result: ${data.layers.output ? data.layers.output.name : ""}`;
    $("no-picture").hidden = Boolean(images.output);
    $("no-picture").textContent = images.output ? "" : is_failed(frame) ? "This frame failed: it has no result." : "This frame has no result.";
  }
  $("layers").hidden = mapped.length === 0;
  $("viewer").classList.toggle("few-layers", mapped.length < 2);
  stage.style.aspectRatio = `${data.width || 16} / ${data.height || 9}`;

  // ---- Facts of a frame.
  function show_facts(frame) {
    const list = make("dl");
    const fact = (term, value) => value !== undefined && value !== null && value !== "" && list.append(make("dt", {}, term), make("dd", {}, value));
    list.append(make("dt", {}, "Status"), make("dd", {}, badge_of(frame)));
    fact("Result", frame.output);
    fact("Input", frame.input);
    fact("Depth", frame.depth);
    if (is_number(frame.held)) fact("Held", `from frame ${frame.held}`);
    if (is_number(frame.nearest) && is_number(frame.farthest)) fact("Distances", `${short(frame.nearest)} to ${short(frame.farthest)}`);
    if (is_number(frame.seconds)) fact("Time", milliseconds(frame.seconds));
    for (const step of steps) if (is_number(frame[step.key])) fact(`· ${step.name}`, milliseconds(frame[step.key]));
    for (const key of layers.filter((each) => !data.layers[each].ticks)) {
      const found = (frame.stats || {})[key];
      if (found) fact(`Invalid, ${roles[key].toLowerCase()}`, `${number(found.invalid)} (${percent(found.invalid, found.pixels)})`);
    }
    const card = make("div", { class: "card" }, list);
    if (frame.missing) card.append(make("p", { class: "trouble" }, `${frame.missing} is not there`));
    if (frame.error) card.append(make("p", { class: "trouble bad" }, frame.error));
    for (const warning of frame.warnings || []) card.append(make("p", { class: "trouble" }, warning));
    $("facts").replaceChildren(card);
  }

  // ---- Legends and histograms.
  function show_layers(frame) {
    const sections = mapped.map((key) => {
      const layer = data.layers[key], found = (frame.stats || {})[key];
      const section = make("section", { class: "layer", "aria-label": roles[key] },
        make("h3", {}, roles[key]), make("div", { class: "meaning" }, layer.meaning));
      if (key === "depth" && frame.images && frame.images.depth)
        section.append(make("img", { src: frame.images.depth, alt: `Depth of frame ${label(frame)} in false colour` }));
      if (found && found.histogram) section.append(make("div", { class: "histogram-place" }));
      const bar = make("div", { class: "bar" });
      bar.style.background = `linear-gradient(to right, ${layer.colors.join(", ")})`;
      const ticks = layer.ticks.map((tick) => {
        const span = make("span", {}, tick.label);
        span.style.left = `${100 * tick.place}%`;
        return span;
      });
      section.append(bar, make("div", { class: "ticks" }, ticks));
      if (found) {
        const marks = [key_of(data.marks.invalid, `${number(found.invalid)} invalid (${percent(found.invalid, found.pixels)})`)];
        if (found.background) marks.push(key_of(data.marks.background, `${percent(found.background, found.pixels)} background`));
        if (is_number(found.least)) marks.push(make("span", {}, `${short(found.least)} to ${short(found.greatest)}`));
        section.append(make("div", { class: "marks" }, marks));
      }
      return section;
    });
    $("layers").replaceChildren(...sections);
    mapped.forEach((key, i) => {
      const place = sections[i].querySelector(".histogram-place"), found = (frame.stats || {})[key];
      if (place) place.append(histogram_of(found.histogram, place.clientWidth));
    });
  }

  // ---- Charts over the frames.
  // Room for the axes and the scales of a plot; gives what its marks need.
  function plot(width, low, high, name) {
    const height = 190, top = 8, bottom = 40, ticks = nice_ticks(low, high, 5);
    const left = Math.max(...ticks.map((tick) => number(tick).length), 2) * 6.6 + 12, right = 6;
    const svg = make("svg", { class: "plot", viewBox: `0 0 ${width} ${height}`, height, role: "img", "aria-label": name });
    const step = (width - left - right) / frames.length;
    const y = (value) => top + (height - top - bottom) * (1 - (value - low) / (high - low || 1));
    for (const tick of ticks) {
      svg.append(make("line", { class: "grid", x1: left, x2: width - right, y1: Math.round(y(tick)) + 0.5, y2: Math.round(y(tick)) + 0.5 }));
      svg.append(make("text", { x: left - 7, y: y(tick) + 4, "text-anchor": "end" }, number(tick)));
    }
    const x = (i) => left + (i + 0.5) * step;
    svg.append(make("line", { class: "axis", x1: left, x2: width - right, y1: height - bottom + 0.5, y2: height - bottom + 0.5 }));
    const numbered = frames.every((frame) => is_number(frame.frame));
    const text_of = (i) => (numbered ? String(frames[i].frame) : String(i + 1));
    const widest = Math.max(...[0, frames.length - 1].map((i) => text_of(i).length)) * 7 + 14;
    const every = [1, 2, 5, 10, 20, 25, 50, 100, 200, 250, 500, 1000, 2000, 5000, 10000, 100000].find((n) => n * step >= Math.max(widest, 36)) || frames.length;
    const round = frames.map((_, i) => i).filter((i) => Number(text_of(i)) % every === 0);
    if (round[0] !== 0 && !(round.length && x(round[0]) - x(0) < widest)) round.unshift(0);
    let free = -Infinity;
    for (const i of round) {
      if (x(i) - widest / 2 < free) continue;
      free = x(i) + widest / 2;
      svg.append(make("line", { class: "axis", x1: Math.round(x(i)) + 0.5, x2: Math.round(x(i)) + 0.5, y1: height - bottom, y2: height - bottom + 4 }));
      svg.append(make("text", { x: x(i), y: height - bottom + 17, "text-anchor": "middle" }, text_of(i)));
    }
    svg.append(make("text", { x: (left + width - right) / 2, y: height - 3, "text-anchor": "middle" }, numbered ? "frame" : "frame in order"));
    frames.forEach((frame, i) => {
      if (is_failed(frame)) svg.append(make("rect", { class: "failed", x: x(i) - Math.max(1, step / 2 - 0.5), y: height - bottom + 1, width: Math.max(2, step - 1), height: 4 }));
    });
    const now = make("line", { class: "now", y1: top, y2: height - bottom });
    svg.addEventListener("click", (event) => {
      const box = svg.getBoundingClientRect();
      go(Math.floor((((event.clientX - box.left) / box.width) * width - left) / step));
    });
    return { svg, x, y, step, base: height - bottom, point: (i) => { now.setAttribute("x1", x(i)); now.setAttribute("x2", x(i)); }, finish: () => svg.append(now) };
  }

  // A line through the frames that have a value, parted where some have none. What stands alone is a dot.
  function draw_line(at, values, color) {
    let path = "", drawn = false;
    values.forEach((value, i) => {
      if (is_number(value)) path += `${drawn ? "L" : "M"}${at.x(i).toFixed(1)} ${at.y(value).toFixed(1)}`;
      drawn = is_number(value);
    });
    at.svg.append(make("path", { d: path, fill: "none", stroke: color, "stroke-width": 2, "stroke-linejoin": "round" }));
    values.forEach((value, i) => {
      if (is_number(value) && !is_number(values[i - 1]) && !is_number(values[i + 1]))
        at.svg.append(make("rect", { x: at.x(i) - 2, y: at.y(value) - 2, width: 4, height: 4, fill: color }));
    });
  }

  const charts = [];
  function chart(title, unit, keys, draw) {
    const figure = make("figure", { class: "chart" });
    const head = make("figcaption", { class: "chart-head" }, make("h3", {}, title, make("span", { class: "unit" }, unit ? ` [${unit}]` : "")));
    const legend = make("div", { class: "keys" });
    head.append(legend);
    figure.append(head);
    $("charts").append(figure);
    let at = null;
    charts.push({
      draw() {
        const width = Math.max(260, figure.clientWidth - 32);
        if (at) at.svg.remove();
        at = draw(width);
        at.finish();
        figure.append(at.svg);
      },
      point(i) {
        at.point(i);
        legend.replaceChildren(...keys(frames[i]));
      },
    });
  }

  function time_chart() {
    const total = frames.map((frame) => (steps.some((step) => is_number(frame[step.key])) ? steps.reduce((sum, step) => sum + (is_number(frame[step.key]) ? frame[step.key] : 0), 0) : null));
    if (!total.some(is_number)) return;
    const [least, most] = range_of(total);
    chart("Time a frame", "ms",
      (frame) => steps.map((step) => key_of(step.color, `${step.name} ${is_number(frame[step.key]) ? short(frame[step.key] * 1000) : "–"}`)),
      (width) => {
        const at = plot(width, 0, most * 1000 || 1, `Time a frame: ${short(least * 1000)} to ${short(most * 1000)} ms over ${counted(frames.length, "frame")}`);
        const bar = Math.max(0.8, at.step - Math.min(2, at.step * 0.2));
        const below = frames.map(() => 0);
        for (const step of steps) {
          let path = "";
          frames.forEach((frame, i) => {
            const value = is_number(frame[step.key]) ? frame[step.key] * 1000 : 0;
            if (value > 0) path += `M${(at.x(i) - bar / 2).toFixed(2)} ${at.y(below[i]).toFixed(2)}h${bar.toFixed(2)}V${at.y(below[i] + value).toFixed(2)}h${(-bar).toFixed(2)}z`;
            below[i] += value;
          });
          at.svg.append(make("path", { d: path, fill: step.color }));
        }
        return at;
      });
  }

  function invalid_chart() {
    const series = layers.filter((key) => key === "output" || mapped.includes(key))
      .map((key) => ({ name: roles[key].toLowerCase(), values: frames.map((frame) => ((frame.stats || {})[key] || {}).invalid) }))
      .filter(({ values }) => values.some(is_number));
    const of_log = { name: "decoded depth", values: frames.map((frame) => frame.invalid) };
    if (of_log.values.some(is_number)) series.push(of_log);
    for (let i = series.length - 1; i > 0; --i) { // lines that would hide each other become one
      const same = series.slice(0, i).find(({ values }) => values.every((value, k) => (value ?? null) === (series[i].values[k] ?? null)));
      if (same) same.name += `, ${series.splice(i, 1)[0].name}`;
    }
    if (!series.length) return;
    const colors = ["var(--series)", "var(--compute)", "var(--other)"];
    const most = Math.max(...series.map(({ values }) => range_of(values)[1]));
    chart("Invalid pixels", "pixels",
      (frame) => series.map(({ name, values }, s) => key_of(colors[s % 3], `${name} ${is_number(values[frames.indexOf(frame)]) ? number(values[frames.indexOf(frame)]) : "–"}`)),
      (width) => {
        const at = plot(width, 0, most || 1, most ? `Invalid pixels: at most ${number(most)}` : "Invalid pixels: none in any frame");
        series.forEach(({ values }, s) => draw_line(at, values, colors[s % 3]));
        return at;
      });
  }

  function value_chart(key) {
    const layer = data.layers[key];
    const part = (name) => frames.map((frame) => ((frame.stats || {})[key] || {})[name]);
    const low = part("p1"), middle = part("p50"), high = part("p99");
    if (!middle.some(is_number)) return;
    const [least] = range_of(low), [, most] = range_of(high);
    const pad = most > least ? 0 : Math.abs(most) || 1;
    chart(`${roles[key]}: ${layer.name}`, layer.unit,
      (frame) => {
        const i = frames.indexOf(frame);
        return [key_of("var(--series)", `median ${is_number(middle[i]) ? short(middle[i]) : "–"}`),
          key_of("var(--series-soft)", `98 % lie in ${is_number(low[i]) ? `${short(low[i])} to ${short(high[i])}` : "–"}`)];
      },
      (width) => {
        const at = plot(width, least - pad, most + pad, `${roles[key]} ${layer.name}: the middle 98 % of the values lie between ${short(least)} and ${short(most)}`);
        const bar = at.step;
        let band = "";
        low.forEach((value, i) => {
          if (is_number(value)) band += `M${(at.x(i) - bar / 2).toFixed(2)} ${at.y(value).toFixed(2)}h${bar.toFixed(2)}V${(at.y(high[i]) - 0.5).toFixed(2)}h${(-bar).toFixed(2)}z`;
        });
        at.svg.append(make("path", { d: band, fill: "var(--series-soft)" }));
        draw_line(at, middle, "var(--series)");
        return at;
      });
  }

  if (frames.length > 1) {
    $("over-frames").hidden = false;
    time_chart();
    invalid_chart();
    mapped.forEach(value_chart);
    if (!charts.length) $("over-frames").hidden = true;
    for (const each of charts) each.draw();
  }
  let drawn = 0;
  addEventListener("resize", () => {
    if (drawn === document.body.clientWidth) return;
    drawn = document.body.clientWidth;
    for (const each of charts) each.draw();
    go(current);
  });

  // ---- All frames in a row. One of them is in the order of the Tab key.
  const items = frames.map((frame, i) => {
    const picture = (frame.images || {}).output;
    const button = make("button", { type: "button", tabindex: -1, "aria-label": `Frame ${label(frame)}${is_failed(frame) ? ", failed" : ""}`, onclick: () => go(i) },
      picture ? make("img", { src: picture, alt: "", loading: "lazy", decoding: "async" }) : make("span", { class: "none" }, is_failed(frame) ? "failed" : "none"),
      label(frame));
    if (is_failed(frame) || (frame.warnings || []).length) button.append(make("span", { class: is_failed(frame) ? "dot bad" : "dot" }));
    $("strip").append(button);
    return button;
  });
  $("strip").hidden = frames.length < 2;

  function go(i) {
    i = Math.min(frames.length - 1, Math.max(0, i));
    const focused = items[current] === document.activeElement;
    items[current].removeAttribute("aria-current");
    items[current].tabIndex = -1;
    current = i;
    const frame = frames[i], item = items[i], strip = $("strip");
    item.setAttribute("aria-current", "true");
    item.tabIndex = 0;
    if (focused) item.focus({ preventScroll: true });
    const left = item.offsetLeft - strip.offsetLeft;
    if (left < strip.scrollLeft || left + item.offsetWidth > strip.scrollLeft + strip.clientWidth) strip.scrollLeft = left - (strip.clientWidth - item.offsetWidth) / 2;
    $("frame").value = i;
    $("frame").setAttribute("aria-valuetext", `frame ${label(frame)}, ${i + 1} of ${frames.length}`);
    $("where").replaceChildren(make("b", {}, is_number(frame.frame) ? `Frame ${frame.frame}` : frame.name), ` · ${i + 1} of ${frames.length}`);
    $("previous").disabled = i === 0;
    $("next").disabled = i === frames.length - 1;
    show_stage(frame);
    show_facts(frame);
    show_layers(frame);
    show_camera(frame);
    for (const each of charts) each.point(i);
  }

  $("frame").max = frames.length - 1;
  $("frame").addEventListener("input", () => go(Number($("frame").value)));
  $("previous").addEventListener("click", () => go(current - 1));
  $("next").addEventListener("click", () => go(current + 1));
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || event.shiftKey || event.target.type === "range") return;
    const to = { ArrowLeft: current - 1, ArrowRight: current + 1 }[event.key];
    if (to === undefined) return;
    event.preventDefault();
    go(to);
  });

  let timer = 0;
  function play(on) {
    clearInterval(timer);
    timer = on ? setInterval(() => go((current + 1) % frames.length), 1000 / 12) : 0;
    $("play").setAttribute("aria-pressed", String(on));
    $("facts").setAttribute("aria-live", on ? "off" : "polite");
  }
  $("play").addEventListener("click", () => play(!timer));
  document.querySelector(".transport").hidden = frames.length < 2;
  document.querySelector(".hint").hidden = frames.length < 2;

  // ---- Warnings and failures, the same ones together.
  {
    const said = new Map();
    const add = (kind, text, i) => {
      const key = `${kind} ${text}`;
      if (!said.has(key)) said.set(key, { kind, text, places: [] });
      said.get(key).places.push(i);
    };
    frames.forEach((frame, i) => {
      if (frame.error) add("failed", frame.error, i);
      for (const warning of frame.warnings || []) add("warning", warning, i);
      if (frame.status === "left out") add("left out", frame.missing ? `${frame.missing} is not there` : "A file of the frame is not there", i);
    });
    const rows = [...said.values()].sort((a, b) => (a.kind === "failed" ? 0 : 1) - (b.kind === "failed" ? 0 : 1));
    if (rows.length)
      $("messages").append(make("ul", { class: "messages" }, rows.map(({ kind, text, places }) =>
        make("li", {}, make("span", { class: `badge ${kind === "failed" ? "bad" : "warn"}` }, kind), make("span", { class: "text" }, text),
          make("span", { class: "frames" }, make("button", { type: "button", onclick: () => { go(places[0]); $("viewer").scrollIntoView(); } },
            `${places.length === 1 ? "frame" : "frames"} ${in_words(places)}`))))));
    else $("messages").append(make("p", { class: "note" }, data.has_log ? "None." : "None that the images show. Warnings stand in the log, which was not given."));
    if (data.unread_lines) $("messages").append(make("p", { class: "note" }, `${counted(data.unread_lines, "line")} of the log could not be read.`));
  }

  // ---- What made the frames.
  if (data.runs.length)
    $("runs").append(...data.runs.map((run) => {
      const list = make("dl");
      for (const [term, value] of Object.entries(run.facts)) list.append(make("dt", {}, term), make("dd", {}, value));
      return make("div", { class: "card run" }, make("pre", { tabindex: 0, "aria-label": "Command" }, run.command), list);
    }));
  else
    $("runs").append(make("p", { class: "note" }, data.has_log ? "The log does not say which command made the frames."
      : "No log was given, so the page has no times, warnings, command or camera. Run the command with --log run.jsonl, and give the same option to fathom report."));

  function show_camera(frame) {
    const text = data.cameras[frame.camera];
    if (text === undefined) {
      $("camera").replaceChildren();
      return;
    }
    const of = data.cameras.length === 1 ? "Camera of all frames" : `Camera of frame ${label(frame)}`;
    $("camera").replaceChildren(make("div", { class: "card" }, make("h3", {}, of), make("pre", { tabindex: 0, "aria-label": of }, text)));
  }

  $("footer").textContent = `Made by fathom ${data.version}. Pictures are made smaller, and are for looking only.`;
  go(0);
})();
