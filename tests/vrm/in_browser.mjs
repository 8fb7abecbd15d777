// Plays a VRM file in Debian's Chromium and writes the vertices of its meshes:
//   node in_browser.mjs PACKAGES AVATAR.vrm MOTION.json OUT
// PACKAGES holds node_modules with playwright-core, three and @pixiv/three-vrm. MOTION.json is as play.mjs takes it, with the frames that
// are wanted under "wanted". OUT.MESH.f32 gets the vertices of each mesh, frame after frame (little-endian, metres).
import { createReadStream, existsSync, readFileSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import { join, normalize, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [packages, avatar, motion, out] = process.argv.slice(2);
const PROGRAMS = ["/usr/bin/chromium", "/usr/bin/chromium-browser"];
const PAGE = `<!doctype html><meta charset="utf-8"><title>springs</title><link rel="icon" href="data:,"><script type="importmap">${JSON.stringify({
  imports: {
    three: "/node_modules/three/build/three.module.js",
    "three/addons/": "/node_modules/three/examples/jsm/",
    "@pixiv/three-vrm": "/node_modules/@pixiv/three-vrm/lib/three-vrm.module.js",
  },
})}</script><script type="module">
import { load, play } from "/play.mjs";
window.ready = { load, play };
</script>`;

const places = { "/play.mjs": fileURLToPath(new URL("play.mjs", import.meta.url)), "/avatar.vrm": avatar, "/motion.json": motion };
const server = createServer((request, response) => {
  if (request.url === "/") return response.setHeader("content-type", "text/html").end(PAGE);
  const path = places[request.url] ?? join(packages, normalize(request.url));
  if (!existsSync(path)) return response.writeHead(404).end();
  if (/\.m?js$/.test(path)) response.setHeader("content-type", "text/javascript");
  createReadStream(path).pipe(response);
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));

const { chromium } = createRequire(resolve(packages, "package.json"))("playwright-core");
const executablePath = PROGRAMS.find((path) => existsSync(path));
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--disable-gpu"] });
try {
  const page = await browser.newPage();
  const faults = [];
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => window.ready !== undefined, null, { timeout: 60_000 }).catch((error) => {
    throw new Error([String(error), ...faults].join("\n"));
  });
  const meshes = await page.evaluate(async () => {
    const bytes = await (await fetch("/avatar.vrm")).arrayBuffer();
    const motion = await (await fetch("/motion.json")).json();
    const vrm = await window.ready.load(bytes);
    const played = window.ready.play(vrm, motion, motion.wanted);
    const text = (frame) => {
      const bytes = new Uint8Array(frame.buffer);
      let letters = "";
      for (let k = 0; k < bytes.length; k += 8192) letters += String.fromCharCode(...bytes.subarray(k, k + 8192));
      return btoa(letters);
    };
    return Object.entries(played).map(([name, frames]) => [name, frames.map(text)]);
  });
  for (const [name, frames] of meshes) writeFileSync(`${out}.${name}.f32`, Buffer.concat(frames.map((f) => Buffer.from(f, "base64"))));
  if (faults.length > 0) throw new Error(faults.join("\n"));
} finally {
  await browser.close();
  server.close();
}
