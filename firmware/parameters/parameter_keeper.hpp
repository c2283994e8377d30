#pragma once

#include <cstdint>

#include "firmware/parameters/parameter_store.hpp"

namespace kmax::firmware {

/// What the store is doing or did last. The numbers are store.state.
enum class StoreState : std::uint8_t {
  idle = 0,
  busy = 1,
  saved = 2,
  failed = 3,
  refused = 4,
  defaults_set = 5,
  no_memory = 6,
};

/// What store.command takes.
enum class StoreCommand : std::uint16_t { save = 1, defaults = 2 };

/// The parameter store as the application has it: behind any flash, one step per pass of the main loop, and
/// with what a host reads about it.
class ParameterKeeper {
 public:
  ParameterKeeper();
  ParameterKeeper(const ParameterKeeper&) = delete;
  ParameterKeeper& operator=(const ParameterKeeper&) = delete;

  /// Before anything else, once: takes the memory and puts its newest set into `values`.
  const LoadReport& attach(AnyFlashSectors flash, ParameterValues& values);

  /// Why it cannot be saved now; none: poll() does it from now on. A refusal while a save is under way does
  /// not disturb that.
  Refusal save(const ParameterValues& values, bool armed);

  /// The write lock's code instead of the present one, 0 for none; beside it the set that is kept now, so
  /// that what has not been saved stays so. As save().
  Refusal save_lock_code(std::uint32_t code, bool armed);
  /// The one that a restart brings; 0: none.
  std::uint32_t lock_code() const { return survey_.lock_code; }

  /// All persistent parameters have been set to their defaults, in RAM; or the request was refused.
  void note_defaults(Refusal refusal) {
    if (!busy()) state_ = refusal == Refusal::none ? StoreState::defaults_set : StoreState::refused;
  }

  /// One step of a save under way.
  void poll();

  bool busy() const { return store_.busy(); }
  StoreState state() const { return state_; }
  const LoadReport& loaded() const { return loaded_; }

  /// Writes the readings store.* into `values`.
  void publish(ParameterValues& values) const;

 private:
  Refusal hindrance(bool armed);

  AnyFlashSectors flash_;
  ParameterStore<AnyFlashSectors> store_{flash_};
  StoreSurvey survey_;
  LoadReport loaded_;
  PersistentValues kept_{};  ///< what a restart brings
  StoreState state_ = StoreState::no_memory;
};

}  // namespace kmax::firmware
