#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host_tools/flash/board_profile.hpp"
#include "host_tools/flash/flash_image.hpp"

// The exact command lines that write an image with a method, as arguments without a shell. File names are
// relative to the folder they run in.
//
// The same order for every method: read the parameter sectors; erase the sector of the vector table, so that
// an attempt that breaks off leaves a board that does not start rather than one with half of two programs;
// write the pieces, the one with the vector table last; let the tool verify; read everything back for a
// comparison by this program; only then start the application.
//
// Only sectors of the image are erased and written. OpenOCD also sets the brown-out level
// (info.brown_out_level); the others have no way of changing one option byte and leaving the rest. Sources:
// OpenOCD 0.12 user's guide (adapter gpio, flash erase_address, flash write_image, verify_image, dump_image),
// dfu-util(1) 0.11, stm32flash(1) 0.7.

namespace kmax::flash {

inline constexpr const char* parameters_before_file = "parameters_before.bin";
inline constexpr const char* parameters_after_file = "parameters_after.bin";
/// One erased word: dfu-util has no command that only erases.
inline constexpr const char* blank_file = "blank.bin";

struct Step {
  std::string says;  ///< what it does, for people
  std::vector<std::string> arguments;
  bool changes_flash;
};

struct FlashPlan {
  std::vector<Step> steps;
  std::vector<Step> start;             ///< after the comparison; empty where a reset line or a person does it
  std::string achieved;                ///< what is so before the start, for people
  const ChipMemory* memory = nullptr;  ///< FlashTarget's
};

/// A GPIO line as OpenOCD wants it.
struct AdapterLine {
  unsigned chip_number, offset;
  bool active_low = false, push_pull = false;
};

/// What a method needs to know beside the image.
struct FlashTarget {
  std::string program;                 ///< path
  std::string openocd_target;          ///< BoardProfile's
  const ChipMemory* memory = nullptr;  ///< BoardProfile's
  AdapterLine swdio{}, swclk{};
  std::optional<AdapterLine> reset{};  ///< NRST on a line
  unsigned adapter_kilohertz = 1000;
  std::string usb_serial{};  ///< of the ST-Link or of the board in DFU mode; empty: the only one
  /// Of a board in DFU mode that its firmware has put there: "1-1.2". Other than one whose BOOT0 is set, it
  /// is started by leaving DFU mode. Empty: whichever port it is on, and a reset or a person starts it.
  std::string usb_port{};
  std::string serial_port{};
  unsigned baud_rate = 115200;
};

FlashPlan plan_flash(Method method, const FlashImage& image, const FlashTarget& target);

/// Erases the parameter sectors, and with them the code of the write lock, and reads them back into
/// parameters_after_file. The program stays. It needs the board in hand: its debug port, or its ROM
/// bootloader, which BOOT0 starts.
FlashPlan plan_factory_reset(Method method, const FlashTarget& target);

}  // namespace kmax::flash
