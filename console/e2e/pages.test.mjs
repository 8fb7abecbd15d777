// What holds for every page: quick with thousands of subjects, sizes and colours, keyboard, lost service, no WebGL.
import assert from "node:assert/strict";
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { after, before, test } from "node:test";
import { isAccessible, openBrowser, openPage, picture } from "./browser.mjs";
import { serve, startService } from "./service.mjs";

const SUBJECTS = 2000;
// Held only where TOILE_MEASURE=1 says that nothing else runs on the machine.
const PAINT_MS = 1000;
const MEASURED = process.env.TOILE_MEASURE === "1";

let service, browser;

before(async () => {
  service = await startService();
  for (let k = 0; k < SUBJECTS; k += 1) {
    const folder = join(service.archive, `subject-${String(k).padStart(4, "0")}`);
    mkdirSync(join(folder, "takes"), { recursive: true });
    writeFileSync(join(folder, "subject.toml"), `name = "Subject ${k}"\ndate = "2026-0${1 + (k % 9)}-11"\nrig = "virtual"\nnotes = ""\n`);
  }
  browser = await openBrowser();
});

after(async () => {
  await browser?.close();
  await service?.stop();
});

test(`the archive with ${SUBJECTS} subjects is painted and stays quick`, async () => {
  const tries = [];
  for (let k = 0; k < 3; k += 1) {
    const { page, close } = await openPage(browser, service.address);
    await page.locator(".subject-row").first().waitFor();
    tries.push(await page.evaluate(() => performance.now()));
    await close();
  }
  console.log(`# rows seen after ${tries.map(Math.round).join(", ")} ms`);
  if (MEASURED) assert.ok(Math.min(...tries) <= PAINT_MS, `the quickest of three took ${Math.min(...tries)} ms, the limit is ${PAINT_MS} ms`);
  const { page, faults, close } = await openPage(browser, service.address);
  await page.locator(".subject-row").first().waitFor();
  assert.ok((await page.locator(".subject-row").count()) < 60, "only rows in sight are in the document");
  await page.locator(".virtual").evaluate((list) => list.scrollTo(0, list.scrollHeight));
  await page.waitForFunction(() => document.querySelector(".virtual").scrollTop > 1000 && document.querySelectorAll(".subject-row").length > 5);
  await page.getByRole("searchbox").fill("subject 1234");
  await page.getByText("1 of 2000 subjects").waitFor();
  await picture(page, "archive-search");
  await page.getByRole("button", { name: "Move Subject 1234 to the bin" }).click();
  await page.getByText("0 of 1999 subjects").waitFor();
  await page.getByRole("button", { name: "Undo" }).click();
  await page.getByText("1 of 2000 subjects").waitFor();
  assert.deepEqual(faults, []);
  await close();
});

test("every page fits a phone and a wall screen, light and dark, and is accessible", async () => {
  const sizes = { phone: { width: 390, height: 844 }, wall: { width: 2560, height: 1440 } };
  for (const colorScheme of ["light", "dark"]) {
    for (const [size, viewport] of Object.entries(sizes)) {
      const { page, faults, close } = await openPage(browser, service.address, { viewport, colorScheme });
      for (const [name, place] of [["archive", "#/"], ["scan", "#/scan/subject-0001"], ["jobs", "#/jobs"], ["subject", "#/subjects/subject-0001"]]) {
        await page.goto(`${service.address}/${place}`);
        await page.locator("h1").first().waitFor();
        await page.waitForTimeout(600);
        await picture(page, `${name}-${size}-${colorScheme}`);
        await isAccessible(page, `${name}, ${size}, ${colorScheme}`);
        const wide = await page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
        assert.ok(wide <= 0, `${name} is ${wide} pixels too wide on a ${size}`);
      }
      assert.deepEqual(faults, []);
      await close();
    }
  }
});

test("the keyboard reaches a subject, and a new one", async () => {
  const { page, close } = await openPage(browser, service.address);
  await page.locator(".subject-row").first().waitFor();
  await page.getByRole("searchbox").focus();
  await page.keyboard.type("subject-0077");
  for (let k = 0; k < 12 && !(await page.evaluate(() => document.activeElement.classList.contains("subject-link"))); k += 1) await page.keyboard.press("Tab");
  await page.keyboard.press("Enter");
  await page.getByRole("heading", { name: "Subject 77", exact: true }).waitFor();
  assert.match(page.url(), /subjects\/subject-/);
  await close();
});

test("without WebGL the page says so and everything else works", async () => {
  const plain = await openBrowser({ webgl: false });
  const { page, faults, close } = await openPage(plain, service.address);
  await page.goto(`${service.address}/#/subjects/subject-0002?view=layers`);
  await page.getByText("shows no pictures in space").waitFor();
  await page.getByRole("tab", { name: "Files" }).click();
  await page.getByText("nothing to download yet").waitFor();
  await picture(page, "no-webgl");
  assert.deepEqual(faults, []);
  await close();
  await plain.close();
});

test("a service that dies is told, and the page finds it again by itself", async () => {
  const own = await startService();
  const { page, close } = await openPage(browser, own.address);
  await page.getByText("Nobody was scanned").waitFor();
  await own.end("SIGKILL");
  await page.getByText("The service does not answer").waitFor();
  await picture(page, "service-lost");
  const again = await serve(own.archive, new URL(own.address).port);
  await page.getByText("The service does not answer").waitFor({ state: "detached" });
  await close();
  await again.end();
  rmSync(own.archive, { recursive: true, force: true });
});
