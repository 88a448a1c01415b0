// What a careless operator, a dead lamp or a bad disk do: refused with the reason, and the folder
// is as it was.

#include <gmock/gmock.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "careless_changer.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "gonio/files/sha256.h"
#include "gonio/files/text_file.h"
#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

using devices::Target;
using test::CarelessChanger;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Says that it is lit and is not.
class DeadLamp final : public devices::LightSource {
 public:
  explicit DeadLamp(devices::LightSource& real) : real_(real) {}
  const std::string& name() const override { return real_.name(); }
  std::vector<devices::LightChannel> channels() const override { return real_.channels(); }
  void light(const std::string&) override {}
  void close_shutter() noexcept override { real_.close_shutter(); }

 private:
  devices::LightSource& real_;
};

class Refusal : public ::testing::Test {
 protected:
  Routine routine() const {
    return Routine(test::HiddenBench::nominal(sim::HiddenImage::small),
                   test::HiddenBench::settings(), {folder_.path() / "cal"}, {{"camera", "sim"}},
                   [] { return instrument::UtcSeconds(std::chrono::seconds(1'700'000'000)); });
  }

  /// The step is refused, saying `why`, and leaves neither result nor file.
  void expect_refused(test::HiddenBench& bench, const std::string& step, const std::string& why) {
    Routine calibration = routine();
    for (const char* before : {"darks", "bad_pixels"}) {
      if (step == "intrinsics") calibration.take(before, bench.devices, {}, {});
    }
    const std::size_t results = calibration.archive().results.size();
    EXPECT_THAT([&] { calibration.take(step, bench.devices, {}, {}); },
                ThrowsMessage<StepRefused>(HasSubstr(why)))
        << step;
    EXPECT_EQ(calibration.archive().results.size(), results);
    EXPECT_EQ(calibration.state_of(step), instrument::StepState::missing);
  }

  TemporaryFolder folder_;
};

TEST_F(Refusal, OfAWhiteWhereTheMirrorShouldBe) {
  test::HiddenBench bench(3);
  CarelessChanger changer(*bench.devices.changer, Target::mirror, Target::white);
  bench.devices.changer = &changer;
  expect_refused(bench, "homing", "is the mirror in the holder");
}

TEST_F(Refusal, OfATrapWhereTheWhiteShouldBe) {
  test::HiddenBench bench(3);
  CarelessChanger changer(*bench.devices.changer, Target::white, Target::black_trap);
  bench.devices.changer = &changer;
  Routine calibration = routine();
  calibration.take("darks", bench.devices, {}, {});
  EXPECT_THROW(calibration.take("linearity", bench.devices, {}, {}), StepRefused);
  EXPECT_EQ(calibration.state_of("linearity"), instrument::StepState::missing);
}

TEST_F(Refusal, OfAWhiteWhereTheBoardShouldBe) {
  test::HiddenBench bench(3);
  CarelessChanger changer(*bench.devices.changer, Target::board, Target::white);
  bench.devices.changer = &changer;
  expect_refused(bench, "intrinsics", "no marker");
}

TEST_F(Refusal, OfABoardThatIsHalfHidden) {
  sim::SimOptions options = test::HiddenBench::options_with_board(3, sim::HiddenImage::small);
  const int columns = options.scene.board.columns;
  for (std::size_t cell = 0; cell < options.scene.board.white.size(); ++cell) {
    if (static_cast<int>(cell) % columns > columns / 2) options.scene.board.white[cell] = true;
  }
  test::HiddenBench bench(options);
  expect_refused(bench, "intrinsics", "is part of it hidden");
}

TEST_F(Refusal, OfACameraWithAColourMosaic) {
  sim::SimOptions options = test::HiddenBench::options_with_board(3, sim::HiddenImage::small);
  options.camera.pixel_format = devices::PixelFormat::bayer_rggb;
  test::HiddenBench bench(options);
  expect_refused(bench, "homing", "camera: found a colour mosaic");
}

TEST_F(Refusal, OfALampThatIsOff) {
  test::HiddenBench bench(3);
  DeadLamp lamp(*bench.devices.light);
  bench.devices.light = &lamp;
  expect_refused(bench, "homing", "the lamp on?");
}

TEST_F(Refusal, OfFramesThatAreSaturatedAtTheShortestExposure) {
  sim::SimOptions options = test::HiddenBench::options_with_board(3, sim::HiddenImage::small);
  options.camera.min_exposure = std::chrono::milliseconds(200);
  test::HiddenBench bench(options);
  expect_refused(bench, "warm_up", "saturated");
}

TEST_F(Refusal, OfAFolderThatIsNoLongerWhatItWas) {
  test::HiddenBench bench(3);
  routine().take("darks", bench.devices, {}, {});
  const Folder folder{folder_.path() / "cal"};
  const std::string archive = files::read_text_file(folder.archive(), 1U << 24U);

  const auto raw = *std::filesystem::directory_iterator(folder.path / "raw");
  const std::string seen = files::read_text_file(raw.path(), 1U << 24U);
  std::ofstream(raw.path()) << seen << ' ';
  EXPECT_THAT([&] { routine(); }, ThrowsMessage<DataFormatError>(HasSubstr("darks-")));
  std::filesystem::remove(raw.path());
  EXPECT_THROW(routine(), std::runtime_error);
  std::ofstream(raw.path()) << seen;
  EXPECT_NO_THROW(routine());

  std::ofstream(folder.archive()) << archive.substr(0, archive.size() / 2);
  EXPECT_THAT([&] { routine(); }, ThrowsMessage<DataFormatError>(HasSubstr("calibration.json")));
}

TEST_F(Refusal, OfNumbersThatNobodyHasMeasured) {
  test::HiddenBench bench(3);
  routine().take("darks", bench.devices, {}, {});
  const Folder folder{folder_.path() / "cal"};
  instrument::CalibrationArchive archive = instrument::read_calibration_archive(folder.archive());
  instrument::RawData& raw = archive.results.at(0).raw_data.at(0);
  Observations seen = read_observations(archive.results.at(0), folder);
  seen.darks->black_level_dn.value = 1e150;
  const std::string text = to_json("darks", seen);
  raw.sha256 = files::sha256_of_bytes(text);
  std::ofstream(folder.raw("darks", raw.sha256)) << text;
  instrument::write_calibration_archive(folder.archive(), archive);
  EXPECT_THAT([&] { routine(); },
              ThrowsMessage<DataFormatError>(testing::AllOf(
                  HasSubstr("darks-"), HasSubstr("darks.black_level_dn.value: found 1e+150"))));
}

TEST_F(Refusal, OfRawDataBehindALink) {
  std::filesystem::create_directories(folder_.path() / "cal");
  std::filesystem::create_directories(folder_.path() / "elsewhere");
  std::filesystem::create_directory_symlink(folder_.path() / "elsewhere",
                                            folder_.path() / "cal" / "raw");
  EXPECT_THAT([&] { routine(); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("raw: found a link")));
}

TEST_F(Refusal, OfWhatALaterTakingMakesWrongIsOfItsFindingsToo) {
  const sim::SimOptions few = test::HiddenBench::options_with_board(3, sim::HiddenImage::small);
  sim::SimOptions many = few;
  many.camera.hot_pixel_fraction = 0.001;
  const Folder folder{folder_.path() / "cal"};
  test::HiddenBench bench(few);
  {
    Routine calibration = routine();
    calibration.take("darks", bench.devices, {}, {});
    calibration.take("bad_pixels", bench.devices, {}, {});
  }
  // Cold ones to just below what is allowed.
  instrument::CalibrationArchive archive = instrument::read_calibration_archive(folder.archive());
  instrument::StepResult& result = archive.results.at(1);
  Observations seen = read_observations(result, folder);
  for (std::uint32_t i = 0; i < 400; ++i) seen.defects.push_back({700 * i, sensor::defect::kCold});
  const std::string text = to_json("bad_pixels", seen);
  result.raw_data.at(0).sha256 = files::sha256_of_bytes(text);
  std::ofstream(folder.raw("bad_pixels", result.raw_data.at(0).sha256)) << text;
  instrument::write_calibration_archive(folder.archive(), archive);

  Routine calibration = routine();
  const auto cold = [](const Routine& of) {
    const std::vector<std::uint8_t>& map = of.findings().bad_pixels;
    return std::count_if(map.begin(), map.end(),
                         [](std::uint8_t bits) { return (bits & sensor::defect::kCold) != 0; });
  };
  ASSERT_EQ(calibration.state_of("bad_pixels"), instrument::StepState::valid);
  EXPECT_GE(cold(calibration), 380);
  test::HiddenBench another(many);
  const instrument::StepResult& darks = calibration.take("darks", another.devices, {}, {});
  EXPECT_THAT(darks.notes, testing::Contains(HasSubstr("bad_pixels, evaluated again with this")));
  EXPECT_EQ(calibration.state_of("bad_pixels"), instrument::StepState::missing);
  EXPECT_EQ(cold(calibration), 0);
  EXPECT_FALSE(calibration.findings().seen_after.contains("bad_pixels"));
  EXPECT_EQ(calibration.findings().bad_pixels, routine().findings().bad_pixels);
}

TEST_F(Refusal, OfAFolderOfOtherDevices) {
  test::HiddenBench bench(3);
  routine().take("darks", bench.devices, {}, {});
  EXPECT_THAT(
      [&] {
        Routine(test::HiddenBench::nominal(sim::HiddenImage::small), test::HiddenBench::settings(),
                {folder_.path() / "cal"}, {{"camera", "another"}},
                [] { return instrument::UtcSeconds(std::chrono::seconds(1'700'000'000)); });
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("with other devices")));
}

TEST_F(Refusal, OfAStepBeforeTheOnesItNeeds) {
  test::HiddenBench bench(3);
  Routine calibration = routine();
  EXPECT_THAT([&] { calibration.take("stage_axes", bench.devices, {}, {}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("take that step first")));
  for (const char* step : {"darks", "linearity", "photon_transfer", "darks"}) {
    calibration.take(step, bench.devices, {}, {});
  }
  EXPECT_EQ(calibration.state_of("linearity"), instrument::StepState::valid);
  // A curve that is another takes the gain found with it along.
  calibration.take("linearity", bench.devices, {}, {});
  EXPECT_EQ(calibration.state_of("photon_transfer"), instrument::StepState::stale);
}

}  // namespace
}  // namespace gonio::calibration::routine
