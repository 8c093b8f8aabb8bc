"use strict";
// Draws the motions in #data: figures whose places are channels over time, and curves beside them. No library, no net.
(() => {
const data = JSON.parse(document.getElementById("data").textContent);
const on_white = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#888888"];
const on_black = ["#56b4e9", "#ff8c42", "#2fcf9f", "#e7a0c9", "#f5c04a", "#9ad1f5", "#b79cf0", "#bbbbbb"];
let palette = on_white;
const by = id => document.getElementById(id);

// --- Channels: numbers over frames, 16 bits each between their least and their largest; or one number.
function bytes(text) {
    const raw = atob(text), result = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; ++i) result[i] = raw.charCodeAt(i);
    return result.buffer;
}
function channel(packed) {
    if (typeof packed === "number") return { least: packed, most: packed, at: () => packed };
    const words = new Uint16Array(bytes(packed.d)), scale = (packed.most - packed.least) / 65535;
    const value = i => packed.least + words[i] * scale;
    return { least: packed.least, most: packed.most, frame: value,
             at: place => {
                 const i = Math.min(Math.floor(place), words.length - 1), part = place - i;
                 return part > 0 && i + 1 < words.length ? value(i) * (1 - part) + value(i + 1) * part : value(i);
             } };
}
for (const run of data.runs) {
    run.times = new Float32Array(bytes(run.times));
    run.channels = run.channels.map(channel);
    run.end = run.times[run.times.length - 1];
    // The frame at a time, with its fraction.
    run.place = time => {
        let low = 0, high = run.times.length - 1;
        if (time >= run.times[high]) return high;
        while (high - low > 1) {
            const middle = (low + high) >> 1;
            if (run.times[middle] <= time) low = middle; else high = middle;
        }
        return low + Math.max(0, (time - run.times[low]) / (run.times[high] - run.times[low]));
    };
}
const end = Math.max(...data.runs.map(run => run.end));

// --- The time that is shown.
const state = { time: 0, playing: true, rate: 1, trails: true, last: 0, frames: 0 };
state.rate = data.rate;
const steps = [1, 2, 5];
function change_rate(direction) {
    const exponent = Math.floor(Math.log10(state.rate) + 1e-9), digit = state.rate / 10 ** exponent;
    const ladder = [];
    for (let e = exponent - 1; e <= exponent + 1; ++e) for (const s of steps) ladder.push(s * 10 ** e);
    const next = direction > 0 ? ladder.find(value => value > state.rate * 1.001)
                               : ladder.reverse().find(value => value < state.rate * 0.999);
    state.rate = next || state.rate * digit;
    redraw = true;
}
function seek(time) {
    state.time = Math.min(Math.max(time, 0), end);
    redraw = true;
}
let redraw = true;

// --- Canvases.
const styles = () => getComputedStyle(document.documentElement);
let ink = {};
function read_ink() {
    const style = styles();
    for (const name of ["back", "pane", "ink", "soft", "line", "accent"]) ink[name] = style.getPropertyValue("--" + name).trim();
}
function fit(canvas) {
    const ratio = window.devicePixelRatio || 1, box = canvas.getBoundingClientRect();
    const width = Math.max(1, Math.round(box.width * ratio)), height = Math.max(1, Math.round(box.height * ratio));
    const changed = canvas.width !== width || canvas.height !== height;
    if (changed) { canvas.width = width; canvas.height = height; }
    const context = canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return { context, width: box.width, height: box.height, changed };
}
function pane(parent, caption) {
    const figure = document.createElement("figure"), canvas = document.createElement("canvas");
    const text = document.createElement("figcaption");
    text.append(...caption);
    figure.append(text, canvas);
    parent.append(figure);
    return canvas;
}
function bold(text) {
    const element = document.createElement("b");
    element.textContent = text;
    return element;
}

// --- Scenes: the figures, seen from above or from a place in space.
class Stage {
    constructor(run, index) {
        this.run = run;
        const caption = [bold(data.runs.length > 1 ? `${index + 1}: ${run.label}` : run.label)];
        if (run.note) caption.push(" " + run.note);
        this.canvas = pane(by("scenes"), caption);
        this.spatial = run.figures.some(figure => figure.places[0].length === 3);
        this.turn = 0.6; this.lift = 0.35; this.zoom = 1; this.shift = [0, 0];
        this.bounds();
        this.listen();
        this.colour = (figure, i) => palette[(figure.colour ?? i) % palette.length];
    }
    bounds() {
        const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
        for (const figure of this.run.figures) for (const place of figure.places) place.forEach((c, k) => {
            const one = this.run.channels[c], margin = figure.radius === undefined ? 0 : this.run.channels[figure.radius].most;
            low[k] = Math.min(low[k], one.least - margin);
            high[k] = Math.max(high[k], one.most + margin);
        });
        for (let k = 0; k < 3; ++k) if (low[k] > high[k]) low[k] = high[k] = 0;
        this.middle = low.map((value, k) => (value + high[k]) / 2);
        this.size = low.map((value, k) => high[k] - value);
        const largest = Math.max(...this.size);
        if (!(largest > 0)) this.size = [1, 1, 1];
        this.radius = Math.hypot(...this.size) / 2 || 1;
    }
    listen() {
        const touches = new Map();
        this.canvas.addEventListener("pointerdown", event => {
            this.canvas.setPointerCapture(event.pointerId);
            touches.set(event.pointerId, [event.clientX, event.clientY]);
        });
        this.canvas.addEventListener("pointermove", event => {
            const before = touches.get(event.pointerId);
            if (!before) return;
            const dx = event.clientX - before[0], dy = event.clientY - before[1];
            if (touches.size === 2) {
                const other = [...touches].find(([id]) => id !== event.pointerId)[1];
                const far = Math.hypot(event.clientX - other[0], event.clientY - other[1]);
                this.zoom *= far / (Math.hypot(before[0] - other[0], before[1] - other[1]) || far);
            } else if (this.spatial && !event.shiftKey) {
                this.turn -= dx / 150;
                this.lift = Math.min(1.57, Math.max(-1.57, this.lift + dy / 150));
            } else {
                this.shift[0] += dx; this.shift[1] += dy;
            }
            touches.set(event.pointerId, [event.clientX, event.clientY]);
            redraw = true;
        });
        for (const name of ["pointerup", "pointercancel"]) this.canvas.addEventListener(name, event => touches.delete(event.pointerId));
        this.canvas.addEventListener("wheel", event => {
            event.preventDefault();
            this.zoom *= Math.exp(-event.deltaY / 500);
            redraw = true;
        }, { passive: false });
        this.canvas.addEventListener("dblclick", () => { this.zoom = 1; this.shift = [0, 0]; this.turn = 0.6; this.lift = 0.35; redraw = true; });
    }
    // Pixels of a place; a larger depth lies nearer.
    project(x, y, z) {
        x -= this.middle[0]; y -= this.middle[1]; z -= this.middle[2];
        if (this.spatial) {
            const c = Math.cos(this.turn), s = Math.sin(this.turn), u = c * x + s * y, away = -s * x + c * y;
            const a = Math.cos(this.lift), b = Math.sin(this.lift);
            return [this.width / 2 + this.shift[0] + this.scale * u,
                    this.height / 2 + this.shift[1] - this.scale * (a * z + b * away), b * z - a * away];
        }
        return [this.width / 2 + this.shift[0] + this.scale * x, this.height / 2 + this.shift[1] - (this.run.profile ? this.upright : this.scale) * y, 0];
    }
    at(place, frame) {
        const value = k => k < place.length ? this.run.channels[place[k]].at(frame) : 0;
        return this.project(value(0), value(1), value(2));
    }
    draw(time) {
        const { context, width, height } = fit(this.canvas);
        this.width = width; this.height = height + 16;
        const room = 34;
        this.scale = this.zoom * (this.spatial ? Math.min(width - room, height - room - 16) / (2 * this.radius)
            : Math.min((width - room) / (this.size[0] || 1e-9), (height - room - 16) / (this.size[1] || 1e-9)));
        if (!this.spatial) this.scale = Math.min(this.scale, this.zoom * Math.min(width, height) / Math.max(...this.size) * 2);
        this.upright = this.zoom * (height - 2 * room) / (this.size[1] || 1);
        if (this.run.profile) this.scale = this.zoom * (width - room) / (this.size[0] || 1);
        context.clearRect(0, 0, width, height);
        this.ground(context);
        const frame = this.run.place(time);
        if (state.trails) this.run.figures.forEach((figure, i) => this.trail(context, figure, i, frame));
        const order = this.run.figures.map((figure, i) => {
            const places = figure.places.map(place => this.at(place, frame));
            return { figure, i, places, depth: places.reduce((sum, p) => sum + p[2], 0) / places.length };
        });
        if (this.spatial) order.sort((a, b) => a.depth - b.depth);
        for (const one of order) if (one.figure.kind !== "point") this.shape(context, one);
        for (const one of order) if (one.figure.kind === "point") this.shape(context, one);
        this.flash(context, time);
    }
    // In space: the square below, and the axes at its corner.
    ground(context) {
        if (!this.spatial) return;
        const r = Math.max(this.size[0], this.size[1]) / 2 || this.radius / 2, [mx, my, mz] = this.middle, z = mz - this.size[2] / 2;
        context.strokeStyle = ink.line;
        context.lineWidth = 1;
        context.beginPath();
        for (let i = -4; i <= 4; ++i) for (const [a, b] of [[[i / 4, -1], [i / 4, 1]], [[-1, i / 4], [1, i / 4]]]) {
            context.moveTo(...this.project(mx + r * a[0], my + r * a[1], z));
            context.lineTo(...this.project(mx + r * b[0], my + r * b[1], z));
        }
        context.stroke();
    }
    trail(context, figure, i, frame) {
        if (!figure.trail) return;
        const length = Math.min(frame, 1500), begin = Math.ceil(frame - length), pieces = 12;
        context.strokeStyle = this.colour(figure, i);
        context.lineWidth = 1.4;
        for (let piece = 0; piece < pieces; ++piece) {
            const from = begin + Math.floor(length * piece / pieces), to = Math.min(Math.floor(frame), begin + Math.ceil(length * (piece + 1) / pieces));
            context.globalAlpha = 0.08 + 0.6 * (piece + 1) / pieces;
            context.beginPath();
            for (let k = from; k <= to; ++k) { const p = this.at(figure.places[0], k); if (k === from) context.moveTo(p[0], p[1]); else context.lineTo(p[0], p[1]); }
            if (piece === pieces - 1) { const p = this.at(figure.places[0], frame); context.lineTo(p[0], p[1]); }
            context.stroke();
        }
        context.globalAlpha = 1;
    }
    shape(context, { figure, i, places }) {
        const colour = this.colour(figure, i);
        context.lineWidth = figure.kind === "line" ? 2.6 : 1.8;
        context.lineJoin = context.lineCap = "round";
        context.strokeStyle = figure.kind === "point" ? ink.pane : figure.still ? ink.soft : figure.kind === "line" ? ink.ink : colour;
        context.beginPath();
        if (figure.kind === "point") {
            context.fillStyle = figure.still ? ink.soft : colour;
            context.arc(places[0][0], places[0][1], figure.still ? 4.5 : figure.many ? 5 : 7, 0, 7);
            context.fill();
        } else if (figure.kind === "circle") {
            const frame = this.run.place(state.time);
            context.arc(places[0][0], places[0][1], Math.max(1, this.run.channels[figure.radius].at(frame) * this.scale), 0, 7);
            context.globalAlpha = 0.15; context.fillStyle = colour; context.fill(); context.globalAlpha = 1;
        } else if (figure.kind === "spring") {
            const [a, b] = places, dx = b[0] - a[0], dy = b[1] - a[1], turns = 9, wide = 7, length = Math.hypot(dx, dy) || 1;
            context.moveTo(a[0], a[1]);
            for (let k = 0; k <= 2 * turns; ++k) {
                const along = 0.12 + 0.76 * (k + 0.5) / (2 * turns + 1), side = wide * (k % 2 ? 1 : -1);
                context.lineTo(a[0] + along * dx - side * dy / length, a[1] + along * dy + side * dx / length);
            }
            context.lineTo(b[0], b[1]);
        } else {
            places.forEach((p, k) => k === 0 ? context.moveTo(p[0], p[1]) : context.lineTo(p[0], p[1]));
            if (figure.closed) context.closePath();
        }
        context.stroke();
    }
    // An event or impact shines for a moment.
    flash(context, time) {
        const shown = this.run.events.filter(event => time >= event.t && time - event.t < 0.35 * state.rate);
        if (!shown.length) return;
        context.fillStyle = ink.accent;
        context.font = "13px system-ui, sans-serif";
        context.fillText([...new Set(shown.map(event => this.run.event_names[event.kind]))].slice(0, 3).join(", "), 12, this.height - 28);
    }
}

// --- Charts: curves over time, or one over another, with a mark where the motion is.
class Chart {
    constructor(title, curves, options = {}) {
        this.curves = curves; this.options = options;
        this.names = [];
        const caption = [];
        curves.forEach((curve, i) => {
            const name = bold(curve.label);
            this.names.push(name);
            if (i > 0) caption.push(" · ");
            caption.push(name);
        });
        this.canvas = pane(by("charts"), title ? [title + ": ", ...caption] : caption);
        this.picture = document.createElement("canvas");
        if (!options.phase) {
            const move = event => {
                if (event.buttons === 0 && event.type === "pointermove") return;
                const box = this.canvas.getBoundingClientRect();
                seek((event.clientX - box.left - this.left) / (box.width - this.left - 10) * end);
            };
            this.canvas.addEventListener("pointerdown", move);
            this.canvas.addEventListener("pointermove", move);
        }
    }
    colour(i) { return palette[(this.curves[i].colour ?? i) % palette.length]; }
    // With the digits by which it differs from a number `step` away.
    static number(value, step) {
        const size = Math.abs(value), digits = size > step ? Math.min(17, Math.ceil(Math.log10(size / step) + 1.001)) : 1;
        const plain = size === 0 || (size >= 1e-3 && size < 1e5);
        return plain ? String(+value.toPrecision(Math.max(3, digits))) : value.toExponential(Math.max(1, digits - 1));
    }
    // Round numbers between two others, and what is written beside each.
    static ticks(low, high, count) {
        const rough = (high - low) / count, power = 10 ** Math.floor(Math.log10(rough));
        const step = [1, 2, 5, 10].map(s => s * power).find(s => s >= rough * 0.999), result = [];
        for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && result.length <= 4 * count; ++k)
            result.push([k * step, Chart.number(k * step, step)]);
        return result.length < 2 && high > low && count < 100 ? Chart.ticks(low, high, 2 * count) : result;  // one tells no scale
    }
    scales(context, width, height) {
        let low = Infinity, high = -Infinity, left = 0, right = end;
        if (this.options.phase) { left = Infinity; right = -Infinity; }
        for (const curve of this.curves) {
            low = Math.min(low, curve.y.least); high = Math.max(high, curve.y.most);
            if (curve.x) { left = Math.min(left, curve.x.least); right = Math.max(right, curve.x.most); }
        }
        const widen = (a, b) => b - a > 1e-14 * Math.abs(a) ? [a - 0.06 * (b - a), b + 0.06 * (b - a)] : [a - (Math.abs(a) || 1) * 0.1, b + (Math.abs(b) || 1) * 0.1];
        [low, high] = widen(low, high);
        if (this.options.phase) [left, right] = widen(left, right);
        this.ticks = Chart.ticks(low, high, Math.max(2, height / 45));
        this.left = 10 + Math.max(40, ...this.ticks.map(([, label]) => context.measureText(label).width));
        this.x = value => this.left + (value - left) / (right - left || 1) * (width - this.left - 10);
        this.y = value => 6 + (high - value) / (high - low) * (height - 26);
        this.range = [left, right, low, high];
    }
    paint(width, height, ratio) {
        this.picture.width = this.canvas.width; this.picture.height = this.canvas.height;
        const context = this.picture.getContext("2d");
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        this.names.forEach((name, i) => { name.style.color = this.colour(i); });
        context.font = "11px system-ui, sans-serif";
        this.scales(context, width, height);
        const [left, right] = this.range;
        context.strokeStyle = ink.line; context.fillStyle = ink.soft; context.lineWidth = 1;
        context.textAlign = "right"; context.textBaseline = "middle";
        for (const [tick, label] of this.ticks) {
            context.beginPath(); context.moveTo(this.left, this.y(tick)); context.lineTo(width - 10, this.y(tick)); context.stroke();
            context.fillText(label, this.left - 6, this.y(tick));
        }
        context.textAlign = "center"; context.textBaseline = "top";
        for (const [tick, label] of Chart.ticks(left, right, Math.max(2, width / 90))) context.fillText(label, this.x(tick), height - 16);
        this.curves.forEach((curve, i) => this.curve(context, curve, i, width));
        if (this.curves.some(curve => curve.run.events.length) && !this.options.phase) this.marks(context, height);
    }
    curve(context, curve, i, width) {
        context.strokeStyle = this.colour(i);
        context.lineWidth = curve.run.times.length > 3000 ? 0.8 : 1.4;
        context.beginPath();
        const count = curve.run.times.length;
        if (this.options.phase || count < 4 * width) {
            for (let k = 0; k < count; ++k) {
                const x = this.x(curve.x ? curve.x.at(k) : curve.run.times[k]), y = this.y(curve.y.at(k));
                if (k === 0) context.moveTo(x, y); else context.lineTo(x, y);
            }
        } else {  // of each column of pixels the least and the largest
            const columns = Math.floor(2 * width);
            for (let c = 0, k = 0; c < columns; ++c) {
                let low = Infinity, high = -Infinity, x = 0;
                for (const stop = Math.min(count, Math.ceil((c + 1) / columns * count)); k < stop; ++k) {
                    const y = this.y(curve.y.at(k));
                    low = Math.min(low, y); high = Math.max(high, y); x = this.x(curve.run.times[k]);
                }
                if (low <= high) { context.lineTo(x, low); context.lineTo(x, high); }
            }
        }
        context.stroke();
    }
    marks(context, height) {
        context.strokeStyle = ink.accent; context.globalAlpha = 0.5;
        context.beginPath();
        for (const curve of this.curves.slice(0, 1)) for (const event of curve.run.events) {
            context.moveTo(this.x(event.t), height - 20); context.lineTo(this.x(event.t), height - 26);
        }
        context.stroke();
        context.globalAlpha = 1;
    }
    draw(time, fresh) {
        const { context, width, height, changed } = fit(this.canvas), ratio = window.devicePixelRatio || 1;
        if (changed || fresh || !this.range) this.paint(width, height, ratio);
        context.clearRect(0, 0, width, height);
        context.drawImage(this.picture, 0, 0, width, height);
        context.strokeStyle = ink.soft; context.lineWidth = 1;
        if (!this.options.phase) {
            context.beginPath(); context.moveTo(this.x(time), 6); context.lineTo(this.x(time), height - 20); context.stroke();
        }
        this.curves.forEach((curve, i) => {
            const frame = curve.run.place(time);
            context.fillStyle = this.colour(i);
            context.beginPath();
            context.arc(this.x(curve.x ? curve.x.at(frame) : Math.min(time, curve.run.end)), this.y(curve.y.at(frame)), 4, 0, 7);
            context.fill();
        });
    }
}

