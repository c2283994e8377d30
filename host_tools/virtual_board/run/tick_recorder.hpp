#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "host_tools/base/elf_image.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// One run of the conversions' interrupt, without what interrupts it.
struct RecordedTick {
  /// A load or store of memory outside CCM.
  struct Access {
    std::size_t at;  ///< how many instructions had begun, with all of its block
    std::uint32_t address;
  };

  std::uint32_t object = UINT32_MAX;     ///< where the axis lies in the image's memory
  std::size_t axis = 0;                  ///< 0 or 1
  std::vector<std::uint32_t> addresses;  ///< of the instructions, as executed
  std::vector<Access> accesses;
  std::uint64_t register_waits = 0;  ///< Bus::register_waits() of it
};

/// What every tick of an image executes, and how much the main loop does. Makes the board slower, and is
/// there as long as the board runs. Throws std::runtime_error for an image without the tick's functions.
class TickRecorder {
 public:
  /// Before the board's first run.
  TickRecorder(const base::ElfImage& image, VirtualBoard& board);
  TickRecorder(const TickRecorder&) = delete;
  TickRecorder& operator=(const TickRecorder&) = delete;

  void start();
  /// Instructions outside all interrupts since start().
  std::uint64_t main_loop() const { return main_loop_; }
  /// Those since start(), or since they were taken last; the latest may not be over.
  std::vector<RecordedTick> take();

 private:
  void begin_block(std::uint32_t address, std::uint32_t size);
  void note_access(std::uint32_t address);
  std::uint64_t instructions_in(std::uint32_t address, std::uint32_t size);

  VirtualBoard& board_;
  std::uint32_t handler_, axis_tick_;
  bool recording_ = false, open_ = false;
  bool in_tick_ = false;  ///< the present block is the tick's
  std::uint64_t waits_before_ = 0, main_loop_ = 0;
  std::map<std::uint32_t, std::uint64_t> lengths_;  ///< of the main loop's blocks, instructions
  std::vector<RecordedTick> ticks_;
};

}  // namespace kmax::virtual_board
