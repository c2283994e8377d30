#include "host_tools/libkmax/translated.hpp"

#include "host_tools/base/errors.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/link.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::library {

void rethrow_translated() {
  try {
    throw;
  } catch (const base::ValueError& error) {
    throw ValueError(error.what());
  } catch (const device::AddressError& error) {
    throw ValueError(error.what());
  } catch (const cli::UsageError& error) {
    throw ValueError(error.what());
  } catch (const simulation::SceneError& error) {
    throw ValueError(error.what());
  } catch (const device::LinkError& error) {
    throw LinkError(error.what());
  } catch (const device::RefusedError& error) {
    throw RefusedError(error.what());
  } catch (const base::DeviceError& error) {
    throw RefusedError(error.what());
  }
}

}  // namespace kmax::library
