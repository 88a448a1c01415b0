#include "genicam.h"

#include <fmt/format.h>

#include <string_view>

#include "image.h"
#include "registers.h"

namespace gonio::gige_emulator {
namespace {

using namespace registers;

/// What is within an <EnumEntry>.
struct Choice {
  std::string_view name;
  std::uint32_t value;
};

constexpr Choice kOffAndOn[] = {{"Off", 0}, {"On", 1}};
constexpr Choice kAutomatic[] = {{"Off", 0}, {"Once", 1}, {"Continuous", 2}};
// The fake camera counts this one so.
constexpr Choice kAutomaticGain[] = {{"Off", 1}, {"Once", 3}, {"Continuous", 2}};
constexpr Choice kSources[] = {{"Software", kSoftware}, {"Line1", kLine1}};
constexpr Choice kRisingEdge[] = {{"RisingEdge", 0}};
constexpr Choice kFrameStart[] = {{"FrameStart", 0}};
constexpr Choice kContinuous[] = {{"Continuous", 1}};

/// Collects the nodes and the names of the features among them.
class Description {
 public:
  void integer_register(std::string_view name, std::uint32_t address, std::string_view access) {
    nodes_ += fmt::format(
        "<IntReg Name=\"{}\"><Address>0x{:x}</Address><Length>4</Length>"
        "<AccessMode>{}</AccessMode><pPort>Device</pPort><Sign>Unsigned</Sign>"
        "<Endianess>BigEndian</Endianess></IntReg>\n",
        name, address, access);
  }

  void text(std::string_view name, std::uint32_t address, int length) {
    feature(name);
    nodes_ += fmt::format(
        "<StringReg Name=\"{}\" NameSpace=\"Standard\"><Address>0x{:x}</Address>"
        "<Length>{}</Length><AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n",
        name, address, length);
  }

  /// `limits`: the inner nodes Min, Max, pMax, Inc.
  void integer(std::string_view name, std::uint32_t address, std::string_view limits) {
    feature(name);
    integer_register(fmt::format("{}Register", name), address, "RW");
    nodes_ += fmt::format(
        "<Integer Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>{1}</Integer>\n",
        name, limits);
  }

  /// A number of `unit`s in an integer register.
  void scaled(std::string_view name, std::uint32_t address, double per_unit, double min, double max,
              std::string_view unit) {
    feature(name);
    integer_register(fmt::format("{}Register", name), address, "RW");
    nodes_ += fmt::format(
        "<Converter Name=\"{0}Converter\"><FormulaTo>(FROM * {1})</FormulaTo>"
        "<FormulaFrom>(TO / {1})</FormulaFrom><pValue>{0}Register</pValue></Converter>\n"
        "<Float Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Converter</pValue>"
        "<Min>{2}</Min><Max>{3}</Max><Unit>{4}</Unit></Float>\n",
        name, per_unit, min, max, unit);
  }

  void real(std::string_view name, std::uint32_t address, std::string_view access, double min,
            double max) {
    feature(name);
    nodes_ += fmt::format(
        "<FloatReg Name=\"{0}Register\"><Address>0x{1:x}</Address><Length>4</Length>"
        "<AccessMode>{2}</AccessMode><pPort>Device</pPort><Endianess>BigEndian</Endianess>"
        "</FloatReg>\n<Float Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>"
        "<Min>{3}</Min><Max>{4}</Max></Float>\n",
        name, address, access, min, max);
  }

  template <typename Choices>
  void choice(std::string_view name, std::uint32_t address, const Choices& choices) {
    feature(name);
    integer_register(fmt::format("{}Register", name), address, "RW");
    nodes_ += fmt::format("<Enumeration Name=\"{}\" NameSpace=\"Standard\">", name);
    for (const auto& entry : choices) add_entry(entry.name, entry.value);
    nodes_ += fmt::format("<pValue>{}Register</pValue></Enumeration>\n", name);
  }

  void constant_choice(std::string_view name, const Choice& only) {
    feature(name);
    nodes_ += fmt::format("<Enumeration Name=\"{}\" NameSpace=\"Standard\">", name);
    add_entry(only.name, only.value);
    nodes_ += fmt::format("<Value>{}</Value></Enumeration>\n", only.value);
  }

  void boolean(std::string_view name, std::uint32_t address) {
    feature(name);
    integer_register(fmt::format("{}Register", name), address, "RW");
    nodes_ += fmt::format(
        "<Boolean Name=\"{0}\" NameSpace=\"Standard\"><pValue>{0}Register</pValue>"
        "<OnValue>1</OnValue><OffValue>0</OffValue></Boolean>\n",
        name);
  }

  void command(std::string_view name, std::string_view integer_register, int value) {
    feature(name);
    nodes_ += fmt::format(
        "<Command Name=\"{}\" NameSpace=\"Standard\"><pValue>{}</pValue>"
        "<CommandValue>{}</CommandValue></Command>\n",
        name, integer_register, value);
  }

  void verbatim(std::string_view name, std::string_view node) {
    feature(name);
    nodes_ += node;
  }

