#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace gonio::brdf::testing {

/// A second reader of RGL files, written from the format's description alone and as plainly as
/// possible: a foreign program's view of what we write. Knows nothing of the product's code.
class PlainRglReader {
 public:
  struct Field {
    std::uint8_t type = 0;
    std::vector<std::uint64_t> shape;
    std::vector<float> numbers;     ///< of float fields
    std::vector<std::uint8_t> raw;  ///< of byte fields
  };

  explicit PlainRglReader(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    if (bytes.substr(0, 14) != std::string("tensor_file\0\1\0", 14)) {
      throw std::runtime_error("no tensor file");
    }
    std::size_t at = 14;
    const auto number = [&]<class N>(N) {
      N value{};
      std::memcpy(&value, bytes.data() + at, sizeof value);
      at += sizeof value;
      return value;
    };
    const std::uint32_t count = number(std::uint32_t{});
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint16_t length = number(std::uint16_t{});
      const std::string name = bytes.substr(at, length);
      at += length;
      Field field;
      const std::uint16_t dimensions = number(std::uint16_t{});
      field.type = number(std::uint8_t{});
      const std::uint64_t offset = number(std::uint64_t{});
      std::uint64_t elements = 1;
      for (int d = 0; d < dimensions; ++d) {
        field.shape.push_back(number(std::uint64_t{}));
        elements *= field.shape.back();
      }
      if (field.type == 10) {
        field.numbers.resize(elements);
        std::memcpy(field.numbers.data(), bytes.data() + offset, 4 * elements);
      } else if (field.type == 1) {
        field.raw.assign(bytes.begin() + static_cast<std::ptrdiff_t>(offset),
                         bytes.begin() + static_cast<std::ptrdiff_t>(offset + elements));
      }
      fields[name] = field;
    }
  }

  /// `values` of a field with one plane per (theta_i, channel): "rgb" or "spectra". The light is at
  /// azimuth 0.
  double f_cos_theta_o(const std::string& values, std::size_t channel, double theta_i,
                       const Eigen::Vector3d& wo) const {
    const Eigen::Vector3d wi(std::sin(theta_i), 0.0, std::cos(theta_i));
    const Eigen::Vector3d m = (wi + wo).normalized();
    const double u = std::sqrt(std::acos(std::min(m.z(), 1.0)) * 2.0 / kPi);
    const double v = (std::atan2(m.y(), m.x()) + kPi) / (2.0 * kPi);
    const std::vector<float>& lights = fields.at("theta_i").numbers;
    std::size_t k = 0;
    while (k + 2 < lights.size() && lights[k + 1] <= theta_i) ++k;
    const double t = (theta_i - lights[k]) / (lights[k + 1] - lights[k]);

    const Field& vndf = fields.at("vndf");
    const std::size_t height = vndf.shape[2];
    const std::size_t width = vndf.shape[3];
    // The density for this light on its grid, each of the two normalised.
    std::vector<double> density(height * width, 0.0);
    for (std::size_t side = 0; side < 2; ++side) {
      const float* const grid = vndf.numbers.data() + (k + side) * height * width;
      double sum = 0.0;
      for (std::size_t y = 0; y + 1 < height; ++y) {
        for (std::size_t x = 0; x + 1 < width; ++x) {
          sum += 0.25 * (grid[y * width + x] + grid[y * width + x + 1] + grid[(y + 1) * width + x] +
                         grid[(y + 1) * width + x + 1]);
        }
      }
      sum /= static_cast<double>((height - 1) * (width - 1));
      for (std::size_t i = 0; i < density.size(); ++i) {
        density[i] += (side == 0 ? 1.0 - t : t) * grid[i] / sum;
      }
    }
    const auto row_at = [&](double y) {
      const double place = y * static_cast<double>(height - 1);
      const std::size_t j = std::min(static_cast<std::size_t>(place), height - 2);
      const double s = place - static_cast<double>(j);
      std::vector<double> row(width);
      for (std::size_t x = 0; x < width; ++x) {
        row[x] = (1.0 - s) * density[j * width + x] + s * density[(j + 1) * width + x];
      }
      return row;
    };
    const auto total_at = [&](double y) { return integral_to(row_at(y), 1.0); };
    std::vector<double> totals(height);
    for (std::size_t j = 0; j < height; ++j) {
      totals[j] = total_at(static_cast<double>(j) / static_cast<double>(height - 1));
    }
    const double sample_y = integral_to(totals, v) / integral_to(totals, 1.0);
    const double sample_x = integral_to(row_at(v), u) / total_at(v);

    const Field& table = fields.at(values);
    const std::size_t plane = table.shape[3] * table.shape[4];
    const auto value = [&](std::size_t slice) {
      return bilinear(table.numbers.data() + (slice * table.shape[2] + channel) * plane,
                      table.shape[3], table.shape[4], sample_x, sample_y);
    };
    const double looked_up = (1.0 - t) * value(k) + t * value(k + 1);
    const auto grid = [&](const char* name, double x, double y) {
      const Field& field = fields.at(name);
      return bilinear(field.numbers.data(), field.shape[0], field.shape[1], x, y);
    };
    return looked_up * grid("ndf", u, v) /
           (4.0 * grid("sigma", std::sqrt(theta_i * 2.0 / kPi), 0.5));
  }

  std::map<std::string, Field> fields;

 private:
  static constexpr double kPi = std::numbers::pi;

  /// Of a piecewise linear function over [0, 1], from 0 to `to`.
  static double integral_to(const std::vector<double>& nodes, double to) {
    const double step = 1.0 / static_cast<double>(nodes.size() - 1);
    double sum = 0.0;
    for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
      const double begin = static_cast<double>(i) * step;
      if (begin >= to) break;
      const double share = std::min((to - begin) / step, 1.0);
      const double end = nodes[i] + share * (nodes[i + 1] - nodes[i]);
      sum += 0.5 * (nodes[i] + end) * share * step;
    }
    return sum;
  }

  static double bilinear(const float* grid, std::size_t height, std::size_t width, double x,
                         double y) {
    const double at_x = std::min(std::max(x, 0.0), 1.0) * static_cast<double>(width - 1);
    const double at_y = std::min(std::max(y, 0.0), 1.0) * static_cast<double>(height - 1);
    const std::size_t i = std::min(static_cast<std::size_t>(at_x), width - 2);
    const std::size_t j = std::min(static_cast<std::size_t>(at_y), height - 2);
    const double s = at_x - static_cast<double>(i);
    const double t = at_y - static_cast<double>(j);
    return (1 - t) * ((1 - s) * grid[j * width + i] + s * grid[j * width + i + 1]) +
           t * ((1 - s) * grid[(j + 1) * width + i] + s * grid[(j + 1) * width + i + 1]);
  }
};

}  // namespace gonio::brdf::testing
