#include "gonio/console/standard_descriptors.h"

#include <fcntl.h>

namespace gonio::cli {

void hold_standard_descriptors() {
  for (int descriptor = 0; descriptor < 3; ++descriptor) {
    // Not /dev/null: inside of gonio-emulate, umockdev takes a second descriptor for everything in
    // /dev, and that would be the next standard one.
    if (::fcntl(descriptor, F_GETFD) == -1) ::open("/", O_RDONLY | O_DIRECTORY);
  }
}

}  // namespace gonio::cli
