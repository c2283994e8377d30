#pragma once

namespace kmax::drivers::cortex_m {

/// The chip's part of the start: makes the RAM to which start-up has copied the tick's code appear at the
/// addresses for which that code is linked, and what is fetched next comes from there. Called before
/// constructors and main, with the clocks as a reset leaves them, of images that have such code.
void map_tick_code();

}  // namespace kmax::drivers::cortex_m
