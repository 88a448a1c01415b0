#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <string>

#include "gonio/calibration_report/calibration_report.h"
#include "gonio/errors/errors.h"
#include "hidden_bench.h"
#include "page_reading.h"
#include "temporary_folder.h"

namespace gonio::calibration_report {
namespace {

using ::testing::HasSubstr;
namespace routine = calibration::routine;

constexpr instrument::UtcSeconds kRealNoon{std::chrono::seconds(1'700'000'000)};

TEST(CalibrationReport, ShowsWhatTheRoutineFoundOnASimulatedBench) {
  const TemporaryFolder temporary;
  const routine::Folder folder{temporary.path() / "cal"};
  routine::test::HiddenBench bench(1);
  const auto nominal = routine::test::HiddenBench::nominal(sim::HiddenImage::small);
  routine::Routine steps(nominal, routine::test::HiddenBench::settings(), folder,
                         {{"camera", "SN-4711"}}, [] { return kRealNoon; });
  for (const char* step : {"darks", "linearity", "photon_transfer"}) {
    steps.take(step, bench.devices, {}, {});
  }
  CalibrationReportData data;
  data.rig = "hidden";
  data.archive = steps.archive();
  data.observations = read_observations(steps.archive(), folder);
  data.findings = steps.findings();
  data.instrument = steps.instrument();
  data.now = kRealNoon;
  EXPECT_EQ(data.observations.size(), 3U);
  EXPECT_EQ(data.observations.at("photon_transfer").levels.size(),
            static_cast<std::size_t>(steps.settings().light_levels));
  const std::string page = html(data);
  EXPECT_THAT(page, HasSubstr("SN-4711"));
  EXPECT_THAT(page, HasSubstr("Incomplete: 15 missing, 0 stale, 0 expired"));
  for (const char* title :
       {"Photon transfer", "Photon transfer: residuals", "Linearity", "Bad pixels in the frame"}) {
    EXPECT_TRUE(test::Figure(page, title).there()) << title;
  }
  const auto bad = std::count_if(data.findings.bad_pixels.begin(), data.findings.bad_pixels.end(),
                                 [](std::uint8_t bits) { return bits != 0; });
  const test::Figure map(page, "Bad pixels in the frame");
  EXPECT_EQ(map.circles("dot (r|b|light)").size() + map.dots().size(),
            static_cast<std::size_t>(bad));

  const auto& darks = *instrument::find_result(steps.archive(), "darks");
  std::ofstream(folder.raw("darks", darks.raw_data.at(0).sha256), std::ios::app) << ' ';
  EXPECT_THROW(read_observations(steps.archive(), folder), DataFormatError);
}

}  // namespace
}  // namespace gonio::calibration_report