// --- The page.
document.querySelector("h1").textContent = data.title;
const stages = data.runs.map((run, i) => new Stage(run, i)), charts = [];
const several = data.runs.length > 1;
for (const group of data.charts) {
    const curves = [];
    data.runs.forEach((run, r) => group.curves.forEach((name, i) => {
        const curve = run.curves[name];
        if (!curve) return;
        curves.push({ run, label: several ? `${r + 1}: ${curve.label}` : curve.label, y: run.channels[curve.y],
                      x: curve.x === undefined ? undefined : run.channels[curve.x], colour: r * group.curves.length + i });
    }));
    if (curves.length) charts.push(new Chart(group.title, curves, { phase: group.phase }));
}

const prefers_dark = window.matchMedia("(prefers-color-scheme: dark)");
let chosen = null, fresh = true;
function show_theme() {
    const dark = chosen ?? prefers_dark.matches;
    document.documentElement.classList.toggle("dark", dark);
    palette = dark ? on_black : on_white;
    read_ink();
    redraw = fresh = true;
}
prefers_dark.addEventListener("change", show_theme);
const toggle_theme = () => { chosen = !(chosen ?? prefers_dark.matches); show_theme(); };
const toggle_play = () => {
    if (!state.playing && state.time >= end) state.time = 0;
    state.playing = !state.playing;
    redraw = true;
};
const toggle_trails = () => { state.trails = !state.trails; redraw = true; };
by("theme").onclick = toggle_theme;
by("play").onclick = toggle_play;
by("trails").onclick = toggle_trails;
by("slower").onclick = () => change_rate(-1);
by("faster").onclick = () => change_rate(1);
by("time").oninput = event => seek(Number(event.target.value) * end);
window.addEventListener("resize", () => { redraw = true; });
const keys = { " ": toggle_play, d: toggle_theme, t: toggle_trails, "+": () => change_rate(1), "=": () => change_rate(1),
               "-": () => change_rate(-1), ArrowLeft: () => seek(state.time - state.rate), ArrowRight: () => seek(state.time + state.rate),
               Home: () => seek(0), End: () => seek(end), r: () => seek(0) };
