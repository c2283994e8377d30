#pragma once

namespace kmax::virtual_board {

/// Stores to memory from which no code was ever fetched, made faster.
///
/// For every store to RAM, Unicorn 2.0.1 (Debian 12) collects the pages that are stored to, in a tree that it
/// allocates, to throw away what it has translated from them; QEMU, from which it comes, and Unicorn from 2.1
/// on do so only for pages that were translated. A firmware that runs from flash stores to none of those:
/// that was 30 % of a board's time. So kmax-board has these three functions of the library in place of its
/// own, which the dynamic linker allows, and they do nothing until note_code_in_ram() was called. From then
/// on they are the library's, for every board of this process. A library that has no such functions is not
/// changed.
///
/// Call before the first block that lies in RAM goes on: what was translated is then thrown away when it is
/// stored to.
void note_code_in_ram();

}  // namespace kmax::virtual_board
