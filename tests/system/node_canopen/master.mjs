#!/usr/bin/env node
// A CANopen master that was not written here, the npm package `canopen`, against node 1 on a bus.
// usage: node master.mjs STREAM [SEGMENTS]    STREAM: the Unix stream socket of bus_bridge.py
//        node master.mjs --stand-in           tries the master itself, against a node of the same package
//
// SEGMENTS is how many segments of a block transfer the master takes at once, 1 to 127 and 127 where it is left out. What
// an adapter keeps for a PC that is late limits them behind an adapter, for the two masters here together: the package
// never asks again for a block whose end is lost.
//
// One line for each step: `ok`, `FAILED` with the reason, or `left out` where the stand-in cannot do it. Exit code:
// 0 nothing failed, 1 something did, 2 wrong usage.

import { once } from 'node:events';
import { DataType, Device, NmtState } from './canopen_package.mjs';
import { startStandIn } from './stand_in.mjs';
import { StreamBus, loopbackBus } from './stream_bus.mjs';

const node = 1;
const watched = 125; // the node whose heartbeat node 1 is told to watch
const patience = 60000; // ms, for what a machine that is not busy does at once
const tpdo = 0x180 + node;
const rpdo = 0x200 + node;
const bootUp = NmtState.INITIALIZING;
const second = { request: 0x6a0 + node, response: 0x6b0 + node };
const abort = { localControl: 0x08000021, deviceState: 0x08000022, unsupported: 0x06010000, readOnly: 0x06010002, noObject: 0x06020000, notMappable: 0x06040041,
                tooLong: 0x06040042, noSubIndex: 0x06090011 };

const [argument, segmentsAtOnce = '127'] = process.argv.slice(2);
const standIn = argument === '--stand-in';
const understood = standIn ? process.argv.length === 3
                           : [3, 4].includes(process.argv.length) && !argument.startsWith('-') &&
                             /^[1-9][0-9]{0,2}$/.test(segmentsAtOnce) && Number(segmentsAtOnce) <= 127;
if (!understood) {
  console.error('usage: node master.mjs STREAM [SEGMENTS] | --stand-in        SEGMENTS: 1 to 127');
  process.exit(2);
}

// --- the bus and the master

let bus;
if (standIn) {
  const [here, there] = loopbackBus();
  bus = here;
  startStandIn(there);
} else {
  bus = await StreamBus.open(argument).catch((error) => {
    console.error(`master: ${argument}: ${error.message}`);
    process.exit(1);
  });
  bus.on('gone', () => {
    console.log('FAILED the bus is gone');
    process.exit(1);
  });
}
const master = new Device({ id: 126 });
const { eds, sdo, nmt } = master;
sdo.setBlockSize(Number(segmentsAtOnce));
eds.addSdoClientParameter(node, 0x600 + node, 0x580 + node);
eds.addHeartbeatConsumer(node, patience);
eds.addEmcyConsumer(0x80 + node);
eds.setSyncCobId(0x80);
eds.setSyncGenerationEnable(true);
master.on('message', (message) => bus.send(message));
bus.on('frame', (message) => master.receive(message));
master.start();
const other = new Device({ id: 124 }); // at the second SDO server
other.sdo.setBlockSize(Number(segmentsAtOnce));
other.eds.addSdoClientParameter(node, second.request, second.response);
other.on('message', (message) => bus.send(message));
bus.on('frame', (message) => other.receive(message));
other.start();

// --- what steps are made of

function expect(condition, reason) {
  if (!condition) throw new Error(reason);
}
const hex = (number) => `${number.toString(16).toUpperCase()}h`;
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/// The first `count` frames from now on of which `wanted` holds; `trigger` is called once they are looked for.
function frames(what, wanted, count, trigger = () => {}) {
  return new Promise((resolve, reject) => {
    const heard = [];
    const timer = setTimeout(() => {
      bus.off('frame', listen);
      reject(new Error(`${what}: ${heard.length} of ${count} came within ${patience} ms`));
    }, patience);
    function listen(frame) {
      if (!wanted(frame) || heard.push(frame) < count) return;
      clearTimeout(timer);
      bus.off('frame', listen);
      resolve(heard);
    }
    bus.on('frame', listen);
    trigger();
  });
}
const heartbeats = (state, count, trigger) =>
  frames(`heartbeat ${state}`, ({ id, data }) => id === 0x700 + node && data.length === 1 && data[0] === state, count,
         trigger);

