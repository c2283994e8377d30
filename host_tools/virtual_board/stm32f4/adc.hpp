#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// ADC1, ADC2, ADC3 and their common registers as one block of 0x400 bytes at 0x4001'2000. RM0090, chapter
/// Analog-to-digital converter, sections Injected channel management, Channel-wise programmable sampling
/// time, Conversion on external trigger, ADC registers.
///
/// Injected groups of 1 to 4 conversions, started by TIM1's TRGO (rising edge) or JSWSTART. A conversion
/// takes its sampling time plus 12 ADC clocks; the input is held at the end of the sampling time. Writing
/// JSQR while the group runs throws its work away and begins the new list at once (section Channel
/// selection). Starts begin at once: the latency of up to 3 ADC clocks (data sheet) is not modelled.
///
/// Refused: all bits and registers beyond those (regular conversions, continuous and discontinuous mode,
/// watchdog, DMA, offsets, left alignment, lower resolution, multi-ADC modes, EOCIE, internal channels, other
/// triggers and edges); an ADC clock above 36 MHz; a start while the converter is off or less than 3 us after
/// ADON; a list of several without SCAN; a channel that the converter cannot reach; changing a sampling time
/// while a conversion runs.
///
/// Cost: a trigger that starts two conversions each on ADC2 and ADC3 and three on ADC1 makes three events:
/// both first holds, both ends, the end of the three. No allocation.
class AdcModel final : public Peripheral {
 public:
  /// Volts at a channel's pin (0 to 15) at an instant. Channel numbers mean the same pin on all converters. A
  /// group of one or two is asked for the first at the very instant; else it is asked when the group ends or
  /// the firmware looks, that is with instants of up to one group's length ago: a world that keeps no past
  /// may answer with the present for what is that slow.
  using Input = std::function<double(unsigned channel, BoardTime instant)>;

  AdcModel(const BoardClocks& clocks, InterruptLines& interrupts, Input volts);

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void advance(BoardTime now) override;
  BoardTime next_event() const override { return next_event_; }
  void reset(BoardTime now) override;

  /// Rising edge of TIM1's TRGO. Throws RefusedAccess when a converter that listens is not ready.
  void trigger_injected(BoardTime now);

  /// Triggers that found the injected group of the converter (1 to 3) still running, and did nothing.
  std::uint64_t ignored_triggers(unsigned adc) const { return converters_.at(adc - 1).ignored_triggers; }
  /// Groups that were thrown away because JSQR was written while they ran.
  std::uint64_t restarted_groups(unsigned adc) const { return converters_.at(adc - 1).restarted_groups; }

  /// 3.3 V full scale, nearest of 4096 codes; the first and the last take all beyond.
  static std::uint32_t code_of(double volts);

 private:
  struct Conversion {
    unsigned channel = 0;
    BoardTime held_at = 0;
    BoardTime ends_at = 0;
    bool held = false;
    std::uint32_t code = 0;
  };
  class Converter {
   public:
    Converter(AdcModel& model, unsigned number) : model_(&model), number_(number) {}
    static const RegisterTable<Converter>& registers();

    const char* name() const;
    bool interrupts() const;
    void start_injected(BoardTime now);
    /// Does the next thing that is due; false when there is none.
    bool step(BoardTime now);
    BoardTime next_event() const;

    std::uint32_t sr = 0, cr2 = 0;
    bool running = false;  ///< the injected group
    std::uint64_t ignored_triggers = 0, restarted_groups = 0;

   private:
    void write_cr2(const Access& access, std::uint32_t value);
    void write_list(const Access& access, std::uint32_t value);
    template <std::uint32_t Converter::*target>
    void write_sampling(const Access& access, std::uint32_t value);
    void require_ready(BoardTime now) const;
    Conversion conversion(unsigned channel, BoardTime begin) const;
    /// Channel of a place in the injected group.
    unsigned listed_channel(unsigned place) const;
    [[noreturn]] void refuse(const Access& access, const std::string& why) const {
      virtual_board::refuse(access, name(), why);
    }
    [[noreturn]] void refuse_start(const std::string& why) const;

    AdcModel* model_;
    unsigned number_;
    std::uint32_t cr1_ = 0, smpr1_ = 0, smpr2_ = 0, jsqr_ = 0;
    std::array<std::uint32_t, 4> jdr_{};
    BoardTime on_since_ = never;
    unsigned index_ = 0, count_ = 0;  // of the conversion under way, of the group
    Conversion injected_;
    BoardTime group_ends_at_ = 0;
  };

  static const RegisterTable<AdcModel>& common_registers();
  std::uint32_t read_csr() const;
  void write_ccr(const Access& access, std::uint32_t value);
  void hold(Conversion& conversion) const;
  void settle();
  BoardTime clock_period() const;

  const BoardClocks& clocks_;
  InterruptLines& interrupts_;
  Input volts_;
  std::array<Converter, 3> converters_{Converter{*this, 1}, Converter{*this, 2}, Converter{*this, 3}};
  std::uint32_t ccr_ = 0;
  BoardTime next_event_ = never;
  bool interrupt_ = false;
};

}  // namespace kmax::virtual_board
