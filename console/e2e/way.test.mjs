// The whole way in the browser, with the virtual person: new subject, body, trousers, process, look, brush, animate, download.
import assert from "node:assert/strict";
import { existsSync, readdirSync, readFileSync, statSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { drawn, isAccessible, openBrowser, openPage, picture, windowLine } from "./browser.mjs";
import { startService } from "./service.mjs";

// The virtual person is drawn before the camera opens.
const OPEN_MS = 240_000;
const TAKE_MS = 240_000;
const PROCESS_MS = 600_000;
// The virtual person has turned once round by then. Where the machine is too busy to follow her, the page does not know it and the take is ended by hand.
const TURN_S = 15.5;
// Coarse, so that the way takes minutes on two cores.
const SETTINGS = "[fusion]\nvoxel_size = 0.008\ntruncation = 0.024\nclosing_rounds = 2\nrefine_rounds = 0\ntarget_triangles = 30000\n[texture]\nsize = 1024\nphotos = 24\n";

let service, browser, tab;

before(async () => {
  service = await startService();
  browser = await openBrowser();
  tab = await openPage(browser, service.address);
});

after(async () => {
  await browser?.close();
  await service?.stop();
});

const subjectFile = (file) => join(service.archive, "mira", file);

async function recordTake(page, layer) {
  await page.getByLabel("Countdown").selectOption("0");
  await page.waitForFunction(() => Number(document.querySelector(".pace")?.dataset.rate) > 0, null, { timeout: 120_000 });
  await page.getByRole("button", { name: "Start", exact: true }).click();
  await page.getByRole("button", { name: "End the take" }).waitFor();
  await page.locator(".ring").waitFor();
  await page.waitForTimeout(3000);
  const { rate, age } = await page.locator(".pace").evaluate((told) => told.dataset);
  console.log(`# ${layer}: ${rate} pictures a second, ${age} ms old`);
  await picture(page, `scan-${layer}-recording`);
  if (layer === "body") await isAccessible(page, "scan, recording");
  const kept = page.getByRole("button", { name: "Keep, next layer" });
  const recorded = async () => (await page.evaluate(async () => (await (await fetch("/api/capture")).json()).seconds ?? 0)) > TURN_S;
  for (const began = Date.now(); !(await kept.isVisible()) && !(await recorded()); ) {
    assert.ok(Date.now() - began < TAKE_MS, "the take does not get longer");
    await page.waitForTimeout(500);
  }
  if (!(await kept.isVisible())) await page.getByRole("button", { name: "End the take" }).click({ timeout: 5000 }).catch(() => console.log(`# ${layer}: ended by itself meanwhile`));
  await kept.waitFor({ timeout: TAKE_MS }).catch(async (error) => {
    await picture(page, "scan-stuck");
    throw error;
  });
}

async function jobDone(page) {
  // The page knows of a job a moment after it was opened; the service knows it at once.
  const atWork = () => page.evaluate(async () => (await (await fetch("/api/jobs")).json()).some((job) => ["queued", "running"].includes(job.state)));
  for (const began = Date.now(); await atWork(); ) {
    assert.ok(Date.now() - began < PROCESS_MS, "the job does not end");
    await page.waitForTimeout(500);
  }
  await page.waitForFunction(() => document.querySelector(".subject-job") === null, null, { timeout: PROCESS_MS });
}

test("a new subject is added and scanned in underwear, then in trousers", async () => {
  const { page } = tab;
  await page.getByRole("button", { name: "New subject" }).click();
  await page.getByRole("textbox", { name: "Name" }).fill("Mira");
  await picture(page, "archive-new");
  await page.getByRole("button", { name: "Create and scan" }).click();
  await page.getByText("Virtual").first().waitFor();
  await page.getByRole("radio", { name: /virtual/i }).check();
  await picture(page, "scan-setup");
  await isAccessible(page, "scan, before");
  await page.getByRole("button", { name: "Open the camera" }).click();
  await page.getByRole("button", { name: "Start", exact: true }).waitFor({ timeout: OPEN_MS });
  await page.waitForTimeout(1500);
  await picture(page, "scan-preview");
  await recordTake(page, "body");
  await picture(page, "scan-review");
  await isAccessible(page, "scan, after");
  await page.getByRole("button", { name: "Keep, next layer" }).click();
  await page.getByRole("button", { name: "Start", exact: true }).waitFor({ timeout: OPEN_MS });
  await recordTake(page, "trousers");
  await page.getByRole("button", { name: "Keep, and finish" }).click();
  await page.getByRole("heading", { name: "Mira" }).waitFor();
  const takes = readdirSync(subjectFile("takes")).filter((name) => name.endsWith(".mcap")).sort();
  assert.deepEqual(takes, ["00-body.mcap", "01-trousers.mcap"]);
});

test("the takes are looked through frame by frame", async () => {
  const { page } = tab;
  await page.getByRole("tab", { name: "Frames" }).click();
  await page.locator(".frame-pair img").nth(3).waitFor();
  await page.getByLabel("Place in the turn").evaluate((slider) => {
    slider.value = "0.5"; // snaps to a frame, which fill() would refuse
    slider.dispatchEvent(new Event("input", { bubbles: true }));
  });
  await page.waitForTimeout(1500);
  await picture(page, "subject-frames");
  assert.ok(await page.locator(".frame-pair img").first().evaluate((img) => img.naturalWidth > 100));
});

test("processing shows its progress and ends with an avatar", { timeout: PROCESS_MS + 20_000 }, async () => {
  const { page } = tab;
  writeFileSync(subjectFile("toile.toml"), SETTINGS);
  await page.getByRole("button", { name: "Process" }).click();
  await page.locator(".subject-job").waitFor({ timeout: 10_000 });
  await page.getByRole("link", { name: "Jobs" }).click();
  await page.getByRole("button", { name: "Log" }).first().click();
  await page.waitForTimeout(2500);
  await picture(page, "jobs");
  await isAccessible(page, "jobs");
  await page.locator(".job-what a").first().click();
  await page.getByRole("heading", { name: "Mira" }).waitFor();
  await jobDone(page);
  assert.ok(existsSync(subjectFile("avatar.glb")), service.told());
});

test("the result is looked at in all views", async () => {
  const { page } = tab;
  for (const [tabName, name] of [["Layers", "layers"], ["Scans", "scans"], ["Measurements", "measures"], [/Warnings/, "warnings"], ["Files", "files"]]) {
    await page.getByRole("tab", { name: tabName }).click();
    await drawn(page);
    await page.waitForTimeout(500);
    await picture(page, `subject-${name}`);
    await isAccessible(page, `subject, ${name}`);
  }
  await page.getByRole("tab", { name: "Scans" }).click();
  await page.getByRole("radio", { name: /trousers/ }).check();
  await page.getByLabel("Body over the scan").check();
  await page.getByLabel("Distances from the body as colours").check();
  await page.getByText(/mean \d/).waitFor({ timeout: 60_000 });
  await picture(page, "subject-distances");
});

test("a stroke of the brush is kept as an edit, and the layer is rebuilt with a new border", { timeout: 120_000 }, async () => {
  const { page } = tab;
  await page.getByRole("link", { name: "Correct" }).click();
  await drawn(page);
  await page.waitForTimeout(1500);
  const cut = subjectFile("build/01-trousers/cut.ply");
  const before = statSync(cut).mtimeMs;
  await page.keyboard.press("n");
  // Down a shin, some 25 cm over the ground.
  const [from, to] = await windowLine(page, [0.3, 0.2]);
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(...to, { steps: 6 });
  await page.mouse.up();
  await page.waitForFunction(() => document.querySelector("[data-keeper]")?.dataset.keeper === "kept" && /rebuilt in/.test(document.querySelector("[data-keeper]").textContent), null, { timeout: 90_000 });
  await page.waitForTimeout(1500);
  await picture(page, "correct");
  await isAccessible(page, "correct");
  const edits = JSON.parse(readFileSync(subjectFile("edits/01-trousers.json"), "utf8"));
  assert.equal(edits.strokes[0].mark, "does-not-belong");
  assert.ok(statSync(cut).mtimeMs > before);
  console.log(`# ${await page.locator("[data-keeper]").textContent()}`);
});

test("the avatar is animated, moves, and is downloaded", { timeout: PROCESS_MS }, async () => {
  const { page } = tab;
  await page.getByRole("link", { name: /Back to/ }).click();
  await page.getByRole("button", { name: "Animate" }).click();
  await page.getByLabel("Garments move").selectOption("skinning");
  await page.getByRole("dialog").getByRole("button", { name: "Animate" }).click();
  await page.locator(".subject-job").waitFor({ timeout: 20_000 });
  await jobDone(page);
  await page.getByRole("tab", { name: "Motion" }).click();
  await drawn(page);
  await page.waitForFunction(() => Number(document.querySelector(".scrub input").value) > 0.2, null, { timeout: 60_000 });
  await picture(page, "subject-motion");
  await isAccessible(page, "subject, motion");
  await page.getByRole("tab", { name: "Files" }).click();
  const [download] = await Promise.all([page.waitForEvent("download"), page.getByRole("link", { name: /Avatar/ }).first().click()]);
  const bytes = readFileSync(await download.path());
  assert.equal(bytes.toString("latin1", 0, 4), "glTF");
});

test("nothing was wrong on the way", () => {
  assert.deepEqual(tab.faults, []);
});
