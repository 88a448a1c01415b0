#include "archive_rows.h"

#include "frame_folder.h"

namespace gonio::acquisition {
namespace {

constexpr int kMaxFramePixels_px = 65536;
constexpr int kMostPoints = 10'000'000;

}  // namespace

std::chrono::nanoseconds RowFields::nanoseconds() {
  const std::chrono::nanoseconds time(number<std::int64_t>());
  if (time < std::chrono::nanoseconds(0) || time > kLongestSession) {
    fail(fmt::format("found a time of {} ns, expected 0 to {}", time.count(),
                     kLongestSession.count()));
  }
  return time;
}

int RowFields::point(int lowest) {
  const int point = number<int>();
  if (point < lowest || point > kMostPoints) {
    fail(fmt::format("found point {}, expected {} to {}", point, lowest, kMostPoints));
  }
  return point;
}

std::vector<Angle> RowFields::angles() {
  std::vector<Angle> result;
  for (const double degrees : numbers<double>()) result.push_back(Angle::from_degrees(degrees));
  return result;
}

std::vector<std::int64_t> RowFields::counts(std::size_t size) {
  std::vector<std::int64_t> result = numbers<std::int64_t>();
  if (result.size() != size || std::ranges::any_of(result, [](auto count) { return count < 0; })) {
    fail(fmt::format("expected {} counts of rows", size));
  }
  return result;
}

devices::Frame shape_of(RowFields& fields) {
  devices::Frame shape;
  shape.width_px = fields.number<int>();
  shape.height_px = fields.number<int>();
  shape.pixel_format =
      fields.name({devices::PixelFormat::mono, devices::PixelFormat::bayer_rggb,
                   devices::PixelFormat::bayer_grbg, devices::PixelFormat::bayer_gbrg,
                   devices::PixelFormat::bayer_bggr});
  shape.saturation_level_dn = fields.number<std::uint16_t>();
  shape.black_level_dn = fields.number<double>();
  shape.gain_db = fields.number<double>();
  if (shape.width_px < 1 || shape.height_px < 1 || shape.width_px > kMaxFramePixels_px ||
      shape.height_px > kMaxFramePixels_px) {
    fields.fail(fmt::format("a frame of {} x {} px", shape.width_px, shape.height_px));
  }
  return shape;
}

FrameRecord frame_record(RowFields& fields, std::int64_t number) {
  FrameRecord record;
  record.id = number;
  record.kind = fields.name({FrameKind::dark, FrameKind::lamp_off, FrameKind::white,
                             FrameKind::sample, FrameKind::sentinel});
  record.point = fields.point(-1);
  record.channel = fields.text();
  const bool lit = record.kind == FrameKind::white || record.kind == FrameKind::sample;
  if (lit && record.channel.empty()) fields.fail("found no channel, expected that of the lamp");
  record.joints = fields.angles();
  record.joints_spread = fields.angles();
  record.exposure = fields.nanoseconds();
  if (record.exposure.count() <= 0) fields.fail("an exposure that is not positive");
  record.exposure_start = fields.nanoseconds();
  record.monitor = fields.number<double>();
  record.camera_frame_id = fields.number<std::uint64_t>();
  record.file = fields.text();
  if (record.file != frame_file_name(number)) {
    fields.fail(
        fmt::format("frame file {:?}, expected {:?}", record.file, frame_file_name(number)));
  }
  record.sha256 = fields.text();
  return record;
}

PointRecord point_record(RowFields& fields) {
  PointRecord record;
  record.point = fields.point(0);
  record.commanded.theta_h = Angle::from_degrees(fields.number<double>());
  record.commanded.theta_d = Angle::from_degrees(fields.number<double>());
  record.commanded.phi_d = Angle::from_degrees(fields.number<double>());
  const std::string& branch = fields.text();
  if (branch.size() != 1) fields.fail(fmt::format("branch {:?}", branch));
  record.branch = branch.front();
  record.joints = fields.angles();
  record.outcome = fields.name({PointOutcome::Measured, PointOutcome::Saturated,
                                PointOutcome::TooDark, PointOutcome::Failed});
  record.note = fields.text();
  record.finished_at = fields.nanoseconds();
  return record;
}

}  // namespace gonio::acquisition
