#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/parallel/parallel.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr int kAll = 100;  // more components than there are
using test::kGramTolerance;

TrainingSet lobes(const std::vector<int>& numbers) {
  TrainingSet set(brdf::RadiometricScale::si);
  for (const int i : numbers) {
    set.add({"lobe-" + std::to_string(i), i % 2 == 0 ? "even" : "odd", ""}, test::material(i));
  }
  return set;
}

Basis of_first_four(int component_count) {
  return train(test::training_set(), test::training_gram(), std::vector<std::size_t>{0, 1, 2, 3},
               component_count);
}

/// Norm of what mean + Q u leaves of the rows of the whole test set.
double norm_left_over(const Basis& basis) {
  double square = 0.0;
  for (Eigen::Index t = 0; t < 3 * test::kMaterials; ++t) {
    const auto row =
        test::training_set().row(static_cast<std::size_t>(t / 3), static_cast<int>(t % 3));
    const Eigen::VectorXf fitted =
        basis.mean + basis.components * basis.left_vectors.row(t).transpose().cast<float>();
    square += static_cast<double>(
        (Eigen::Map<const Eigen::VectorXf>(row.data(), fitted.size()) - fitted).squaredNorm());
  }
  return std::sqrt(square);
}

bool descending(const Eigen::VectorXd& values) {
  return std::is_sorted(values.begin(), values.end(), std::greater<>());
}

TEST(Append, ToAWholeBasisEqualsTrainingOnAllMaterials) {
  const Basis joined = append(of_first_four(kAll), lobes({4, 5}), kAll);
  const Basis& direct = test::full_basis();

  ASSERT_EQ(joined.materials.size(), direct.materials.size());
  for (std::size_t i = 0; i < direct.materials.size(); ++i) {
    EXPECT_EQ(joined.materials[i].name, direct.materials[i].name);
    EXPECT_EQ(joined.materials[i].family, direct.materials[i].family);
    EXPECT_EQ(joined.materials[i].sha256, direct.materials[i].sha256);
  }
  EXPECT_EQ(joined.mapping, direct.mapping);
  EXPECT_EQ(joined.scale, direct.scale);
  ASSERT_EQ(joined.singular_values.size(), direct.singular_values.size());
  const Eigen::ArrayXd squares = direct.singular_values.array().square();
  EXPECT_LT((joined.singular_values.array().square() - squares).abs().maxCoeff(),
            kGramTolerance * squares[0]);
  EXPECT_LT((joined.mean - direct.mean).cwiseAbs().maxCoeff(), 2e-6);
  for (Eigen::Index j = 0; j < 5; ++j) {  // beyond, components are close to each other in size
    EXPECT_LT((joined.components.col(j) - direct.components.col(j)).norm(),
              1e-3 * static_cast<float>(direct.singular_values[j]))
        << "component " << j;
    EXPECT_LT((joined.left_vectors.col(j) - direct.left_vectors.col(j)).norm(), 1e-3)
        << "component " << j;
  }
  EXPECT_LT(norm_left_over(joined), 1e-3 * direct.singular_values[0]);
}