window.addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
    event.preventDefault();
    if (document.activeElement) document.activeElement.blur();
    keys[event.key]();
});

function show() {
    for (const stage of stages) stage.draw(state.time);
    for (const chart of charts) chart.draw(state.time, fresh);
    fresh = false;
    by("time").value = end > 0 ? state.time / end : 0;
    by("clock").textContent = `t = ${state.time.toPrecision(4)} of ${+end.toPrecision(5)}`;
    by("speed").textContent = `${+state.rate.toPrecision(2)} / s`;
    by("play").textContent = state.playing ? "❚❚" : "▶";
    by("play").setAttribute("aria-label", state.playing ? "pause" : "play");
    by("trails").setAttribute("aria-pressed", state.trails);
    ++state.frames;
}
function tick(now) {
    const passed = Math.min((now - state.last) / 1000, 0.1);
    state.last = now;
    if (state.playing) {
        state.time += passed * state.rate;
        if (state.time >= end) { state.time = end; state.playing = false; }
        redraw = true;
    }
    if (redraw) { redraw = false; show(); }
    requestAnimationFrame(tick);
}
// --- `lobatto view --video`: with #frames=COUNT,RATE every frame stands as a picture in the text of the page.
function paint_text(context) {
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = texts.nextNode(); node; node = texts.nextNode()) {
        const parent = node.parentElement;
        if (!node.data.trim() || !parent.closest("h1, figcaption")) continue;
        const range = document.createRange();
        range.selectNodeContents(node);
        const box = range.getBoundingClientRect(), style = getComputedStyle(parent);
        context.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
        context.fillStyle = style.color;
        context.textBaseline = "middle";
        context.fillText(node.data.replace(/\s+/g, " "), box.left, box.top + box.height / 2);
    }
}
function picture(canvas) {
    const context = canvas.getContext("2d");
    context.fillStyle = ink.back;
    context.fillRect(0, 0, canvas.width, canvas.height);
    for (const figure of document.querySelectorAll("figure")) {
        const box = figure.getBoundingClientRect();
        context.fillStyle = ink.pane;
        context.fillRect(box.left, box.top, box.width, box.height);
        const one = figure.querySelector("canvas"), place = one.getBoundingClientRect();
        context.drawImage(one, place.left, place.top, place.width, place.height);
    }
    paint_text(context);
    context.textAlign = "right";
    context.fillText(by("clock").textContent, canvas.width - 20, 24);
    context.textAlign = "left";
    return canvas.toDataURL("image/jpeg", 0.92);
}
function print_frames(count, rate) {
    const canvas = document.createElement("canvas"), frames = [];
    canvas.width = window.innerWidth & ~1;  // encoders want even sizes
    canvas.height = window.innerHeight & ~1;
    state.playing = false;
    for (let i = 0; i < count; ++i) {
        state.time = Math.min(i / rate * state.rate, end);
        show();
        frames.push(picture(canvas).split(",")[1]);
    }
    const text = document.createElement("pre");
    text.id = "frames";
    text.textContent = frames.join("\n");
    document.body.replaceChildren(text);
}

show_theme();
window.lobatto = { state, data, seek };
const asked = /^#frames=(\d+),(\d+)$/.exec(window.location.hash);
if (asked) print_frames(Number(asked[1]), Number(asked[2]));
else requestAnimationFrame(now => { state.last = now; tick(now); });
})();
