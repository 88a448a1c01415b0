#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <stdexcept>

#include "gonio/errors/errors.h"
#include "memory_file.h"

/// What libFuzzer calls for every trial.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace gonio::fuzz {

/// Runs a reader on the bytes. The errors a reader documents are expected; anything else (another
/// exception, a sanitizer's finding, a hang, an allocation beyond the limit) is a finding.
template <class Read>
int trial(const std::uint8_t* data, std::size_t size, Read read) {
  try {
    const MemoryFile file({data, size});
    read(file.path());
  } catch (const DataFormatError&) {
  } catch (const FileError&) {
  } catch (const ConfigError&) {
  }
  return 0;
}

}  // namespace gonio::fuzz
