// Starts `toile serve` on an archive of its own and stops it.
import { spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { createInterface } from "node:readline";

const PROGRAM = process.env.TOILE ?? new URL("../../target/release/toile", import.meta.url).pathname;
// No test measures time by such a limit: it only ends what hangs.
const START_MS = 120_000;

/** A service on a new, empty archive; `stop` ends it and removes the archive. */
export async function startService() {
  const archive = mkdtempSync(join(tmpdir(), "toile-console-"));
  const running = await serve(archive);
  const stop = async () => {
    await running.end();
    rmSync(archive, { recursive: true, force: true });
  };
  return { archive, ...running, stop };
}

/** Starts the program on an archive; the first line that it prints is its address. */
export async function serve(archive, port = 0) {
  const child = spawn(PROGRAM, ["serve", archive, "--port", String(port)], { stdio: ["ignore", "pipe", "pipe"] });
  const told = [];
  child.stderr.on("data", (bytes) => told.push(String(bytes)));
  const address = await new Promise((resolve, reject) => {
    const late = setTimeout(() => reject(new Error(`toile serve printed no address:\n${told.join("")}`)), START_MS);
    createInterface({ input: child.stdout }).once("line", (line) => {
      clearTimeout(late);
      const found = line.match(/https?:\/\/\S+/);
      if (found === null) reject(new Error(`the first line is no address: ${line}`));
      else resolve(found[0].replace(/\/$/, ""));
    });
    child.once("exit", (code) => reject(new Error(`toile serve ended with ${code}:\n${told.join("")}`)));
  });
  const over = new Promise((resolve) => child.once("exit", resolve));
  const end = async (signal = "SIGTERM") => {
    child.kill(signal);
    await over;
  };
  return { address, end, told: () => told.join("") };
}
