// The installed npm package `canopen`, which scripts/install_node_packages puts into build/node_canopen.

import { createRequire } from 'node:module';

const require = createRequire(new URL('../../../build/node_canopen/package.json', import.meta.url));

// The package takes its CRC from node-crc, which is C and would have to be compiled. This one stands in its place: the
// block transfer's CRC of CiA 301 is CRC-16 of polynomial 1021h that starts with 0, with the check value 31C3h.
// It is the only one that the package asks for, so the other arguments need no look.
function crc(...given) {
  const data = given.at(-1);
  let value = 0;
  for (const byte of data) {
    value ^= byte << 8;
    for (let bit = 0; bit < 8; ++bit) value = ((value << 1) ^ (value & 0x8000 ? 0x1021 : 0)) & 0xffff;
  }
  const result = Buffer.alloc(2);
  result.writeUInt16BE(value);
  return result;
}
if (crc(Buffer.from('123456789')).readUInt16BE() !== 0x31c3)
  throw new Error('the CRC is wrong');
const place = require.resolve('node-crc');
require.cache[place] = { id: place, filename: place, loaded: true, exports: { crc } };

export const { Device, DataType, Eds, ObjectType, NmtState } = require('canopen');
