#!/usr/bin/python3
"""Joins a CAN bus to programs that can only have streams.

usage: bus_bridge.py BUS STREAM

BUS is a SocketCAN interface, or, with a '/', a Unix SOCK_SEQPACKET socket (kmax-board, kmax serve); each of its messages
is one `struct can_frame`, 16 bytes. STREAM is made: a Unix stream socket that carries the same frames one behind the
other. Each program that connects to STREAM is a node of its own on the bus. Prints "ready" when it can be connected to,
and runs until it is killed or the bus is gone (exit code 1).
"""

import os
import selectors
import socket
import sys

FRAME = 16


class Node:
    """One program, and its place on the bus."""

    def __init__(self, stream, bus):
        self.stream, self.bus = stream, bus
        self.rest = b""  # a stream may cut a frame in two

    def from_stream(self):
        """False: the program has left."""
        data = self.stream.recv(4096)
        frames, used = self.rest + data, 0
        while len(frames) - used >= FRAME:
            self.bus.send(frames[used:used + FRAME])
            used += FRAME
        self.rest = frames[used:]
        return bool(data)

    def from_bus(self):
        """False: the bus has gone."""
        frame = self.bus.recv(64)
        if len(frame) == FRAME:
            self.stream.sendall(frame)
        return bool(frame)


def bus_at(place):
    if "/" in place:
        bus = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        bus.connect(place)
    else:
        bus = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        bus.bind((place,))
    return bus


def serve(bus_path, listener):
    """Returns when the bus is gone."""
    selector = selectors.DefaultSelector()
    selector.register(listener, selectors.EVENT_READ)

    def leave(node):
        for end in (node.stream, node.bus):
            selector.unregister(end)
            end.close()

    while True:
        for key, _ in selector.select():
            if key.fileobj is listener:
                stream, _ = listener.accept()
                node = Node(stream, bus_at(bus_path))
                selector.register(stream, selectors.EVENT_READ, node)
                selector.register(node.bus, selectors.EVENT_READ, node)
                continue
            node = key.data
            if node.stream.fileno() < 0:
                continue  # it left in this very round
            try:
                alive = node.from_stream() if key.fileobj is node.stream else node.from_bus()
                if not alive and key.fileobj is node.bus:
                    return
            except (BrokenPipeError, ConnectionResetError):
                alive = False
            if not alive:
                leave(node)


def main(arguments):
    if len(arguments) != 2:
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    bus_path, stream_path = arguments
    try:
        bus_at(bus_path).close()
    except OSError as error:
        print(f"bus_bridge: {bus_path}: {error.strerror}", file=sys.stderr)
        return 1
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as listener:
        listener.bind(stream_path)
        try:
            listener.listen()
            print("ready", flush=True)
            serve(bus_path, listener)
        except OSError as error:
            print(f"bus_bridge: {bus_path}: {error}", file=sys.stderr)
            return 1
        finally:
            os.unlink(stream_path)
    print(f"bus_bridge: {bus_path}: the bus is gone", file=sys.stderr)
    return 1


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(130)
