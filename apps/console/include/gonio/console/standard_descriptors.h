#pragma once

namespace gonio::cli {

/// A standard descriptor that the caller closed would become the next file that is opened, a
/// drive's port perhaps, and results or messages would go into it. After this call those that were
/// closed belong to something that can be neither read nor written.
///
/// Threads  Before any other, first of all in main().
void hold_standard_descriptors();

}  // namespace gonio::cli
