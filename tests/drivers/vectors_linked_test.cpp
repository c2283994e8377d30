// The table that is flashed, for vectors_test.cpp. A translation unit of its own: the handlers defined there
// must replace the weak ones at link time, as a board's do.
#include "board/stm32f405/vectors.cpp"
