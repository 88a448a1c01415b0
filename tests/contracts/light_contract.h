#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <ostream>
#include <set>
#include <string>
#include <thread>

#include "gonio/devices/light_source.h"

/// What every LightSource and every LampMonitor has to do; see rotation_stage_contract.h for the
/// pattern. Each needs the other to be seen, so they are made together.
namespace gonio::contracts {

struct LightUnderTest {
  std::shared_ptr<devices::LightSource> light;  ///< keeps its world alive
  std::shared_ptr<devices::LampMonitor> monitor;
  std::function<double()> brightness;  ///< any reading of the lamp's light, dark level removed
  /// Cuts the link to the lamp, or brings it back; none where there is no link to lose.
  std::function<void(bool connected)> set_link = {};
};

struct LightMaker {
  std::string name;
  std::function<LightUnderTest()> make;

  friend std::ostream& operator<<(std::ostream& out, const LightMaker& maker) {
    return out << maker.name;
  }
};

class LightContract : public testing::TestWithParam<LightMaker> {
 protected:
  static constexpr double kDarkShare = 0.01;  // of what the dimmest channel gives
  static constexpr double kRepeat = 0.05;
  static constexpr std::chrono::seconds kCloseDeadline{1};  // of the host's time
  static constexpr std::chrono::seconds kLinkDeadline{10};

  LightContract() : made_(GetParam().make()), light_(*made_.light), monitor_(*made_.monitor) {}

  std::string first() const { return light_.channels().front().name; }
  std::string last() const { return light_.channels().back().name; }

  double lit(const std::string& channel) {
    light_.light(channel);
    return made_.brightness();
  }

  LightUnderTest made_;
  devices::LightSource& light_;
  devices::LampMonitor& monitor_;
};

class LightSourceContract : public LightContract {};
class LampMonitorContract : public LightContract {};

TEST_P(LightSourceContract, HasChannelsOfDifferentNames) {
  EXPECT_FALSE(light_.name().empty());
  ASSERT_FALSE(light_.channels().empty());
  std::set<std::string> names;
  for (const devices::LightChannel& channel : light_.channels()) {
    EXPECT_FALSE(channel.name.empty());
    EXPECT_GE(channel.wavelength_nm, 0.0);
    names.insert(channel.name);
  }
  EXPECT_EQ(names.size(), light_.channels().size());
}

TEST_P(LightSourceContract, IsDarkAtFirst) {
  const double dark = made_.brightness();
  EXPECT_LT(std::abs(dark), kDarkShare * lit(first()));
}

TEST_P(LightSourceContract, EveryChannelShinesAndGoesOut) {
  for (const devices::LightChannel& channel : light_.channels()) {
    const double bright = lit(channel.name);
    EXPECT_GT(bright, 0.0) << channel.name;
    light_.close_shutter();
    EXPECT_LT(std::abs(made_.brightness()), kDarkShare * bright) << channel.name;
  }
}

TEST_P(LightSourceContract, OnlyTheLastChannelSelectedShines) {
  const double alone = lit(first());
  light_.light(last());
  EXPECT_NEAR(lit(first()) / alone, 1.0, kRepeat);
}

TEST_P(LightSourceContract, SelectingTheLitChannelChangesNothing) {
  const double once = lit(first());
  EXPECT_NEAR(lit(first()) / once, 1.0, kRepeat);
}

TEST_P(LightSourceContract, UnknownChannelIsRefusedAndLeavesTheLightAsItIs) {
  EXPECT_THROW(light_.light("no such channel"), std::invalid_argument);
  EXPECT_THROW(light_.light(""), std::invalid_argument);
  const double bright = lit(first());
  EXPECT_THROW(light_.light("no such channel"), std::invalid_argument);
  EXPECT_NEAR(made_.brightness() / bright, 1.0, kRepeat);
}

TEST_P(LightSourceContract, ShutterClosesFromAnotherThreadAndTwice) {
  const double bright = lit(first());
  std::thread([&] { light_.close_shutter(); }).join();
  light_.close_shutter();
  EXPECT_LT(std::abs(made_.brightness()), kDarkShare * bright);
  EXPECT_NEAR(lit(first()) / bright, 1.0, kRepeat);
}

TEST_P(LightSourceContract, ShutterIsClosedSoon) {
  light_.light(first());
  const auto begun = std::chrono::steady_clock::now();
  light_.close_shutter();
  EXPECT_LT(std::chrono::steady_clock::now() - begun, kCloseDeadline);
}

TEST_P(LightSourceContract, LostLinkIsAnErrorUntilItIsBack) {
  if (!made_.set_link) GTEST_SKIP() << "this lamp has no link to lose";
  const double bright = lit(first());
  made_.set_link(false);
  const auto begun = std::chrono::steady_clock::now();
  light_.close_shutter();  // cannot, and cannot say so
  EXPECT_THAT(
      [&] { light_.light(last()); },
      testing::Throws<devices::DeviceError>(testing::Property(
          "code", &devices::DeviceError::code,
          testing::AnyOf(devices::DeviceErrc::Disconnected, devices::DeviceErrc::Timeout))));
  EXPECT_LT(std::chrono::steady_clock::now() - begun, kLinkDeadline);
  made_.set_link(true);
  EXPECT_NEAR(lit(first()) / bright, 1.0, kRepeat);
  light_.close_shutter();
  EXPECT_LT(std::abs(made_.brightness()), kDarkShare * bright);
}

TEST_P(LampMonitorContract, ReadsTheLitLampAndNothingInTheDark) {
  EXPECT_FALSE(monitor_.name().empty());
  const double dark = monitor_.read();
  light_.light(first());
  const double bright = monitor_.read();
  EXPECT_GT(bright, 0.0);
  EXPECT_LT(std::abs(dark), kDarkShare * bright);
  light_.close_shutter();
  EXPECT_LT(std::abs(monitor_.read()), kDarkShare * bright);
}

TEST_P(LampMonitorContract, RepeatsItself) {
  light_.light(last());
  const double once = monitor_.read();
  EXPECT_NEAR(monitor_.read() / once, 1.0, kDarkShare);
}

}  // namespace gonio::contracts
