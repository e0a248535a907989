// Checks that a map.ply opens in Spark: loads it with the reader of @sparkjsdev/spark and compares
// every splat with what stands in the file. Of an SPZ file that `covsplat export` made of that map,
// it compares every splat with the map.ply as well.
//
//   node tools/check_map.mjs map.ply [map.spz]     (make check-map MAP=folder/map.ply does all)
//
// Exit code 0: Spark sees what was written; 1: it does not, or a property is missing; 2: usage.
import { resolveObjectURL } from "node:buffer";
import { readFileSync } from "node:fs";
import { Worker as NodeWorker } from "node:worker_threads";

const REQUIRED = [
  "x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
  "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];
const EXPECTED = ["nx", "ny", "nz", "confidence", "control_score", "intensity", "last_seen"];
const RENDER_MODE = "SplatRenderMode: 2dgs";
const SIZES = {
  char: 1, int8: 1, uchar: 1, uint8: 1, short: 2, int16: 2, ushort: 2, uint16: 2,
  int: 4, int32: 4, uint: 4, uint32: 4, float: 4, float32: 4, double: 8, float64: 8,
};
const FLOAT_TYPES = ["float", "float32"];
const SH_C0 = 0.28209479177387814;
// Spark's ExtSplats keep positions as float32, the rest as half floats and 32-bit quaternions.
const TOLERANCE = { position: 0, ln_scale: 0.01, opacity: 0.001, color: 0.005, rotation_rad: 0.01 };
// Half a step of SPZ, and the above.
const SPZ_TOLERANCE = {
  position: 0.5 / 4096 + 1e-5, ln_scale: 0.5 / 16 + 0.01, opacity: 0.5 / 255 + 0.001,
  color: 0.5 / 255 / 0.15 * SH_C0 + 0.005, rotation_rad: 0.015,
};

function parseHeader(bytes) {
  const text = bytes.subarray(0, 65536).toString("latin1");
  const end = /end_header\r?\n/.exec(text);
  if (!text.startsWith("ply") || !end) throw new Error("no PLY header");
  const header = { comments: [], properties: [], count: 0, stride: 0, format: "" };
  let element = "";
  for (const line of text.slice(0, end.index).split(/\r?\n/)) {
    const [keyword, ...words] = line.split(" ");
    if (keyword === "format") header.format = words[0];
    if (keyword === "comment") header.comments.push(words.join(" "));
    if (keyword === "element") {
      element = words[0];
      if (element === "vertex") header.count = Number(words[1]);
      else if (header.properties.length === 0) throw new Error(`element ${element} before vertex`);
    }
    if (keyword === "property" && element === "vertex") {
      const [type, name] = words;
      if (!(type in SIZES)) throw new Error(`property ${words.join(" ")}: unknown type`);
      header.properties.push({ name, type, offset: header.stride });
      header.stride += SIZES[type];
    }
  }
  return { ...header, dataStart: end.index + end[0].length };
}

/** Values of the float properties by name, read from the file without Spark. */
function parseColumns(bytes, header) {
  const view = new DataView(bytes.buffer, bytes.byteOffset + header.dataStart);
  const columns = {};
  for (const { name, type, offset } of header.properties) {
    if (!FLOAT_TYPES.includes(type)) continue;
    columns[name] = Float32Array.from({ length: header.count }, (_, i) =>
      view.getFloat32(i * header.stride + offset, true));
  }
  return columns;
}

function headerProblems(bytes, header) {
  const problems = [];
  if (header.format !== "binary_little_endian") problems.push(`format is ${header.format}`);
  const types = new Map(header.properties.map((p) => [p.name, p.type]));
  for (const name of REQUIRED) {
    if (!types.has(name)) problems.push(`property ${name} is missing`);
    else if (!FLOAT_TYPES.includes(types.get(name))) problems.push(`property ${name} is no float`);
  }
  const bytesLeft = bytes.length - header.dataStart;
  const wanted = header.count * header.stride;
  if (bytesLeft < wanted) problems.push(`truncated: ${bytesLeft} of ${wanted} bytes of splats`);
  if (!header.comments.includes(RENDER_MODE)) problems.push(`comment ${RENDER_MODE} is missing`);
  if (header.count === 0) problems.push("no splats");
  return problems;
}

/** What Spark expects of a browser: workers from blob or data URLs, and `self`. */
function stubBrowser() {
  const prelude = `
    const { parentPort } = require("node:worker_threads");
    const handlers = new Map();
    globalThis.self = globalThis;
    self.postMessage = (message, options) => parentPort.postMessage(message, options?.transfer);
    self.addEventListener = (_, handler) => {
      handlers.set(handler, (data) => handler({ data }));
      parentPort.on("message", handlers.get(handler));
    };
    self.removeEventListener = (_, handler) => parentPort.off("message", handlers.get(handler));
  `;
  globalThis.self = globalThis;
  globalThis.Worker = class {
    constructor(url) {
      const blob = resolveObjectURL(String(url));
      const text = blob ? blob.text() : Promise.resolve(decodeURIComponent(url.split(",", 2)[1]));
      this.started = text.then((code) => {
        const worker = new NodeWorker(prelude + code, { eval: true });
        worker.unref();
        worker.on("message", (data) => this.onmessage?.({ data }));
        worker.on("error", (error) => { throw error; });
        return worker;
      });
    }
    addEventListener() {}
    postMessage(message, options) {
      this.started.then((worker) => worker.postMessage(message, options?.transfer));
    }
    terminate() {
      this.started.then((worker) => worker.terminate());
    }
  };
}

async function loadWithSpark(path, bytes) {
  stubBrowser();
  const { ExtSplats } = await import("@sparkjsdev/spark");
  const splats = new ExtSplats({ fileBytes: new Uint8Array(bytes), fileName: path });
  // Waiting for an unreferenced worker alone would let node exit.
  const keepAlive = setInterval(() => {}, 1000);
  try {
    return await splats.initialized;
  } finally {
    clearInterval(keepAlive);
  }
}

/** The map's frame (forward, left, up) turned to SPZ's (right, up, back). */
function columnsInSpzFrame(c) {
  const negated = (column) => column.map((value) => -value);
  const [w, x, y, z] = [c.rot_0, c.rot_1, c.rot_2, c.rot_3];
  // (w x y z) = (0.5 -0.5 0.5 0.5) takes the map's x to -z, y to -x and z to y.
  const turned = (f) => w.map((_, i) => 0.5 * f(w[i], x[i], y[i], z[i]));
  return {
    ...c, x: negated(c.y), y: c.z, z: negated(c.x),
    rot_0: turned((w, x, y, z) => w + x - y - z), rot_1: turned((w, x, y, z) => x - w + z - y),
    rot_2: turned((w, x, y, z) => y + w + z + x), rot_3: turned((w, x, y, z) => z + w - y - x),
  };
}

/** Spark's splat next to the file's: the differences by kind. */
function differences(splat, c, i) {
  const rotation = [c.rot_1[i], c.rot_2[i], c.rot_3[i], c.rot_0[i]];
  const { x, y, z, w } = splat.quaternion;
  const dot = rotation[0] * x + rotation[1] * y + rotation[2] * z + rotation[3] * w;
  const cosine = Math.abs(dot) / (Math.hypot(...rotation) * Math.hypot(x, y, z, w));
  const most = (a, b) => a.reduce((worst, value, k) => {
    const gap = Math.abs(value - b[k]);
    return gap > worst || Number.isNaN(gap) ? gap : worst;
  }, 0);
  const { center, scales, color } = splat;
  return {
    position: most([center.x, center.y, center.z], [c.x[i], c.y[i], c.z[i]]),
    ln_scale: most([scales.x, scales.y, scales.z].map(Math.log),
      [c.scale_0[i], c.scale_1[i], c.scale_2[i]]),
    opacity: Math.abs(splat.opacity - 1 / (1 + Math.exp(-c.opacity[i]))),
    color: most([color.r, color.g, color.b],
      [c.f_dc_0[i], c.f_dc_1[i], c.f_dc_2[i]].map((f) => 0.5 + SH_C0 * f)),
    rotation_rad: cosine <= 1 ? 2 * Math.acos(cosine) : cosine < 1.001 ? 0 : NaN,
  };
}

function compare(splats, columns, count, tolerance) {
  const problems = [];
  if (splats.numSplats !== count) {
    return [`Spark found ${splats.numSplats} splats, the file has ${count}`];
  }
  for (const name of REQUIRED) {
    const bad = columns[name].findIndex((value) => !Number.isFinite(value));
    if (bad >= 0) problems.push(`${name} of splat ${bad} is ${columns[name][bad]}`);
  }
  const worst = Object.fromEntries(Object.keys(tolerance).map((kind) => [kind, { gap: 0, at: 0 }]));
  for (let i = 0; i < count; ++i) {
    for (const [kind, gap] of Object.entries(differences(splats.getSplat(i), columns, i))) {
      const known = Number.isNaN(worst[kind].gap);  // NaN is worst and stays
      if (!known && !(gap <= worst[kind].gap)) worst[kind] = { gap, at: i };
    }
  }
  for (const [kind, { gap, at }] of Object.entries(worst)) {
    const good = gap <= tolerance[kind];
    console.log(`  ${kind.padEnd(12)} differs by at most ${gap.toPrecision(3)} (splat ${at})`);
    if (!good) problems.push(`${kind} differs by ${gap} at splat ${at}, not ${tolerance[kind]}`);
  }
  return problems;
}

async function check(path, spzPath) {
  const bytes = readFileSync(path);
  const header = parseHeader(bytes);
  const names = header.properties.map((p) => p.name);
  console.log(`${path}: ${header.count} splats, ${names.length} properties`);
  console.log(`  comments: ${header.comments.join(", ") || "none"}`);
  const problems = headerProblems(bytes, header);
  const unseen = EXPECTED.filter((name) => !names.includes(name));
  if (unseen.length > 0) console.log(`  not there, though covsplat writes them: ${unseen.join(" ")}`);
  if (problems.length > 0) return problems;
  const columns = parseColumns(bytes, header);
  problems.push(...compare(await loadWithSpark(path, bytes), columns, header.count, TOLERANCE));
  if (!spzPath) return problems;
  const spzBytes = readFileSync(spzPath);
  console.log(`${spzPath}: ${(spzBytes.length / header.count).toFixed(1)} bytes per splat`);
  const spz = await loadWithSpark(spzPath, spzBytes);
  const spzColumns = columnsInSpzFrame(columns);
  return [...problems, ...compare(spz, spzColumns, header.count, SPZ_TOLERANCE)];
}

const [path, spzPath, ...rest] = process.argv.slice(2);
if (!path || rest.length > 0) {
  console.error("usage: node tools/check_map.mjs map.ply [map.spz]");
  process.exit(2);
}
let problems;
try {
  problems = await check(path, spzPath);
} catch (error) {
  problems = [String(error?.message ?? error)];
}
for (const problem of problems) console.error(`${[path, spzPath].join(" ")}: ${problem}`);
console.log(problems.length === 0 ? "Spark reads it as written." : "Not as Spark needs it.");
process.exit(problems.length === 0 ? 0 : 1);
