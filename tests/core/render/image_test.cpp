#include "gonio/render/image.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/errors/errors.h"
#include "gonio/render/comparison_sheet.h"
#include "gonio/render/difference.h"
#include "gonio/render/png.h"
#include "temporary_folder.h"

namespace gonio::render {
namespace {

constexpr Rgba8 kRed = {255, 0, 0, 255};
constexpr Rgba8 kHalfBlue = {0, 0, 255, 128};

/// Read back by libpng's simple interface, which the writer does not use.
Image decoded(const std::vector<std::byte>& bytes) {
  png_image reader;
  std::memset(&reader, 0, sizeof reader);
  reader.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&reader, bytes.data(), bytes.size()) == 0) {
    throw std::runtime_error(reader.message);
  }
  reader.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> buffer(PNG_IMAGE_SIZE(reader));
  if (png_image_finish_read(&reader, nullptr, buffer.data(), 0, nullptr) == 0) {
    throw std::runtime_error(reader.message);
  }
  Image image(static_cast<int>(reader.width), static_cast<int>(reader.height));
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const std::uint8_t* p = buffer.data() + 4 * (y * image.width() + x);
      image.at(x, y) = {p[0], p[1], p[2], p[3]};
    }
  }
  return image;
}

Image chequered(bool opaque) {
  Image image(7, 5);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 7; ++x) {
      image.at(x, y) = {static_cast<std::uint8_t>(30 * x), static_cast<std::uint8_t>(50 * y), 200,
                        static_cast<std::uint8_t>(opaque ? 255 : 40 * x)};
    }
  }
  return image;
}

TEST(Image, BlendsByAlpha) {
  const Rgba8 mixed = blend(kRed, kHalfBlue);
  EXPECT_EQ(mixed, (Rgba8{127, 0, 128, 255}));
  EXPECT_EQ(blend(Rgba8{}, kHalfBlue), kHalfBlue);  // on nothing it stays what it is
  EXPECT_EQ(blend(kRed, kHalfBlue, 0.0), kRed);
}

TEST(Image, CutsOffWhatSticksOut) {
  Image image(4, 4, kRed);
  const Image patch(3, 3, Rgba8{0, 255, 0, 255});
  image.draw(patch, -2, -2);
  image.draw(patch, 3, 3);
  EXPECT_EQ(image.at(0, 0).g, 255);
  EXPECT_EQ(image.at(1, 1), kRed);
  EXPECT_EQ(image.at(3, 3).g, 255);
  image.draw(patch, 100, -100);  // wholly outside
  EXPECT_EQ(image.at(2, 2), kRed);
}

TEST(Image, RefusesAbsurdSizes) {
  EXPECT_THROW(Image(0, 5), std::invalid_argument);
  EXPECT_THROW(Image(5, 1 << 20), std::invalid_argument);
}

TEST(Png, HoldsEveryPixel) {
  for (const bool opaque : {true, false}) {
    const Image image = chequered(opaque);
    EXPECT_EQ(decoded(encode_png(image)), image);
  }
}

TEST(Png, IsTheSameBytesEachTime) {
  EXPECT_EQ(encode_png(chequered(true)), encode_png(chequered(true)));
}

TEST(Png, IsNotWrittenOverAnExistingFileUnlessTold) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "a.png";
  write_png(path, chequered(true));
  EXPECT_THROW(write_png(path, chequered(false)), FileError);
  write_png(path, chequered(false), files::Overwrite::Yes);
  EXPECT_GT(std::filesystem::file_size(path), 60u);
}

TEST(HeatColour, RisesInLightness) {
  const auto luma = [](Rgba8 c) { return 0.21 * c.r + 0.72 * c.g + 0.07 * c.b; };
  for (int i = 1; i <= 20; ++i) {
    EXPECT_GT(luma(heat_colour(i / 20.0)), luma(heat_colour((i - 1) / 20.0))) << i;
  }
  EXPECT_EQ(heat_colour(7.0), heat_colour(1.0));
}

SpherePicture flat(const Eigen::Array3f& radiance) {
  SpherePicture picture;
  picture.size = 16;
  picture.radiance.assign(256, radiance);
  picture.coverage.assign(256, 1.0F);
  return picture;
}

TEST(Difference, IsTheColourDifferenceOfWhatIsShown) {
  // Linear 0.4 and 0.2, L* = 69.47 and 51.84: by lightness alone, mean 60.65,
  // S_L = 1 + 0.015 * 10.65^2/sqrt(20 + 10.65^2) = 1.1473 -> 17.63/1.1473 = 15.37.
  const DifferencePicture d = difference_picture(flat(Eigen::Array3f::Constant(0.4F)),
                                                 flat(Eigen::Array3f::Constant(0.2F)), 1.0);
  EXPECT_NEAR(d.mean_delta_e, 15.37, 0.02);
  EXPECT_NEAR(d.p95_delta_e, d.mean_delta_e, 1e-9);
  EXPECT_EQ(d.image.at(3, 3), heat_colour(1.0));
}

TEST(Difference, OfEqualPicturesIsTheColdEnd) {
  const SpherePicture grey = flat(Eigen::Array3f::Constant(0.4F));
  const DifferencePicture d = difference_picture(grey, grey, 1.0);
  EXPECT_EQ(d.mean_delta_e, 0.0);
  EXPECT_EQ(d.image.at(5, 5), heat_colour(0.0));
  EXPECT_THROW(difference_picture(grey, grey, 1.0, 0.0), std::invalid_argument);
}

class Grey final : public brdf::BrdfModel {
 public:
  explicit Grey(double per_sr) : per_sr_(per_sr) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry&) const override {
    return brdf::Rgb::Constant(per_sr_);
  }
  double per_sr_;
};

TEST(Sheet, HasARowPerLightingAndSurvivesAnyName) {
  SheetOptions options;
  options.sphere_size = 64;
  options.lightings = {PictureLighting::a};
  options.reference_name = std::string(300, 'w');
  options.result_name = "\xff\x01 <b>\xc3\xa9";
  const Image one = comparison_sheet(Grey(0.2), Grey(0.2), brdf::RadiometricScale::si, options);
  options.lightings = {PictureLighting::a, PictureLighting::b};
  const Image two = comparison_sheet(Grey(0.2), Grey(0.1), brdf::RadiometricScale::si, options);
  EXPECT_EQ(one.width(), two.width());
  EXPECT_GT(two.height(), one.height() + 64);
  EXPECT_GT(sphere_sheet(Grey(0.2), brdf::RadiometricScale::si, options).width(), 2 * 64);

  options.lightings.clear();
  EXPECT_THROW(sphere_sheet(Grey(0.2), brdf::RadiometricScale::si, options), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::render