function bytesOf(value, size) {
  const data = Buffer.alloc(size);
  if (size === 1) data.writeUInt8(value & 0xff);
  else if (size === 2) data.writeUInt16LE(value & 0xffff);
  else data.writeUInt32LE(value >>> 0);
  return data;
}
const place = (index, subIndex) => ({ deviceId: node, index, subIndex, timeout: patience });
const read = (index, subIndex = 0, blockTransfer = false) => sdo.upload({ ...place(index, subIndex), blockTransfer });
const write = (index, subIndex, data, blockTransfer = false) =>
  sdo.download({ ...place(index, subIndex), data, blockTransfer, blockInterval: 0 });
const set = (index, subIndex, value, size) => write(index, subIndex, bytesOf(value, size));

// The number of mapped objects; the stand-in has none that can be written.
const setCount = async (index, count) => standIn || set(index, 0, count, 1);

async function numberAt(index, subIndex, size) {
  const data = await read(index, subIndex);
  expect(data.length === size, `${hex(index)}:${subIndex} has ${data.length} bytes instead of ${size}`);
  return data.readUIntLE(0, size);
}
async function keeps(index, subIndex, value, size) {
  await set(index, subIndex, value, size);
  const found = await numberAt(index, subIndex, size);
  expect(found === value, `${hex(index)}:${subIndex} reads ${hex(found)} after ${hex(value)} was written`);
}
async function refused(what, code, attempt) {
  const error = await attempt.then(() => null, (reason) => reason);
  expect(error, `${what} was not refused`);
  expect(code === undefined || error.code === code,
         `${what} was refused with ${hex(error.code ?? 0)} (${error.message}) instead of ${hex(code ?? 0)}`);
}

// --- the steps

const steps = [];
const step = (name, run) => steps.push({ name, run });
const stepOfFirmware = (name, run) => steps.push({ name, run: standIn ? null : run });

async function resetAndBootUp(command) {
  await heartbeats(bootUp, 1, command);
  await sleep(0); // the package's own node restarts later
}
step('NMT reset node: boot-up', () => resetAndBootUp(() => nmt.resetNode(node)));
step('NMT reset communication: boot-up', () => resetAndBootUp(() => nmt.resetCommunication(node)));
step('SDO upload 4 bytes, 1000h device type', async () => {
  const type = await numberAt(0x1000, 0, 4);
  expect((type & 0xffff) === 402, `it says device profile ${type & 0xffff} instead of 402`);
});
step('SDO upload 1 byte, 6061h', () => numberAt(0x6061, 0, 1));
step('SDO upload 2 bytes, 6041h', () => numberAt(0x6041, 0, 2));
step('SDO download 1 byte, 6060h', async () => {
  const before = await numberAt(0x6060, 0, 1);
  await keeps(0x6060, 0, 10, 1); // cyclic synchronous torque
  await keeps(0x6060, 0, before, 1);
});
step('SDO download 2 bytes, 1017h', () => keeps(0x1017, 0, 50, 2));
step('SDO download 4 bytes, 1016h:1', async () => {
  await keeps(0x1016, 1, watched * 0x10000 + 1000, 4);
  await set(0x1016, 1, 0, 4);
});
step('SDO abort: no such object', () => refused('2FFFh', abort.noObject, read(0x2fff)));
stepOfFirmware('SDO abort: no such sub-index', () => refused('1018h:9', abort.noSubIndex, read(0x1018, 9)));
step('SDO abort: read only', () => refused('1000h', abort.readOnly, set(0x1000, 0, 0, 4)));

