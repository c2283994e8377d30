#include "host_tools/base/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>

#include "host_tools/base/exit_code.hpp"

namespace kmax::base {

void open_standard_streams() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(descriptor, F_GETFD) != -1) continue;
    // The lowest free number is this one. The wrong direction makes its use fail.
    const int direction = descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY;
    if (open("/dev/null", direction) != descriptor) std::_Exit(failed);
  }
}

}  // namespace kmax::base
