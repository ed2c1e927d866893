// SPDX-License-Identifier: Apache-2.0
// A network in ONNX Runtime, asked as peer.h says:
//   node peer_onnxruntime.mjs MODEL.onnx THREADS FOLDER [HEIGHT WIDTH]
// FOLDER is where npm installed onnxruntime-node. With HEIGHT and WIDTH the crops of a batch are that
// large and go through the network one by one.
import { createRequire } from 'node:module';
import { resolve } from 'node:path';
import { createInterface } from 'node:readline';

const model = resolve(process.argv[2]);
const ort = createRequire(resolve(process.argv[4]) + '/')('onnxruntime-node');
const session = await ort.InferenceSession.create(model, {
  intraOpNumThreads: Number(process.argv[3]), interOpNumThreads: 1, graphOptimizationLevel: 'all',
  logSeverityLevel: 3,
});

const single = process.argv.length > 5;
const [height, width] = single ? process.argv.slice(5).map(Number) : [128, 64];
const channels = 3;

function patches(batch) {
  const values = new Float32Array(batch * height * width * channels);
  for (let n = 0, i = 0; n < batch; ++n) {
    for (let pixel = 0; pixel < height * width; ++pixel) {
      for (let c = 0; c < channels; ++c, ++i) {
        const bits = Math.imul(i, 2654435761 | 0) >>> 0;
        values[(n * channels + c) * height * width + pixel] = ((bits >>> 8) & 0xffff) / 16384 - 2;
      }
    }
  }
  return new ort.Tensor('float32', values, [batch, channels, height, width]);
}

const now = process.env.PEER_CPU_TIME
  ? () => { const { user, system } = process.cpuUsage(); return (user + system) / 1e3; }
  : () => performance.now();
const inputs = new Map();
for await (const line of createInterface({ input: process.stdin })) {
  const [what, count] = line.split(' ');
  const batch = single ? 1 : Number(count);
  if (what === 'train') {
    console.log('none');
    continue;
  }
  if (!inputs.has(batch)) inputs.set(batch, patches(batch));
  const start = now();
  let result;
  for (let i = 0; i < (single ? Number(count) : 1); ++i) {
    result = await session.run({ [session.inputNames[0]]: inputs.get(batch) });
  }
  const elapsed = now() - start;
  if (what === 'embed') {
    console.log(elapsed.toFixed(4));
  } else {
    const values = result[session.outputNames[0]].data;
    console.log([...values.slice(0, 128), ...values.slice(128 * (batch - 1))].join(' '));
  }
}
