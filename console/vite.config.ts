import { readdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { defineConfig } from "vitest/config";

/** Writes a compressed twin beside each script and style sheet; the service sends it to browsers that take gzip. */
const gzipTwins = {
  name: "gzip-twins",
  closeBundle() {
    const folder = join(import.meta.dirname ?? ".", "dist", "assets");
    for (const name of readdirSync(folder).filter((n) => /\.(js|css)$/.test(n))) {
      writeFileSync(join(folder, `${name}.gz`), gzipSync(readFileSync(join(folder, name)), { level: 9 }));
    }
  },
};

// The page keeps a strict content security policy: no inline script or style, nothing from elsewhere, no eval.
export default defineConfig({
  base: "./",
  plugins: [gzipTwins],
  esbuild: { jsx: "automatic", jsxImportSource: "preact" },
  build: {
    target: "es2022",
    outDir: "dist",
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    chunkSizeWarningLimit: 1200,
  },
  worker: { format: "es" },
  server: { proxy: { "/api": { target: "http://127.0.0.1:7070", ws: true } } },
  test: { include: ["test/**/*.test.ts"] },
});
