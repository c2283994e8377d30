#pragma once

#include <array>
#include <string>
#include <string_view>

#include "host_tools/virtual_board/odrive_v3/scene_world.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// What a person at the bench does to board and motors, from a named pipe, a line each:
///
///   push AXIS NEWTON     a hand leans on the handle, along +x
///   swing AXIS NEWTON    a hand moves it to and fro, 0.2 s of board time each way
///   release AXIS         no hand is there
///   unplug AXIS          the motor's three wires
///   plug AXIS            the same, back again
///   plant AXIS DEFECT    a wiring fault or a broken part (host_tools/simulation/defect.hpp)
///   mend AXIS DEFECT     it is right again
///   stop open            the emergency stop's contact; or: stop closed
///
/// A hand is damped by 8 N s/m. Lines that are not understood are answered on stderr, and nothing is done.
class BenchPipe {
 public:
  /// Makes the pipe; one that is there is used. Throws std::runtime_error with the reason.
  BenchPipe(const std::string& path, VirtualBoard& board, SceneWorld& world);
  ~BenchPipe();
  BenchPipe(const BenchPipe&) = delete;
  BenchPipe& operator=(const BenchPipe&) = delete;

  /// Does what has come since the last call, and moves the hands on.
  void exchange();

  /// One line; what is wrong with it, or "".
  std::string take(std::string_view line);

 private:
  void move(std::size_t axis);

  struct Hand {
    double force = 0.0;  ///< N
    bool swings = false;
    BoardTime since = 0;
  };

  VirtualBoard& board_;
  SceneWorld& world_;
  std::string path_;
  bool made_ = false;
  int pipe_ = -1;
  std::string rest_;  ///< of a line that has not ended
  std::array<Hand, 2> hands_{};
};

}  // namespace kmax::virtual_board
