#pragma once
// Kmax from a program's point of view. All quantities are SI: m, s, N, A, kg, Hz.

#include <kmax/command.hpp>
#include <kmax/device.hpp>
#include <kmax/errors.hpp>
#include <kmax/scene.hpp>
#include <kmax/version.hpp>
