#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace kmax::firmware::canopen {

/// Why an SDO transfer ended early: CiA 301, table "SDO abort codes".
enum class Abort : std::uint32_t {
  none = 0,
  toggle = 0x05030000,
  timeout = 0x05040000,
  command = 0x05040001,
  block_size = 0x05040002,
  sequence = 0x05040003,
  crc = 0x05040004,
  memory = 0x05040005,
  unsupported_access = 0x06010000,
  write_only = 0x06010001,
  read_only = 0x06010002,
  no_object = 0x06020000,
  not_mappable = 0x06040041,
  pdo_length = 0x06040042,
  incompatible = 0x06040043,
  incompatible_inside = 0x06040047,
  hardware = 0x06060000,
  length = 0x06070010,
  too_long = 0x06070012,
  too_short = 0x06070013,
  no_subindex = 0x06090011,
  value_range = 0x06090030,
  value_too_high = 0x06090031,
  value_too_low = 0x06090032,
  maximum_below_minimum = 0x06090036,
  general = 0x08000000,
  not_transferred = 0x08000020,
  local_control = 0x08000021,
  device_state = 0x08000022,
};

struct AbortText {
  Abort code;
  std::string_view words;
};

inline constexpr std::array abort_texts = std::to_array<AbortText>({
    {Abort::none, "no error"},
    {Abort::toggle, "the toggle bit did not alternate"},
    {Abort::timeout, "the transfer took too long"},
    {Abort::command, "the command is not known"},
    {Abort::block_size, "the block size is not 1 to 127"},
    {Abort::sequence, "a sequence number is not valid"},
    {Abort::crc, "the checksum is wrong"},
    {Abort::memory, "out of memory: the value is longer than can be taken"},
    {Abort::unsupported_access, "this object cannot be written now: the device is locked"},
    {Abort::write_only, "it can only be written"},
    {Abort::read_only, "it can only be read"},
    {Abort::no_object, "there is no such object"},
    {Abort::not_mappable, "this object cannot be mapped to the PDO"},
    {Abort::pdo_length, "the objects mapped are longer than a PDO"},
    {Abort::incompatible, "the parameters do not fit together"},
    {Abort::incompatible_inside, "the parameters do not fit together inside the device"},
    {Abort::hardware, "a hardware error, or the memory is missing"},
    {Abort::length, "the length does not fit the object"},
    {Abort::too_long, "too long for the object"},
    {Abort::too_short, "too short for the object"},
    {Abort::no_subindex, "there is no such sub-index"},
    {Abort::value_range, "the value is not allowed"},
    {Abort::value_too_high, "the value is above the highest allowed"},
    {Abort::value_too_low, "the value is below the lowest allowed"},
    {Abort::maximum_below_minimum, "the maximum is below the minimum"},
    {Abort::general, "a general error"},
    {Abort::not_transferred, "the data cannot be transferred or stored"},
    {Abort::local_control, "the data cannot be transferred or stored because of local control"},
    {Abort::device_state, "the data cannot be transferred or stored in the present state of the device"},
});

constexpr std::string_view to_string(Abort code) {
  for (const AbortText& text : abort_texts) {
    if (text.code == code) return text.words;
  }
  return "an abort code this program does not know";
}

}  // namespace kmax::firmware::canopen
