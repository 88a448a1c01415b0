// The devices of a rig file whose driver is "hardware".

#include "gonio/setup/rig_devices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <string>

#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::string wire_text() {
  return files::read_text_file(std::string(GONIO_RIGS) + "/wire.toml", 1 << 20);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// wire.toml with one change is refused, and the message holds `why`.
void expect_refused(const std::string& from, const std::string& to, const std::string& why) {
  const std::string text = replaced(wire_text(), from, to);
  EXPECT_THAT([&] { rig_file_from_text(text, "rig.toml"); },
              ThrowsMessage<ConfigError>(testing::AllOf(HasSubstr("rig.toml:"), HasSubstr(why))))
      << from << " -> " << to;
}

TEST(RigDevices, NameTheDriversAndAddressesOfTheExample) {
  const RigFile rig = rig_file_from_text(wire_text(), "rig.toml");
  EXPECT_EQ(rig.driver, RigFile::Driver::hardware);
  ASSERT_EQ(rig.devices.axes.size(), 3U);
  EXPECT_EQ(rig.devices.axes[0].driver, AxisDevice::Driver::modbus);
  EXPECT_EQ(rig.devices.axes[1].unit, 2);
  EXPECT_EQ(rig.devices.axes[2].driver, AxisDevice::Driver::apt);
  EXPECT_EQ(rig.devices.axes[2].serial, "55000001");
  ASSERT_NE(rig.devices.bus("lamp"), nullptr);
  EXPECT_EQ(rig.devices.bus("lamp")->kind, BusEntry::Kind::modbus_tcp);
  EXPECT_EQ(rig.devices.bus("lamps"), nullptr);
  EXPECT_EQ(rig.devices.lamp.channels.at(1).wavelength_nm, 530.0);
  EXPECT_EQ(rig.devices.camera.id, "127.0.0.1");
}

TEST(RigDevices, ReadBackFromTheResolvedFileAsTheyWere) {
  const RigFile rig = rig_file_from_text(wire_text(), "rig.toml");
  const std::string resolved = rig_file_text(rig, false);
  EXPECT_EQ(rig_file_text(rig_file_from_text(resolved, "again.toml"), false), resolved);
  EXPECT_THAT(resolved, HasSubstr("serial = \"55000001\""));
}

TEST(RigDevices, AreNoKeysOfASimulatedRig) {
  expect_refused("driver = \"hardware\"", "driver = \"simulated\"", "unknown key");
}

TEST(RigDevices, RefuseABusThatIsNotThere) {
  expect_refused("bus = \"stages\"", "bus = \"stage\"",
                 "axis.lamp_arm.device.bus: found \"stage\"");
  expect_refused("[lamp]\nbus = \"lamp\"", "[lamp]", "lamp.bus: found none");
}

TEST(RigDevices, RefuseTwoOfOneAddress) {
  expect_refused("unit = 2", "unit = 1", "which is that of axis.lamp_arm.device");
  expect_refused("name = \"lamp\"", "name = \"stages\"", "\"stages\" twice");
  expect_refused("name = \"lamp\"\ntype = \"modbus_tcp\"\nhost = \"127.0.0.1\"\ntcp_port = 1502",
                 "name = \"lamp\"\ntype = \"modbus_rtu\"\nport = \"/dev/ttyUSB0\"",
                 "bus[1].port: found /dev/ttyUSB0, which is that of bus \"stages\"");
  expect_refused("number = 2", "number = 1", "1 twice, expected a number of its own");
  expect_refused("name = \"G\"", "name = \"R\"", "\"R\" twice");
}

TEST(RigDevices, RefuseWhatIsMissing) {
  expect_refused("port = \"/dev/ttyUSB0\"", "", "bus[0].port: found none");
  expect_refused("host = \"127.0.0.1\"", "", "bus[1].host: found none");
  expect_refused("profile = \"oriental-az\"", "", "axis.azimuth.device.profile: found none");
  expect_refused("serial = \"55000001\"", "", "axis.tilt.device.serial: found none");
  expect_refused("id = \"127.0.0.1\"", "", "camera_device.id: found none");
}

TEST(RigDevices, RefuseValuesOutOfRange) {
  expect_refused("unit = 2", "unit = 248", "1 to 247");
  expect_refused("baud = 115200", "baud = 10", "300 to");
  expect_refused("tcp_port = 1502", "tcp_port = 70000", "1 to 65535");
  expect_refused("steady_ms = 0", "steady_ms = 0\nfirst_level_register = 65534", "at most 65535");
  expect_refused("steady_ms = 0", "steady_ms = 0\nchannel_register = 2", "a level's register");
  expect_refused("driver = \"apt\"", "driver = \"ftdi\"", "expected \"modbus\" or \"apt\"");
}

TEST(RigDevices, NameAChangerAndWhatItCarries) {
  const std::string changer =
      "[changer]\nbus = \"lamp\"\nunit = 2\ntimeout_s = 30\n"
      "[[changer.place]]\ntarget = \"sample\"\nnumber = 1\n"
      "[[changer.place]]\ntarget = \"white\"\nnumber = 2\n[monitor]";
  const std::string text =
      replaced(replaced(wire_text(), "[monitor]", changer), "\"in_frame\"", "\"changer\"");
  const ChangerDevice found = rig_file_from_text(text, "rig.toml").devices.changer;
  EXPECT_EQ(found.unit, 2);
  EXPECT_EQ(found.timeout, std::chrono::seconds(30));
  ASSERT_EQ(found.places.size(), 2U);
  EXPECT_EQ(found.places[1].target, devices::Target::white);
  EXPECT_EQ(found.places[1].number, 2);
  EXPECT_TRUE(found.carries(devices::Target::sample));
  EXPECT_FALSE(found.carries(devices::Target::mirror));

  expect_refused("placement = \"in_frame\"", "placement = \"changer\"",
                 "a [changer] that carries sample and white");
  expect_refused("[monitor]", "[changer]\nbus = \"lamp\"\n[monitor]",
                 "changer.unit: found 1, which is that of lamp");
  expect_refused("[monitor]", "[changer]\nbus = \"wheel\"\n[monitor]", "found \"wheel\"");
  expect_refused("[monitor]",
                 "[changer]\nbus = \"lamp\"\nunit = 2\n[[changer.place]]\n"
                 "target = \"tray\"\n[monitor]",
                 "expected");
}

}  // namespace
}  // namespace gonio::cli
