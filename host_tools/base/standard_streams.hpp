#pragma once

namespace kmax::base {

/// Opens the descriptors 0, 1 and 2 that whoever started this program has closed, so that no file, port or
/// socket of its own is given one of their numbers and gets its messages. They can be neither read nor
/// written, as before: what is said into a closed output fails. First thing in main(). A program that cannot
/// open them ends.
void open_standard_streams();

}  // namespace kmax::base