function pattern(size, start) {
  return Buffer.from(Array.from({ length: size }, (_, i) => (i * 37 + (i >> 8) + start) & 0xff));
}
// One byte, one segment, one more; as many segments as the master takes at once, one more, and several times as many.
const atOnce = 7 * Number(segmentsAtOnce);
for (const size of [1, 7, 8, atOnce, atOnce + 1, Math.floor(2.25 * atOnce)]) {
  for (const block of [false, true]) {
    const kind = block ? 'block' : size > 4 ? 'segmented' : 'expedited';
    step(`SDO ${kind}, ${size} byte${size > 1 ? 's' : ''}`, async () => {
      const data = pattern(size, block ? size + 128 : size);
      await write(0x5822, 1, data, block);
      for (const back of [block, !block]) {
        const found = await read(0x5822, 1, back);
        const differs = [...data].findIndex((byte, i) => found[i] !== byte);
        expect(found.equals(data), `${size} written, ${found.length} read ${back ? 'as a block' : 'in segments'}; ` +
                                   `the first that differs is ${differs}`);
      }
    });
  }
}

step('heartbeat at the time set', async () => {
  await set(0x1017, 0, 20, 2);
  await heartbeats(NmtState.PRE_OPERATIONAL, 5);
});
step('NMT start: operational', async () => {
  const told = once(nmt, 'heartbeat', { signal: AbortSignal.timeout(patience) });
  await heartbeats(NmtState.OPERATIONAL, 2, () => nmt.startNode(node));
  const [{ deviceId, state }] = await told;
  expect(deviceId === node && state === NmtState.OPERATIONAL, `the package was told ${deviceId}: ${state}`);
});
step('NMT stop: stopped, and no SDO', async () => {
  await heartbeats(NmtState.STOPPED, 2, () => nmt.stopNode(node));
  await refused('1000h', undefined, sdo.upload({ ...place(0x1000, 0), timeout: 200 }));
});
step('NMT enter pre-operational', async () => {
  await heartbeats(NmtState.PRE_OPERATIONAL, 2, () => nmt.enterPreOperational(node));
  await read(0x1000);
});

stepOfFirmware('TPDO mapping is refused while the TPDO exists', async () => {
  await set(0x1800, 1, tpdo | 0x40000000, 4);
  await refused('1A00h:0', undefined, set(0x1a00, 0, 0, 1));
});
step('TPDO mapped again: 6041h, 6061h, 6064h at each SYNC', async () => {
  await set(0x1800, 1, 0xc0000000 | tpdo, 4);
  await set(0x1800, 2, 1, 1);
  await setCount(0x1a00, 0);
  await set(0x1a00, 1, 0x60410010, 4);
  await set(0x1a00, 2, 0x60610008, 4);
  await set(0x1a00, 3, 0x60640020, 4);
  await setCount(0x1a00, 3);
  await set(0x1800, 1, 0x40000000 | tpdo, 4);
});
stepOfFirmware('TPDO mapping: what cannot be mapped, and what is too long', async () => {
  await set(0x1801, 1, 0xc0000280 + node, 4);
  await set(0x1a01, 0, 0, 1);
  await refused('1017h in a TPDO', abort.notMappable, set(0x1a01, 1, 0x10170010, 4));
  await set(0x1a01, 1, 0x60640020, 4);
  await set(0x1a01, 2, 0x606c0020, 4);
  await set(0x1a01, 3, 0x60410010, 4);
  await refused('80 bits', abort.tooLong, set(0x1a01, 0, 3, 1));
});

