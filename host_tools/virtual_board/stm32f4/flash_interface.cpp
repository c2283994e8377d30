#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"

#include <algorithm>
#include <cstddef>
#include <string>

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace flash_acr = stm32::flash_acr;
namespace flash_cr = stm32::flash_cr;
namespace flash_sr = stm32::flash_sr;

constexpr std::uint32_t acr_bits = flash_acr::Latency::mask | flash_acr::Prefetch::mask |
                                   flash_acr::InstructionCache::mask | flash_acr::DataCache::mask |
                                   flash_acr::InstructionCacheReset::mask | flash_acr::DataCacheReset::mask;
constexpr std::uint32_t cr_bits = flash_cr::Program::mask | flash_cr::SectorErase::mask |
                                  flash_cr::Sector::mask | flash_cr::Parallelism::mask |
                                  flash_cr::Start::mask | flash_cr::Lock::mask;
constexpr std::uint32_t sr_bits = flash_sr::errors | flash_sr::EndOfOperation::mask;

constexpr BoardTime store_duration = 16 * units_per_microsecond;

BoardTime erase_duration(unsigned sector) {
  const BoardTime millisecond = 1000 * units_per_microsecond;
  switch (stm32::flash_sector_bytes(sector)) {
    case 16 * 1024:
      return 250 * millisecond;
    case 64 * 1024:
      return 550 * millisecond;
    default:
      return 1000 * millisecond;
  }
}

}  // namespace

FlashInterface::FlashInterface(const BoardClocks& clocks, std::span<std::uint8_t> image)
    : RegisterBlock("FLASH", registers()), clocks_(clocks), image_(image) {
  const std::uint32_t expected = stm32::flash_sector_offset(stm32::flash_sector_count);
  if (image.size() == expected) return;
  throw std::invalid_argument("flash image of " + std::to_string(image.size()) + " bytes; must be " +
                              std::to_string(expected));
}

std::uint32_t FlashInterface::wait_states() const {
  return flash_acr::Latency::of(acr_);
}

std::uint32_t FlashInterface::wait_states_needed(BoardTime core_period) {
  // One wait state per 30 MHz begun.
  const BoardTime hz = units_per_second / core_period;
  return static_cast<std::uint32_t>((hz - 1) / 30'000'000);
}

void FlashInterface::set_write_protected(unsigned sector, bool write_protected) {
  write_protected_.at(sector) = write_protected;
}

void FlashInterface::cut_power_after(std::uint64_t operations, std::uint64_t seed) {
  cut_at_ = operations == 0 ? 0 : operations_ + operations;
  random_.seed(seed);
}

void FlashInterface::reset(BoardTime now) {
  if (now < busy_until_ && latest_) tear();
  busy_until_ = now;
  latest_.reset();
  acr_ = 0;
  sr_ = 0;
  cr_ = flash_cr::Lock::mask;
  first_key_given_ = false;
  locked_up_ = false;
  // The caches come out of reset disabled and must be assumed to hold anything until they are reset.
}

void FlashInterface::power_up(BoardTime now) {
  power_is_cut_ = false;
  cut_at_ = 0;
  data_cache_is_stale_ = false;
  latest_.reset();
  reset(now);
}

const RegisterTable<FlashInterface>& FlashInterface::registers() {
  using Model = FlashInterface;
  using Row = Register<Model>;
  using Layout = stm32::FlashRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, acr), "ACR", Row::shows<&Model::acr_>, acr_bits,
       Row::takes<&Model::write_access_control>},
      {offsetof(Layout, keyr), "KEYR", nullptr, any_bits, Row::takes<&Model::write_key>},
      {offsetof(Layout, sr), "SR", Row::shows<&Model::read_status>, sr_bits,
       Row::clears_by_ones<&Model::sr_>},
      {offsetof(Layout, cr), "CR", Row::shows<&Model::cr_>, cr_bits, Row::takes<&Model::write_control>},
      {offsetof(Layout, optcr), "OPTCR", Row::shows<&Model::optcr_>}};
  return table;
}

