#pragma once

#include <functional>

#include "host_tools/serve/real_time.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/run/bench_pipe.hpp"
#include "host_tools/virtual_board/run/gpio_bridge.hpp"

namespace kmax::virtual_board {

struct PaceReport {
  double simulated_s = 0.0;
  double behind_s = 0.0;  ///< real time that was given up because this machine was too slow or held up
};

/// Runs the board at the pace of the real clock, or as fast as it goes (`free_running`), until `stop` says so
/// or `duration_s` of board time have passed (0: no end). USART2 and CAN are connected to `host`, the lines
/// of the connector to `gpio`, and hands and defects to `bench`, if there is one.
///
/// A process that is held up catches up as long as it is less than 50 ms behind; beyond, the board's time
/// stands still for the rest and that is counted.
PaceReport run_board(VirtualBoard& board, const serve::HostSide& host, GpioBridge* gpio, BenchPipe* bench,
                     double duration_s, bool free_running, const std::function<bool()>& stop);

}  // namespace kmax::virtual_board
