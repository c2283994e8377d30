#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"

#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace kmax::virtual_board {

using namespace drivers::cortex_m;

namespace {

/// Four comparators (Cortex-M4 of the STM32F405), a cycle counter.
constexpr std::uint32_t dwt_fixed_bits = dwt_ctrl::Comparators::bits(4);
constexpr std::uint32_t fpccr_settings =
    floating_point_fpccr::AutomaticPreservation::mask | floating_point_fpccr::LazyPreservation::mask;

}  // namespace

const RegisterTable<CoreDebug>& CoreDebug::registers() {
  using Row = Register<CoreDebug>;
  static const RegisterTable<CoreDebug> table{
      {offsetof(CoreDebugRegisters, dhcsr), "DHCSR", Row::zero},
      Row::word<&CoreDebug::demcr_>(offsetof(CoreDebugRegisters, demcr), "DEMCR",
                                    core_debug_demcr::TraceEnable::mask)};
  return table;
}

DwtModel::DwtModel(std::function<std::uint64_t()> cycles, std::function<bool()> trace_enabled)
    : RegisterBlock("DWT", registers()),
      cycles_(std::move(cycles)),
      trace_enabled_(std::move(trace_enabled)) {}

const RegisterTable<DwtModel>& DwtModel::registers() {
  using Row = Register<DwtModel>;
  static const RegisterTable<DwtModel> table{
      {offsetof(DwtRegisters, ctrl), "CTRL", Row::shows<&DwtModel::read_ctrl>,
       dwt_fixed_bits | dwt_ctrl::CycleCounterEnable::mask, Row::takes<&DwtModel::write_ctrl>},
      {offsetof(DwtRegisters, cyccnt), "CYCCNT", Row::shows<&DwtModel::count>, any_bits,
       Row::takes<&DwtModel::count_>}};
  return table;
}

void DwtModel::before_access(const Access& access) {
  refuse_if(!trace_enabled_(), access, "DEMCR.TRCENA is not set");
}

std::uint32_t DwtModel::count() const {
  return counting_ ? count_ + static_cast<std::uint32_t>(cycles_() - since_) : count_;
}

std::uint32_t DwtModel::read_ctrl() const {
  return dwt_fixed_bits | dwt_ctrl::CycleCounterEnable::bits(counting_ ? 1 : 0);
}

void DwtModel::write_ctrl(std::uint32_t value) {
  count_ = count();
  counting_ = dwt_ctrl::CycleCounterEnable::of(value) != 0;
}

void FloatingPointControl::reset(BoardTime /*now*/) {
  fpccr_ = fpccr_reset;
  fpcar_ = 0;
  lazy_active_ = false;
}

void FloatingPointControl::begin_lazy_frame(std::uint32_t address) {
  fpcar_ = address;
  lazy_active_ = true;
}

const RegisterTable<FloatingPointControl>& FloatingPointControl::registers() {
  using Model = FloatingPointControl;
  using Row = Register<Model>;
  using Layout = FloatingPointRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, fpccr), "FPCCR", Row::shows<&Model::read_fpccr>,
       fpccr_settings | floating_point_fpccr::LazyActive::mask, Row::takes<&Model::write_fpccr>},
      {offsetof(Layout, fpcar), "FPCAR", Row::shows<&Model::fpcar_>},
      Row::reserved(offsetof(Layout, fpdscr), "FPDSCR"),
      {offsetof(Layout, mvfr0), "MVFR0", [](Model&, const Access&) { return feature_word_0; }},
      {offsetof(Layout, mvfr1), "MVFR1", [](Model&, const Access&) { return feature_word_1; }}};
  return table;
}

std::uint32_t FloatingPointControl::read_fpccr() const {
  return fpccr_ | (lazy_active_ ? floating_point_fpccr::LazyActive::mask : 0);
}

void FloatingPointControl::write_fpccr(const Access& access, std::uint32_t value) {
  refuse_if(floating_point_fpccr::AutomaticPreservation::of(value) == 0, access,
            "FPCCR = 0x{:08X}: only ASPEN with or without LSPEN is modelled", value);
  fpccr_ = value & fpccr_settings;
}

void MemoryProtection::reset(BoardTime /*now*/) {
  regions_ = {};
  ctrl_ = 0;
  selected_ = 0;
  ++version_;
}

bool MemoryProtection::enabled() const {
  return mpu_ctrl::Enable::of(ctrl_) != 0;
}

bool MemoryProtection::in_fault_handlers() const {
  return mpu_ctrl::InFaultHandlers::of(ctrl_) != 0;
}

