// The view of a specimen that turns under the mouse. Bundled with three.js into view.min.js; README.md says how.
import {
  AmbientLight, BufferAttribute, BufferGeometry, ConeGeometry, CylinderGeometry, DirectionalLight, DoubleSide, LineBasicMaterial, LineSegments,
  Mesh, MeshBasicMaterial, MeshLambertMaterial, OrthographicCamera, Scene, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

// Values of voxels with x fastest, with one more layer on each side that puts the surface on the box's faces.
function padded(values, n, level) {
  const m = n.map((c) => c + 2);
  const all = new Float32Array(m[0] * m[1] * m[2]);
  for (let z = 0; z < m[2]; z++) for (let y = 0; y < m[1]; y++) for (let x = 0; x < m[0]; x++) {
    const at = [x, y, z].map((c, a) => Math.min(Math.max(c - 1, 0), n[a] - 1));
    const value = values[at[0] + n[0] * (at[1] + n[1] * at[2])];
    const inside = at[0] === x - 1 && at[1] === y - 1 && at[2] === z - 1;
    all[x + m[0] * (y + m[1] * z)] = inside ? value : Math.min(2 * level - value, level - 1);
  }
  return { all, m };
}

// Naive surface nets (Gibson 1998): one vertex in each cell that the surface crosses, one quadrilateral across each crossed edge.
function surface({ all, m }, level) {
  const steps = [1, m[0], m[0] * m[1]];
  const edges = [];
  for (let a = 0; a < 8; a++) for (let axis = 0; axis < 3; axis++) if (!(a >> axis & 1)) edges.push([a, a | 1 << axis, axis]);
  const corner = (c) => (c & 1) + (c >> 1 & 1) * steps[1] + (c >> 2) * steps[2];
  const offsets = [0, 1, 2, 3, 4, 5, 6, 7].map(corner);
  const number = new Int32Array(all.length).fill(-1);
  const places = [];
  const faces = [];
  for (let z = 0; z < m[2] - 1; z++) for (let y = 0; y < m[1] - 1; y++) for (let x = 0; x < m[0] - 1; x++) {
    const at = x + steps[1] * y + steps[2] * z;
    let mask = 0;
    for (let c = 0; c < 8; c++) if (all[at + offsets[c]] >= level) mask |= 1 << c;
    if (mask === 0 || mask === 255) continue;
    let count = 0;
    const sum = [0, 0, 0];
    for (const [a, b, axis] of edges) {
      if ((mask >> a & 1) === (mask >> b & 1)) continue;
      const low = all[at + offsets[a]];
      const share = (level - low) / (all[at + offsets[b]] - low);
      for (let c = 0; c < 3; c++) sum[c] += (a >> c & 1) + (c === axis ? share : 0);
      count += 1;
    }
    number[at] = places.length / 3;
    places.push(x + sum[0] / count, y + sum[1] / count, z + sum[2] / count);
    // Edges from the cell's first corner: the cells around each were all seen before.
    const position = [x, y, z];
    for (let axis = 0; axis < 3; axis++) {
      const u = (axis + 1) % 3, v = (axis + 2) % 3;
      if ((mask & 1) === (mask >> (1 << axis) & 1) || position[u] === 0 || position[v] === 0) continue;
      const quad = [at, at - steps[u], at - steps[u] - steps[v], at - steps[v]].map((i) => number[i]);
      if (!(mask & 1)) quad.reverse();
      faces.push(quad[0], quad[1], quad[2], quad[0], quad[2], quad[3]);
    }
  }
  return { places, faces };
}

// Means of blocks of four voxels a side, smoothed by their neighbours.
function blocks({ all, m }) {
  const n = m.map((c) => Math.ceil(c / 4));
  const sums = new Float32Array(n[0] * n[1] * n[2]);
  for (let z = 0; z < m[2]; z++) for (let y = 0; y < m[1]; y++) for (let x = 0; x < m[0]; x++) {
    sums[(x >> 2) + n[0] * ((y >> 2) + n[1] * (z >> 2))] += Math.max(all[x + m[0] * (y + m[1] * z)], 0) / (64 * 255);
  }
  return ([x, y, z]) => {
    let sum = 0, weights = 0;
    const q = [x / 4 - 0.5, y / 4 - 0.5, z / 4 - 0.5];
    for (let c = 0; c < 64; c++) {
      const at = [c & 3, c >> 2 & 3, c >> 4].map((d, a) => Math.floor(q[a]) - 1 + d);
      const weight = at.reduce((w, i, a) => w * Math.max(0, 1.6 - Math.abs(i - q[a])), 1);
      weights += weight;
      if (at.every((i, a) => i >= 0 && i < n[a])) sum += weight * sums[at[0] + n[0] * (at[1] + n[1] * at[2])];
    }
    return sum / weights;
  };
}

// Colours of the vertices: the bone's, or a field's, darker where bone stands before them.
function colours(net, volume, normals, painted) {
  const around = blocks(volume);
  const tint = new Float32Array(net.places.length);
  for (let i = 0; i < tint.length; i += 3) {
    const place = [0, 1, 2].map((c) => net.places[i + c]);
    const before = (far) => around(place.map((p, c) => p + far * normals[i + c]));
    const light = Math.min(1, Math.max(0.2, 1.15 - 1.0 * before(2) - 1.0 * before(5)));
    painted(place.map((p, c) => p - 0.7 * normals[i + c])).forEach((v, c) => { tint[i + c] = v * light; });
  }
  return tint;
}

const linear = (c) => Math.pow(c / 255, 2.2);
const BONE = [238, 226, 202].map(linear);

// The colour of the mean of the field's voxels around a place; 0 stands for no value.
function painter(field, n, scale) {
  if (!field) return () => BONE;
  return (place) => {
    let sum = 0, weights = 0;
    const q = place.map((p) => p - 1);
    for (let c = 0; c < 8; c++) {
      const at = [c & 1, c >> 1 & 1, c >> 2].map((d, a) => Math.min(Math.max(Math.floor(q[a]) + d, 0), n[a] - 1));
      const value = field[at[0] + n[0] * (at[1] + n[1] * at[2])];
      if (value === 0) continue;
      const weight = at.reduce((w, i, a) => w * Math.max(0.001, 1 - Math.abs(i - q[a])), 1);
      sum += weight * (value - 1) / 254;
      weights += weight;
    }
    if (weights === 0) return [0.3, 0.3, 0.3];
    const at = Math.min(sum / weights, 0.9999) * (scale.length - 1);
    const k = Math.floor(at);
    return scale[k].map((low, c) => linear(low + (at - k) * (scale[k + 1][c] - low)));
  };
}

function body(data) {
  const volume = padded(data.values, data.n, data.level);
  const net = surface(volume, data.level);
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(net.places), 3));
  geometry.setIndex(new BufferAttribute(new Uint32Array(net.faces), 1));
  geometry.computeVertexNormals();
  const normals = geometry.getAttribute("normal").array;
  geometry.setAttribute("color", new BufferAttribute(colours(net, volume, normals, painter(data.field, data.n, data.scale)), 3));
  const h = data.voxel_mm;
  geometry.translate(-0.5, -0.5, -0.5).scale(h[0], h[1], h[2]).translate(...data.size_mm.map((s) => -s / 2));
  return new Mesh(geometry, new MeshLambertMaterial({ vertexColors: true, side: DoubleSide }));
}

