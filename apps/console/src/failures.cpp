#include "gonio/console/failures.h"

#include <new>

#include "gonio/devices/device_error.h"
#include "gonio/errors/errors.h"

namespace gonio::cli {
namespace {

ExitCode code_of(const std::exception& error) {
  if (dynamic_cast<const UsageError*>(&error) != nullptr) return kBadInput;
  if (dynamic_cast<const DataFormatError*>(&error) != nullptr) return kBadInput;
  if (dynamic_cast<const FileError*>(&error) != nullptr) return kBadInput;
  if (dynamic_cast<const ConfigError*>(&error) != nullptr) return kBadInput;
  // Of std::filesystem's own calls: a name too long, a folder that may not be entered.
  if (dynamic_cast<const std::filesystem::filesystem_error*>(&error) != nullptr) return kBadInput;
  if (const auto* device = dynamic_cast<const devices::DeviceError*>(&error)) {
    // Refused before anything moved or was exposed: another request is what helps.
    return device->code() == devices::DeviceErrc::LimitViolation ? kBadInput : kDeviceFailure;
  }
  return kFailure;
}

}  // namespace

Failure describe(const std::exception& error) {
  Failure failure{code_of(error), error.what(), {}};
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) failure.message = "out of memory";
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error)) {
    failure.message = file->path1().string() + ": " + file->code().message();
  }
  if (const auto* usage = dynamic_cast<const UsageError*>(&error)) failure.hint = usage->hint();
  if (dynamic_cast<const FileError*>(&error) != nullptr && failure.message.ends_with("it exists")) {
    failure.hint = "choose another name, or give --force to replace it";
  }
  try {
    std::rethrow_if_nested(error);
  } catch (const std::exception& inner) {
    const Failure cause = describe(inner);
    failure.message += ": " + cause.message;
    if (failure.code == kFailure) failure.code = cause.code;
    if (failure.hint.empty()) failure.hint = cause.hint;
  }
  return failure;
}

}  // namespace gonio::cli
