// Khronos' glTF validator over files: node validate_gltf.cjs FILE...   (NODE_PATH names where gltf-validator is installed)
// Prints one JSON object: { FILE: { errors, warnings, infos, messages } }; hints about unused things are not counted.
const fs = require("fs");
const validator = require("gltf-validator");

async function main() {
  const result = {};
  for (const file of process.argv.slice(2)) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 100 });
    const { numErrors, numWarnings, numInfos, messages } = report.issues;
    result[file] = { errors: numErrors, warnings: numWarnings, infos: numInfos, messages, info: report.info };
  }
  console.log(JSON.stringify(result));
}

main().catch((error) => {
  console.error(String(error));
  process.exit(1);
});
