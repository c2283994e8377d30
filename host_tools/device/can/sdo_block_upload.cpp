// SdoClient: block upload (CiA 301, 7.2.4.3.12 to 7.2.4.3.15).
#include <fmt/format.h>

#include <algorithm>

#include "firmware/canopen/sdo_crc.hpp"
#include "firmware/canopen/sdo_frame.hpp"
#include "host_tools/device/can/sdo_client.hpp"

namespace kmax::device {

namespace canopen = firmware::canopen;
namespace sdo_flag = canopen::sdo_flag;
using canopen::Abort;

namespace {
constexpr std::uint8_t block_upload = 0xA0;
// Bounds for a node that sends without end: frames taken for one block, and blocks that bring nothing.
constexpr unsigned frames_per_block_max = 4 * canopen::sdo_block_size_max;
constexpr std::size_t idle_blocks_max = 8;

constexpr std::uint8_t command(canopen::SdoBlockUploadRequest request, unsigned flags = 0) {
  return static_cast<std::uint8_t>(block_upload | static_cast<unsigned>(request) | flags);
}
}  // namespace

SdoClient::Bytes SdoClient::upload_block(Object object, const ReportProgress& report) {
  using enum canopen::SdoBlockUploadRequest;
  // Protocol switch threshold 0: the node is not to fall back to segments for a short value.
  send(canopen::sdo_bytes(command(initiate, sdo_flag::block_crc), object, canopen::sdo_block_size_max));
  Data answer;
  try {
    answer = reply(object, [object](const Data& data) {
      const auto kind = data[0] & 0xE0U;
      return canopen::sdo_address(data) == object && (kind == canopen::sdo_response::initiate_block_upload ||
                                                      kind == canopen::sdo_response::initiate_upload);
    });
  } catch (const SdoAborted& aborted) {
    if (aborted.code() == Abort::command) return upload_segmented(object);  // a node without block transfer
    throw;
  }
  if ((answer[0] & 0xE0U) == canopen::sdo_response::initiate_upload) return finish_upload(object, answer);

  const bool checked = (answer[0] & sdo_flag::block_crc) != 0;
  const bool sized = (answer[0] & sdo_flag::block_size_indicated) != 0;
  const std::size_t most = sized ? canopen::sdo_word(answer) : settings_.longest;
  if (most > settings_.longest)
    give_up(object, Abort::memory, fmt::format("the node announces {} bytes", most));

  Bytes bytes;
  send({command(start)});
  for (std::size_t had = 0, idle = 0; !receive_block(object, bytes, report); had = bytes.size()) {
    idle = bytes.size() == had ? idle + 1 : 0;
    if (idle == idle_blocks_max)
      give_up(object, Abort::sequence, "its first segment is lost again and again");
    if (bytes.size() > most) give_up(object, Abort::too_long, "it is longer than announced");
  }

  answer = reply(
      object, [](const Data& data) { return (data[0] & 0xE3U) == canopen::sdo_response::end_block_upload; });
  const std::size_t unused = std::min<std::size_t>((answer[0] >> 2) & 7U, bytes.size());
  bytes.erase(bytes.end() - static_cast<std::ptrdiff_t>(unused), bytes.end());
  if (sized && bytes.size() != most)
    give_up(object, Abort::length, fmt::format("{} bytes came, {} were announced", bytes.size(), most));
  const auto crc = static_cast<std::uint16_t>(answer[1] | answer[2] << 8);
  if (checked && canopen::sdo_crc(canopen::sdo_crc_start, bytes) != crc)
    give_up(object, Abort::crc, "its checksum is wrong");
  send({command(end)});
  return bytes;
}

/// Takes one block and acknowledges what came without a gap: the node goes on behind that. True: it was the
/// last one.
bool SdoClient::receive_block(Object object, Bytes& bytes, const ReportProgress& report) {
  using enum canopen::SdoBlockUploadRequest;
  unsigned good = 0, seen = 0;
  bool last = false;
  // Only what brings the block on puts it off.
  auto until = Clock::now() + settings_.response_timeout;
  for (unsigned frames = 0; frames < frames_per_block_max; ++frames) {
    const auto segment = next(object, until);
    if (!segment) {
      // Nothing at all: the acknowledgement was lost, or the whole block. Nobody can tell which.
      if (seen == 0) {
        ++counters_.timeouts;
        throw Failed{"no answer", true};
      }
      break;  // the end of the block was lost
    }
    const unsigned number = (*segment)[0] & ~unsigned{sdo_flag::last_of_block};
    const bool ends = ((*segment)[0] & sdo_flag::last_of_block) != 0;
    if (number == 0) {
      ++counters_.foreign;
      continue;
    }
    if (number > seen) until = Clock::now() + settings_.block_silence;
    seen = number;
    if (number == good + 1) {
      ++good;
      bytes.insert(bytes.end(), segment->begin() + 1, segment->end());
      last = ends;
    }
    if (ends || number == canopen::sdo_block_size_max) break;
  }
  if (good != seen || (!last && good != canopen::sdo_block_size_max)) ++counters_.lost_segments;
  try {
    if (report) report(bytes.size());
  } catch (...) {
    send_abort(object, Abort::general);
    throw;
  }
  send({command(response), static_cast<std::uint8_t>(good), canopen::sdo_block_size_max});
  return last;
}

}  // namespace kmax::device
