// public_readers.mjs FOLDER FILE...: glTF files as others see them. FOLDER holds node_modules with gltf-validator and
// @gltf-transform/core. Prints a line of JSON a file: what Khronos's validator has against it, and what gltf-transform
// reads of it.
import fs from 'node:fs';
import { createRequire } from 'node:module';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

const [folder, ...files] = process.argv.slice(2);
const require = createRequire(path.join(path.resolve(folder), 'none.js'));
const load = async (name) => import(pathToFileURL(require.resolve(name)));
const validator = require('gltf-validator');
const { NodeIO } = await load('@gltf-transform/core');

// The validator is older than the extension: it knows neither its name nor the names of its attributes.
const tooNew = (issue) => issue.code === 'UNSUPPORTED_EXTENSION' || issue.code === 'UNUSED_OBJECT' ||
    (issue.code === 'MESH_PRIMITIVE_INVALID_ATTRIBUTE' && issue.pointer.includes('/KHR_gaussian_splatting:'));

for (const file of files) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
        uri: path.basename(file),
        maxIssues: 0,
        externalResourceFunction: (uri) =>
            Promise.resolve(new Uint8Array(fs.readFileSync(path.join(path.dirname(file), decodeURIComponent(uri))))),
    });
    const document = await new NodeIO().read(file);
    const primitive = document.getRoot().listMeshes()[0].listPrimitives()[0];
    const values = (name) => Array.from(primitive.getAttribute(name)?.getArray().slice(0, 6) ?? []);
    const node = document.getRoot().listNodes()[0];
    console.log(JSON.stringify({
        issues: report.issues.messages.filter((issue) => !tooNew(issue)),
        mode: primitive.getMode(),
        attributes: primitive.listSemantics(),
        splats: primitive.getAttribute('POSITION').getCount(),
        position: values('POSITION'),
        scale: values('KHR_gaussian_splatting:SCALE'),
        opacity: values('KHR_gaussian_splatting:OPACITY'),
        rotation: node.getRotation(),
    }));
}
