// Debian's Chromium, driven by playwright-core. Errors in the console fail; pictures go to target/console.
import assert from "node:assert/strict";
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { chromium } from "playwright-core";

const PICTURES = new URL("../../target/console/", import.meta.url).pathname;
const PROGRAMS = ["/usr/bin/chromium", "/usr/bin/chromium-browser"];
// A machine without a graphics card draws by SwiftShader.
const DRAWING = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

// Ends what hangs; a machine that does much beside may take its time.
const WAIT_MS = 120_000;

mkdirSync(PICTURES, { recursive: true });

export async function openBrowser({ webgl = true } = {}) {
  const executablePath = PROGRAMS.find((path) => existsSync(path));
  assert.ok(executablePath, "Chromium is missing; scripts/console.sh e2e installs it");
  const drawing = webgl ? DRAWING : ["--disable-gpu", "--disable-3d-apis"];
  return await chromium.launch({ executablePath, args: ["--no-sandbox", ...drawing, "--autoplay-policy=no-user-gesture-required"] });
}

/** A page that collects errors of its console, exceptions, and requests to elsewhere. */
export async function openPage(browser, address, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1440, height: 900 }, acceptDownloads: true, bypassCSP: false, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(WAIT_MS);
  const faults = [];
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (!["blob:", "data:"].includes(url.protocol) && url.host !== new URL(address).host) faults.push(`asked elsewhere: ${url}`);
  });
  await page.goto(`${address}/`);
  return { page, faults, close: () => context.close() };
}

export async function picture(page, name) {
  await page.screenshot({ path: `${PICTURES}${name}.png` });
}

/** No finding of axe-core that is serious or critical. It comes in over the debugging line, so the page's policy stays in force. */
export async function isAccessible(page, name) {
  await page.evaluate(AXE);
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  const bad = violations.filter((v) => ["serious", "critical"].includes(v.impact));
  const told = bad.map((v) => `${name}: ${v.id} (${v.impact}): ${v.help}\n    ${v.nodes.slice(0, 3).map((n) => n.html.slice(0, 160)).join("\n    ")}`);
  assert.equal(told.join("\n"), "");
}

/** Waits until nothing is being read for the picture in space. */
export async function drawn(page) {
  await page.waitForFunction(() => document.querySelector("canvas")?.viewer?.content.children.length > 0, null);
  await page.waitForFunction(() => document.querySelector(".stage-busy") === null, null);
}

/**
 * Where a line down the surface is in the window: at the first height its point nearest to the camera, which nothing hides,
 * at the others the points nearest to that. Which way a scan looks depends on the moment when its take began.
 */
export async function windowLine(page, heights) {
  return await page.evaluate((list) => {
    const { viewer } = document.querySelector(".stage canvas");
    const points = [];
    viewer.content.traverse((part) => {
      if (!part.isMesh || !part.visible || part.geometry.getAttribute("position") === undefined) return;
      const { array } = part.geometry.getAttribute("position");
      for (let k = 0; k + 2 < array.length; k += 3) points.push([array[k], array[k + 1], array[k + 2]]);
    });
    const eye = viewer.camera.position;
    let from = [eye.x, eye.y, eye.z];
    return list.map((height) => {
      const far = (p) => (p[0] - from[0]) ** 2 + (p[2] - from[2]) ** 2;
      const level = points.filter((p) => Math.abs(p[1] - height) < 0.015);
      from = level.reduce((best, p) => (far(p) < far(best) ? p : best));
      return viewer.windowPlace(from);
    });
  }, heights);
}
