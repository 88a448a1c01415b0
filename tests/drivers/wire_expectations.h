#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "wire_camera.h"

namespace gonio::aravis_camera {

// Of a control channel that does not answer: five times half a second inside Aravis.
inline constexpr auto kControlDeadline = std::chrono::milliseconds(2500);
// What a busy machine may add to a deadline.
inline constexpr auto kSlack = std::chrono::milliseconds(2000);

inline emulator_faults::FaultRule rule(emulator_faults::Fault fault,
                                       std::optional<std::uint64_t> count = std::nullopt,
                                       std::uint64_t skip = 0) {
  emulator_faults::FaultRule made;
  made.fault = fault;
  made.count = count;
  made.skip = skip;
  return made;
}

/// Runs `action`, which must throw a devices::DeviceError of this code in time.
inline void expect_error(devices::DeviceErrc code, const std::string& part,
                         std::chrono::milliseconds deadline, const std::function<void()>& action) {
  const auto start = std::chrono::steady_clock::now();
  try {
    action();
    FAIL() << "no error";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_EQ(error.device(), "camera");
    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
  }
  EXPECT_LE(std::chrono::steady_clock::now() - start, deadline + kSlack);
}

inline bool shows_pattern(const devices::Frame& frame, int bits, const Region& region) {
  for (int row = 0; row < region.height; ++row) {
    for (int column = 0; column < region.width; ++column) {
      if (row + region.y == 0 && column + region.x == 0) continue;  // counts exposures
      const unsigned converted = PatternCamera::value(row + region.y, column + region.x);
      const unsigned expected = bits >= 12 ? converted << (bits - 12) : converted >> (12 - bits);
      if (frame.at(row, column) != expected) return false;
    }
  }
  return true;
}

}  // namespace gonio::aravis_camera
