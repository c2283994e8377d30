// A node with ID 1 from the same package, to try the master without firmware. It has what the package's server can do:
// SDO of all kinds, NMT, heartbeat, and a PDO mapping that is fixed; it refuses less than CiA 301 asks for.

import { DataType, Device, NmtState, ObjectType } from './canopen_package.mjs';

export function startStandIn(bus) {
  const device = new Device({ id: 1 });
  const { eds } = device;
  device.on('message', (message) => bus.send(message));
  bus.on('frame', (message) => device.receive(message));

  const value = (index, parameterName, dataType, defaultValue) =>
    eds.addEntry(index, { parameterName, dataType, defaultValue, accessType: 'rw' });
  eds.getEntry(0x1000).defaultValue = 0x20192;
  const statusword = value(0x6041, 'Statusword', DataType.UNSIGNED16, 0x0250);
  const operation = value(0x6060, 'Modes of operation', DataType.INTEGER8, -1);
  const mode = value(0x6061, 'Modes of operation display', DataType.INTEGER8, -1);
  const position = value(0x6064, 'Position actual value', DataType.INTEGER32, -123456);
  const torque = value(0x6072, 'Max torque', DataType.UNSIGNED16, 1000);
  value(0x1017, 'Producer heartbeat time', DataType.UNSIGNED16, 0);
  const scratch = eds.addEntry(0x5822, { parameterName: 'Scratch pad', objectType: ObjectType.RECORD });
  scratch.addSubObject(1, { parameterName: 'Scratch pad', dataType: DataType.DOMAIN, accessType: 'rw' });
  const stays = { saveDefault: true }; // after a reset
  eds.addHeartbeatConsumer(125, 1000);
  eds.setSyncCobId(0x80, stays);
  eds.setEmcyCobId(0x81, stays);
  eds.addSdoServerParameter(0, 0x581, 0x601, stays);
  eds.addTransmitPdo({ cobId: 0x181, transmissionType: 1, dataObjects: [statusword, mode, position] }, stays);
  eds.addReceivePdo({ cobId: 0x201, transmissionType: 255, dataObjects: [torque, operation] }, stays);

  // The package says neither that it has come up nor that a heartbeat is lost.
  device.nmt.on('changeState', (state) => {
    if (state === NmtState.INITIALIZING) bus.send({ id: 0x701, data: Buffer.from([0]) });
  });
  device.nmt.on('timeout', () => device.emcy.write(0x8130, Buffer.alloc(5)));
  device.start();
  return device;
}
