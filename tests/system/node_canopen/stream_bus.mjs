// A CAN bus as `struct can_frame`s, 16 bytes each, on a stream socket (bus_bridge.py), or in this process.

import { EventEmitter } from 'node:events';
import { connect } from 'node:net';

const frameSize = 16;
const notStandard = 0xe0000000; // the flags of extended, remote and error frames

/// Emits 'frame' with { id, data } for each data frame with an 11-bit identifier, and 'gone' when the bus is.
export class StreamBus extends EventEmitter {
  static async open(path) {
    const socket = connect(path);
    await new Promise((resolve, reject) => socket.once('connect', resolve).once('error', reject));
    return new StreamBus(socket);
  }

  constructor(socket) {
    super();
    this.socket = socket;
    let rest = Buffer.alloc(0);
    socket.on('data', (chunk) => {
      rest = Buffer.concat([rest, chunk]);
      for (; rest.length >= frameSize; rest = rest.subarray(frameSize)) {
        const id = rest.readUInt32LE(0);
        // A copy: the package keeps what it is given.
        if (!(id & notStandard)) this.emit('frame', { id, data: Buffer.from(rest.subarray(8, 8 + rest[4])) });
      }
    });
    socket.on('close', () => this.emit('gone'));
    socket.on('error', () => {}); // 'close' follows
  }

  send({ id, data }) {
    const frame = Buffer.alloc(frameSize);
    frame.writeUInt32LE(id, 0);
    frame[4] = data.length;
    data.copy(frame, 8);
    this.socket.write(frame);
  }

  close() {
    this.removeAllListeners('gone');
    this.socket.destroy();
  }
}

/// Two ends of a bus in this process; what one sends the other hears later, as on a wire.
export function loopbackBus() {
  const ends = [new EventEmitter(), new EventEmitter()];
  ends.forEach((end, index) => {
    end.send = ({ id, data }) => {
      const copy = Buffer.from(data);
      setImmediate(() => ends[1 - index].emit('frame', { id, data: copy }));
    };
    end.close = () => {};
  });
  return ends;
}