function box(size) {
  const points = [];
  for (let a = 0; a < 8; a++) for (let axis = 0; axis < 3; axis++) if (!(a >> axis & 1)) {
    for (const c of [a, a | 1 << axis]) points.push(...size.map((s, i) => (c >> i & 1 ? s / 2 : -s / 2)));
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ color: 0x8a9198 }));
}

// Two heads and a shaft along the load axis, next to the box.
function arrow(size, axis, largest) {
  const parts = [];
  const ink = new MeshBasicMaterial({ color: 0x1e1e1e });
  const place = new Vector3(...size.map((s, a) => (a === axis ? 0 : -s / 2 - 0.05 * largest)));
  const turn = (mesh) => {
    if (axis === 0) mesh.rotateZ(-Math.PI / 2);
    if (axis === 2) mesh.rotateX(Math.PI / 2);
    return mesh;
  };
  const length = size[axis], head = 0.045 * largest;
  const shaft = turn(new Mesh(new CylinderGeometry(0.004 * largest, 0.004 * largest, length - head), ink));
  shaft.position.copy(place);
  parts.push(shaft);
  for (const end of [-1, 1]) {
    const cone = turn(new Mesh(new ConeGeometry(0.35 * head, head), ink));
    if (end < 0) cone.rotateX(Math.PI);
    cone.position.copy(place);
    cone.position.setComponent(axis, end * (length - head) / 2);
    parts.push(cone);
  }
  const top = place.clone().setComponent(axis, length / 2);
  return { parts, top };
}