std::uint32_t FlashInterface::read_status(const Access& access) const {
  return sr_ | flash_sr::Busy::bits(access.now < busy_until_ ? 1 : 0);
}

void FlashInterface::write_access_control(const Access& access, std::uint32_t value) {
  const std::uint32_t needed = wait_states_needed(clocks_.core);
  refuse_if(flash_acr::Latency::of(value) < needed, access, "ACR: {} wait states, the present HCLK needs {}",
            flash_acr::Latency::of(value), needed);
  const bool resets_instructions = flash_acr::InstructionCacheReset::of(value) != 0;
  const bool resets_data = flash_acr::DataCacheReset::of(value) != 0;
  refuse_if((resets_instructions && flash_acr::InstructionCache::of(acr_ | value) != 0) ||
                (resets_data && flash_acr::DataCache::of(acr_ | value) != 0),
            access, "ACR: a cache can be reset only while it is disabled");
  if (resets_data) data_cache_is_stale_ = false;
  acr_ = value;
}

void FlashInterface::write_key(const Access& access, std::uint32_t value) {
  if (locked_up_) return;
  const bool locked = flash_cr::Lock::of(cr_) != 0;
  if (locked && !first_key_given_ && value == stm32::flash_key_1) {
    first_key_given_ = true;
    return;
  }
  if (locked && first_key_given_ && value == stm32::flash_key_2) {
    first_key_given_ = false;
    cr_ &= ~flash_cr::Lock::mask;
    return;
  }
  first_key_given_ = false;
  locked_up_ = true;
  cr_ |= flash_cr::Lock::mask;
  refuse(access,
         "KEYR: wrong key, or right key out of turn (bus error); CR is now locked until the next reset");
}

void FlashInterface::write_control(const Access& access, std::uint32_t value) {
  refuse_if(access.now < busy_until_, access, "CR written while BSY is set: the bus would stall");
  if (flash_cr::Lock::of(cr_) != 0) {
    if (value == cr_) return;
    refuse(access, "CR written while it is locked: ignored on silicon");
  }
  refuse_if(flash_cr::Parallelism::of(value) == 3, access,
            "CR: 64-bit parallelism needs Vpp, which the board does not have");
  const bool start = flash_cr::Start::of(value) != 0;
  refuse_if(start && flash_cr::Lock::of(value) != 0, access, "CR: STRT together with LOCK");
  cr_ = value & ~flash_cr::Start::mask;
  if (start) start_erase(access);
}

void FlashInterface::start_erase(const Access& access) {
  refuse_if(flash_cr::SectorErase::of(cr_) == 0 || flash_cr::Program::of(cr_) != 0, access,
            "CR: STRT needs SER and no PG (RM0090: unpredictable)");
  refuse_if(flash_cr::Parallelism::of(cr_) != flash_cr::by_word, access,
            "CR: erase at other than x32: not modelled");
  const std::uint32_t sector = flash_cr::Sector::of(cr_);
  refuse_if(sector >= stm32::flash_sector_count, access, "CR: sector {} does not exist; 0 to 11 do", sector);
  refuse_if((sr_ & flash_sr::errors) != 0, access,
            "erase started with error flags set in SR: clear them first");
  if (write_protected_[sector]) {
    sr_ |= flash_sr::WriteProtected::mask;
    return;
  }
  const std::uint32_t offset = stm32::flash_sector_offset(sector);
  const std::uint32_t bytes = stm32::flash_sector_bytes(sector);
  begin(offset, bytes, access.now, erase_duration(sector));
  std::ranges::fill(image_.subspan(offset, bytes), std::uint8_t{0xFF});
  data_cache_is_stale_ = true;
  cut_if_due();
}