bool MemoryProtection::allows(std::uint32_t address, Use use) const {
  if (address >= 0xE000'0000 && address < 0xE010'0000) return use != Use::fetch;
  for (unsigned number = mpu_region_count; number-- > 0;) {
    const auto [base, attributes] = regions_[number];
    if (mpu_rasr::Enable::of(attributes) == 0) continue;
    const std::uint32_t last_bit = mpu_rasr::Size::of(attributes);
    const std::uint32_t offset = address - base;
    if (std::uint64_t{offset} >> (last_bit + 1) != 0) continue;
    const std::uint32_t eighth = offset >> (last_bit - 2);
    if ((mpu_rasr::SubregionDisable::of(attributes) >> eighth & 1U) != 0) continue;
    const std::uint32_t permission = mpu_rasr::Permission::of(attributes);
    if (permission == 0) return false;
    if (use == Use::store) return permission <= 3;
    return use == Use::load || mpu_rasr::ExecuteNever::of(attributes) == 0;
  }
  if (mpu_ctrl::PrivilegedDefault::of(ctrl_) == 0) return false;
  const bool peripherals = address >= 0x4000'0000 && address < 0x6000'0000;
  return use != Use::fetch || (!peripherals && address < 0xA000'0000);
}

const RegisterTable<MemoryProtection>& MemoryProtection::registers() {
  using Model = MemoryProtection;
  using Row = Register<Model>;
  using Layout = MpuRegisters;
  constexpr auto address = [](std::uint32_t offset) {
    return Row{offset, "RBAR", Row::shows<&Model::read_address>, any_bits, Row::takes<&Model::write_address>};
  };
  constexpr auto attributes = [](std::uint32_t offset) {
    return Row{offset, "RASR", Row::shows<&Model::read_attributes>, any_bits,
               Row::takes<&Model::write_attributes>};
  };
  // RBAR and RASR appear four times, eight bytes apart.
  constexpr std::uint32_t alias = offsetof(Layout, alias);
  static const RegisterTable<Model> table{
      {offsetof(Layout, type), "TYPE",
       [](Model&, const Access&) { return mpu_type::RegionCount::bits(mpu_region_count); }},
      {offsetof(Layout, ctrl), "CTRL", Row::shows<&Model::ctrl_>,
       mpu_ctrl::Enable::mask | mpu_ctrl::InFaultHandlers::mask | mpu_ctrl::PrivilegedDefault::mask,
       Row::takes<&Model::write_control>},
      {offsetof(Layout, rnr), "RNR", Row::shows<&Model::selected_>, any_bits, Row::takes<&Model::select>},
      address(offsetof(Layout, rbar)),
      attributes(offsetof(Layout, rasr)),
      address(alias),
      attributes(alias + 4),
      address(alias + 8),
      attributes(alias + 12),
      address(alias + 16),
      attributes(alias + 20)};
  return table;
}

void MemoryProtection::write_control(const Access& access, std::uint32_t value) {
  refuse_if(mpu_ctrl::Enable::of(value) == 0 && mpu_ctrl::InFaultHandlers::of(value) != 0, access,
            "HFNMIENA without ENABLE is unpredictable");
  if (mpu_ctrl::Enable::of(value) != 0) refuse_fine_borders(access);
  ctrl_ = value;
}

void MemoryProtection::select(const Access& access, std::uint32_t value) {
  refuse_if(value >= mpu_region_count, access, "region {} of eight", value);
  selected_ = value;
}

std::uint32_t MemoryProtection::read_address() const {
  return regions_[selected_].address | mpu_rbar::Region::bits(selected_);
}

void MemoryProtection::write_address(const Access& access, std::uint32_t value) {
  if (mpu_rbar::Valid::of(value) != 0) select(access, mpu_rbar::Region::of(value));
  regions_[selected_].address = value & mpu_rbar::Address::mask;
}

void MemoryProtection::write_attributes(const Access& access, std::uint32_t value) {
  if (mpu_rasr::Enable::of(value) != 0) {
    constexpr std::uint32_t smallest = 4;  // 32 bytes
    const std::uint32_t size_code = mpu_rasr::Size::of(value);
    refuse_if(size_code < smallest, access, "SIZE = {}: a region has at least 32 bytes", size_code);
    const std::uint32_t below = 0xFFFF'FFFFU >> (31 - size_code);
    const std::uint32_t address = regions_[selected_].address;
    refuse_if((address & below) != 0, access, "region {} at 0x{:08X} is not aligned to its size", selected_,
              address);
    constexpr std::uint32_t reserved = 4;
    refuse_if(mpu_rasr::Permission::of(value) == reserved, access, "AP = {} is reserved", reserved);
    constexpr std::uint32_t smallest_with_eighths = 7;  // 256 bytes
    refuse_if(mpu_rasr::SubregionDisable::of(value) != 0 && size_code < smallest_with_eighths, access,
              "sub-regions of a region of 2^{} bytes", size_code + 1);
  }
  regions_[selected_].attributes = value;
  if (enabled()) refuse_fine_borders(access);
}

void MemoryProtection::refuse_fine_borders(const Access& access) const {
  for (const Region& region : regions_) {
    if (mpu_rasr::Enable::of(region.attributes) == 0) continue;
    constexpr std::uint32_t page = 9, page_in_eighths = 12;
    const std::uint32_t coarse =
        mpu_rasr::SubregionDisable::of(region.attributes) != 0 ? page_in_eighths : page;
    const bool memory =
        memory_map::flash.contains(region.address) || memory_map::sram.contains(region.address) ||
        memory_map::ccm.contains(region.address) || memory_map::sram1_at_zero.contains(region.address);
    refuse_if(memory && mpu_rasr::Size::of(region.attributes) < coarse, access,
              "region at 0x{:08X}: borders in memory are modelled at multiples of 1 KiB only",
              region.address);
  }
}

}  // namespace kmax::virtual_board
