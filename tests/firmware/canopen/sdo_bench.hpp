#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "firmware/canopen/sdo_server.hpp"
#include "tests/firmware/canopen/in_memory_objects.hpp"

namespace kmax::firmware::canopen {

using Eight = std::array<std::uint8_t, 8>;

/// A server, its objects, a clock, and a look at every frame that it sends.
template <std::size_t buffer_size = 2048>
class SdoBench {
 public:
  static constexpr std::uint8_t node_id = 5;

  explicit SdoBench(const SdoConfig& config = {}, std::uint32_t start_us = 0xFFFF'F000U)
      : server(objects, config), now_us(start_us) {
    server.start(SdoChannel::predefined(node_id));
  }

  void send(const Eight& bytes) {
    now_us += 130;  // a frame at 1 Mbit/s
    const drivers::CanFrame frame{.identifier = 0x600U + node_id, .length = 8, .data = bytes};
    server.receive(frame, now_us);
    server.poll(now_us);
  }

  std::optional<Eight> reply() {
    drivers::CanFrame frame;
    frame.length = 0xFF;
    frame.extended = frame.remote = true;
    if (!server.next_frame(frame, now_us)) return std::nullopt;
    now_us += 130;
    if (frame.identifier != 0x580U + node_id || frame.extended || frame.remote || frame.length != 8) {
      complaints.push_back("a frame of another kind than a response");
    }
    return frame.data;
  }

  /// Sends and returns the answer; 8 bytes of 0xEE if there is none. A second answer is a defect.
  Eight ask(const Eight& bytes) {
    send(bytes);
    const std::optional<Eight> answer = reply();
    if (answer && reply()) complaints.push_back("two answers to one request");
    return answer.value_or(no_answer);
  }

  void wait(std::uint32_t duration_us) {
    for (std::uint32_t passed = 0; passed < duration_us; passed += 500) {
      now_us += 500;
      server.poll(now_us);
    }
  }

  static constexpr Eight no_answer{0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE, 0xEE};

  InMemoryObjects objects;
  SdoServer<InMemoryObjects, buffer_size> server;
  std::uint32_t now_us;
  std::vector<std::string> complaints;  ///< of the bench or the client: what the standard does not allow
};

/// A request for an object: command, address, four more bytes.
inline Eight request(std::uint8_t command, ObjectAddress address, std::array<std::uint8_t, 4> rest = {}) {
  return {command,
          static_cast<std::uint8_t>(address.index & 0xFF),
          static_cast<std::uint8_t>(address.index >> 8),
          address.subindex,
          rest[0],
          rest[1],
          rest[2],
          rest[3]};
}

inline Eight abort_frame(ObjectAddress address, Abort code) {
  const auto c = static_cast<std::uint32_t>(code);
  return request(0x80, address,
                 {static_cast<std::uint8_t>(c), static_cast<std::uint8_t>(c >> 8),
                  static_cast<std::uint8_t>(c >> 16), static_cast<std::uint8_t>(c >> 24)});
}

/// Bytes that differ from their neighbours and from one multiple of 7 or 112 to the next.
inline Bytes pattern(std::size_t size) {
  Bytes bytes;
  std::uint32_t state = 12345;
  for (std::size_t i = 0; i < size; ++i) {
    state = state * 1664525U + 1013904223U;
    bytes.push_back(static_cast<std::uint8_t>(state >> 24));
  }
  return bytes;
}

/// An SDO client that keeps to CiA 301 v4.2, 7.2.4.3, written from its frame tables alone: numbers are
/// spelled out here, the CRC goes bit by bit, and nothing of the server's own encoding is used. Every answer
/// is compared with what the standard allows; deviations go to the bench's complaints. Faults are put in
/// between by hooks.
template <typename Bench>
class SdoTestClient {
 public:
  /// May take segments away, repeat and reorder them.
  using Fault = std::function<void(std::vector<Eight>&)>;

  struct Outcome {
    Abort abort = Abort::none;
    Bytes data;
  };

