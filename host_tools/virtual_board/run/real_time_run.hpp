#pragma once

#include <functional>

#include "host_tools/serve/real_time.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/run/bench_pipe.hpp"
#include "host_tools/virtual_board/run/gpio_bridge.hpp"
#include "host_tools/virtual_board/run/usbip_server.hpp"

namespace kmax::virtual_board {

/// Runs the board at `pace` by the real clock, or as fast as it goes (null), until `stop` says so or
/// `duration_s` of board time have passed (0: no end). USART2 and CAN are connected to `host`, the lines of
/// the connector to `gpio`, hands and defects to `bench`, and USB to the clients of `usb`, if there is one.
/// Returns the board time, s.
double run_board(VirtualBoard& board, const serve::HostSide& host, GpioBridge* gpio, BenchPipe* bench,
                 UsbipServer* usb, double duration_s, serve::Pace* pace, const std::function<bool()>& stop);

}  // namespace kmax::virtual_board
