#pragma once
// How a scene's motion is integrated. `exact` is the method of coupled_handle.hpp and the only one to work
// with; the others are there to be compared with it (reference_integrators.hpp).

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

enum class IntegratorKind : std::uint8_t { exact, semi_implicit_euler, rk4, adaptive };

inline constexpr std::array<std::string_view, 4> integrator_names{"exact", "semi_implicit_euler", "rk4",
                                                                  "adaptive"};

struct IntegratorConfig {
  IntegratorKind kind = IntegratorKind::exact;
  double substeps = 10.0;    // equal steps per 2 ms (at least one per interval); semi_implicit_euler and rk4
  double tolerance = 1e-10;  // relative, of the local error; adaptive
};

inline constexpr std::array integrator_fields{
    ModelField<IntegratorConfig>{
        "substeps", &IntegratorConfig::substeps, 1.0, 1e6, "per 2 ms",
        "equal steps per 2 ms, at least one per interval; semi_implicit_euler and rk4"},
    ModelField<IntegratorConfig>{"tolerance", &IntegratorConfig::tolerance, 1e-14, 1e-2, "",
                                 "relative tolerance of the local error; adaptive"},
};

// Throws std::invalid_argument.
inline void validate(const IntegratorConfig& config) {
  require_allowed(config, std::span<const ModelField<IntegratorConfig>>(integrator_fields), "integrator");
}

}  // namespace kmax::simulation
