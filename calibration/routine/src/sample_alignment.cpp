#include "gonio/calibration/routine/sample_alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "bench.h"
#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::routine {
namespace {

const std::array<double, 2> kArms_deg{40.0, 80.0};
constexpr int kSide = 7;
constexpr double kSearch_deg = 4.0;  // half width of the first, coarse scan
constexpr double kSpot_mm = 2.0;     // half width of the spot whose brightness is followed
constexpr double kLevel = 0.6;       // of saturation, at the brightest
constexpr double kLeft = 0.35;       // of the peak, at the edge of the fine scan
constexpr double kStandsOut = 1.15;  // brightest over dimmest of the coarse scan; matte: up to 1.09
// Brightest less dimmest of the coarse scan over its sigma; 49 looks at nothing come to 3 to 4.
constexpr double kClear = 6.0;
constexpr double kSearched_deg = 1.25 * kSearch_deg;  // how far a scan's middle may follow
constexpr int kNarrowings = 6;

/// Scans of one lamp-arm angle.
class HighlightScan {
 public:
  HighlightScan(Bench& bench, Angle arm) : bench_(bench), arm_(arm) {}

  geometry::Peak peak() {
    // Coarse first: where is it, and how wide?
    go(pose({}, {}));
    exposure_ = bench_.exposure_for(0.25 * kLevel);
    double half_deg = kSearch_deg;
    std::vector<geometry::PeakSample> scan;
    for (int narrowing = 0;; ++narrowing) {
      scan = scan_about_centre(half_deg);
      const auto [dimmest, brightest] =
          std::minmax_element(scan.begin(), scan.end(),
                              [](const auto& a, const auto& b) { return a.signal < b.signal; });
      if (narrowing == 0) require_highlight(*dimmest, *brightest);
      const auto index = static_cast<int>(brightest - scan.begin());
      centre_azimuth_ = centre_azimuth_ + (index % kSide - kSide / 2) * step(half_deg);
      centre_tilt_ = centre_tilt_ + (index / kSide - kSide / 2) * step(half_deg);
      require_searched();
      go(pose({}, {}));
      exposure_ = bench_.exposure_for(kLevel);
      const double edge = edge_share(half_deg);
      if (edge > kLeft || narrowing == kNarrowings) break;
      half_deg *= edge < 0.05 ? 0.4 : 0.7;
    }
    scan = scan_about_centre(half_deg);
    geometry::PeakOptions options;
    options.u_joint = bench_.instrument().u_joint;
    return geometry::fit_peak(bench_.instrument().rig, scan, options);
  }

 private:
  static Angle step(double half_deg) { return Angle::from_degrees(half_deg / (kSide / 2)); }

  rig::Joints pose(Angle azimuth_off, Angle tilt_off) const {
    return bench_.joints(arm_, 0.5 * arm_ + centre_azimuth_ + azimuth_off, centre_tilt_ + tilt_off);
  }

  [[noreturn]] static void refuse(const std::string& found) {
    throw StepRefused(fmt::format(
        "sample: found no highlight within {:g} deg of where its normal should be ({}), expected a "
        "glossy sample that lies straight: align a matte one by its seat",
        kSearch_deg, found));
  }

  static void require_highlight(const geometry::PeakSample& dimmest,
                                const geometry::PeakSample& brightest) {
    const double ratio = brightest.signal / dimmest.signal;
    const double clear =
        (brightest.signal - dimmest.signal) / std::hypot(brightest.sigma, dimmest.sigma);
    if (ratio < kStandsOut) refuse(fmt::format("brightest {:.2f} times the dimmest", ratio));
    if (clear < kClear) {
      refuse(fmt::format("brightest and dimmest differ by {:.1f} times their noise", clear));
    }
  }

  /// A brightness that rises on and on is none of a highlight.
  void require_searched() const {
    const double off_deg =
        std::max(std::abs(centre_azimuth_.degrees()), std::abs(centre_tilt_.degrees()));
    if (off_deg <= kSearched_deg) return;
    refuse(fmt::format("it grows brighter out to azimuth {:+.1f}, tilt {:+.1f} deg off",
                       centre_azimuth_.degrees(), centre_tilt_.degrees()));
  }

  /// The search stays where the axes may go.
  rig::Joints go(const rig::Joints& joints) {
    if (!bench_.allowed(joints)) {
      refuse(fmt::format(
          "it grows brighter out to the axes' limits, azimuth {:.2f}, tilt {:.2f} deg",
          joints[bench_.axis("azimuth")].degrees(), joints[bench_.axis("tilt")].degrees()));
    }
    return bench_.go(joints);
  }

  geometry::PeakSample sample_at(const rig::Joints& joints) {
    const rig::Joints stood = go(joints);
    const Picture picture = bench_.picture(bench_.main_channel(), exposure_, 1);
    const auto spot = bench_.signal_at(picture, stood, {0.0, 0.0}, kSpot_mm);
    if (!spot)
      throw StepRefused("sample: found its middle outside the picture, expected it inside");
    return {stood, std::max(spot->dn_per_s, 1e-9), spot->sigma_dn_per_s};
  }

  /// Mean brightness at the four ends of the scan over that of its middle.
  double edge_share(double half_deg) {
    const Angle half = Angle::from_degrees(half_deg);
    const double middle = sample_at(pose({}, {})).signal;
    double sum = 0.0;
    for (const double sign : {-1.0, 1.0}) {
      sum += sample_at(pose(sign * half, {})).signal + sample_at(pose({}, sign * half)).signal;
    }
    return 0.25 * sum / middle;
  }

  std::vector<geometry::PeakSample> scan_about_centre(double half_deg) {
    std::vector<geometry::PeakSample> scan;
    for (int j = 0; j < kSide; ++j) {
      bench_.tell(fmt::format("highlight with the lamp at {:g} deg, line", arm_.degrees()),
                  static_cast<std::size_t>(j), kSide);
      for (int i = 0; i < kSide; ++i) {
        scan.push_back(
            sample_at(pose((i - kSide / 2) * step(half_deg), (j - kSide / 2) * step(half_deg))));
      }
    }
    return scan;
  }

  Bench& bench_;
  Angle arm_;
  std::chrono::nanoseconds exposure_{0};
  Angle centre_azimuth_;
  Angle centre_tilt_;
};

}  // namespace

SampleAlignment align_sample(const acquisition::DeviceSet& devices,
                             const instrument::Instrument& known, const RoutineSettings& settings,
                             const std::function<void(const std::string&, double)>& progress,
                             std::stop_token stop) {
  acquisition::GuardedDevices guarded(
      devices, known.rig, settings.session,
      [](std::chrono::nanoseconds, const std::string&, const std::string&) {}, stop);
  guarded.home_all();
  guarded.mount(devices::Target::sample);
  std::size_t arm = 0;
  Bench bench(guarded, known, settings, [&](const std::string& what, double fraction) {
    if (progress) {
      progress(what, (static_cast<double>(arm) + fraction) / static_cast<double>(kArms_deg.size()));
    }
  });
  bench.light(bench.main_channel());
  SampleAlignment found;
  for (; arm < kArms_deg.size(); ++arm) {
    found.peaks.push_back(HighlightScan(bench, Angle::from_degrees(kArms_deg[arm])).peak());
  }
  geometry::PeakFitOptions options;
  options.max_disagreement = Angle::from_degrees(0.2);
  found.normal = geometry::fit_mount_normal(known.rig, found.peaks, options);
  return found;
}

}  // namespace gonio::calibration::routine