TEST(Append, GivesOrthogonalComponentsAndOrthonormalCentredLeftVectors) {
  const Basis joined = append(of_first_four(6), lobes({4, 5}), 6);
  const Eigen::MatrixXd q = joined.components.cast<double>();
  const Eigen::VectorXd squares = joined.singular_values.head(6).array().square();
  EXPECT_LT((q.transpose() * q - Eigen::MatrixXd(squares.asDiagonal())).norm(),
            kGramTolerance * squares[0]);
  const Eigen::MatrixXd& u = joined.left_vectors;
  EXPECT_LT((u.transpose() * u - Eigen::MatrixXd::Identity(6, 6)).norm(), 1e-9);
  EXPECT_LT(u.colwise().sum().cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Append, ToACutBasisComesNearWhatTrainingOnAllWithAsManyComponentsLeaves) {
  constexpr int kKept = 6;
  const Basis joined = append(of_first_four(kKept), lobes({4, 5}), kKept);
  const Basis direct = train(test::training_set(), test::training_gram(), kKept);
  ASSERT_EQ(joined.component_count(), kKept);
  ASSERT_EQ(joined.singular_values.size(), direct.singular_values.size());
  EXPECT_TRUE(descending(joined.singular_values));
  EXPECT_LT((joined.mean - direct.mean).cwiseAbs().maxCoeff(), 2e-6) << "the mean loses nothing";
  // The best of all choices leaves the least; the detour may cost what was cut off twice.
  const double best = norm_left_over(direct);
  EXPECT_GE(norm_left_over(joined), best * (1.0 - 1e-6));
  EXPECT_LT(norm_left_over(joined), 1.2 * best);
  // What was left out is kept count of: the energy of all rows is the same.
  EXPECT_NEAR(joined.singular_values.squaredNorm(), direct.singular_values.squaredNorm(),
              1e-6 * direct.singular_values.squaredNorm());
}

TEST(Append, KeepsNoComponentWeakerThanWhatHadBeenLeftOut) {
  const Basis cut = of_first_four(3);
  const Basis joined = append(cut, lobes({4, 5}), kAll);
  EXPECT_LT(joined.component_count(), 3 + 6);
  EXPECT_GE(joined.component_count(), 3);
  EXPECT_GT(joined.singular_values[joined.component_count() - 1], cut.singular_values[3]);
  EXPECT_TRUE(descending(joined.singular_values));
}

TEST(Append, TakesTheOldMeanWhereANewMaterialHasNoValue) {
  const Basis old = of_first_four(kAll);
  brdf::BrdfTable table = brdf::tabulate(test::material(4), brdf::RadiometricScale::si);
  std::vector<double> stored = table.stored_planes();
  const std::size_t hole = 700000;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    stored[channel * brdf::lattice::kCells + test::training_set().cells()[hole]] = -1.0;
  }
  TrainingSet holed(brdf::RadiometricScale::si);
  holed.add({"holed", "", ""},
            brdf::BrdfTable(std::move(stored), brdf::IndexConvention::bin_centre, table.scale()));
  const Basis joined = append(old, holed, kAll);
  // A single cell lies below the rank tolerance; black would be 2.2 away.
  constexpr float kOfOneCell = 0.05f;
  const Eigen::Index at = static_cast<Eigen::Index>(hole);
  EXPECT_NEAR(joined.mean[at], old.mean[at], 1e-5);
  for (Eigen::Index t = 12; t < 15; ++t) {
    const float fitted =
        joined.mean[at] +
        joined.components.row(at).dot(joined.left_vectors.row(t).transpose().cast<float>());
    EXPECT_NEAR(fitted, old.mean[at], kOfOneCell) << "row " << t;
  }
}

TEST(Append, GivesTheSameBytesWithOneAndTwoThreads) {
  const Basis old = of_first_four(6);
  const TrainingSet added = lobes({4});
  parallel::set_thread_count(1);
  const Basis one = append(old, added, 6);
  parallel::set_thread_count(2);
  const Basis two = append(old, added, 6);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.singular_values, two.singular_values);
  EXPECT_EQ(one.mean, two.mean);
  EXPECT_EQ(one.components, two.components);
  EXPECT_EQ(one.left_vectors, two.left_vectors);
}

TEST(Append, RefusesWhatDoesNotBelongToTheBasis) {
  const Basis old = of_first_four(3);
  const auto refusal = [&](const TrainingSet& added, int count, const char* words) {
    EXPECT_THAT([&] { append(old, added, count); },
                ThrowsMessage<std::invalid_argument>(HasSubstr(words)));
  };
  refusal(lobes({4, 2}), 3, "lobe-2 is already in the basis");
  refusal(lobes({4}), 0, "fewer than 1 component");
  refusal(lobes({}), 3, "no material");
  TrainingSet other_scale(brdf::RadiometricScale::merl);
  other_scale.add({"a", "", ""}, test::material(4));
  refusal(other_scale, 3, "scale merl, the basis has si");
  TrainingSet other_mapping(brdf::RadiometricScale::si, LogMapping{1e-2, 0.01});
  other_mapping.add({"a", "", ""}, test::material(4));
  refusal(other_mapping, 3, "mapping");
}

}  // namespace
}  // namespace gonio::basis
