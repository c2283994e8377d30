#pragma once

#include <kmax/export.hpp>

namespace kmax {

/// Of the library that a program runs with, semantic: "0.1.0".
KMAX_API const char* version();

}  // namespace kmax
