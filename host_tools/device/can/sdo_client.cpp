#include "host_tools/device/can/sdo_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "firmware/canopen/sdo_frame.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::device {

namespace canopen = firmware::canopen;
namespace cob_id = canopen::cob_id;
namespace sdo_flag = canopen::sdo_flag;
using canopen::Abort;

namespace {
// The commands of an SDO client with the flags still to be added (CiA 301, 7.2.4.3.3 ff.).
constexpr unsigned upload_request = 0x40, upload_segment_request = 0x60;
constexpr unsigned download_request = 0x20, download_segment_request = 0x00;

bool has_command(const canopen::SdoBytes& bytes, std::uint8_t command) {
  return (bytes[0] & 0xE0U) == command;
}

canopen::SdoBytes message(unsigned command, SdoClient::Object object, std::uint32_t word = 0) {
  return canopen::sdo_bytes(static_cast<std::uint8_t>(command), object, word);
}

/// Aborts that are about the transfer, not about the object: another attempt may do better.
bool is_about_transfer(Abort code) {
  return code == Abort::toggle || code == Abort::timeout || code == Abort::sequence || code == Abort::crc;
}

// Objects every node must have (CiA 301, 7.5.1), as markers.
constexpr SdoClient::Object markers[] = {{0x1000, 0}, {0x1001, 0}, {0x1018, 0}, {0x1018, 1}};

const char* state_text(std::uint8_t state) {
  switch (state) {
    case 4:
      return "stopped, in which it answers no SDO; start it with the NMT command 'enter pre-operational' "
             "(cansend IFACE 000#8000)";
    case 5:
      return "operational";
    case 127:
      return "pre-operational";
    default:
      return "unknown";
  }
}
}  // namespace

std::string text_of(SdoClient::Object object) {
  return fmt::format("0x{:04X}:{:02X}", object.index, object.subindex);
}

SdoAborted::SdoAborted(Abort code, SdoClient::Object object)
    : std::runtime_error(fmt::format("the node refused object {}: {} (SDO abort {:08X})", text_of(object),
                                     canopen::to_string(code), static_cast<std::uint32_t>(code))),
      code_(code),
      object_(object) {}

SdoClient::SdoClient(CanPort& port, std::uint8_t node, const SdoSettings& settings)
    : port_(port), node_(node), settings_(settings) {}

std::vector<CanFilter> SdoClient::filters_for(std::uint8_t node) {
  return {{cob_id::sdo_response + node, 0x7FF}, {cob_id::heartbeat + node, 0x7FF}};
}

void SdoClient::send(const Data& data) {
  drivers::CanFrame frame{.identifier = cob_id::sdo_request + node_, .length = 8, .data = data};
  port_.send(frame);
}

void SdoClient::send_abort(Object object, Abort code) {
  send(message(canopen::sdo_response::abort, object, static_cast<std::uint32_t>(code)));
}

void SdoClient::give_up(Object object, Abort code, std::string why) {
  send_abort(object, code);
  throw Failed{std::move(why)};
}

/// The next message of the node's server; nothing if none comes until `deadline`.
std::optional<SdoClient::Data> SdoClient::next(Object object, Clock::time_point deadline) {
  // Looks at least once, and a bus full of frames that are of no use here does not hold the program.
  do {
    const auto left = std::chrono::ceil<std::chrono::microseconds>(deadline - Clock::now());
    const auto received = port_.receive(std::max(left, std::chrono::microseconds(0)));
    if (!received) {
      if (port_.bus_off()) throw LinkError(fmt::format("{}: {}", port_.description(), port_.trouble()));
      continue;
    }
    const drivers::CanFrame& frame = received->frame;
    if (frame.extended || frame.remote) continue;
    if (frame.identifier == cob_id::heartbeat + node_ && frame.length == 1) {
      state_ = static_cast<std::uint8_t>(frame.data[0] & 0x7F);
      if (state_ == 0) throw Failed{"the device restarted in the middle of it"};
      continue;
    }
    if (frame.identifier != cob_id::sdo_response + node_ || frame.length != 8) continue;
    if (frame.data[0] == canopen::sdo_response::abort && canopen::sdo_address(frame.data) == object)
      throw SdoAborted(static_cast<Abort>(canopen::sdo_word(frame.data)), object);
    return frame.data;
  } while (Clock::now() < deadline);
  return std::nullopt;
}

SdoClient::Data SdoClient::reply(Object object, const std::function<bool(const Data&)>& is_answer) {
  const auto deadline = Clock::now() + settings_.response_timeout;
  while (const auto data = next(object, deadline)) {
    if (is_answer(*data)) return *data;
    ++counters_.foreign;
    if (Clock::now() >= deadline) break;  // a node that chatters must not hold the program
  }
  ++counters_.timeouts;
  throw Failed{"no answer", true};
}

/// What has arrived before the question is not its answer: while this program waited, another one may have
/// talked to the node.
void SdoClient::begin(Object object) {
  const auto until = Clock::now() + settings_.response_timeout;
  while (port_.receive(std::chrono::microseconds(0)) && Clock::now() < until) {
  }
  if (suspect_) resynchronise(object);
  suspect_ = object;  // until the transfer has ended well
}

void SdoClient::resynchronise(Object object) {
  send_abort(*suspect_, Abort::timeout);  // frees the server from what may be open
  do {
    marker_ = (marker_ + 1) % std::size(markers);
  } while (markers[marker_] == object);
  const Object marker = markers[marker_];
  send(message(upload_request, marker));
  try {
    const Data answer = reply(marker, [marker](const Data& data) {
      return has_command(data, canopen::sdo_response::initiate_upload) &&
             canopen::sdo_address(data) == marker;
    });
    if ((answer[0] & sdo_flag::expedited) == 0)
      send_abort(marker, Abort::general);  // a segmented one is not fetched
  } catch (const SdoAborted&) {
    // An answer as well.
  }
}

