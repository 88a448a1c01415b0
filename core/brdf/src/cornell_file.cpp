#include "gonio/brdf/cornell_file.h"

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "gonio/brdf/spectrum.h"
#include "gonio/errors/errors.h"
#include "gonio/files/input_file.h"

namespace gonio::brdf {
namespace {

constexpr std::uintmax_t kMostBytes = std::uintmax_t{64} << 20U;
constexpr int kMostWavelengths = 2000;
/// Six decimals in the files.
constexpr double kAngleRounding = 1e-5;
/// Noise is a small number; this says that a column is no BRDF.
constexpr double kLowestValue = -1.0;

/// The numbers of a text one after the other.
class Numbers {
 public:
  Numbers(const std::filesystem::path& path, std::string_view text) : path_(path), text_(text) {}

  /// Nothing at the end of the file.
  std::optional<double> next() {
    skip_blanks();
    if (text_.empty()) return std::nullopt;
    std::size_t end = 0;
    while (end < text_.size() && !blank(text_[end]) && text_[end] != '#') ++end;
    const std::string_view word = text_.substr(0, end);
    double value = 0.0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(value)) {
      std::string shown;
      for (const char c : word.substr(0, 40)) shown += c >= ' ' && c <= '~' ? c : '?';
      fail("found \"" + shown + "\", expected a finite number");
    }
    text_.remove_prefix(end);
    return value;
  }

  double require(const std::string& what) {
    const std::optional<double> value = next();
    if (!value) fail("the file ends here, expected " + what);
    return *value;
  }

  [[noreturn]] void fail(const std::string& message) const {
    throw DataFormatError(path_, "line " + std::to_string(line_), message);
  }

 private:
  static bool blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\f' || c == '\v';
  }

  void skip_blanks() {
    bool comment = false;
    std::size_t at = 0;
    for (; at < text_.size(); ++at) {
      const char c = text_[at];
      if (c == '#') comment = true;
      if (c == '\n') {
        comment = false;
        ++line_;
      }
      if (!comment && !blank(c)) break;
    }
    text_.remove_prefix(at);
  }

  const std::filesystem::path& path_;
  std::string_view text_;
  int line_ = 1;
};

std::string read_text(const std::filesystem::path& path) {
  files::InputFile file(path);
  if (file.size() > kMostBytes) {
    throw DataFormatError(path, "byte " + std::to_string(kMostBytes),
                          "found " + std::to_string(file.size()) + " bytes, expected at most " +
                              std::to_string(kMostBytes));
  }
  std::string text(static_cast<std::size_t>(file.size()), '\0');
  file.read(std::as_writable_bytes(std::span(text)));
  return text;
}

}  // namespace

std::vector<ScatteredValue> read_cornell(const std::filesystem::path& path) {
  const std::string text = read_text(path);
  Numbers numbers(path, text);
  const double count = numbers.require("the number of wavelengths");
  if (!(count >= 2 && count <= kMostWavelengths) || count != std::floor(count)) {
    numbers.fail("found " + std::to_string(count) +
                 ", expected a number of wavelengths from 2 to " +
                 std::to_string(kMostWavelengths));
  }
  std::vector<double> wavelengths(static_cast<std::size_t>(count));
  for (double& wavelength : wavelengths) wavelength = numbers.require("another wavelength");
  Eigen::Matrix3Xd weights;
  try {
    weights = srgb_weights(wavelengths);
  } catch (const std::invalid_argument& error) {
    numbers.fail(error.what());
  }

  std::vector<ScatteredValue> samples;
  Eigen::VectorXd spectrum(weights.cols());
  const auto angle = [&](double value, const char* name, double min, double max) {
    if (!(value >= min - kAngleRounding && value <= max + kAngleRounding)) {
      numbers.fail(std::string("found ") + name + " = " + std::to_string(value) +
                   " rad, expected " + std::to_string(min) + " to " + std::to_string(max));
    }
    return Angle::from_radians(value);
  };
  while (const std::optional<double> first = numbers.next()) {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    const Angle theta_i = angle(*first, "theta_i", 0.0, std::numbers::pi / 2.0);
    const Angle phi_i = angle(numbers.require("phi_i"), "phi_i", -kTurn, kTurn);
    const Angle theta_o = angle(numbers.require("theta_o"), "theta_o", 0.0, std::numbers::pi / 2.0);
    const Angle phi_o = angle(numbers.require("phi_o"), "phi_o", -kTurn, kTurn);
    for (double& value : spectrum) {
      value =
          numbers.require("a value for each of " + std::to_string(weights.cols()) + " wavelengths");
      if (value < kLowestValue) {
        numbers.fail("found a BRDF of " + std::to_string(value) + ", expected 0 or above");
      }
    }
    const DirectionPair pair{direction(theta_i, phi_i), direction(theta_o, phi_o)};
    if (pair.wi.z() <= 0.0 || pair.wo.z() <= 0.0) continue;  // at the horizon: no BRDF
    const Rgb rgb = (weights * spectrum).array();
    samples.push_back({pair, rgb.max(0.0)});
  }
  if (samples.empty()) numbers.fail("the file ends here, expected at least one sample");
  return samples;
}

}  // namespace gonio::brdf
