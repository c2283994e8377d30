#pragma once

/// What the shared library shows; all else in it is hidden.
#define KMAX_API __attribute__((visibility("default")))