const sync = () => master.sync.write();
const isTpdo = ({ id }) => id === tpdo;
step('TPDO at each SYNC, with what SDO reads', async () => {
  await heartbeats(NmtState.OPERATIONAL, 1, () => nmt.startNode(node));
  for (let i = 0; i < 5; ++i) {
    const [{ data }] = await frames('TPDO', isTpdo, 1, sync);
    expect(data.length === 7, `it has ${data.length} bytes instead of 7`);
    const statusword = await numberAt(0x6041, 0, 2);
    const mode = await numberAt(0x6061, 0, 1);
    expect(data.readUInt16LE(0) === statusword, `statusword ${hex(data.readUInt16LE(0))}, by SDO ${hex(statusword)}`);
    expect(data[2] === mode, `mode ${data[2]}, by SDO ${mode}`);
  }
});
step('no TPDO without SYNC', async () => {
  let count = 0;
  const listen = (frame) => (count += isTpdo(frame) ? 1 : 0);
  bus.on('frame', listen);
  await heartbeats(NmtState.OPERATIONAL, 5);
  bus.off('frame', listen);
  expect(count === 0, `${count} came`);
});
stepOfFirmware('TPDO at every third SYNC', async () => {
  await set(0x1800, 1, 0xc0000000 | tpdo, 4);
  await set(0x1800, 2, 3, 1);
  await set(0x1800, 1, 0x40000000 | tpdo, 4);
  let count = 0;
  const listen = (frame) => (count += isTpdo(frame) ? 1 : 0);
  bus.on('frame', listen);
  for (let i = 0; i < 9; ++i) {
    sync();
    await read(0x1000); // is answered after what the SYNC was answered with
  }
  bus.off('frame', listen);
  expect(count === 3, `${count} came at 9 SYNCs`);
});
step('RPDO mapped again and taken over at once', async () => {
  await set(0x1400, 1, 0x80000000 | rpdo, 4);
  await setCount(0x1600, 0);
  await set(0x1600, 1, 0x60720010, 4);
  await set(0x1600, 2, 0x60600008, 4);
  await setCount(0x1600, 2);
  await set(0x1400, 2, 255, 1);
  await set(0x1400, 1, rpdo, 4);
  const mode = await numberAt(0x6060, 0, 1);
  // The package sends what its own objects hold.
  const torque = eds.addEntry(0x6072, { parameterName: 'Max torque', dataType: DataType.UNSIGNED16 });
  const operation = eds.addEntry(0x6060, { parameterName: 'Modes of operation', dataType: DataType.INTEGER8 });
  eds.addTransmitPdo({ cobId: rpdo, transmissionType: 255, dataObjects: [torque, operation] });
  nmt.startNode();
  for (const [value, display] of [[777, 10], [1000, mode]]) {
    torque.value = value;
    operation.raw = Buffer.from([display]);
    master.pdo.write(rpdo);
    await heartbeats(NmtState.OPERATIONAL, 2);
    const found = [await numberAt(0x6072, 0, 2), await numberAt(0x6060, 0, 1)];
    expect(found[0] === value && found[1] === display, `${value} and ${display} sent, ${found} read`);
  }
});
step('no PDO in pre-operational', async () => {
  await set(0x1800, 1, 0xc0000000 | tpdo, 4);
  await set(0x1800, 2, 1, 1);
  await set(0x1800, 1, 0x40000000 | tpdo, 4);
  await heartbeats(NmtState.PRE_OPERATIONAL, 1, () => nmt.enterPreOperational(node));
  let count = 0;
  const listen = (frame) => (count += isTpdo(frame) ? 1 : 0);
  bus.on('frame', listen);
  sync();
  await heartbeats(NmtState.PRE_OPERATIONAL, 3);
  bus.off('frame', listen);
  expect(count === 0, `${count} came`);
});

stepOfFirmware('SDO server 1200h as it is, and the second, 1201h, where it is told to be', async () => {
  expect((await numberAt(0x1200, 1, 4)) === 0x600 + node, 'it is asked by another identifier');
  expect((await numberAt(0x1200, 2, 4)) === 0x580 + node, 'it answers by another identifier');
  expect((await numberAt(0x1201, 1, 4)) === 0x80000000, 'there is a second one from the factory');
  await refused('a restricted identifier', undefined, set(0x1201, 1, 0x601, 4));
  await keeps(0x1201, 1, second.request, 4);
  await keeps(0x1201, 2, second.response, 4);
  const type = await other.sdo.upload(place(0x1000, 0));
  expect(type.equals(await read(0x1000)), 'the second one says another device type');
});
stepOfFirmware('two masters transfer at once', async () => {
  const data = pattern(2000, 3);
  const texts = async () => {
    const found = [];
    for (let i = 0; i < 20; ++i) found.push(await other.sdo.upload({ ...place(0x1008, 0), blockTransfer: i % 2 === 1 }));
    return found;
  };
  const [, heard] = await Promise.all([write(0x5822, 1, data, true), texts()]);
  const [back, trace] = await Promise.all([read(0x5822, 1, true),
                                           other.sdo.upload({ ...place(0x5820, 1), blockTransfer: true })]);
  expect(heard.every((text) => text.toString() === 'Kmax haptic device controller'), `there came ${heard[0]}`);
  expect(back.equals(data), `${back.length} bytes came back`);
  expect(trace.length === 128, `a trace object has ${trace.length} bytes`);
});
stepOfFirmware('a transaction belongs to the master that began it', async () => {
  const control = (value) => other.sdo.download({ ...place(0x5810, 1), data: bytesOf(value, 2) });
  await control(1);
  await refused('the other one', abort.localControl, set(0x5810, 1, 2, 2));
  await refused('its settings', abort.localControl, set(0x5805, 2, 1, 2));
  await control(0);
  await set(0x5805, 2, 0, 2);
  await set(0x1201, 1, 0x80000000, 4);
});

