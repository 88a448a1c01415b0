#include "camera_features.h"

#include <cmath>

namespace gonio::aravis_camera {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

DeviceErrc code_of(const GError& error) {
  if (error.domain == ARV_GC_ERROR) {
    return error.code == ARV_GC_ERROR_OUT_OF_RANGE ? DeviceErrc::LimitViolation : DeviceErrc::Fault;
  }
  if (error.domain != ARV_DEVICE_ERROR) return DeviceErrc::Fault;
  switch (error.code) {
    // Aravis has asked five times in 2.5 s by then.
    case ARV_DEVICE_ERROR_TIMEOUT:
    case ARV_DEVICE_ERROR_NOT_CONNECTED:
    case ARV_DEVICE_ERROR_NOT_FOUND:
    case ARV_DEVICE_ERROR_TRANSFER_ERROR:
    case ARV_DEVICE_ERROR_NOT_CONTROLLER:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_ACCESS_DENIED:
      return DeviceErrc::Disconnected;
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR:
    case ARV_DEVICE_ERROR_PROTOCOL_ERROR_BUSY:
    case ARV_DEVICE_ERROR_GENICAM_NOT_FOUND:
      return DeviceErrc::Protocol;
    default:
      return DeviceErrc::Fault;
  }
}

}  // namespace

void CameraFeatures::fail(DeviceErrc code, const std::string& message) const {
  throw DeviceError(code, name_, message);
}

void CameraFeatures::require_control() const {
  if (!arrivals_.control_lost()) return;
  fail(DeviceErrc::Disconnected,
       "control of the camera was lost: it was restarted, unplugged, or another program took it");
}

void CameraFeatures::check(std::string_view what, GError* error) const {
  if (error == nullptr) return;
  const DeviceErrc code = code_of(*error);
  const std::string message = error->message;
  g_error_free(error);
  fail(code, std::string(what) + ": " + message);
}

bool CameraFeatures::has(const char* feature) const {
  return call(feature, [&](GError** e) {
           return arv_camera_is_feature_available(camera_, feature, e);
         }) != 0;
}

std::string CameraFeatures::text(const char* feature) const {
  const char* const found =
      call(feature, [&](GError** e) { return arv_camera_get_string(camera_, feature, e); });
  return found == nullptr ? "" : found;
}

void CameraFeatures::set_text(const char* feature, const std::string& value) const {
  call(feature + (" to " + value),
       [&](GError** e) { arv_camera_set_string(camera_, feature, value.c_str(), e); });
}

std::string CameraFeatures::said(const char* what, const char* (*get)(ArvCamera*, GError**)) const {
  const char* const found = call(what, [&](GError** e) { return get(camera_, e); });
  return found == nullptr ? "" : found;
}

double CameraFeatures::number(const std::string& feature) const {
  return call(feature, [&](GError** e) {
    return is_raw(feature)
               ? static_cast<double>(arv_camera_get_integer(camera_, feature.c_str(), e))
               : arv_camera_get_float(camera_, feature.c_str(), e);
  });
}

void CameraFeatures::set_number(const std::string& feature, double value) const {
  call(feature, [&](GError** e) {
    if (is_raw(feature)) {
      arv_camera_set_integer(camera_, feature.c_str(), std::llround(value), e);
    } else {
      arv_camera_set_float(camera_, feature.c_str(), value, e);
    }
  });
}

Region CameraFeatures::region() const {
  Region found;
  call("region", [&](GError** e) {
    arv_camera_get_region(camera_, &found.x, &found.y, &found.width, &found.height, e);
  });
  return found;
}

}  // namespace gonio::aravis_camera
