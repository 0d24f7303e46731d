// SPDX-License-Identifier: Apache-2.0
// The page's user interface: navigation, layers, channels, and the readout of the fragment under
// the pointer. The page has this script after page_drawing.js, in the same <script> element.
function start(data) {
  const { draw, nearest } = renderer(data);

  // The target of the orbit is a point in the space of the captured camera.
  const home = [0, 0, -view.distance], state = {};
  const turned = () => times(turn(state.pitch, [1, 0, 0]), turn(-state.yaw, view.up));
  function look() {
    const back = view.perspective ? view.distance / state.zoom : view.distance;
    const camera = times(shift(0, 0, -back), times(turned(), shift(...state.target.map(c => -c))));
    // All captured fragments lie in a sphere around the initial target.
    const middle = -(camera[2] * home[0] + camera[6] * home[1] + camera[10] * home[2] + camera[14]);
    const near = view.perspective ? Math.max(middle - view.radius, 1e-3 * back) : middle - view.radius;
    const to = Number(slider.value);
    return { camera, near, far: Math.max(middle + view.radius, near + back),
      half: view.half.map(h => view.perspective ? h : h / state.zoom),
      from: only.checked ? to - 1 : 0, to: Math.min(to, view.layerEnds.length), channel: select.value };
  }

  // Drawing comes before the readout.
  const due = { draw: false, probe: false };
  let waiting = false;
  function soon(what) {
    due[what] = true;
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => {
      waiting = false;
      const what = due.draw ? "draw" : "probe";
      due[what] = false;
      if (what === "probe") return probe();
      draw(look());
      soon("probe");
    });
  }
  function ask() {
    element("shown").value = only.checked ? "layer " + (slider.value - 1) : slider.value + " of " + slider.max;
    const { low, ramp, high } = channels[select.value];
    element("key").hidden = !low;
    element("low").textContent = low ?? "";
    element("high").textContent = high ?? "";
    element("ramp").hidden = !ramp;
    element("ramp").style.background = ramp ? "linear-gradient(90deg, #" + ramp.join(", #") + ")" : "";
    soon("draw");
  }

  let pointed = null;  // position in the picture, 0 to 1 in both directions
  function probe() {
    const i = pointed ? nearest(look(), ...pointed) : -1, line = element("probe");
    line.dataset.reading = 1 + Number(line.dataset.reading ?? 0);
    if (i < 0) {
      line.textContent = pointed ? "Nothing is shown here."
        : "Point at the picture to read depth, layer" + (view.objects ? ", pixel and object." : " and pixel.");
      return;
    }
    const z = zOf(data.depths[i]), error = halfStep * (view.perspective ? z : 1);
    const digits = Math.min(Math.floor(-Math.log10(2 * error)), 4 - Math.floor(Math.log10(Math.abs(z) || 1)));
    const pixel = data.texels[4 * i], width = view.window[2];
    const told = [["Z", z.toFixed(Math.max(0, Math.min(20, digits)))],
      ["layer", view.layerEnds.findIndex(end => i < end)],
      ["pixel", view.window[0] + pixel % width + ", " + (view.window[1] + Math.floor(pixel / width))]];
    for (const [kind, ids, names] of [["object", data.objects, view.objects], ["material", data.materials, view.materials]])
      if (ids) told.push([kind, names[ids[i]] ?? ids[i]]);
    line.replaceChildren(...told.map(([name, value]) => {
      const part = document.createElement("span"), label = document.createElement("b");
      label.textContent = name;
      part.append(label, " " + value + " ");
      return part;
    }));
  }
  function point(x, y, marked) {
    pointed = [x, y];
    const mark = element("mark");
    mark.hidden = !marked;
    mark.style.left = canvas.offsetLeft + canvas.clientLeft + x * canvas.clientWidth + "px";
    mark.style.top = canvas.offsetTop + canvas.clientTop + y * canvas.clientHeight + "px";
    soon("probe");
  }

  function turnBy(yaw, pitch) {
    state.yaw += yaw;
    state.pitch = Math.max(-1.55, Math.min(1.55, state.pitch + pitch));
    ask();
  }
  function approach(factor) {
    state.zoom = Math.max(0.1, Math.min(20, state.zoom * factor));
    ask();
  }
  function move(right, down) {  // by fractions of the picture's size, so that the target follows the pointer
    const size = 2 * (view.perspective ? view.distance : 1) / state.zoom, m = turned();
    const x = -right * size * view.half[0], y = down * size * view.half[1];
    const away = state.target.map((c, i) => c + m[4 * i] * x + m[4 * i + 1] * y - home[i]);
    const within = Math.min(1, view.radius / Math.hypot(...away));
    state.target = home.map((c, i) => c + within * away[i]);
    ask();
  }
  function show(channel) {
    select.value = channel;
    ask();
  }
  function reset() {
    Object.assign(state, { yaw: 0, pitch: 0, zoom: 1, target: home });
    slider.value = slider.max;
    only.checked = false;
    show("color");
  }

  const pointers = new Map();
  const spread = () => {  // centre of the touches, and their distance
    const [a, b = a] = pointers.values();
    return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2, apart: Math.hypot(a.x - b.x, a.y - b.y) };
  };
  const place = event => ({ x: event.offsetX / canvas.clientWidth, y: event.offsetY / canvas.clientHeight });
  canvas.addEventListener("pointerdown", event => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    point(...Object.values(place(event)), event.pointerType !== "mouse");
  });
  canvas.addEventListener("pointermove", event => {
    point(...Object.values(place(event)), event.pointerType !== "mouse");
    if (!pointers.has(event.pointerId)) return;
    const was = spread();
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    const now = spread(), moving = pointers.size > 1 || event.shiftKey || event.buttons > 1;
    const scale = Math.PI / canvas.clientWidth;
    if (moving) move((now.x - was.x) / canvas.clientWidth, (now.y - was.y) / canvas.clientHeight);
    else turnBy((was.x - now.x) * scale, (now.y - was.y) * scale);
    if (was.apart > 0) approach(now.apart / was.apart);
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, event => pointers.delete(event.pointerId));
  canvas.addEventListener("pointerleave", event => {
    if (event.pointerType !== "mouse") return;
    pointed = null;
    soon("probe");
  });
  canvas.addEventListener("contextmenu", event => event.preventDefault());
  canvas.addEventListener("mousedown", event => event.button === 1 && event.preventDefault());  // prevents autoscroll
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    approach(Math.exp(-event.deltaY * (event.deltaMode === 1 ? 0.05 : 0.002)));
  }, { passive: false });

  const layer = step => { slider.value = Number(slider.value) + step; ask(); };
  const arrow = (x, y) => event => event.shiftKey ? move(-x, y) : turnBy(x, y);
  const names = Object.keys(channels);
  const keys = {
    ArrowLeft: arrow(-0.05, 0), ArrowRight: arrow(0.05, 0), ArrowUp: arrow(0, 0.05), ArrowDown: arrow(0, -0.05),
    "+": () => approach(1.1), "=": () => approach(1.1), "-": () => approach(1 / 1.1),
    "[": () => layer(-1), "]": () => layer(1), r: reset, p: () => point(0.5, 0.5, true),
    o: () => { only.checked = !only.checked; ask(); },
    c: event => show(names.at((names.indexOf(select.value) + (event.shiftKey ? -1 : 1)) % names.length)),
    d: () => show(select.value === "depth" ? "color" : "depth"),
  };
  document.addEventListener("keydown", event => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target === select) return;
    if (event.target === slider && event.key.startsWith("Arrow")) return;
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action(event);
  });
  for (const control of [slider, only, select]) control.addEventListener("input", ask);
  element("reset").addEventListener("click", reset);
  element("controls").addEventListener("submit", event => event.preventDefault());
  new ResizeObserver(() => {
    if (pointed) point(...pointed, !element("mark").hidden);
    soon("draw");
  }).observe(canvas);
  reset();
}

