#include "gonio/render/lighting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace gonio::render {
namespace {

constexpr int kSoftLights = 160;
constexpr double kGoldenAngle = 2.399963;  // radians, as quoted figures were made with
constexpr double kSolidAngle = 4.0 * std::numbers::pi / kSoftLights;

/// A Fibonacci spiral around the vertical axis.
Eigen::Vector3d soft_direction(int i) {
  const double height = 1.0 - (2.0 * i + 1.0) / kSoftLights;
  const double radius = std::sqrt(1.0 - height * height);
  return {radius * std::cos(kGoldenAngle * i), height, radius * std::sin(kGoldenAngle * i)};
}

std::vector<DirectionalLight> make_lighting_a() {
  std::vector<DirectionalLight> lights;
  for (int i = 0; i < kSoftLights; ++i) {
    const Eigen::Vector3d direction = soft_direction(i);
    lights.push_back({direction, (0.35 + 0.65 * std::max(direction.y(), 0.0)) * kSolidAngle});
  }
  lights.push_back({Eigen::Vector3d(0.5, 0.7, 0.5).normalized(), 3.0});
  lights.push_back({Eigen::Vector3d(-0.7, 0.3, 0.6).normalized(), 1.5});
  lights.push_back({Eigen::Vector3d(0.2, -0.3, 0.9).normalized(), 1.0});
  lights.push_back({Eigen::Vector3d(-0.2, 0.5, -0.8).normalized(), 4.0});
  return lights;
}

std::vector<DirectionalLight> make_lighting_b() {
  constexpr std::array kBright = {20, 78, 93, 96, 125, 155};
  std::vector<DirectionalLight> lights;
  for (int i = 0; i < kSoftLights; ++i) lights.push_back({soft_direction(i), 0.3 * kSolidAngle});
  for (const int i : kBright) lights[static_cast<std::size_t>(i)].irradiance += 2.5;
  return lights;
}

}  // namespace

std::string_view to_string(MetricLighting lighting) {
  return lighting == MetricLighting::a ? "A" : "B";
}

const std::vector<DirectionalLight>& lights_of(MetricLighting lighting) {
  static const std::vector<DirectionalLight> a = make_lighting_a();
  static const std::vector<DirectionalLight> b = make_lighting_b();
  return lighting == MetricLighting::a ? a : b;
}

}  // namespace gonio::render
