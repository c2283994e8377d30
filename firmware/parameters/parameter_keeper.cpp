#include "firmware/parameters/parameter_keeper.hpp"

namespace kmax::firmware {

// The defaults. As the member's initialiser they would be worked out when compiled and stored in the image, 1
// KiB of it.
ParameterKeeper::ParameterKeeper() {
  for (std::size_t i = 0; i < persistent_count; ++i)
    kept_[i] = descriptors[owner_of(persistent_slots[i]).entry].default_value();
}

const LoadReport& ParameterKeeper::attach(AnyFlashSectors flash, ParameterValues& values) {
  flash_ = flash;
  state_ = flash_.present() ? StoreState::idle : StoreState::no_memory;
  survey_ = store_.survey();
  loaded_ = store_.load(values);
  kept_ = persistent_part(values);
  return loaded_;
}

Refusal ParameterKeeper::hindrance(bool armed) {
  if (busy()) return Refusal::store_busy;
  if (!flash_.present()) return Refusal::store_missing;
  if (armed) state_ = StoreState::refused;
  return armed ? Refusal::while_armed : Refusal::none;
}

Refusal ParameterKeeper::save(const ParameterValues& values, bool armed) {
  if (const Refusal refusal = hindrance(armed); refusal != Refusal::none) return refusal;
  // A master that saves at each of its starts must not wear the flash out.
  if (survey_.newest && state_ != StoreState::failed && persistent_part(values) == kept_) {
    state_ = StoreState::saved;
    return Refusal::none;
  }
  store_.begin(values);
  state_ = StoreState::busy;
  return Refusal::none;
}

Refusal ParameterKeeper::save_lock_code(std::uint32_t code, bool armed) {
  if (const Refusal refusal = hindrance(armed); refusal != Refusal::none) return refusal;
  if (code == lock_code() && state_ != StoreState::failed) {
    state_ = StoreState::saved;
    return Refusal::none;
  }
  store_.begin(kept_, code);
  state_ = StoreState::busy;
  return Refusal::none;
}

void ParameterKeeper::poll() {
  if (!busy()) return;
  const SaveProgress progress = store_.step();
  if (progress == SaveProgress::busy) return;
  survey_ = store_.survey();
  state_ = progress == SaveProgress::done ? StoreState::saved : StoreState::failed;
  if (progress == SaveProgress::done) kept_ = store_.set();
}

void ParameterKeeper::publish(ParameterValues& v) const {
  v.set_whole<"store.state">(static_cast<std::uint32_t>(state_));
  v.set_whole<"store.sequence">(survey_.header.sequence);
  v.set_whole<"store.saved_parameters">(survey_.parameters());
  std::uint32_t unsaved = 0;
  for (std::size_t i = 0; i < persistent_count; ++i)
    unsaved += v.raw(persistent_slots[i]) != kept_[i] ? 1U : 0U;
  v.set_whole<"store.unsaved_parameters">(unsaved);
  v.set_whole<"store.free_saves">(flash_.present() ? static_cast<std::uint32_t>(store_.free_saves(survey_))
                                                   : 0U);
  v.set_whole<"store.erases">(survey_.erases);
  v.set_whole<"store.write_errors">(store_.write_errors());
  v.set_whole<"store.damaged_records">(survey_.damaged);
  const MigrationReport& migration = loaded_.migration;
  v.set_whole<"store.migrated_dropped">(migration.dropped);
  v.set_whole<"store.migrated_defaulted">(migration.defaulted);
  v.set_whole<"store.dropped_1">(migration.first_dropped[0]);
  v.set_whole<"store.dropped_2">(migration.first_dropped[1]);
  v.set_whole<"store.dropped_3">(migration.first_dropped[2]);
  v.set_whole<"store.defaulted_1">(migration.first_defaulted[0]);
  v.set_whole<"store.defaulted_2">(migration.first_defaulted[1]);
  v.set_whole<"store.defaulted_3">(migration.first_defaulted[2]);
}

}  // namespace kmax::firmware
