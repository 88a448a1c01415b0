#include "gonio/brdf/builtin_materials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>
#include <stdexcept>

#include "albedo_quadrature.h"

namespace gonio::brdf {
namespace {

using literals::operator""_deg;
using testing::directional_albedo;
using testing::kQuadrature;

/// Pairs spread over all that a gonioreflectometer sees, fixed.
std::vector<DirectionPair> probes(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> cosine(0.05, 1.0);
  std::uniform_real_distribution<double> degrees(-180.0, 180.0);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<DirectionPair> pairs;
  while (static_cast<int>(pairs.size()) < count) {
    const Eigen::Vector3d wi = direction(Angle::from_radians(std::acos(cosine(random))), Angle());
    // Half of them near the mirror direction, where materials differ most.
    const double spread = pairs.size() % 2 == 0 ? 90.0 : 25.0;
    const double u = unit(random);
    const Eigen::Vector3d half =
        direction(Angle::from_degrees(spread * u * u), Angle::from_degrees(degrees(random)));
    const Eigen::Vector3d wo = (2.0 * wi.dot(half) * half - wi).normalized();
    if (wi.dot(half) > 0.0 && wo.z() > 0.05) pairs.push_back({wi, wo});
  }
  return pairs;
}

/// ln(f cos cos + 0.001) at every probe and channel: what a basis sees of a material.
Eigen::ArrayXd log_signature(const BuiltinMaterial& material,
                             const std::vector<DirectionPair>& pairs) {
  Eigen::ArrayXd signature(3 * static_cast<Eigen::Index>(pairs.size()));
  Eigen::Index at = 0;
  for (const DirectionPair& pair : pairs) {
    const double w = pair.wi.z() * pair.wo.z();
    signature.segment<3>(at) = (material.model->evaluate(pair) * w + 1e-3).log();
    at += 3;
  }
  return signature;
}

TEST(BuiltinMaterials, AreAboutAHundredInAtLeastSixFamilies) {
  EXPECT_GE(builtin_materials().size(), 100u);
  std::map<std::string, int> members;
  for (const BuiltinMaterial& material : builtin_materials()) ++members[material.family];
  for (const char* family : {"paint", "plastic", "metal", "fabric", "wood", "metallic-paint"}) {
    EXPECT_GE(members[family], 8) << family;
  }
  for (const auto& [family, count] : members) EXPECT_GE(count, 5) << family;
}

TEST(BuiltinMaterials, ListEachFamilyOnce) {
  std::set<std::string> seen;
  for (const BuiltinMaterial& material : builtin_materials()) seen.insert(material.family);
  const std::vector<std::string> listed = families();
  EXPECT_EQ(listed.size(), seen.size());
  EXPECT_EQ(std::set<std::string>(listed.begin(), listed.end()), seen);
}

TEST(BuiltinMaterials, HaveUniquePlainNamesADescriptionAndASource) {
  std::set<std::string> names;
  for (const BuiltinMaterial& material : builtin_materials()) {
    EXPECT_TRUE(names.insert(material.name).second) << material.name;
    EXPECT_EQ(material.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz-"), std::string::npos)
        << material.name;
    EXPECT_FALSE(material.description.empty()) << material.name;
    // Every source names a publication with its year.
    EXPECT_THAT(material.source, ::testing::ContainsRegex("[(, ](19|20)[0-9][0-9]"))
        << material.name;
    EXPECT_EQ(material.description.find('\n'), std::string::npos);
  }
}

TEST(BuiltinMaterials, ReflectNoMoreThanTheyReceive) {
  for (const BuiltinMaterial& material : builtin_materials()) {
    for (const double theta_i : {0.0, 30.0, 60.0, 80.0, 87.0}) {
      const Rgb albedo = directional_albedo(*material.model, Angle::from_degrees(theta_i));
      EXPECT_LE(albedo.maxCoeff(), 1.0 + kQuadrature) << material.name << " at " << theta_i;
    }
  }
}

TEST(BuiltinMaterials, ReflectSomethingInEveryChannel) {
  for (const BuiltinMaterial& material : builtin_materials()) {
    const Rgb albedo = directional_albedo(*material.model, 45.0_deg);
    EXPECT_GE(albedo.minCoeff(), 0.005) << material.name;
  }
}

TEST(BuiltinMaterials, AreReciprocalFiniteAndPositive) {
  const std::vector<DirectionPair> pairs = probes(200, 11);
  for (const BuiltinMaterial& material : builtin_materials()) {
    for (const DirectionPair& pair : pairs) {
      const Rgb there = material.model->evaluate(pair);
      const Rgb back = material.model->evaluate(DirectionPair{pair.wo, pair.wi});
      ASSERT_TRUE(there.isFinite().all()) << material.name;
      ASSERT_GT(there.minCoeff(), 0.0) << material.name;
      ASSERT_LT(((there - back).abs() / there).maxCoeff(), 1e-9) << material.name;
    }
  }
}

TEST(BuiltinMaterials, AreNotCopiesOfOneAnother) {
  constexpr double kDistinct = 0.08;  // 8 % on average is plain to see; 3 % is a sample's noise
  const std::vector<DirectionPair> pairs = probes(400, 12);
  const auto& all = builtin_materials();
  std::vector<Eigen::ArrayXd> signatures;
  for (const BuiltinMaterial& material : all) {
    signatures.push_back(log_signature(material, pairs));
    for (std::size_t j = 0; j + 1 < signatures.size(); ++j) {
      const double distance = std::sqrt((signatures.back() - signatures[j]).square().mean());
      EXPECT_GT(distance, kDistinct) << material.name << " and " << all[j].name;
    }
  }
}

TEST(BuiltinMaterials, HaveThreeDifferentChannels) {
  const std::vector<DirectionPair> pairs = probes(100, 13);
  for (const BuiltinMaterial& material : builtin_materials()) {
    Rgb apart = Rgb::Zero();
    for (const DirectionPair& pair : pairs) {
      const Rgb f = material.model->evaluate(pair);
      apart += Rgb(std::abs(f[0] - f[1]), std::abs(f[1] - f[2]), std::abs(f[2] - f[0])) / f.sum();
    }
    EXPECT_GT(apart.minCoeff(), 0.0) << material.name;
  }
}

TEST(BuiltinMaterials, SpreadFromBlackToWhiteAndFromMatteToMirror) {
  double darkest = 1.0;
  double brightest = 0.0;
  double flattest = 1e9;
  double sharpest = 0.0;
  const Eigen::Vector3d wi = direction(45.0_deg, 0.0_deg);
  for (const BuiltinMaterial& material : builtin_materials()) {
    const double albedo = directional_albedo(*material.model, 0.0_deg)[1];
    darkest = std::min(darkest, albedo);
    brightest = std::max(brightest, albedo);
    const double mirror =
        material.model->evaluate(DirectionPair{wi, direction(45.0_deg, 180.0_deg)})[1];
    const double aside =
        material.model->evaluate(DirectionPair{wi, direction(0.0_deg, 0.0_deg)})[1];
    flattest = std::min(flattest, mirror / aside);
    sharpest = std::max(sharpest, mirror / aside);
  }
  EXPECT_LT(darkest, 0.02);
  EXPECT_GT(brightest, 0.9);
  EXPECT_LT(flattest, 1.2);
  EXPECT_GT(sharpest, 1e4);
}

TEST(BuiltinMaterials, LookLikeTheirNames) {
  const auto albedo = [](const char* name) {
    return directional_albedo(*builtin_material(name).model, 20.0_deg);
  };
  // Normal reflectance of the metals at 630/532/465 nm from the cited tables, for nearly all of
  // the surface: gold 0.94/0.70/0.40, copper 0.91/0.61/0.55, silver 0.99/0.98/0.98.
  EXPECT_NEAR(albedo("gold-polished")[0], 0.91, 0.05);
  EXPECT_NEAR(albedo("gold-polished")[2], 0.39, 0.05);
  EXPECT_NEAR(albedo("copper-polished")[1], 0.59, 0.05);
  EXPECT_GT(albedo("silver-polished").minCoeff(), 0.9);
  EXPECT_GT(albedo("white-ptfe").minCoeff(), 0.8);
  EXPECT_LT(albedo("black-velvet").maxCoeff(), 0.03);
  const Rgb red = albedo("signal-red-enamel");
  EXPECT_GT(red[0], 4.0 * red[1]);
  const Rgb blue = albedo("blue-denim");
  EXPECT_GT(blue[2], blue[1]);
  EXPECT_GT(blue[1], blue[0]);
}

TEST(BuiltinMaterials, AreFoundByName) {
  for (const BuiltinMaterial& material : builtin_materials()) {
    EXPECT_EQ(&builtin_material(material.name), &material);
  }
}

TEST(BuiltinMaterials, SuggestTheNearestNameForATypingSlip) {
  EXPECT_THAT(
      [] { builtin_material("gold-polihsed"); },
      ::testing::ThrowsMessage<std::invalid_argument>(::testing::AllOf(
          ::testing::HasSubstr("gold-polihsed"), ::testing::HasSubstr("\"gold-polished\""))));
}

}  // namespace
}  // namespace gonio::brdf
