#pragma once

#include "firmware/board_interface/board_identity.hpp"
#include "firmware/command/axes.hpp"
#include "firmware/command/host_writes.hpp"
#include "firmware/command/parameter_access.hpp"
#include "firmware/command/store_commands.hpp"
#include "firmware/drive/link_states.hpp"
#include "firmware/links/readings.hpp"

namespace kmax::firmware {

/// What the registers and objects of the links stand for.
struct LinkSources {
  const BoardIdentity& board;
  ParameterAccess& parameters;
  StoreCommands& store;
  HostWrites& writes;
  Readings& readings;
  Axes& axes;  ///< their trace, captures and fault log
  LinkStates& links;
};

}  // namespace kmax::firmware