document.title = view.title + " – layers";
element("title").textContent = view.title;
canvas.style.aspectRatio = view.width + " / " + view.height;
canvas.style.width = "min(100%, " + (74 * view.width / view.height).toFixed(3) + "vh)";
canvas.width = view.width;
canvas.height = view.height;
slider.max = layers;
slider.value = slider.max;
canvas.setAttribute("aria-label", "The layers of " + view.title + ", seen from any side");
for (const [value, { name }] of Object.entries(channels)) select.append(new Option(name, value));
const oneDigit = n => Number(n.toPrecision(1)).toLocaleString("en", { maximumFractionDigits: 20 });
element("precision").textContent = "Z is the depth of the nearest fragment under the pointer, in the capturing camera's space and " +
  "in scene units. It is stored in 16 bits, within " + (view.perspective ? oneDigit(100 * halfStep) + " %" : oneDigit(halfStep)) +
  " of the file's Z. Pixels count from the upper left corner. The channel Depth shows the distance from the current view, " +
  "and Normal the normals of the drawn cells, without shading normals.";
element("legend").textContent = "A layered depth image: " + many(view.layerEnds.at(-1) ?? 0) + " fragments on " +
  view.layerEnds.length + " layers, captured by one camera at " + many(view.width) + " × " + many(view.height) +
  " pixels. Every fragment is drawn as one pixel on its surface. Surfaces that no ray of that camera hit are missing: " +
  "look around to see these gaps, and remove layers to see the surfaces behind them.";
unpack().then(start).catch(error => fail("The layers cannot be shown: " + error.message));
