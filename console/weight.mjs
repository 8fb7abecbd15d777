// The page's script weighs at most 1 MB with gzip. Run after a build.
import { readdirSync, readFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const LIMIT = 1_000_000;
const folder = new URL("dist/assets/", import.meta.url);
const weights = readdirSync(folder).filter((name) => name.endsWith(".js")).map((name) => gzipSync(readFileSync(new URL(name, folder))).length);
const total = weights.reduce((sum, weight) => sum + weight, 0);
console.log(`console: ${weights.length} scripts, ${Math.round(total / 1000)} kB with gzip (limit ${LIMIT / 1000} kB)`);
process.exit(total <= LIMIT ? 0 : 1);
