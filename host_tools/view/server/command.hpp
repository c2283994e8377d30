#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/device/capture_reader.hpp"
#include "host_tools/json/json.hpp"
#include "host_tools/view/server/procedure_text.hpp"

namespace kmax::view {

using ClientId = std::uint64_t;

/// What a client wants; docs/view.md says what each message means.
struct Command {
  enum class Kind : std::uint8_t {
    alive,
    stop,
    arm,
    disarm,
    clear,
    set,
    revert,
    save,
    map,
    capture,
    procedure,
    answer,
    cancel,
    keep
  };

  Kind kind = Kind::alive;
  json::Json id{};  ///< comes back in the reply; null: there was none
  std::size_t axis = 0;
  std::vector<std::string> assignments{};  ///< "NAME=VALUE" of set, as `kmax set` takes them
  std::string map_side{};                  ///< of map: the name of the parameter that goes up
  device::CaptureSettings capture{};
  ProcedureSettings procedure{};
  std::uint32_t prompt = 0;  ///< of answer
  bool keep = false;         ///< of keep
  ClientId client = 0;
};

/// A message that no command could be made of. `id`: of the message, if it had one.
class BadMessage : public std::runtime_error {
 public:
  BadMessage(const std::string& what, json::Json message_id)
      : std::runtime_error(what), id(std::move(message_id)) {}
  json::Json id;
};

/// Throws BadMessage that says what was wrong and what is allowed.
Command parse_command(std::string_view text);

}  // namespace kmax::view