void FlashInterface::store(std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now) {
  require_power();
  const std::uint32_t offset = offset_of(address, bytes);
  const Access access{offset, bytes, now};
  if (now < busy_until_)
    virtual_board::refuse(access, "flash memory", "store while BSY is set: the bus would stall");
  if ((sr_ & flash_sr::errors) != 0)
    virtual_board::refuse(access, "flash memory", "store with error flags set in SR: clear them first");
  if (flash_cr::Program::of(cr_) == 0 || flash_cr::SectorErase::of(cr_) != 0) {
    sr_ |= flash_sr::SequenceError::mask;
    return;
  }
  if (bytes != 1U << flash_cr::Parallelism::of(cr_)) {
    sr_ |= flash_sr::ParallelismError::mask;
    return;
  }
  if (write_protected_[sector_at(offset)]) {
    sr_ |= flash_sr::WriteProtected::mask;
    return;
  }
  begin(offset, bytes, now, store_duration);
  for (unsigned byte = 0; byte < bytes; ++byte)
    image_[offset + byte] = static_cast<std::uint8_t>(image_[offset + byte] & (value >> (8 * byte)));
  cut_if_due();
}

std::uint32_t FlashInterface::load(std::uint32_t address, unsigned bytes, BoardTime now) const {
  require_power();
  const std::uint32_t offset = offset_of(address, bytes);
  if (data_cache_is_stale_ && flash_acr::DataCache::of(acr_) != 0) {
    virtual_board::refuse(
        {offset, bytes, now}, "flash memory",
        "load through a data cache that was not reset after an erase: it may give the old content");
  }
  std::uint32_t value = 0;
  for (unsigned byte = 0; byte < bytes; ++byte)
    value |= static_cast<std::uint32_t>(image_[offset + byte]) << (8 * byte);
  return value;
}

void FlashInterface::begin(std::uint32_t offset, std::uint32_t bytes, BoardTime now, BoardTime duration) {
  const auto changed = image_.subspan(offset, bytes);
  latest_ = Operation{offset, {changed.begin(), changed.end()}};
  busy_until_ = now + duration;
  ++operations_;
}

void FlashInterface::cut_if_due() {
  if (operations_ != cut_at_) return;
  tear();
  power_is_cut_ = true;
  throw PowerCut("power cut in flash operation " + std::to_string(operations_));
}

void FlashInterface::tear() {
  // Every bit that was to change has done so with the same probability, from none to all of them; in an erase
  // whole words stay behind as well, since its pulses do not reach all rows alike.
  constexpr std::array chances{0.0, 0.1, 0.5, 0.9, 1.0};
  const double bit_chance = chances[random_() % chances.size()];
  const double word_chance = chances[random_() % chances.size()];
  std::bernoulli_distribution bit_done(bit_chance);
  std::bernoulli_distribution word_done(word_chance);
  const bool erase = latest_->before.size() > sizeof(std::uint32_t);
  bool whole = false;
  for (std::size_t i = 0; i < latest_->before.size(); ++i) {
    const std::uint8_t old = latest_->before[i];
    std::uint8_t& now = image_[latest_->offset + i];
    if (erase && i % 4 == 0) whole = word_done(random_);
    if (whole) continue;
    const std::uint8_t to_change = old ^ now;
    std::uint8_t changed = 0;
    for (unsigned bit = 0; bit < 8; ++bit)
      if ((to_change >> bit & 1U) != 0 && bit_done(random_))
        changed = static_cast<std::uint8_t>(changed | 1U << bit);
    now = old ^ changed;
  }
}

void FlashInterface::require_power() const {
  if (power_is_cut_) throw RefusedAccess("flash: access after the power was cut");
}

std::uint32_t FlashInterface::offset_of(std::uint32_t address, unsigned bytes) const {
  const std::uint32_t offset = address - stm32::flash_memory_base;
  if (offset < image_.size() && offset % bytes == 0) return offset;
  throw RefusedAccess("flash memory: access of " + std::to_string(bytes) + " bytes at address " +
                      std::to_string(address) + " is outside or not aligned");
}

unsigned FlashInterface::sector_at(std::uint32_t offset) {
  unsigned sector = 0;
  while (stm32::flash_sector_offset(sector + 1) <= offset) ++sector;
  return sector;
}

}  // namespace kmax::virtual_board
