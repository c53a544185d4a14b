// Validates the .glb or .gltf named on the command line, and the files beside it, with Khronos' validator; prints its
// report as JSON.
// Usage: node validate_gltf.mjs NODE_MODULES FILE
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';

const [nodeModules, file] = process.argv.slice(2);
const require = createRequire(resolve(nodeModules, 'index.js'));
const validator = require('gltf-validator');
const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), {
  maxIssues: 1000,
  externalResourceFunction: async (uri) => new Uint8Array(readFileSync(join(dirname(file), decodeURIComponent(uri)))),
});
process.stdout.write(JSON.stringify(report));