async function bytes(id) {
  const text = document.getElementById(id)?.textContent.trim();
  if (!text) return null;
  const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function roundLength(most) {
  const decade = Math.pow(10, Math.floor(Math.log10(most)));
  return [5, 2, 1].map((s) => s * decade).find((l) => l <= most * (1 + 1e-9));
}

async function start() {
  const data = JSON.parse(document.getElementById("specimen").textContent);
  data.values = await bytes("values");
  data.field = await bytes("field");
  const canvas = document.getElementById("view");
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.setClearColor(0xffffff);
  const largest = Math.max(...data.size_mm);
  const radius = Math.hypot(...data.size_mm) / 2;
  const scene = new Scene();
  const { parts, top } = arrow(data.size_mm, data.load_axis, largest);
  scene.add(body(data), box(data.size_mm), ...parts);
  const camera = new OrthographicCamera(-1, 1, 1, -1, 0.01 * radius, 12 * radius);
  camera.up.set(0, 0, 1);
  const [az, el] = [-58, 24].map((d) => d * Math.PI / 180);
  camera.position.set(Math.cos(el) * Math.cos(az), Math.cos(el) * Math.sin(az), Math.sin(el)).multiplyScalar(5 * radius);
  const key = new DirectionalLight(0xffffff, 2.5);
  key.position.set(-0.55, 0.62, 0.56);
  camera.add(key);
  scene.add(camera, new AmbientLight(0xffffff, 0.95));
  const controls = new OrbitControls(camera, canvas);
  controls.minZoom = 0.5;
  controls.maxZoom = 20;
  const bar = document.getElementById("bar"), name = document.getElementById("length"), load = document.getElementById("load");
  const draw = () => {
    renderer.render(scene, camera);
    const perMm = canvas.clientWidth * camera.zoom / (camera.right - camera.left);
    const mm = roundLength(Math.min(180, 0.4 * canvas.clientWidth) / perMm);
    bar.style.width = `${mm * perMm}px`;
    name.textContent = mm < 0.1 ? `${+(mm * 1000).toPrecision(6)} µm` : `${+mm.toPrecision(6)} mm`;
    const at = top.clone().project(camera);
    load.style.left = `${(at.x + 1) / 2 * canvas.clientWidth}px`;
    load.style.top = `${(1 - at.y) / 2 * canvas.clientHeight}px`;
  };
  const fit = () => {
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    const half = 1.08 * radius * Math.max(1, height / width);
    const wide = half * width / height;
    Object.assign(camera, { left: -wide, right: wide, top: half, bottom: -half });
    camera.updateProjectionMatrix();
    draw();
  };
  controls.addEventListener("change", draw);
  addEventListener("resize", fit);
  fit();
  document.body.dataset.ready = "yes";
}

start().catch((error) => {
  document.getElementById("hint").textContent = `The view could not be drawn (${error.message}). It needs WebGL and a browser of 2023 or newer; the still picture shows the same.`;
});
