#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "host_tools/virtual_board/peripheral.hpp"

// The registers of a peripheral as a table: a row says where a register lies, what it is called in the
// manual, what a load shows, which bits a store may set and what the store does. What has no row, or a row
// without that direction, or a bit outside of the row's, is refused with the register's name.
//
//   const RegisterTable<PwrModel>& PwrModel::registers() {
//     using Row = Register<PwrModel>;
//     static const RegisterTable<PwrModel> table{
//         {offsetof(PwrRegisters, cr), "CR", Row::shows<&PwrModel::cr_>, pwr_cr::VoltageScale1::mask,
//          Row::takes<&PwrModel::write_control>},
//         {offsetof(PwrRegisters, csr), "CSR", Row::shows<&PwrModel::status>}};
//     return table;
//   }
//
// Cost of an access: one look-up by offset and one indirect call.

namespace kmax::virtual_board {

/// All bits of a register may be written.
inline constexpr std::uint32_t any_bits = 0xFFFF'FFFF;

template <typename Model>
struct Register {
  using Read = std::uint32_t (*)(Model&, const Access&);
  using Write = void (*)(Model&, const Access&, std::uint32_t);

  std::uint32_t offset;
  const char* name;
  Read read = nullptr;         ///< none: the register cannot be read
  std::uint32_t writable = 0;  ///< bits that a store may set
  Write write = nullptr;       ///< none: the register cannot be written

  /// Shows a word of the model, which is found along `path`: data members, and indices of arrays. Or asks the
  /// member function at the head of it, which takes the access and then the rest of the path, or only the
  /// rest.
  template <auto... path>
  static std::uint32_t shows(Model& model, const Access& access) {
    return ask<path...>(model, access);
  }
  /// Stores into a word of the model, or calls the member function: with the access, the rest of the path and
  /// the value, or without the access.
  template <auto... path>
  static void takes(Model& model, const Access& access, std::uint32_t value) {
    hand<path...>(model, access, value);
  }
  /// Clears in a word of the model the bits that are written 0.
  template <auto... path>
  static void clears_by_zeros(Model& model, const Access& /*access*/, std::uint32_t value) {
    reach(model, path...) &= value;
  }
  /// Clears in a word of the model the bits that are written 1.
  template <auto... path>
  static void clears_by_ones(Model& model, const Access& /*access*/, std::uint32_t value) {
    reach(model, path...) &= ~value;
  }
  /// A word that shows what was stored.
  template <auto... path>
  static constexpr Register word(std::uint32_t offset, const char* name, std::uint32_t writable) {
    return {offset, name, shows<path...>, writable, takes<path...>};
  }
  /// Reads 0, and nothing but 0 may be stored.
  static constexpr Register reserved(std::uint32_t offset, const char* name) {
    return {offset, name, zero, 0, nothing};
  }
  static std::uint32_t zero(Model& /*model*/, const Access& /*access*/) { return 0; }
  static void nothing(Model& /*model*/, const Access& /*access*/, std::uint32_t /*value*/) {}

 private:
  template <typename Whole, typename Step, typename... Rest>
  static auto& reach(Whole& whole, Step step, Rest... rest) {
    if constexpr (sizeof...(Rest) == 0) {
      return part(whole, step);
    } else {
      return reach(part(whole, step), rest...);
    }
  }
  template <typename Whole, typename Step>
  static auto& part(Whole& whole, Step step) {
    if constexpr (std::is_integral_v<Step>) {
      return whole[step];
    } else {
      return whole.*step;
    }
  }
  template <auto head, auto... rest>
  static std::uint32_t ask(Model& model, const Access& access) {
    if constexpr (!std::is_member_function_pointer_v<decltype(head)>) {
      return reach(model, head, rest...);
    } else if constexpr (std::is_invocable_v<decltype(head), Model&, const Access&, decltype(rest)...>) {
      return (model.*head)(access, rest...);
    } else {
      return (model.*head)(rest...);
    }
  }
  template <auto head, auto... rest>
  static void hand(Model& model, const Access& access, std::uint32_t value) {
    if constexpr (!std::is_member_function_pointer_v<decltype(head)>) {
      reach(model, head, rest...) = value;
    } else if constexpr (std::is_invocable_v<decltype(head), Model&, const Access&, decltype(rest)...,
                                             std::uint32_t>) {
      (model.*head)(access, rest..., value);
    } else {
      (model.*head)(rest..., value);
    }
  }
};

template <typename Model>
class RegisterTable {
 public:
  RegisterTable(std::initializer_list<Register<Model>> rows) : RegisterTable(std::vector(rows)) {}
  explicit RegisterTable(std::vector<Register<Model>> rows) : rows_(std::move(rows)) {
    for (std::size_t row = 0; row < rows_.size(); ++row) {
      const std::size_t word = rows_[row].offset / 4;
      if (word >= index_.size()) index_.resize(word + 1, none);
      index_[word] = row;
    }
  }

  /// Throws RefusedAccess, as do read() and write().
  const Register<Model>& at(const Access& access, const char* block) const {
    require_word(access, block);
    const std::size_t word = access.offset / 4;
    if (word >= index_.size() || index_[word] == none) refuse(access, block, "register not modelled");
    return rows_[index_[word]];
  }
  std::uint32_t read(Model& model, const char* block, const Access& access) const {
    const Register<Model>& row = at(access, block);
    if (row.read == nullptr) refuse(access, block, fmt::format("{} cannot be read", row.name));
    return row.read(model, access);
  }
  void write(Model& model, const char* block, const Access& access, std::uint32_t value) const {
    const Register<Model>& row = at(access, block);
    if (row.write == nullptr) refuse(access, block, fmt::format("{} cannot be written", row.name));
    if ((value & ~row.writable) != 0) {
      refuse(access, block,
             fmt::format("{} = 0x{:X}: bits 0x{:X} are reserved or not modelled", row.name, value,
                         value & ~row.writable));
    }
    row.write(model, access, value);
  }

 private:
  static constexpr std::size_t none = ~std::size_t{0};
  std::vector<Register<Model>> rows_;
  std::vector<std::size_t> index_;
};

/// A peripheral whose registers are all words in one table.
template <typename Model>
class RegisterBlock : public Peripheral {
 public:
  std::uint32_t read(const Access& access) override {
    before_access(access);
    return table_.read(static_cast<Model&>(*this), block_, access);
  }
  void write(const Access& access, std::uint32_t value) override {
    before_access(access);
    table_.write(static_cast<Model&>(*this), block_, access, value);
    after_write();
  }

 protected:
  /// `block`: the peripheral's name in the manual. Both must outlive the block.
  RegisterBlock(const char* block, const RegisterTable<Model>& table) : block_(block), table_(table) {}

  /// Brings the model to the time of the access; may refuse it.
  virtual void before_access(const Access& access) { advance(access.now); }
  /// What follows from any store that was accepted, such as the levels of interrupts.
  virtual void after_write() {}

  [[noreturn]] void refuse(const Access& access, const std::string& why) const {
    virtual_board::refuse(access, block_, why);
  }
  template <typename... Arguments>
  void refuse_if(bool condition, const Access& access, fmt::format_string<Arguments...> why,
                 Arguments&&... arguments) const {
    if (condition) refuse(access, fmt::format(why, std::forward<Arguments>(arguments)...));
  }
  const char* block() const { return block_; }
  const RegisterTable<Model>& table() const { return table_; }

 private:
  const char* block_;
  const RegisterTable<Model>& table_;
};

}  // namespace kmax::virtual_board
