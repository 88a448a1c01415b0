#pragma once

#include <cstdint>

namespace gonio::gige_emulator::registers {

// Where Aravis' fake camera looks itself (arvfakecamera.h).
inline constexpr std::uint32_t kWidth = 0x100;
inline constexpr std::uint32_t kHeight = 0x104;
inline constexpr std::uint32_t kGain = 0x110;  // hundredths of a dB
inline constexpr std::uint32_t kGainAuto = 0x114;
inline constexpr std::uint32_t kSensorHeight = 0x118;
inline constexpr std::uint32_t kSensorWidth = 0x11c;
inline constexpr std::uint32_t kExposureUs = 0x120;
inline constexpr std::uint32_t kAcquisition = 0x124;
inline constexpr std::uint32_t kPixelFormat = 0x128;
inline constexpr std::uint32_t kOffsetX = 0x130;
inline constexpr std::uint32_t kOffsetY = 0x134;
inline constexpr std::uint32_t kFramePeriodUs = 0x138;
inline constexpr std::uint32_t kTriggerMode = 0x300;
inline constexpr std::uint32_t kFakeTriggerSource = 0x304;  // 1: frames go when 0x30c is 1
inline constexpr std::uint32_t kFakeTrigger = 0x30c;

// Ours, in the room it leaves unused. TriggerSoftware writes here, so that the fake camera does not
// send before the frame exists.
inline constexpr std::uint32_t kBlackLevel = 0x2000;   // float32
inline constexpr std::uint32_t kTemperature = 0x2004;  // float32
inline constexpr std::uint32_t kExposureAuto = 0x2008;
inline constexpr std::uint32_t kBlackLevelAuto = 0x200c;
inline constexpr std::uint32_t kGammaEnable = 0x2010;
inline constexpr std::uint32_t kTriggerSource = 0x2014;
inline constexpr std::uint32_t kTriggerSoftware = 0x2018;
inline constexpr std::uint32_t kBalanceWhiteAuto = 0x201c;
inline constexpr std::uint32_t kPayloadBytes = 0x2020;  // 0: what the image takes

// GigE Vision bootstrap registers.
inline constexpr std::uint32_t kVendorName = 0x48;
inline constexpr std::uint32_t kModelName = 0x68;
inline constexpr std::uint32_t kSerialNumber = 0xd8;
inline constexpr std::uint32_t kStreamPort = 0x0d00;
inline constexpr std::uint32_t kPacketSize = 0x0d04;

// Values of TriggerSource.
inline constexpr std::uint32_t kSoftware = 0;
inline constexpr std::uint32_t kLine1 = 1;

}  // namespace gonio::gige_emulator::registers