  struct Download {
    bool size_indicated = true;
    std::optional<std::uint32_t> size{};  ///< another one than the true one
    bool crc = true;
    std::uint16_t crc_error = 0;
    std::optional<std::uint8_t> unused{};  ///< n of the last segment, another one than the true one
    Fault fault{};                         ///< on a block on its way to the server
  };

  struct Upload {
    bool crc = true;
    std::uint8_t switch_threshold = 0;
    std::function<std::uint8_t()> block_size = [] { return std::uint8_t{127}; };
    Fault fault{};  ///< on a block on its way to the client
  };

  explicit SdoTestClient(Bench& bench) : bench_(&bench) {}

  Outcome upload(ObjectAddress address) {
    bench_->send(request(0x40, address));
    const Eight answer = await();
    return ended(answer, address) ? Outcome{code(answer), {}} : upload_rest(answer, address);
  }

  /// Expedited when it is 1 to 4 bytes long and its size is to be indicated truly, else in segments.
  Abort download(ObjectAddress address, const Bytes& data, const Download& how = {}) {
    if (!data.empty() && data.size() <= 4 && how.size_indicated && !how.size && !how.unused) {
      Eight initiate = request(static_cast<std::uint8_t>(0x23 | (4 - data.size()) << 2), address);
      std::copy(data.begin(), data.end(), initiate.begin() + 4);
      bench_->send(initiate);
      return confirmed(request(0x60, address), address);
    }
    return download_segmented(address, data, how);
  }

  Abort download_segmented(ObjectAddress address, const Bytes& data, const Download& how = {}) {
    bench_->send(with_size(how.size_indicated ? 0x21 : 0x20, address, data, how));
    Abort abort = confirmed(request(0x60, address), address);
    std::uint8_t toggle = 0;
    for (std::size_t offset = 0; abort == Abort::none;) {
      const std::size_t length = std::min<std::size_t>(7, data.size() - offset);
      const bool last = offset + length == data.size();
      const std::size_t unused = last && how.unused ? *how.unused : 7 - length;
      Eight segment = piece(data, offset);
      segment[0] = static_cast<std::uint8_t>(toggle | unused << 1 | (last ? 1U : 0U));
      bench_->send(segment);
      abort = confirmed({static_cast<std::uint8_t>(0x20 | toggle)}, address);
      toggle ^= 0x10;
      offset += length;
      if (last) break;
    }
    return abort;
  }

  Abort block_download(ObjectAddress address, const Bytes& data, const Download& how = {}) {
    const unsigned flags = (how.crc ? 4U : 0U) | (how.size_indicated ? 2U : 0U);
    bench_->send(with_size(static_cast<std::uint8_t>(0xC0 | flags), address, data, how));
    Eight answer = await();
    if (ended(answer, address)) return code(answer);
    const bool server_crc = (answer[0] & 4U) != 0;
    expect(answer == request(server_crc ? 0xA4 : 0xA0, address, {answer[4]}), "block download: initiate");
    unsigned block_size = answer[4];
    const std::size_t total = data.empty() ? 1 : (data.size() + 6) / 7;
    for (std::size_t next = 0; next < total;) {
      expect(block_size >= 1 && block_size <= 127, "block download: block size");
      std::vector<Eight> block;
      for (unsigned number = 1; number <= block_size && next + number <= total; ++number) {
        Eight segment = piece(data, 7 * (next + number - 1));
        segment[0] = static_cast<std::uint8_t>(number | (next + number == total ? 0x80U : 0U));
        block.push_back(segment);
      }
      const std::size_t sent = block.size();
      if (how.fault) how.fault(block);
      for (const Eight& segment : block) bench_->send(segment);
      answer = await();
      if (ended(answer, address)) return code(answer);
      expect(answer == Eight{0xA2, answer[1], answer[2]}, "block download: acknowledgement");
      expect(answer[1] <= sent, "block download: more acknowledged than sent");
      next += answer[1];
      block_size = answer[2];
      ++blocks;
    }
    const std::size_t unused = how.unused.value_or(static_cast<std::uint8_t>(7 * total - data.size()));
    const unsigned crc = how.crc && server_crc ? bitwise_crc(data) ^ how.crc_error : 0U;
    bench_->send({static_cast<std::uint8_t>(0xC1 | unused << 2), static_cast<std::uint8_t>(crc & 0xFF),
                  static_cast<std::uint8_t>(crc >> 8)});
    return confirmed({0xA1}, address);
  }