void SdoClient::attempt(Object object, int attempts, const std::function<void()>& transfer) {
  state_.reset();
  for (int number = 1;; ++number) {
    try {
      begin(object);
      transfer();
      suspect_.reset();
      ++counters_.transfers;
      return;
    } catch (const Failed& failed) {
      if (number == attempts) fail(object, failed, number);
    } catch (const SdoAborted& aborted) {
      if (!is_about_transfer(aborted.code())) suspect_.reset();
      if (!suspect_ || number == attempts) throw;
    }
    ++counters_.repeated;
  }
}

void SdoClient::fail(Object object, const Failed& last, int attempts) {
  const std::string tried = attempts == 1 ? "sent once" : fmt::format("sent {} times", attempts);
  const std::string trouble = port_.trouble();
  if (!last.silent)
    throw LinkError(fmt::format("{}: the conversation with node {} about object {} failed ({}): {}{}",
                                port_.description(), node_, text_of(object), tried, last.why,
                                trouble.empty() ? "" : "; " + trouble));
  std::string check =
      "check that the device is powered, the wiring, and that node ID and bit rate are the device's, or it "
      "was stopped by an NMT master";
  if (state_) check = fmt::format("the device is there, its state is {}", state_text(*state_));
  if (!trouble.empty()) check = trouble;
  throw LinkError(fmt::format("{}: no answer from node {} within {} ms (object {}, {}); {}",
                              port_.description(), node_, settings_.response_timeout.count(), text_of(object),
                              tried, check));
}

SdoClient::Bytes SdoClient::upload(Object object, std::size_t expected, const ReportProgress& report) {
  Bytes value;
  attempt(object, settings_.attempts, [&] {
    value = expected >= settings_.block_from ? upload_block(object, report) : upload_segmented(object);
  });
  return value;
}

SdoClient::Bytes SdoClient::upload_segmented(Object object) {
  send(message(upload_request, object));
  return finish_upload(object, reply(object, [object](const Data& data) {
                         return has_command(data, canopen::sdo_response::initiate_upload) &&
                                canopen::sdo_address(data) == object;
                       }));
}

SdoClient::Bytes SdoClient::finish_upload(Object object, const Data& answer) {
  const bool sized = (answer[0] & sdo_flag::size_indicated) != 0;
  if ((answer[0] & sdo_flag::expedited) != 0) {
    const unsigned unused = sized ? (answer[0] >> 2) & 3U : 0U;
    return Bytes(answer.begin() + 4, answer.end() - unused);
  }
  const std::size_t most = sized ? canopen::sdo_word(answer) : settings_.longest;
  if (most > settings_.longest)
    give_up(object, Abort::memory, fmt::format("the node announces {} bytes", most));
  Bytes bytes;
  for (unsigned toggle = 0;; toggle ^= sdo_flag::toggle) {
    send({static_cast<std::uint8_t>(upload_segment_request | toggle)});
    const Data segment = reply(
        object, [](const Data& data) { return has_command(data, canopen::sdo_response::upload_segment); });
    if ((segment[0] & sdo_flag::toggle) != toggle)
      give_up(object, Abort::toggle, "a segment came twice or was lost");
    const unsigned unused = (segment[0] >> 1) & 7U;
    bytes.insert(bytes.end(), segment.begin() + 1, segment.end() - unused);
    if (bytes.size() > most) give_up(object, Abort::too_long, "it is longer than announced");
    if ((segment[0] & sdo_flag::last_segment) != 0) break;
  }
  if (sized && bytes.size() != most)
    throw Failed{fmt::format("{} bytes came, {} were announced", bytes.size(), most)};
  return bytes;
}

void SdoClient::download(Object object, std::span<const std::uint8_t> value, bool idempotent) {
  attempt(object, idempotent ? settings_.attempts : 1, [&] { download_once(object, value); });
}

void SdoClient::download_once(Object object, std::span<const std::uint8_t> value) {
  const auto is_answer = [object](const Data& data) {
    return has_command(data, canopen::sdo_response::initiate_download) &&
           canopen::sdo_address(data) == object;
  };
  if (!value.empty() && value.size() <= 4) {
    const auto unused = static_cast<unsigned>(4 - value.size());
    Data request =
        message(download_request | sdo_flag::expedited | sdo_flag::size_indicated | unused << 2, object);
    std::copy(value.begin(), value.end(), request.begin() + 4);
    send(request);
    reply(object, is_answer);
    return;
  }
  send(
      message(download_request | sdo_flag::size_indicated, object, static_cast<std::uint32_t>(value.size())));
  reply(object, is_answer);
  unsigned toggle = 0;
  do {
    const std::size_t count = std::min<std::size_t>(7, value.size());
    Data segment{static_cast<std::uint8_t>(download_segment_request | toggle | (7 - count) << 1 |
                                           (count == value.size() ? sdo_flag::last_segment : 0U))};
    std::copy_n(value.begin(), count, segment.begin() + 1);
    value = value.subspan(count);
    send(segment);
    const Data answer = reply(
        object, [](const Data& data) { return has_command(data, canopen::sdo_response::download_segment); });
    if ((answer[0] & sdo_flag::toggle) != toggle)
      give_up(object, Abort::toggle, "the answer to a segment came twice or was lost");
    toggle ^= sdo_flag::toggle;
  } while (!value.empty());
}

}  // namespace kmax::device
