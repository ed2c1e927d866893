// SPDX-License-Identifier: Apache-2.0
// The network in ONNX Runtime, asked as peer.h says:  node peer_onnxruntime.mjs MODEL.onnx THREADS
// The package onnxruntime-node is looked for in the folder of the model.
import { createRequire } from 'node:module';
import { dirname, resolve } from 'node:path';
import { createInterface } from 'node:readline';

const model = resolve(process.argv[2]);
const ort = createRequire(dirname(model) + '/')('onnxruntime-node');
const session = await ort.InferenceSession.create(model, {
  intraOpNumThreads: Number(process.argv[3]), interOpNumThreads: 1, graphOptimizationLevel: 'all',
});

function patches(batch) {
  const [height, width, channels] = [128, 64, 3];
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
  const batch = Number(count);
  if (what === 'train') {
    console.log('none');
    continue;
  }
  if (!inputs.has(batch)) inputs.set(batch, patches(batch));
  const start = now();
  const { embeddings } = await session.run({ patches: inputs.get(batch) });
  const elapsed = now() - start;
  if (what === 'embed') {
    console.log(elapsed.toFixed(4));
  } else {
    const values = embeddings.data;
    console.log([...values.slice(0, 128), ...values.slice(128 * (batch - 1))].join(' '));
  }
}
