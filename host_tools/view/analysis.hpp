#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/check/hand_choice.hpp"
#include "host_tools/view/server/message.hpp"

namespace kmax::view {

/// What follows from the parameters: the drawn law, the criteria's verdicts, stability maps. It takes
/// milliseconds to hundreds of them, so that a thread of its own does it; while it computes, only the newest
/// parameters wait.
class Analysis {
 public:
  Analysis(check::HandChoice hand, Publish publish);
  ~Analysis();
  Analysis(const Analysis&) = delete;
  Analysis& operator=(const Analysis&) = delete;

  /// For any thread; does not wait.
  void parameters(const firmware::ParameterValues& values);
  /// From now on also the map of wall.stiffness and the parameter of this name. Throws base::ValueError if
  /// there is no such map.
  void want_map(std::size_t axis, const std::string& up);

 private:
  void run();
  void analyse(const firmware::ParameterValues& values);
  void publish_if_new(Message message);

  check::HandChoice hand_;
  Publish publish_;
  std::map<std::string, std::string> published_;  ///< texts by key; the thread's own

  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<firmware::ParameterValues> newest_;
  std::set<std::pair<std::size_t, std::string>> maps_;
  bool again_ = false, ended_ = false;
  std::thread thread_;
};

}  // namespace kmax::view