const isSync = ({ id }) => id === 0x80;
stepOfFirmware('SYNC by the device, with its counter', async () => {
  await set(0x1019, 0, 3, 1);
  await set(0x1006, 0, 20000, 4);
  const heard = await frames('SYNC', isSync, 5, () => set(0x1005, 0, 0x40000080, 4));
  expect(heard.every(({ data }) => data.length === 1), 'it has no counter');
  expect(heard.map(({ data }) => data[0]).join() === '1,2,3,1,2', `it counts ${heard.map(({ data }) => data[0])}`);
  await refused('1019h', abort.deviceState, set(0x1019, 0, 4, 1));
  await refused('1005h', abort.deviceState, set(0x1005, 0, 0x40000090, 4));
});
stepOfFirmware('TPDO at each SYNC of the device', async () => {
  await heartbeats(NmtState.OPERATIONAL, 1, () => nmt.startNode(node));
  const heard = await frames('SYNC and TPDO', (frame) => isSync(frame) || isTpdo(frame), 11);
  for (let i = 1; i < heard.length; ++i)
    expect(isSync(heard[i]) !== isSync(heard[i - 1]), `frame ${i} is ${hex(heard[i].id)} once more`);
  await heartbeats(NmtState.PRE_OPERATIONAL, 1, () => nmt.enterPreOperational(node));
  await set(0x1005, 0, 0x80, 4);
  await set(0x1006, 0, 0, 4);
  await set(0x1019, 0, 0, 1);
});

step('EMCY 8130h when a watched heartbeat ends', async () => {
  nmt.enterPreOperational(node);
  await set(0x1016, 1, watched * 0x10000 + 200, 4);
  const told = new Promise((resolve, reject) => {
    const others = [];
    const timer = setTimeout(() => reject(new Error(`of others there came: ${others.map(hex)}`)), patience);
    master.emcy.on('emergency', ({ cobId, em }) => {
      others.push(em.code);
      if (cobId === 0x80 + node && em.code === 0x8130) resolve(clearTimeout(timer));
    });
  });
  bus.send({ id: 0x700 + watched, data: Buffer.from([NmtState.OPERATIONAL]) });
  await told;
});
stepOfFirmware('its place in the error history, 1003h', async () => {
  expect((await numberAt(0x1003, 0, 1)) >= 1, 'the history is empty');
  const newest = await numberAt(0x1003, 1, 4);
  expect(newest === (0x80 + watched) * 0x10000 + 0x8130, `the newest is ${hex(newest)}`);
});
step('back to the start', async () => {
  await set(0x1016, 1, 0, 4);
  await set(0x1017, 0, 0, 2);
  await resetAndBootUp(() => nmt.resetNode(node));
});

const count = { ok: 0, FAILED: 0, 'left out': 0 };
for (const { name, run } of steps) {
  let verdict = 'left out', reason = '';
  if (run) {
    verdict = 'ok';
    await run().catch((error) => {
      verdict = 'FAILED';
      reason = `: ${error.message}`;
    });
  }
  ++count[verdict];
  console.log(`${verdict} ${name}${reason}`);
}
console.log(Object.entries(count).map(([verdict, number]) => `${number} ${verdict}`).join(', '));
process.exit(count.FAILED ? 1 : 0);