  std::string xml(const std::string& vendor, const std::string& model) const {
    return fmt::format(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n"
        "<RegisterDescription ModelName=\"{}\" VendorName=\"{}\" StandardNameSpace=\"GEV\" "
        "SchemaMajorVersion=\"1\" SchemaMinorVersion=\"0\" SchemaSubMinorVersion=\"1\" "
        "MajorVersion=\"1\" MinorVersion=\"0\" SubMinorVersion=\"0\" "
        "ToolTip=\"Emulated camera\" ProductGuid=\"0\" VersionGuid=\"0\" "
        "xmlns=\"http://www.genicam.org/GenApi/Version_1_0\">\n"
        "<Category Name=\"Root\" NameSpace=\"Standard\"><pFeature>Camera</pFeature></Category>\n"
        "<Category Name=\"Camera\">{}</Category>\n{}"
        "<Port Name=\"Device\" NameSpace=\"Standard\"></Port>\n</RegisterDescription>\n",
        model, vendor, features_, nodes_);
  }

 private:
  void feature(std::string_view name) { features_ += fmt::format("<pFeature>{}</pFeature>", name); }
  void add_entry(std::string_view name, std::uint32_t value) {
    nodes_ += fmt::format(
        "<EnumEntry Name=\"{}\" NameSpace=\"Standard\"><Value>{}</Value></EnumEntry>", name, value);
  }

  std::string features_;
  std::string nodes_;
};

struct NamedFormat {
  std::string_view name;
  std::uint32_t value;
};

std::vector<NamedFormat> formats_of(devices::PixelFormat layout) {
  std::vector<NamedFormat> entries;
  for (const PixelFormat& format : pixel_formats(layout)) {
    entries.push_back({format.name, format.code});
  }
  return entries;
}

}  // namespace

std::string genicam_description(const devices::CameraInfo& sensor, const std::string& vendor,
                                const std::string& model) {
  using Microseconds = std::chrono::duration<double, std::micro>;
  Description of;
  of.text("DeviceVendorName", kVendorName, 32);
  of.text("DeviceModelName", kModelName, 32);
  of.text("DeviceSerialNumber", kSerialNumber, 16);
  of.real("DeviceTemperature", kTemperature, "RO", -40.0, 125.0);

  of.integer("SensorWidth", kSensorWidth, "");
  of.integer("SensorHeight", kSensorHeight, "");
  // Steps of two: a Bayer pattern keeps its phase and two packed pixels stay together.
  of.integer("Width", kWidth, "<Min>2</Min><pMax>SensorWidth</pMax><Inc>2</Inc>");
  of.integer("Height", kHeight, "<Min>2</Min><pMax>SensorHeight</pMax><Inc>2</Inc>");
  of.integer("OffsetX", kOffsetX, "<Min>0</Min><pMax>SensorWidth</pMax><Inc>2</Inc>");
  of.integer("OffsetY", kOffsetY, "<Min>0</Min><pMax>SensorHeight</pMax><Inc>2</Inc>");
  of.choice("PixelFormat", kPixelFormat, formats_of(sensor.pixel_format));
  of.integer_register("PayloadBytes", kPayloadBytes, "RO");
  of.verbatim("PayloadSize",
              "<IntSwissKnife Name=\"PayloadSize\" NameSpace=\"Standard\">"
              "<pVariable Name=\"WIDTH\">Width</pVariable>"
              "<pVariable Name=\"HEIGHT\">Height</pVariable>"
              "<pVariable Name=\"PIXELFORMAT\">PixelFormat</pVariable>"
              "<pVariable Name=\"BYTES\">PayloadBytes</pVariable>"
              "<Formula>BYTES &gt; 0 ? BYTES : WIDTH * HEIGHT * ((PIXELFORMAT>>16)&amp;0xFF) / 8"
              "</Formula>"
              "</IntSwissKnife>\n");

  of.integer_register("AcquisitionRegister", kAcquisition, "WO");
  of.constant_choice("AcquisitionMode", kContinuous[0]);
  of.command("AcquisitionStart", "AcquisitionRegister", 1);
  of.command("AcquisitionStop", "AcquisitionRegister", 0);
  of.scaled("ExposureTime", kExposureUs, 1.0, Microseconds(sensor.min_exposure).count(),
            Microseconds(sensor.max_exposure).count(), "us");
  of.choice("ExposureAuto", kExposureAuto, kAutomatic);
  of.constant_choice("TriggerSelector", kFrameStart[0]);
  of.choice("TriggerMode", kTriggerMode, kOffAndOn);
  of.choice("TriggerSource", kTriggerSource, kSources);
  of.constant_choice("TriggerActivation", kRisingEdge[0]);
  of.integer_register("TriggerSoftwareRegister", kTriggerSoftware, "RW");
  of.command("TriggerSoftware", "TriggerSoftwareRegister", 1);

  of.scaled("Gain", kGain, 100.0, 0.0, 24.0, "dB");
  of.choice("GainAuto", kGainAuto, kAutomaticGain);
  of.real("BlackLevel", kBlackLevel, "RW", 0.0, 1023.0);
  of.choice("BlackLevelAuto", kBlackLevelAuto, kAutomatic);
  of.boolean("GammaEnable", kGammaEnable);
  if (sensor.pixel_format != devices::PixelFormat::mono) {
    of.choice("BalanceWhiteAuto", kBalanceWhiteAuto, kAutomatic);
  }
  return of.xml(vendor, model);
}

}  // namespace gonio::gige_emulator
