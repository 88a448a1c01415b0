#include "gonio/instrument/alignment.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "example_instrument.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::instrument {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::chrono::sys_seconds kFound{std::chrono::seconds(1'800'000'000)};

Alignment example() {
  Alignment alignment;
  alignment.tilt_x = Angle::from_degrees(0.3);
  alignment.tilt_y = Angle::from_degrees(-0.2);
  alignment.covariance << 3e-8, 1e-9, 1e-9, 5e-8;
  alignment.method = "highlight";
  alignment.sample = "A17";
  alignment.instrument_sha256 = std::string(64, 'a');
  alignment.found = kFound;
  return alignment;
}

TEST(Alignment, ReadsBackAsItWasWritten) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path() / "alignment.json";
  write_alignment(file, example());
  const Alignment read = read_alignment(file);
  EXPECT_EQ(read.tilt_x, example().tilt_x);
  EXPECT_EQ(read.tilt_y, example().tilt_y);
  EXPECT_EQ(read.covariance, example().covariance);
  EXPECT_EQ(read.method, "highlight");
  EXPECT_EQ(read.sample, "A17");
  EXPECT_EQ(read.found, kFound);
  EXPECT_EQ(read.instrument_sha256, example().instrument_sha256);
  EXPECT_THROW(write_alignment(file, example()), FileError);
}

TEST(Alignment, OneOfAnOlderVersionIsRefusedAsSuch) {
  std::string text = to_json(example());
  const std::string version = "\"version\": 2";
  text.replace(text.find(version), version.size(), "\"version\": 1");
  EXPECT_THAT([&] { alignment_from_json(text, "a.json"); },
              ThrowsMessage<DataFormatError>(HasSubstr("an older version of gonio")));
}

TEST(Alignment, HoldsForItsSampleForADay) {
  using std::chrono::hours;
  EXPECT_THAT(reasons_against(example(), "A17", kFound + hours(24)), testing::IsEmpty());
  EXPECT_THAT(reasons_against(example(), "", kFound), testing::IsEmpty());
  EXPECT_THAT(reasons_against(example(), "A18", kFound),
              testing::ElementsAre(HasSubstr("found one of sample \"A17\", expected \"A18\"")));
  EXPECT_THAT(reasons_against(example(), "A17", kFound + hours(25)),
              testing::ElementsAre(HasSubstr("is of 2027-01-15 08:00 UTC")));
  EXPECT_THAT(reasons_against(example(), "A17", kFound - std::chrono::minutes(5)),
              testing::IsEmpty());
  EXPECT_THAT(reasons_against(example(), "A17", kFound - hours(1)),
              testing::ElementsAre(HasSubstr("found 2027-01-15 08:00 UTC, which is to come")));
  Alignment unnamed = example();
  unnamed.sample.clear();
  EXPECT_THAT(reasons_against(unnamed, "A18", kFound), testing::IsEmpty());
}

TEST(Alignment, TurnsTheSamplesNormal) {
  const Instrument before = example_instrument();
  const Instrument after = aligned(before, example());
  // A turn about x moves the normal towards -y, one about y towards +x.
  const Eigen::Vector3d normal =
      before.rig.sample.home_pose.linear().transpose() * after.rig.sample.home_pose.linear().col(2);
  EXPECT_NEAR(normal.y(), -std::sin(example().tilt_x.radians()), 1e-6);
  EXPECT_NEAR(normal.x(), std::sin(example().tilt_y.radians()), 1e-6);
  EXPECT_EQ(after.rig.sample.home_pose.translation(), before.rig.sample.home_pose.translation());
  EXPECT_NEAR(after.u_normal.radians(), 2e-4, 1e-9);
}

TEST(Alignment, RefusesWhatCannotBe) {
  const auto refused = [](auto spoil, const char* why) {
    Alignment alignment = example();
    spoil(alignment);
    EXPECT_THAT([&] { alignment.validate(); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(why)));
  };
  refused([](Alignment& a) { a.tilt_x = Angle::from_degrees(30.0); }, "tilt");
  refused([](Alignment& a) { a.tilt_y = Angle::from_radians(std::nan("")); }, "tilt");
  refused([](Alignment& a) { a.covariance(0, 0) = -1.0; }, "covariance");
  refused([](Alignment& a) { a.covariance(0, 1) = 0.1; }, "covariance");
  refused([](Alignment& a) { a.covariance(1, 1) = 1e308; }, "a sigma of");
  refused([](Alignment& a) { a.covariance.setZero(); }, "a sigma of 0 deg");
  refused([](Alignment& a) { a.method = "guess"; }, "method");
  refused([](Alignment& a) { a.sample = "a\nb"; }, "sample");
  refused([](Alignment& a) { a.instrument_sha256 = "0"; }, "instrument_sha256");
  EXPECT_THAT([] { alignment_from_json("{}", "a.json"); },
              ThrowsMessage<DataFormatError>(HasSubstr("a.json")));
}

}  // namespace
}  // namespace gonio::instrument
