#include "host_tools/device/serial/identification_reply.hpp"

#include <array>
#include <string_view>

#include "firmware/modbus/crc.hpp"

namespace kmax::device::identification {

namespace {
// unit, function, MEI type, read code, conformity, more follows, next object, number of objects
constexpr std::size_t header_length = 8;
constexpr std::size_t more_follows_at = 5, next_object_at = 6, count_at = 7;
constexpr std::size_t crc_length = 2;
constexpr std::size_t exception_length = 5;
}  // namespace

std::size_t frame_length(std::span<const std::uint8_t> received) {
  if (received.size() < 2) return 0;
  if (received[1] != function) return exception_length;
  if (received.size() < header_length) return 0;
  std::size_t at = header_length;
  for (std::uint8_t object = 0; object < received[count_at]; ++object) {
    if (received.size() < at + 2) return 0;
    at += 2u + received[at + 1];
  }
  return at + crc_length;
}

std::optional<Page> parse(std::span<const std::uint8_t> frame, std::uint8_t unit) {
  if (frame.size() < header_length + crc_length || frame.size() != frame_length(frame)) return std::nullopt;
  if (firmware::modbus::crc_of(frame) != 0) return std::nullopt;
  if (frame[0] != unit || frame[1] != function || frame[2] != mei_type) return std::nullopt;
  Page page;
  std::size_t at = header_length;
  for (std::uint8_t object = 0; object < frame[count_at]; ++object) {
    const std::span<const std::uint8_t> text = frame.subspan(at + 2, frame[at + 1]);
    page.objects[frame[at]] = std::string(text.begin(), text.end());
    at += 2 + text.size();
  }
  if (frame[more_follows_at] != 0) page.next_object = frame[next_object_at];
  return page;
}

std::string name_of(std::uint8_t object) {
  constexpr std::array<std::string_view, 7> standard = {"vendor_name",          "product_code", "revision",
                                                        "vendor_url",           "product_name", "model_name",
                                                        "user_application_name"};
  if (object < standard.size()) return std::string(standard[object]);
  return "object_" + std::to_string(object);
}

}  // namespace kmax::device::identification
