#pragma once

#include <arv.h>

#include <string>
#include <string_view>
#include <type_traits>

#include "arrivals.h"
#include "gonio/aravis_camera/options.h"
#include "gonio/devices/device_error.h"

namespace gonio::aravis_camera {

/// Features of an open camera by name, and Aravis' errors as ours.
///
/// Errors  DeviceError: Disconnected also when control was lost meanwhile.
class CameraFeatures {
 public:
  /// All must outlive it. `name` is the device's in errors.
  CameraFeatures(ArvCamera* camera, const std::string& name, const Arrivals& arrivals)
      : camera_(camera), name_(name), arrivals_(arrivals) {}

  [[noreturn]] void fail(devices::DeviceErrc code, const std::string& message) const;
  void require_control() const;

  /// Calls Aravis and turns its error into ours.
  template <typename Function>
  std::invoke_result_t<const Function&, GError**> call(std::string_view what,
                                                       const Function& function) const {
    require_control();
    GError* error = nullptr;
    if constexpr (std::is_void_v<decltype(function(&error))>) {
      function(&error);
      check(what, error);
    } else {
      const auto result = function(&error);
      check(what, error);
      return result;
    }
  }

  bool has(const char* feature) const;
  /// The first name that the camera has, or "".
  template <typename Names>
  std::string first_of(const Names& names) const {
    for (const char* name : names) {
      if (has(name)) return name;
    }
    return {};
  }

  std::string text(const char* feature) const;
  void set_text(const char* feature, const std::string& value) const;
  /// What a C string of the camera says, which may be null.
  std::string said(const char* what, const char* (*get)(ArvCamera*, GError**)) const;

  /// Integer features are those called "..Raw".
  static bool is_raw(const std::string& feature) { return feature.ends_with("Raw"); }
  double number(const std::string& feature) const;
  void set_number(const std::string& feature, double value) const;

  Region region() const;

 private:
  /// Frees the error.
  void check(std::string_view what, GError* error) const;

  ArvCamera* camera_;
  const std::string& name_;
  const Arrivals& arrivals_;
};

}  // namespace gonio::aravis_camera
