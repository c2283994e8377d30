#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/flash/board_profile.hpp"
#include "host_tools/lines/lines_config.hpp"
#include "host_tools/usb/usb_devices.hpp"

// Which way of flashing to take: those that the board has, and of them those that are there right now.

namespace kmax::flash {

struct MethodVerdict {
  Method method;
  bool applies;      ///< to the board
  bool ready;        ///< what it needs is there
  std::string text;  ///< why it does not apply, or what is missing, or what makes it ready
};

/// In the order of preference: all_methods.
std::vector<MethodVerdict> judge_methods(const BoardProfile& board, const lines::LinesConfig& config,
                                         std::span<const usb::UsbDevice> devices);

/// No method can be used, or not the one asked for. The message lists all of them with their reasons.
class MethodError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// The method does not apply to the board, ever.
class MethodNotOnBoardError : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// `wanted`: "auto" or a method's name. With `dry` a method that is not ready is taken, too, when it is asked
/// for by name.
Method choose_method(const std::string& wanted, const BoardProfile& board,
                     std::span<const MethodVerdict> verdicts, bool dry);

}  // namespace kmax::flash
