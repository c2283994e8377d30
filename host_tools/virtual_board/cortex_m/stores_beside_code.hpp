#pragma once

namespace kmax::virtual_board {

/// Stores to memory from which no code was ever fetched, made faster.
///
/// Unicorn 2.0.1 (Debian 12) leaves translated code at every store to RAM and collects the pages that are
/// stored to, in a tree that it allocates, to throw away what it has translated from them; QEMU, from which
/// it comes, and Unicorn from 2.1 on do so only for pages that were translated. A firmware that runs from
/// flash stores to none of those: that was 30 % of a board's time for the tree, and a seventh of the rest for
/// the way there. So kmax-board has these functions of the library in front of its own, which the dynamic
/// linker allows: a page that comes into the engine's table of addresses is marked there as one that needs no
/// such care, and nothing is collected, until note_code_in_ram() was called. From then on they are the
/// library's, for every board of this process. A library that has no such functions is not changed.
///
/// Call from the hook of each block that is met in RAM for the first time, before it goes on: the executing
/// engine forgets its table, and what was translated is from then on thrown away when it is stored to.
void note_code_in_ram();

}  // namespace kmax::virtual_board
