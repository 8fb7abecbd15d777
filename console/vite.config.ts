import { defineConfig } from "vitest/config";

// The page keeps a strict content security policy: no inline script or style, nothing from elsewhere, no eval.
export default defineConfig({
  base: "./",
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
