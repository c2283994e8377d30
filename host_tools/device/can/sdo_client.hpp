#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "firmware/canopen/object_access.hpp"
#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

/// The node ended the transfer and said why.
class SdoAborted : public std::runtime_error {
 public:
  SdoAborted(firmware::canopen::Abort code, firmware::canopen::ObjectAddress object);

  firmware::canopen::Abort code() const { return code_; }
  firmware::canopen::ObjectAddress object() const { return object_; }

 private:
  firmware::canopen::Abort code_;
  firmware::canopen::ObjectAddress object_;
};

struct SdoSettings {
  std::chrono::milliseconds response_timeout{500};  ///< for each reply
  std::chrono::milliseconds block_silence{200};     ///< after which segments of a block count as lost
  int attempts = 3;                                 ///< of reads and idempotent writes
  std::size_t block_from = 64;                      ///< expected bytes from which a block upload pays
  std::size_t longest = std::size_t{1} << 20;       ///< bytes an upload may have
};

struct SdoCounters {
  std::uint64_t transfers = 0;      ///< that ended well
  std::uint64_t timeouts = 0;       ///< replies that did not come
  std::uint64_t repeated = 0;       ///< attempts after the first
  std::uint64_t foreign = 0;        ///< replies that belonged to another request: late, or to another client
  std::uint64_t lost_segments = 0;  ///< gaps in blocks that were asked for again
};

/// The client of one node's SDO server (CiA 301, 7.2.4.3): expedited, segmented and block uploads,
/// expedited and segmented downloads. Belongs to one thread; nobody else may talk to the server meanwhile
/// (CanNodeLock).
///
/// A reply is taken for an answer only if it names the object asked for. One that comes too late could
/// still name it, if the same object is asked for again: after a failure a marker is therefore sent first, a
/// read of another object, and all that comes before its answer is dropped: a node answers in order.
///
/// Errors: SdoAborted; LinkError if there is no answer, or none that makes sense, or the bus is gone. Reads
/// and idempotent writes are tried again; a write is not, since a lost answer does not tell whether the node
/// acted.
class SdoClient {
 public:
  using Object = firmware::canopen::ObjectAddress;
  using Bytes = std::vector<std::uint8_t>;
  /// Bytes that have arrived, at least once for each block. What it throws comes through, and the transfer
  /// is aborted.
  using ReportProgress = std::function<void(std::size_t)>;

  /// The port must let the node's replies pass: filters_for(node).
  SdoClient(CanPort& port, std::uint8_t node, const SdoSettings& settings = {});

  static std::vector<CanFilter> filters_for(std::uint8_t node);

  /// `expected`: how many bytes there will be, as far as is known; decides only how they travel.
  Bytes upload(Object object, std::size_t expected = 0, const ReportProgress& report = {});

  void download(Object object, std::span<const std::uint8_t> value, bool idempotent);

  std::uint8_t node() const { return node_; }
  const SdoCounters& counters() const { return counters_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Data = std::array<std::uint8_t, 8>;
  /// This attempt failed; the message says why.
  struct Failed {
    std::string why;
    bool silent = false;  ///< nothing came
  };

  void attempt(Object object, int attempts, const std::function<void()>& transfer);
  [[noreturn]] void fail(Object object, const Failed& last, int attempts);
  void begin(Object object);
  void resynchronise(Object object);

  void send(const Data& data);
  void send_abort(Object object, firmware::canopen::Abort code);
  [[noreturn]] void give_up(Object object, firmware::canopen::Abort code, std::string why);
  std::optional<Data> next(Object object, Clock::time_point deadline);
  Data reply(Object object, const std::function<bool(const Data&)>& is_answer);

  Bytes upload_segmented(Object object);
  Bytes finish_upload(Object object, const Data& answer);
  Bytes upload_block(Object object, const ReportProgress& report);
  bool receive_block(Object object, Bytes& bytes, const ReportProgress& report);
  void download_once(Object object, std::span<const std::uint8_t> value);

  CanPort& port_;
  std::uint8_t node_;
  SdoSettings settings_;
  SdoCounters counters_;
  /// A transfer of this object has not ended well: an answer may be on its way, or the node have it open.
  std::optional<Object> suspect_;
  unsigned marker_ = 0;
  std::optional<std::uint8_t> state_;  ///< NMT state in the node's last heartbeat
};

/// "0x2000:04"
std::string text_of(firmware::canopen::ObjectAddress object);

}  // namespace kmax::device
