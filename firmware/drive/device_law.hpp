#pragma once

/// DeviceLaw<axes>, an AxesLaw: the law over the axes of this device. A device whose handles are coupled
/// defines KMAX_DEVICE_LAW as the quoted name of a header that defines DeviceLaw in this namespace (see
/// kmax_firmware_library in firmware/CMakeLists.txt); all others have the one below.
#ifdef KMAX_DEVICE_LAW
#include KMAX_DEVICE_LAW
#else
#include "firmware/drive/axes_law.hpp"

namespace kmax::firmware {

template <std::size_t axes>
using DeviceLaw = TangentialInterference<axes>;

}  // namespace kmax::firmware
#endif
