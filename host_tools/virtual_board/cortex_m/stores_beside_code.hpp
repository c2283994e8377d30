#pragma once

namespace kmax::virtual_board {

/// Stores to memory from which no code was ever fetched, made faster; one for each engine.
///
/// Unicorn 2.0.1 (Debian 12) leaves translated code at every store to RAM and collects the pages that are
/// stored to, in a tree that it allocates, to throw away what it has translated from them; QEMU, from which
/// it comes, and Unicorn from 2.1 on do so only for pages that were translated. A firmware that runs from
/// flash stores to none of those: that was 30 % of a board's time for the tree, and a third of the rest for
/// the way there. So this program has some functions of the library in front of its own, which the dynamic
/// linker allows: while an engine runs, a page that comes into its table of addresses is marked there as one
/// that needs no such care, and nothing is collected, until note_code_in_ram() was called. From then on they
/// are the library's for this engine, as they are outside of Running. A library that has no such functions is
/// not changed.
///
/// Memory that must not be stored to has to be known to the engine as read-only (uc_mem_protect), or the
/// marked page takes the store.
class StoresBesideCode {
 public:
  /// As long as it lives, this thread's engine is the one whose object it was given. They may be nested.
  class Running {
   public:
    explicit Running(StoresBesideCode& of);
    ~Running();
    Running(const Running&) = delete;
    Running& operator=(const Running&) = delete;

   private:
    StoresBesideCode* before_;
  };

  /// Call from the hook of each block that lies in RAM, before it goes on: the engine forgets its table, and
  /// what was translated is from then on thrown away when it is stored to.
  void note_code_in_ram();

  /// Nothing that was translated can be stored to any more, as before the first note_code_in_ram(). Call
  /// between runs.
  void note_data_only();

  /// For the functions in front of the library's: the core that is executing, as the library knows it.
  void set_core(void* core) { core_ = core; }
  bool only_data_for(const void* core) const { return !code_in_ram_ && core == core_; }
  bool only_data() const { return !code_in_ram_; }

 private:
  /// The engine forgets its table of addresses, whose pages are marked by it.
  void note(bool code_in_ram);

  bool code_in_ram_ = false;
  void* core_ = nullptr;
};

}  // namespace kmax::virtual_board