  Outcome block_upload(ObjectAddress address, const Upload& how = {}) {
    std::uint8_t block_size = how.block_size();
    bench_->send(request(how.crc ? 0xA4 : 0xA0, address, {block_size, how.switch_threshold}));
    Eight answer = await();
    if (ended(answer, address)) return {code(answer), {}};
    if ((answer[0] & 0xE0) == 0x40) {
      Outcome switched = upload_rest(answer, address);
      expect(switched.data.size() <= how.switch_threshold, "block upload: switched above the threshold");
      return switched;
    }
    const bool crc = how.crc && (answer[0] & 4U) != 0;
    expect((answer[0] & ~4U) == 0xC2 && at(answer, address), "block upload: initiate");
    const std::size_t size = word(answer);
    bench_->send({0xA3});
    Bytes data;
    for (bool complete = false; !complete;) {
      std::vector<Eight> block;
      while (block.size() <= 128) {
        const std::optional<Eight> segment = bench_->reply();
        if (!segment) break;
        if (ended(*segment, address)) return {code(*segment), {}};
        block.push_back(*segment);
      }
      if (block.empty() && ended(answer = await(), address)) return {code(answer), {}};
      check_block(block, block_size);
      if (how.fault) how.fault(block);
      std::uint8_t good = 0;
      for (const Eight& segment : block) {
        if ((segment[0] & 0x7F) != good + 1) continue;
        ++good;
        data.insert(data.end(), segment.begin() + 1, segment.end());
        complete = (segment[0] & 0x80) != 0;
      }
      block_size = how.block_size();
      bench_->send({0xA2, good, block_size});
      ++blocks;
    }
    answer = await();
    if (ended(answer, address)) return {code(answer), {}};
    expect((answer[0] & 0xE3) == 0xC1, "block upload: end");
    const std::size_t unused = answer[0] >> 2 & 7U;
    expect(unused <= data.size(), "block upload: more padding than data");
    data.resize(data.size() - unused);
    expect(data.size() == size, "block upload: another size than indicated");
    const unsigned expected_crc = crc ? bitwise_crc(data) : 0U;
    expect(answer[1] == (expected_crc & 0xFF) && answer[2] == expected_crc >> 8, "block upload: CRC");
    bench_->send({0xA1});
    expect(!bench_->reply().has_value(), "block upload: an answer to the end");
    return {Abort::none, data};
  }

  static std::uint16_t bitwise_crc(const Bytes& data) {
    unsigned crc = 0;
    for (const std::uint8_t byte : data) {
      for (int bit = 7; bit >= 0; --bit) {
        const bool out = ((crc >> 15 ^ byte >> bit) & 1U) != 0;
        crc = crc << 1 & 0xFFFF;
        if (out) crc ^= 0x1021;
      }
    }
    return static_cast<std::uint16_t>(crc);
  }

  int blocks = 0;     ///< acknowledged in either direction
  int time_outs = 0;  ///< of this client

 private:
  static constexpr std::uint32_t patience_us = 600'000;

  void expect(bool fulfilled, const char* what) {
    if (!fulfilled) bench_->complaints.emplace_back(what);
  }

  /// The answer; after some patience this client aborts, and that counts as the answer.
  Eight await() {
    for (int attempt = 0; attempt < 2; ++attempt) {
      if (const std::optional<Eight> answer = bench_->reply()) return *answer;
      if (attempt == 0) bench_->wait(patience_us);
    }
    ++time_outs;
    bench_->send(abort_frame({}, Abort::timeout));
    expect(!bench_->reply().has_value(), "an answer to an abort");
    return abort_frame({}, Abort::timeout);
  }

