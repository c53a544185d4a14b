// Validates the .glb named on the command line with Khronos' validator; prints its report as JSON.
// Usage: node validate_gltf.mjs NODE_MODULES FILE
import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';
import { resolve } from 'node:path';

const [nodeModules, file] = process.argv.slice(2);
const require = createRequire(resolve(nodeModules, 'index.js'));
const validator = require('gltf-validator');
const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { maxIssues: 1000 });
process.stdout.write(JSON.stringify(report));
