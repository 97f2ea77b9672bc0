"use strict";
// The viewer of a check's images. pixels/STEM.js calls lightgauge.show with the values; what is drawn follows from one
// state, which draw() turns into pixels, marks, legends and a read-out. No network, no libraries.
const lightgauge = (() => {
  const IMAGES = ["realtime", "truth", "error", "flip", "significance"];
  const TITLES = { realtime: "real-time", truth: "truth", error: "error", flip: "FLIP", significance: "beyond noise" };
  const CHANNELS = { normal: ["x", "y", "z"], uv: ["u", "v"] };
  const LUMINANCE = [0.2126, 0.7152, 0.0722]; // Rec. 709
  const ZOOMS = [1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192]; // display pixels
  const GRID_FROM = 16, NUMBERS_FROM = 56; // CSS pixels for an image pixel, from which lines and values are drawn
  const DECADES = 3; // of logarithmic false colour

  // zoom is in CSS pixels for an image pixel, null while it follows the size of the panes; x and y are at the centre.
  const DEFAULTS = {
    layout: "side", shown: "realtime", other: "truth", wipe: 0.5, zoom: null, x: 0, y: 0, pixel: null,
    stops: 0, tone: "srgb", colour: "off", scale: 0, relative: false, smooth: true, all: false,
  };
  const CHOICES = { layout: ["side", "one", "wipe"], tone: ["srgb", "reinhard", "linear"], colour: ["off", "linear", "log"] };
  const LIMITS = { wipe: [0, 1], stops: [-12, 12], scale: [-6, 6], zoom: [1 / 64, 512] };
  const DISPLAY_SETTINGS = ["stops", "tone", "colour", "scale", "relative", "smooth", "all"];

  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));
  const find = (selector, root) => root.querySelector(selector);
  const all = (selector, root) => [...root.querySelectorAll(selector)];
  const element = (name, text, attributes = {}) => {
    const made = Object.assign(document.createElement(name), { textContent: text });
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    return made;
  };

  // ---- Values ------------------------------------------------------------------------------------------------------

  // The bytes of a zlib stream in base64.
  async function inflated(text) {
    const packed = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  // float32 values from bytes 0 of all of them, then bytes 1, 2 and 3.
  function floatsOf(planes) {
    const count = planes.length / 4, bytes = new Uint8Array(planes.length);
    for (let i = 0; i < count; i++) for (let byte = 0; byte < 4; byte++) bytes[4 * i + byte] = planes[byte * count + i];
    return new Float32Array(bytes.buffer); // all that runs browsers is little-endian
  }

  // Values at the judged pixels, spread over the whole image; NaN elsewhere.
  function spread(values, channels, judged) {
    const image = new Float32Array(judged.length * channels).fill(NaN);
    let next = 0;
    judged.forEach((is, pixel) => { if (is) for (let c = 0; c < channels; c++) image[pixel * channels + c] = values[next++]; });
    return image;
  }

  // The check with `judged` as one byte a pixel, and `values` as a Float32Array (height x width x channels) an image.
  async function decoded(data) {
    const bits = await inflated(data.judged);
    const judged = Uint8Array.from({ length: data.width * data.height }, (_, i) => (bits[i >> 3] >> (i & 7)) & 1);
    const values = {};
    for (const [name, { channels, where, data: text }] of Object.entries(data.images)) {
      const floats = floatsOf(await inflated(text));
      values[name] = where === "judged" ? spread(floats, channels, judged) : floats;
    }
    return { ...data, judged, values };
  }

  // The mean over the channels of each pixel.
  const channelMeans = (values, channels) => Float64Array.from({ length: values.length / channels }, (_, pixel) => {
    let sum = 0;
    for (let c = 0; c < channels; c++) sum += values[pixel * channels + c];
    return sum / channels;
  });

  // A Gaussian blur along both axes: four standard deviations wide, mirrored at the edges, as SciPy's.
  function blurred(image, width, height, sigma) {
    const radius = Math.floor(4 * sigma + 0.5);
    const weights = Array.from({ length: 2 * radius + 1 }, (_, i) => Math.exp(-0.5 * ((i - radius) / sigma) ** 2));
    const total = weights.reduce((a, b) => a + b);
    const mirrored = (i, n) => { const at = ((i % (2 * n)) + 2 * n) % (2 * n); return at < n ? at : 2 * n - 1 - at; };
    const along = (from, count, step, start) => Float64Array.from({ length: count }, (_, i) =>
      weights.reduce((sum, weight, k) => sum + weight * from[start + step * mirrored(i + k - radius, count)], 0) / total);
    const rows = new Float64Array(image.length), columns = new Float64Array(image.length);
    for (let y = 0; y < height; y++) rows.set(along(image, width, 1, y * width), y * width);
    for (let x = 0; x < width; x++) along(rows, height, width, x).forEach((value, y) => { columns[y * width + x] = value; });
    return columns;
  }

  // The Gaussian mean over those pixels around each one that have a value; the others keep none.
  function smoothed(image, { width, height, smoothing }) {
    if (!smoothing) return image;
    const total = blurred(image.map(value => (isFinite(value) ? value : 0)), width, height, smoothing);
    const weight = blurred(image.map(value => (isFinite(value) ? 1 : 0)), width, height, smoothing);
    return image.map((value, i) => (isFinite(value) ? total[i] / weight[i] : value));
  }

  // What the error map shows: the mean error of the channels, and the size of the truth that it is relative to.
  function errorsOf(check) {
    const error = channelMeans(check.values.error, check.channels);
    const size = channelMeans(check.values.truth.map(Math.abs), check.channels);
    const judged = size.filter(value => isFinite(value));
    const typical = judged.reduce((a, b) => a + b, 0) / judged.length;
    return { error, size, typical, smoothError: smoothed(error, check), smoothSize: smoothed(size, check) };
  }

  // ---- Pixels on the display ---------------------------------------------------------------------------------------

  const VERTEX = `#version 300 es
    void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

  const FRAGMENT = `#version 300 es
    precision highp float;
    precision highp int;
    precision highp sampler2D;
    uniform sampler2D realtime;  // rgb; 0 not judged, 1 judged, 2 judged but no number, 3 neither
    uniform sampler2D truth;     // rgb; FLIP
    uniform sampler2D errors;    // mean error, size of the truth; the same smoothed
    uniform sampler2D tiles;     // error of the tile; 1 if it is wrong beyond noise
    uniform int image, display, tone, colour;
    uniform float gain, errorScale, tileScale, decades;
    uniform vec3 luminance;
    uniform bool relative, smoothly, unjudgedToo;
    uniform vec3 stops[41];      // diverging 5, magma 18, viridis 18
    uniform vec3 notJudged, withinNoise, notANumber;
    out vec4 pixel;

    // t in [0, 1] to the colours at equal distances from stops[first] on.
    vec3 ramp(float t, int first, int count) {
      float at = clamp(t, 0.0, 1.0) * float(count - 1);
      int i = min(int(at), count - 2);
      return mix(stops[first + i], stops[first + i + 1], at - float(i));
    }
    vec3 diverging(float error, float scale) { return ramp(0.5 + 0.5 * error / scale, 0, 5); }

    // IEC 61966-2-1:1999, "Default RGB colour space - sRGB"
    vec3 srgb(vec3 linear) {
      vec3 c = clamp(linear, 0.0, 1.0);
      return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
    }

    vec3 shown(vec3 value) {
      if (display == 1) return clamp(0.5 * value + 0.5, 0.0, 1.0);
      vec3 exposed = value * gain;
      if (colour > 0) {
        float y = dot(luminance, exposed);
        return ramp(colour == 1 ? y : y > 0.0 ? 1.0 + log(y) / log(10.0) / decades : 0.0, 23, 18);
      }
      if (display == 2 || tone == 2) return clamp(exposed, 0.0, 1.0);
      // Reinhard et al., 2002, "Photographic tone reproduction for digital images", equation 3, for each channel
      return srgb(tone == 1 ? max(exposed, 0.0) / (1.0 + max(exposed, 0.0)) : exposed);
    }

    void main() {
      ivec2 at = ivec2(gl_FragCoord.xy);
      at.y = textureSize(realtime, 0).y - 1 - at.y;
      vec4 test = texelFetch(realtime, at, 0), reference = texelFetch(truth, at, 0);
      bool isJudged = test.a == 1.0 || test.a == 2.0;
      vec3 seen = notJudged;
      if (image == 0 && (isJudged || (unjudgedToo && test.a == 0.0))) seen = test.a == 2.0 ? notANumber : shown(test.rgb);
      if (isJudged && image == 1) seen = shown(reference.rgb);
      if (isJudged && image == 2) {
        vec4 e = texelFetch(errors, at, 0);
        float error = smoothly ? e.z : e.x, base = smoothly ? e.w : e.y;
        seen = test.a == 2.0 ? notANumber : diverging(relative ? error / max(base, 1e-30) : error, errorScale);
      }
      if (isJudged && image == 3) seen = ramp(reference.a, 5, 18);
      if (isJudged && image == 4) {
        vec2 tile = texelFetch(tiles, at, 0).xy;
        seen = tile.y == 1.0 ? diverging(tile.x, tileScale) : withinNoise;
      }
      pixel = vec4(seen, 1.0);
    }`;

  const rgbOf = colour => [1, 3, 5].map(i => parseInt(colour.slice(i, i + 2), 16) / 255);

  function programOf(gl) {
    const program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`the shader: ${gl.getProgramInfoLog(program)}`);
    return program;
  }

  // The images as four textures of four floats; see the samplers of the shader. What is no number is a flag, not a NaN:
  // drivers may assume that there are none.
  function texels(check, errors) {
    const { values, channels, judged, display } = check, number = value => (isFinite(value) ? value : 0);
    const rgb = (image, pixel, c) => number(channels === 1 ? image[pixel] : c < channels ? image[pixel * channels + c] : 0);
    const packed = texel => {
      const data = new Float32Array(4 * judged.length);
      for (let pixel = 0; pixel < judged.length; pixel++) data.set(texel(pixel), 4 * pixel);
      return data;
    };
    const hasNumber = pixel => values.realtime.subarray(pixel * channels, (pixel + 1) * channels).every(isFinite);
    const three = (image, pixel) => [rgb(image, pixel, 0), rgb(image, pixel, 1), rgb(image, pixel, 2)];
    const { error, size, smoothError, smoothSize } = errors, tile = values.significance;
    return {
      realtime: packed(p => [...three(values.realtime, p), hasNumber(p) ? judged[p] : 3 - judged[p]]),
      truth: packed(p => [...three(values.truth, p), values.flip ? number(values.flip[p]) : 0]),
      errors: packed(p => [error[p], size[p], smoothError[p], smoothSize[p]].map(number)),
      tiles: packed(p => (tile && isFinite(tile[p]) ? [tile[p], 1, 0, 0] : [0, 0, 0, 0])),
    };
  }

  // Returns pictureOf(name, settings): a canvas with one pixel for each of the image's, drawn anew when settings change.
  function painterOf(check, errors, repaint) {
    const { width, height } = check, canvas = Object.assign(document.createElement("canvas"), { width, height });
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false });
    if (!gl) throw new Error("this browser offers no WebGL2");
    if (gl.drawingBufferWidth < width || gl.drawingBufferHeight < height) throw new Error("the image is larger than WebGL2 can draw here");
    const program = programOf(gl), at = name => gl.getUniformLocation(program, name);
    gl.useProgram(program);
    Object.entries(texels(check, errors)).forEach(([name, data], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
      gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.FLOAT, data);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST); // float32 allows no other
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      gl.uniform1i(at(name), unit);
    });
    const { diverging, magma, viridis } = check.colours;
    gl.uniform3fv(at("stops"), [...diverging, ...magma, ...viridis].flatMap(rgbOf));
    for (const name of ["notJudged", "withinNoise", "notANumber"]) gl.uniform3fv(at(name), rgbOf(check.colours[name]));
    gl.uniform1i(at("display"), { radiance: 0, normal: 1 }[check.display] ?? 2);
    gl.uniform1f(at("decades"), DECADES);
    gl.uniform3fv(at("luminance"), check.channels === 3 ? LUMINANCE : [1, 0, 0]);
    canvas.addEventListener("webglcontextlost", event => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", repaint);
    let drawn = {}, drawnWith = "";
    return (name, settings) => {
      if (drawnWith !== (drawnWith = JSON.stringify(settings))) drawn = {};
      return drawn[name] ??= painted(name, settings);
    };
    function painted(name, { floats, whole }) {
      for (const [key, value] of Object.entries(floats)) gl.uniform1f(at(key), value);
      for (const [key, value] of Object.entries(whole)) gl.uniform1i(at(key), value);
      gl.uniform1i(at("image"), IMAGES.indexOf(name));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      const picture = Object.assign(document.createElement("canvas"), { width, height });
      picture.getContext("2d").drawImage(canvas, 0, 0);
      return picture;
    }
  }

  // ---- Words -------------------------------------------------------------------------------------------------------

  // A number with as many significant digits, and true minus signs.
  function written(value, digits = 4) {
    if (!isFinite(value)) return Number.isNaN(value) ? "NaN" : value < 0 ? "−∞" : "∞";
    if (value === 0) return "0";
    const rounded = Number(value.toPrecision(digits)), size = Math.abs(rounded);
    const plain = size < 10 ** digits ? value.toPrecision(digits) : String(rounded);
    return (size < 1e-4 || size >= 1e6 ? value.toExponential(digits - 1).replace("e+", "e") : plain).replaceAll("-", "−");
  }
  const short = value => written(Number(value.toPrecision(3)), 3).replace(/(\.\d*?)0+(?=e|$)/, "$1").replace(/\.(?=e|$)/, "");
  const signed = (value, digits) => (value > 0 ? "+" : "") + written(value, digits);
  const share = value => `${signed(100 * value, 3)} %`;
  const unitOf = check => (check.unit === "1" ? "" : ` ${check.unit}`);

  // What is known of a pixel.
  function inspected(check, errors, [x, y], smooth) {
    const { values, channels } = check, pixel = y * check.width + x;
    const read = (name, c) => (values[name] ? values[name][pixel * channels + c] : NaN);
    const names = channels === 1 ? [check.quantity] : CHANNELS[check.display] ?? ["R", "G", "B"];
    const rows = names.slice(0, channels).map((name, c) => ({
      name, realtime: read("realtime", c), truth: read("truth", c), sigma: read("sigma", c), error: read("error", c),
    }));
    return {
      x, y, rows, judged: check.judged[pixel] === 1,
      error: (smooth ? errors.smoothError : errors.error)[pixel], size: (smooth ? errors.smoothSize : errors.size)[pixel],
      flip: values.flip?.[pixel], tile: values.significance?.[pixel],
    };
  }

  // ---- The view and links to it ------------------------------------------------------------------------------------

  const hashOf = state => {
    const parts = new URLSearchParams();
    for (const [key, normal] of Object.entries(DEFAULTS)) {
      const value = state[key];
      if (key === "x" || key === "y" || value === null || value === normal) continue;
      parts.set(key, Array.isArray(value) ? value.join(",") : typeof value === "number" ? String(Number(value.toPrecision(6))) : String(value));
    }
    if (state.zoom !== null) parts.set("at", [state.x, state.y].map(value => value.toFixed(2)).join(","));
    return String(parts).replaceAll("%2C", ",") || "view";
  };

  const pairOf = text => {
    const pair = (text ?? "").split(",").map(Number);
    return pair.length === 2 && pair.every(isFinite) && text.trim() ? pair : null;
  };

  // The part of the state that a link tells, for a check with these images; null if it tells nothing.
  function stateOf(hash, check, available) {
    const parts = new URLSearchParams(hash.replace(/^#/, "")), found = {};
    for (const [key, normal] of Object.entries(DEFAULTS)) {
      const text = parts.get(key);
      if (text === null) continue;
      if (typeof normal === "boolean") found[key] = text === "true";
      else if (key in LIMITS) { if (text && isFinite(text)) found[key] = clamp(Number(text), ...LIMITS[key]); }
      else if ((CHOICES[key] ?? (key === "pixel" ? [] : available)).includes(text)) found[key] = text;
    }
    const pixel = pairOf(parts.get("pixel")), centre = pairOf(parts.get("at"));
    if (pixel) found.pixel = [clamp(Math.round(pixel[0]), 0, check.width - 1), clamp(Math.round(pixel[1]), 0, check.height - 1)];
    if (centre) [found.x, found.y] = centre;
    return Object.keys(found).length || hash === "#view" ? found : null;
  }

  // ---- One viewer --------------------------------------------------------------------------------------------------

  function viewerOf(root, check) {
    const part = name => find(`.viewer-${name}`, root);
    const errors = errorsOf(check), available = IMAGES.filter(name => name === "error" || check.values[name]);
    const stage = part("stage"), canvas = part("canvas"), pens = canvas.getContext("2d"), help = part("help");
    const panes = Object.fromEntries(all(".viewer-pane", root).map(pane => [pane.dataset.pane, pane]));
    const area = name => find(".viewer-image", panes[name]);
    const state = { ...DEFAULTS, x: check.width / 2, y: check.height / 2 };
    const hasSize = !["normal", "uv"].includes(check.display); // directions and places have none to expose or to divide by
    const can = { exposure: hasSize, tone: check.display === "radiance", colour: hasSize, relative: hasSize, smooth: check.smoothing > 0 };
    const painter = () => painterOf(check, errors, () => { pictureOf = painter(); draw(); });
    let pictureOf = painter();

    const visible = () => (state.layout === "side" ? available : [state.shown]);
    const gain = () => check.exposure * 2 ** state.stops;
    const isSmooth = () => state.smooth && can.smooth;
    const isRelative = () => state.relative && can.relative;
    const tileRange = () => 2 ** state.scale * check.errorScale;
    const errorRange = () => tileRange() / (isRelative() ? errors.typical : 1);
    const fitted = ({ width, height }) => {
      const largest = Math.min(width / check.width, height / check.height) * devicePixelRatio;
      return (largest >= 1 ? Math.floor(largest) : largest) / devicePixelRatio;
    };
    const zoomNow = () => state.zoom ?? fitted(area(visible()[0]).getBoundingClientRect());

    // Where an image lies in its pane: a rectangle in display pixels, from the upper left of the stage.
    function rectangleOf(image) {
      const ratio = devicePixelRatio, outer = stage.getBoundingClientRect(), inner = area(image).getBoundingClientRect();
      const left = Math.round((inner.left - outer.left) * ratio), top = Math.round((inner.top - outer.top) * ratio);
      const width = Math.round(inner.width * ratio), height = Math.round(inner.height * ratio), zoom = zoomNow() * ratio;
      return {
        image, left, top, width, height, zoom,
        originX: left + Math.round(width / 2 - state.x * zoom), originY: top + Math.round(height / 2 - state.y * zoom),
      };
    }
    function rectangles() {
      if (state.layout !== "wipe") return visible().map(name => rectangleOf(name));
      const whole = rectangleOf(state.shown), cut = Math.round(whole.width * state.wipe);
      return [{ ...whole, width: cut }, { ...whole, image: state.other, left: whole.left + cut, width: whole.width - cut }];
    }

    function set(change) {
      Object.assign(state, change);
      if (state.other === state.shown) state.other = state.shown === "truth" ? "realtime" : "truth";
      if (state.zoom === null) Object.assign(state, { x: check.width / 2, y: check.height / 2 });
      state.x = clamp(state.x, 0, check.width);
      state.y = clamp(state.y, 0, check.height);
      draw();
    }

    // Show one image large. In a wipe, it takes the left side.
    const show = name => set({
      layout: state.layout === "wipe" ? "wipe" : "one", shown: name, other: name === state.other ? state.shown : state.other,
    });
    const flip = () => set(state.layout === "side" ? { layout: "one" } : { shown: state.other, other: state.shown });

    // Zoom by a step; what lies at (dx, dy) CSS pixels from the centre of its pane stays there.
    function zoomBy(direction, dx = 0, dy = 0) {
      const zoom = zoomNow(), ratio = devicePixelRatio, steps = direction > 0 ? ZOOMS : [...ZOOMS].reverse();
      const step = steps.find(each => direction * (each - zoom * ratio) > 1e-3);
      if (step === undefined) return;
      const next = step / ratio;
      set({ zoom: next, x: state.x + dx / zoom - dx / next, y: state.y + dy / zoom - dy / next });
    }
    const pan = (dx, dy) => { const zoom = zoomNow(); set({ zoom, x: state.x + dx / zoom, y: state.y + dy / zoom }); };

    // Move the pixel cursor, and the view if it would leave that.
    function moveTo(x, y) {
      const pixel = [clamp(x, 0, check.width - 1), clamp(y, 0, check.height - 1)], zoom = zoomNow();
      const { width, height } = area(visible()[0]).getBoundingClientRect();
      const near = (centre, at, extent) => clamp(centre, at + 1 - extent / 2 / zoom, at + extent / 2 / zoom);
      const [nextX, nextY] = [near(state.x, pixel[0], width), near(state.y, pixel[1], height)];
      set({ pixel, ...(nextX === state.x && nextY === state.y ? {} : { zoom, x: nextX, y: nextY }) });
      find("[role=status]", part("inspector")).textContent = spoken();
    }
    function step(dx, dy) {
      const [x, y] = state.pixel ?? [Math.floor(state.x), Math.floor(state.y)];
      moveTo(x + (state.pixel ? dx : 0), y + (state.pixel ? dy : 0));
    }
    function goToWorst() {
      const zoom = Math.max(zoomNow(), 16);
      if (!check.worst) return;
      set({ zoom, x: check.worst[0] + 0.5, y: check.worst[1] + 0.5 });
      moveTo(...check.worst);
    }

    async function copyLink() {
      history.replaceState(null, "", `#${hashOf(state)}`);
      const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
      part("note").textContent = copied ? "The link is copied, and in the address bar." : "The link is in the address bar.";
    }
    const reset = () => set(Object.fromEntries(DISPLAY_SETTINGS.map(key => [key, DEFAULTS[key]])));
    const next = key => set({ [key]: CHOICES[key][(CHOICES[key].indexOf(state[key]) + 1) % CHOICES[key].length] });
    const add = (key, change) => set({ [key]: clamp(state[key] + change, ...LIMITS[key]) });
    const actions = {
      in: () => zoomBy(1), out: () => zoomBy(-1), fit: () => set({ zoom: null }), worst: goToWorst, link: copyLink, reset,
      flip, help: () => help.showModal(),
    };

    // ---- Drawing ----

    function draw() {
      arrange();
      const box = stage.getBoundingClientRect(), ratio = devicePixelRatio;
      const [width, height] = [Math.round(box.width * ratio), Math.round(box.height * ratio)];
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      Object.assign(canvas.style, { width: `${width / ratio}px`, height: `${height / ratio}px` });
      drawImages(rectangles());
      legends();
      readOut();
    }

    // Panes side by side are as high as the image is when it fills their width.
    function resizePanes() {
      for (const name of IMAGES) panes[name].hidden = !visible().includes(name);
      const { width } = area(visible()[0]).getBoundingClientRect(), highest = 0.74 * innerHeight;
      const zoom = fitted({ width, height: Math.max(highest, check.height / devicePixelRatio) });
      stage.style.setProperty("--height", `${Math.ceil(zoom * check.height) + 16}px`);
    }

    // Bring the page in line with the state: what is visible, pressed and chosen.
    function arrange() {
      root.dataset.layout = state.layout;
      root.dataset.panes = available.length;
      resizePanes();
      for (const button of all("[data-layout]", root)) button.setAttribute("aria-pressed", String(button.dataset.layout === state.layout));
      for (const button of all("button[data-image]", root)) {
        button.hidden = !available.includes(button.dataset.image);
        button.setAttribute("aria-pressed", String(state.layout !== "side" && button.dataset.image === state.shown));
      }
      for (const option of find("[name=other]", root).options) option.hidden = option.disabled = !available.includes(option.value);
      for (const control of all("[name]", root)) {
        if (control.type === "checkbox") control.checked = state[control.name];
        else control.value = state[control.name];
      }
      for (const label of all("[data-for]", root)) label.hidden = !can[label.dataset.for];
      for (const pair of all(".viewer-pair", root)) pair.hidden = state.layout === "side";
      part("wipe").hidden = state.layout !== "wipe";
      const factor = state.scale < 0 ? `÷ ${2 ** -state.scale}` : `× ${2 ** state.scale}`;
      const said = { stops: `${state.stops > 0 ? "+" : ""}${short(state.stops)} EV`, scale: factor };
      for (const [name, text] of Object.entries(said)) {
        find(`[data-of=${name}]`, root).textContent = text;
        find(`[name=${name}]`, root).setAttribute("aria-valuetext", text);
      }
      find("[data-for=smooth] span", root).textContent = `smoothed over ${check.smoothing} px`;
      find("[data-do=worst]", root).hidden = !check.worst;
      part("zoom").textContent = `× ${short(zoomNow() * devicePixelRatio)}`;
    }

    // The values that a pixel of an image has the colour of.
    const numbersAt = (name, x, y) => {
      const pixel = y * check.width + x;
      if (!check.judged[pixel] && name !== "realtime") return [];
      if (name === "error" && isSmooth()) return [errors.smoothError[pixel]];
      const values = check.values[name], count = values.length / check.judged.length;
      return Array.from(values.subarray(pixel * count, (pixel + 1) * count)).filter(value => name !== "significance" || isFinite(value));
    };

    // The images, lines between pixels and their values where there is room, the pixel cursor, the line of the wipe.
    function drawImages(placed) {
      const ratio = devicePixelRatio, settings = {
        floats: { gain: gain(), errorScale: errorRange(), tileScale: tileRange() },
        whole: {
          tone: CHOICES.tone.indexOf(state.tone), colour: can.colour ? CHOICES.colour.indexOf(state.colour) : 0,
          relative: isRelative(), smoothly: isSmooth(), unjudgedToo: state.all,
        },
      };
      pens.clearRect(0, 0, canvas.width, canvas.height);
      pens.imageSmoothingEnabled = false;
      for (const place of placed) {
        pens.save();
        pens.beginPath();
        pens.rect(place.left, place.top, place.width, place.height);
        pens.clip();
        pens.drawImage(pictureOf(place.image, settings), place.originX, place.originY, check.width * place.zoom, check.height * place.zoom);
        const cell = (x, y) => [place.originX + x * place.zoom, place.originY + y * place.zoom];
        if (place.zoom >= GRID_FROM * ratio) drawCells(place, cell);
        if (state.pixel) outline(...cell(...state.pixel), place.zoom);
        pens.restore();
      }
      if (state.layout === "wipe") {
        const { left, top, height } = placed[1];
        pens.fillStyle = "#000";
        pens.fillRect(left - 2 * ratio, top, 4 * ratio, height);
        pens.fillStyle = "#fff";
        pens.fillRect(left - ratio, top, 2 * ratio, height);
      }
    }
    function drawCells(place, cell) {
      const ratio = devicePixelRatio, { zoom } = place;
      const first = (start, origin) => Math.max(0, Math.floor((start - origin) / zoom));
      const last = (end, origin, count) => Math.min(count, Math.ceil((end - origin) / zoom));
      const [x0, x1] = [first(place.left, place.originX), last(place.left + place.width, place.originX, check.width)];
      const [y0, y1] = [first(place.top, place.originY), last(place.top + place.height, place.originY, check.height)];
      pens.strokeStyle = "rgb(128 128 128 / 45%)";
      pens.lineWidth = 1;
      pens.beginPath();
      const line = (from, to) => { pens.moveTo(...from); pens.lineTo(...to); };
      for (let x = x0; x <= x1; x++) line(cell(x, y0), cell(x, y1));
      for (let y = y0; y <= y1; y++) line(cell(x0, y), cell(x1, y));
      pens.stroke();
      if (zoom < NUMBERS_FROM * ratio) return;
      const size = Math.min(13 * ratio, zoom / 5);
      Object.assign(pens, { font: `${size}px ui-monospace, Menlo, Consolas, monospace`, textAlign: "center", textBaseline: "middle" });
      Object.assign(pens, { lineWidth: 3 * ratio, lineJoin: "round", strokeStyle: "#000", fillStyle: "#fff" });
      for (let y = y0; y < y1; y++) for (let x = x0; x < x1; x++) numbersAt(place.image, x, y).forEach((value, i, row) => {
        const [left, top] = cell(x, y), text = short(value);
        const at = [left + zoom / 2, top + zoom / 2 + (i - (row.length - 1) / 2) * 1.3 * size];
        pens.strokeText(text, ...at);
        pens.fillText(text, ...at);
      });
    }
    function outline(left, top, zoom) {
      const ratio = devicePixelRatio, gap = Math.max(0, (5 * ratio - zoom) / 2); // small pixels get room around them
      for (const [colour, away] of [["#000", 2.5], ["#fff", 1.5], ["#000", 0.5]]) {
        pens.strokeStyle = colour;
        pens.lineWidth = ratio;
        const grown = gap + away * ratio;
        pens.strokeRect(left - grown, top - grown, zoom + 2 * grown, zoom + 2 * grown);
      }
    }

    // ---- Legends and read-out ----

    // How real-time and truth become visible, in words. White is the value that is shown white.
    function shownAs(white) {
      if (check.display === "normal") return "(n + 1) / 2";
      if (check.display === "uv") return "red u, green v, 0 to 1";
      const tones = { srgb: "sRGB", reinhard: "Reinhard, sRGB", linear: "linear" };
      return can.tone ? `× ${short(1 / white)}, ${tones[state.tone]}` : `0 black, ${short(white)}${unitOf(check)} white`;
    }
    function legendOf(name) {
      const { diverging, magma, viridis } = check.colours, unit = unitOf(check), white = 1 / gain();
      const percent = short(100 * errorRange()), size = short(tileRange());
      if (name === "flip") return { colours: magma, ticks: ["0, not visible", "1"] };
      if (name === "error" && isRelative()) return { colours: diverging, ticks: [`−${percent} %`, "0", `+${percent} %`] };
      if (name === "error" || name === "significance") return { colours: diverging, ticks: [`−${size}`, "0", `+${size}${unit}`] };
      if (state.colour === "off" || !can.colour) return { colours: null, ticks: [shownAs(white)] };
      const black = state.colour === "log" ? [short(white / 10 ** DECADES), "logarithmic"] : ["0"];
      return { colours: viridis, ticks: [...black, short(white) + unit] };
    }
    function legends() {
      for (const pane of visible()) {
        const names = state.layout === "wipe" ? [state.shown, state.other] : [pane], title = find("figcaption", panes[pane]);
        title.dataset.own ??= title.textContent;
        title.textContent = names.length > 1 ? names.map(name => TITLES[name]).join(" | ") : title.dataset.own;
        all(".viewer-legend", panes[pane]).forEach((legend, i) => {
          legend.hidden = i >= names.length;
          if (!legend.hidden) showLegend(legend, legendOf(names[i]));
        });
      }
    }
    function showLegend(legend, { colours, ticks }) {
      const ramp = find(".viewer-ramp", legend);
      ramp.hidden = !colours;
      if (colours) ramp.style.background = `linear-gradient(to right, ${colours.join(", ")})`;
      find(".viewer-ticks", legend).replaceChildren(...ticks.map(text => element("span", text)));
    }

    const rowOf = cells => { const row = element("tr", ""); row.append(...cells); return row; };
    function readOut() {
      const where = part("where"), [head, body, facts] = ["thead", "tbody", "dl"].map(name => find(name, part("inspector")));
      if (!state.pixel) {
        where.textContent = "Point at a pixel, or press an arrow key, to read its values.";
        for (const each of [head, body, facts]) each.replaceChildren();
        return;
      }
      const seen = inspected(check, errors, state.pixel, isSmooth()), hasNoise = Boolean(check.values.sigma);
      where.replaceChildren(element("b", `x ${seen.x}, y ${seen.y}`), seen.judged ? unitOf(check) : " not judged");
      const columns = ["real-time", "truth", "error", ...(hasNoise ? ["in σ"] : [])];
      head.replaceChildren(rowOf([element("td", ""), ...columns.map(text => element("th", text, { scope: "col" }))]));
      body.replaceChildren(...seen.rows.map(({ name, realtime, truth, sigma, error }) => {
        const known = [written(truth) + (hasNoise ? ` ± ${written(sigma, 2)}` : ""), signed(error, 3), sigma > 0 ? signed(error / sigma, 3) : ""];
        const cells = [written(realtime), ...(seen.judged ? known : ["–", "–", "–"])].slice(0, columns.length);
        return rowOf([element("th", name, { scope: "row" }), ...cells.map(text => element("td", text))]);
      }));
      const known = seen.judged ? factsOf(seen) : [];
      facts.replaceChildren(...known.flatMap(([name, text]) => [element("dt", name), element("dd", text)]));
    }
    function factsOf(seen) {
      const relative = can.relative && seen.size > 0 ? ` = ${share(seen.error / seen.size)}` : "";
      const facts = [[isSmooth() ? "Error map, smoothed" : "Error map", signed(seen.error, 3) + relative]];
      if (seen.flip !== undefined) facts.push(["FLIP", written(seen.flip, 3)]);
      if (seen.tile !== undefined) facts.push(["Beyond noise", isFinite(seen.tile) ? `tile wrong by ${signed(seen.tile, 3)}` : "no error"]);
      return facts;
    }
    // The read-out for those who hear it.
    function spoken() {
      const rows = all("tbody tr", part("inspector")).map(row => [...row.cells].map(cell => cell.textContent).join(" "));
      return `${part("where").textContent}: ${rows.join("; ")}`;
    }

    // ---- Input ----

    const KEYS = {
      " ": flip, s: () => set({ layout: "side" }), w: () => set({ layout: "wipe" }), g: goToWorst, c: copyLink, r: reset,
      "+": actions.in, "=": actions.in, "-": actions.out, 0: actions.fit, "?": actions.help,
      e: () => add("stops", 0.5), E: () => add("stops", -0.5), "[": () => add("scale", -1), "]": () => add("scale", 1),
      t: () => next("tone"), f: () => next("colour"),
      d: () => can.relative && set({ relative: !state.relative }), m: () => set({ smooth: !state.smooth }), a: () => set({ all: !state.all }),
    };
    const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

    root.addEventListener("keydown", event => {
      if (event.ctrlKey || event.altKey || event.metaKey || help.open || event.target.tagName === "SELECT") return;
      const arrow = ARROWS[event.key], image = available.find(name => String(IMAGES.indexOf(name) + 1) === event.key);
      if ((arrow || event.key === " ") && event.target !== stage) return; // sliders and buttons have their own use for them
      if (arrow) event.shiftKey ? pan(48 * arrow[0], 48 * arrow[1]) : step(...arrow);
      else if (image) show(image);
      else if (Object.hasOwn(KEYS, event.key)) KEYS[event.key]();
      else return;
      event.preventDefault();
    });
    root.addEventListener("pointerenter", () => { if (document.activeElement === document.body) stage.focus({ preventScroll: true }); });
    root.addEventListener("click", event => {
      const { layout, image, do: action } = event.target.closest("button")?.dataset ?? {};
      if (layout) set({ layout });
      else if (image) show(image);
      else if (action) actions[action]();
    });
    root.addEventListener("input", ({ target }) => {
      const value = { checkbox: target.checked, range: Number(target.value) }[target.type] ?? target.value;
      if (target.name in DEFAULTS) set({ [target.name]: value });
    });

    // A place of the window: the offset from its pane's centre in CSS pixels, its share of the pane's width and that of
    // ten CSS pixels, and the image pixel there.
    const paneAt = event => event.target.closest?.(".viewer-image");
    function placeOf(event, pane) {
      const { left, top, width, height, originX, originY, zoom } = rectangleOf(pane.parentElement.dataset.pane);
      const ratio = devicePixelRatio, outer = stage.getBoundingClientRect();
      const [x, y] = [(event.clientX - outer.left) * ratio, (event.clientY - outer.top) * ratio];
      return {
        dx: (x - left - width / 2) / ratio, dy: (y - top - height / 2) / ratio, across: (x - left) / width,
        reach: 10 * ratio / width, pixel: [Math.floor((x - originX) / zoom), Math.floor((y - originY) / zoom)],
      };
    }
    const isInside = ([x, y]) => x >= 0 && y >= 0 && x < check.width && y < check.height;
    let drag = null; // what the pressed pointer moves: the view, or the line of the wipe
    stage.addEventListener("pointerdown", event => {
      const pane = paneAt(event);
      if (!pane || event.button !== 0) return;
      const { across, reach } = placeOf(event, pane);
      drag = { pane, wipes: state.layout === "wipe" && Math.abs(across - state.wipe) < reach, x: event.clientX, y: event.clientY };
      pane.setPointerCapture(event.pointerId);
      stage.focus({ preventScroll: true });
    });
    stage.addEventListener("pointermove", event => {
      const pane = drag?.pane ?? paneAt(event);
      if (!pane) return;
      const { pixel, across } = placeOf(event, pane);
      if (drag?.wipes) set({ wipe: clamp(across, 0, 1) });
      else if (drag) {
        pan(drag.x - event.clientX, drag.y - event.clientY);
        Object.assign(drag, { x: event.clientX, y: event.clientY });
      } else if (isInside(pixel)) set({ pixel });
    });
    for (const kind of ["pointerup", "pointercancel"]) stage.addEventListener(kind, () => { drag = null; });
    stage.addEventListener("dblclick", event => { if (paneAt(event)) actions.fit(); });
    let turned = 0; // of the wheel, since the last step
    stage.addEventListener("wheel", event => {
      const pane = paneAt(event);
      if (!pane || event.ctrlKey) return;
      event.preventDefault();
      turned += event.deltaY * (event.deltaMode ? 40 : 1);
      if (Math.abs(turned) < 40) return;
      const { dx, dy } = placeOf(event, pane);
      zoomBy(-Math.sign(turned), dx, dy);
      turned = 0;
    }, { passive: false });

    function follow(hash = location.hash) {
      const told = stateOf(hash, check, available), [x, y] = told?.pixel ?? [(check.width - 1) / 2, (check.height - 1) / 2];
      if (told) set({ ...DEFAULTS, x: x + 0.5, y: y + 0.5, ...told });
    }
    root.hidden = false;
    draw();
    follow();
    addEventListener("hashchange", () => follow());
    // Elsewhere on the page, a link to a pixel leads back to the images, again and again.
    document.addEventListener("click", event => {
      const link = event.target.closest("a[href^='#pixel=']");
      if (link) { follow(link.hash); root.scrollIntoView(); }
    });
    new ResizeObserver(() => requestAnimationFrame(draw)).observe(stage);
    return { check, errors, state, set };
  }

  // Called by pixels/STEM.js, after assets/controls.js has set `controls`, the markup of the viewer. `ready` is fulfilled when the viewer is there, or its place is left to the pictures.
  async function show(data) {
    const root = find(".viewer", document), failed = find(".viewer-failed", document);
    try {
      root.innerHTML = lightgauge.controls;
      for (const pane of all(".viewer-pane", root)) {
        const what = `${find("figcaption", pane).textContent} of ${root.dataset.title}`;
        find(".viewer-image", pane).setAttribute("aria-label", what);
      }
      lightgauge.viewer = viewerOf(root, await decoded(data));
      find(".viewer-static", document).hidden = true;
    } catch (error) {
      root.hidden = true;
      failed.hidden = false;
      failed.textContent = `The viewer cannot start (${error.message}), so there is no zoom, exposure or read-out. The pictures `
        + "below are complete. Another browser, or hardware acceleration in the settings of this one, would show more.";
    }
  }
  return { viewer: null, ready: null, controls: "", show: data => { lightgauge.ready = show(data); } };
})();