  bool ended(const Eight& answer, ObjectAddress address) {
    if (answer[0] != 0x80) return false;
    expect(at(answer, address) || at(answer, {}), "an abort of another object");
    return true;
  }

  // An answer of another kind confirms nothing: a server that disturbing frames led elsewhere has not written
  // the object.
  Abort confirmed(const Eight& expected, ObjectAddress address) {
    const Eight answer = await();
    if (ended(answer, address)) return code(answer);
    expect(answer == expected, "a confirmation of another kind");
    return answer == expected ? Abort::none : Abort::command;
  }

  Outcome upload_rest(Eight answer, ObjectAddress address) {
    expect(at(answer, address) && (answer[0] & 0xF1) == 0x41, "upload: initiate");
    if ((answer[0] & 2U) != 0) {
      const std::size_t size = 4U - (answer[0] >> 2 & 3U);
      return {Abort::none, Bytes(answer.begin() + 4, answer.begin() + 4 + static_cast<long>(size))};
    }
    expect(answer[0] == 0x41, "upload: n without data");
    const std::size_t size = word(answer);
    Bytes data;
    for (unsigned toggle = 0;; toggle ^= 0x10) {
      bench_->send({static_cast<std::uint8_t>(0x60 | toggle)});
      answer = await();
      if (ended(answer, address)) return {code(answer), {}};
      expect((answer[0] & 0xF0) == toggle, "upload: segment");
      const std::size_t length = 7U - (answer[0] >> 1 & 7U);
      data.insert(data.end(), answer.begin() + 1, answer.begin() + 1 + static_cast<long>(length));
      if ((answer[0] & 1U) != 0 || data.size() > size) break;
    }
    expect(data.size() == size, "upload: another size than indicated");
    return {Abort::none, data};
  }

  void check_block(const std::vector<Eight>& block, std::uint8_t block_size) {
    for (std::size_t i = 0; i < block.size(); ++i) {
      expect((block[i][0] & 0x7F) == i + 1, "block upload: number");
      const bool ends = (block[i][0] & 0x80) != 0 || i + 1 == block_size;
      expect(ends == (i + 1 == block.size()), "block upload: length of the block");
    }
    expect(!block.empty(), "block upload: nothing came");
  }

  static Eight with_size(std::uint8_t command, ObjectAddress address, const Bytes& data,
                         const Download& how) {
    if (!how.size_indicated) return request(command, address);
    const auto size = how.size.value_or(static_cast<std::uint32_t>(data.size()));
    return request(command, address,
                   {static_cast<std::uint8_t>(size), static_cast<std::uint8_t>(size >> 8),
                    static_cast<std::uint8_t>(size >> 16), static_cast<std::uint8_t>(size >> 24)});
  }

  static Eight piece(const Bytes& data, std::size_t offset) {
    Eight bytes{};
    for (std::size_t i = 0; i < 7 && offset + i < data.size(); ++i) bytes[i + 1] = data[offset + i];
    return bytes;
  }

  static bool at(const Eight& answer, ObjectAddress address) {
    return (answer[1] | answer[2] << 8) == address.index && answer[3] == address.subindex;
  }

  static std::uint32_t word(const Eight& answer) {
    return answer[4] | static_cast<std::uint32_t>(answer[5]) << 8 |
           static_cast<std::uint32_t>(answer[6]) << 16 | static_cast<std::uint32_t>(answer[7]) << 24;
  }

  static Abort code(const Eight& answer) { return static_cast<Abort>(word(answer)); }

  Bench* bench_;
};

/// A bench whose client and server must have kept to the standard in the end, with no transfer under way.
template <std::size_t buffer_size = 2048>
struct CleanSdoBench : SdoBench<buffer_size> {
  using SdoBench<buffer_size>::SdoBench;
  ~CleanSdoBench() {
    EXPECT_EQ(this->complaints, std::vector<std::string>{});
    EXPECT_EQ(this->objects.broken_promises, 0);
    EXPECT_FALSE(this->server.busy());
  }
};

}  // namespace kmax::firmware::canopen
