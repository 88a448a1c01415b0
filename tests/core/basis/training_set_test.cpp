#include "gonio/basis/training_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "gonio/brdf/merl_file.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using brdf::IndexConvention;
using brdf::RadiometricScale;
using ::testing::HasSubstr;
namespace lattice = brdf::lattice;

/// Rows are float32 numbers of size 10 made by a few float32 operations.
constexpr double kFloatRounding = 3e-6;

const brdf::BrdfTable& table_of_first_material() {
  static const brdf::BrdfTable table = brdf::tabulate(test::material(0), RadiometricScale::si);
  return table;
}

template <typename Call>
std::string message_of(Call call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no exception";
}

TEST(TrainingSet, HoldsTheMappedValueOfEveryCell) {
  const TrainingSet& set = test::training_set();
  const test::Lobe model = test::material(2);
  ASSERT_EQ(set.cells().size(), 1096216u);
  for (std::size_t i = 0; i < set.cells().size(); i += 997) {
    const brdf::HalfDiff at = lattice::angles_of(lattice::index_from_cell(set.cells()[i]));
    const brdf::Rgb f = model.evaluate(brdf::shading_geometry(at));
    const double w = set.mapping().weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d));
    for (int channel = 0; channel < 3; ++channel) {
      ASSERT_NEAR(set.row(2, channel)[i], std::log(f[channel] * w + 1e-3), kFloatRounding)
          << "cell " << set.cells()[i];
    }
  }
}

TEST(TrainingSet, TakesTheSameRowsFromATableAsFromItsModel) {
  TrainingSet set(RadiometricScale::si);
  set.add({"from table", "", ""}, table_of_first_material());
  for (int channel = 0; channel < 3; ++channel) {
    const auto from_model = test::training_set().row(0, channel);
    const auto from_table = set.row(0, channel);
    for (std::size_t i = 0; i < from_table.size(); ++i) {
      ASSERT_NEAR(from_table[i], from_model[i], kFloatRounding) << "cell " << set.cells()[i];
    }
  }
}

TEST(TrainingSet, MapsValuesOfAllMagnitudes) {
  brdf::BrdfTable table = table_of_first_material();
  const auto& cells = test::training_set().cells();
  std::vector<double> values = {0.0, 1e-30, 1e-9, 1e-4, 0.0123, 1.0, 98.7, 1e5, 1e9, 1e30};
  for (std::size_t i = 0; i < values.size(); ++i) {
    table.set_value(cells[i], brdf::Rgb::Constant(values[i]));
  }
  const Eigen::MatrixXf mapped = mapped_values(LogMapping{}, table);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const brdf::HalfDiff at = lattice::angles_of(lattice::index_from_cell(cells[i]));
    const double w = LogMapping{}.weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d));
    const double expected = std::log(values[i] * w + 1e-3);
    EXPECT_NEAR(mapped(static_cast<Eigen::Index>(i), 1), expected,
                3e-7 * std::max(1.0, std::abs(expected)));
  }
}

TEST(TrainingSet, FillsMissingCellsWithTheMeanOfTheOthersInEitherOrder) {
  const auto& cells = test::training_set().cells();
  const std::size_t gap = 500000;
  brdf::BrdfTable with_gap = table_of_first_material();
  with_gap.set_invalid(cells[gap]);
  const float b = test::training_set().row(1, 2)[gap];
  const float c = test::training_set().row(2, 2)[gap];

  TrainingSet first(RadiometricScale::si);
  first.add({"gap", "", ""}, with_gap);
  EXPECT_NEAR(first.row(0, 2)[gap], std::log(1e-3), kFloatRounding);
  first.add({"b", "", ""}, test::material(1));
  first.add({"c", "", ""}, test::material(2));
  EXPECT_NEAR(first.row(0, 2)[gap], (b + c) / 2, kFloatRounding);

  TrainingSet last(RadiometricScale::si);
  last.add({"b", "", ""}, test::material(1));
  last.add({"c", "", ""}, test::material(2));
  last.add({"gap", "", ""}, with_gap);
  EXPECT_NEAR(last.row(2, 2)[gap], (b + c) / 2, kFloatRounding);
  EXPECT_EQ(last.row(2, 2)[gap + 1], first.row(0, 2)[gap + 1]);
}

TEST(TrainingSet, MappedValuesOfMissingCellsAreNaN) {
  brdf::BrdfTable with_gap = table_of_first_material();
  with_gap.set_invalid(test::training_set().cells()[7]);
  const Eigen::MatrixXf mapped = mapped_values(LogMapping{}, with_gap);
  EXPECT_TRUE(mapped.row(7).array().isNaN().all());
  EXPECT_TRUE(mapped.row(8).allFinite());
}

TEST(TrainingSet, RefusesAMaterialWithMoreThanAFifthMissingAndStaysAsItWas) {
  const auto& cells = test::training_set().cells();
  brdf::BrdfTable table = table_of_first_material();
  for (std::size_t i = 0; i <= cells.size() / 5; ++i) table.set_invalid(cells[i]);
  TrainingSet set(RadiometricScale::si);
  EXPECT_THAT(message_of([&] { set.add({"holes", "", ""}, table); }), HasSubstr("at most a fifth"));
  EXPECT_EQ(set.material_count(), 0u);
}

TEST(TrainingSet, RefusesAMaterialThatIsBlackThroughout) {
  brdf::BrdfTable table = table_of_first_material();
  for (const std::uint32_t cell : test::training_set().cells()) {
    table.set_value(cell, brdf::Rgb::Zero());
  }
  TrainingSet set(RadiometricScale::si);
  EXPECT_THAT(message_of([&] {
                set.add({"black", "", ""}, table);
              }),
              HasSubstr("no cell above the horizon has a value above 0"));
}

TEST(TrainingSet, RefusesWhatDoesNotBelongToIt) {
  TrainingSet set(RadiometricScale::si);
  set.add({"a", "", ""}, test::material(0));
  EXPECT_THAT(message_of([&] {
                set.add({"a", "", ""}, test::material(1));
              }),
              HasSubstr("a is already in the set"));
  EXPECT_THAT(message_of([&] {
                set.add({"", "", ""}, test::material(1));
              }),
              HasSubstr("without a name"));
  const brdf::BrdfTable merl(IndexConvention::bin_centre, RadiometricScale::merl);
  EXPECT_THAT(message_of([&] {
                set.add({"b", "", ""}, merl);
              }),
              HasSubstr("radiometric scale merl, expected si"));
  const brdf::BrdfTable left(IndexConvention::left_edge, RadiometricScale::si);
  EXPECT_THAT(message_of([&] {
                set.add({"b", "", ""}, left);
              }),
              HasSubstr("left_edge, expected bin_centre"));
  EXPECT_EQ(set.material_count(), 1u);
}

TEST(TrainingSet, BringsFilesOfAnotherScaleToItsOwnWhenToldHow) {
  const TemporaryFolder folder;
  brdf::write_merl(folder / "si.binary", table_of_first_material());
  brdf::write_merl(
      folder / "merl.binary",
      brdf::BrdfTable(table_of_first_material()).rescaled(0.5, RadiometricScale::merl));
  TrainingSet set(RadiometricScale::si);
  EXPECT_THAT(message_of([&] {
                set.add_files(std::vector<MaterialFile>{{folder / "merl.binary", ""}});
              }),
              HasSubstr("radiometric scale merl, expected si"));
  set.add_files(std::vector<MaterialFile>{{folder / "merl.binary", "", 2.0},
                                          {folder / "si.binary", "", 2.0}});
  EXPECT_EQ(set.materials()[0].source, "merl") << "the format's name when nothing else is said";
  EXPECT_EQ(set.materials()[0].scale_factor, 2.0);
  EXPECT_EQ(set.materials()[1].scale_factor, 1.0) << "it has the set's scale already";
  for (std::size_t i = 0; i < set.cells().size(); i += 1009) {
    ASSERT_NEAR(set.row(0, 1)[i], set.row(1, 1)[i], kFloatRounding) << "cell " << set.cells()[i];
  }
}

TEST(TrainingSet, RefusesValuesThatAreNotFinite) {
  std::vector<double> stored = table_of_first_material().stored_planes();
  stored[test::training_set().cells()[12345]] = std::numeric_limits<double>::quiet_NaN();
  const brdf::BrdfTable table(std::move(stored), IndexConvention::bin_centre, RadiometricScale::si);
  TrainingSet set(RadiometricScale::si);
  EXPECT_THROW(set.add({"nan", "", ""}, table), std::invalid_argument);
}

TEST(TrainingSet, RefusesAMappingWithoutEpsilonOrFloor) {
  EXPECT_THROW(TrainingSet(RadiometricScale::si, LogMapping{0.0, 0.01}), std::invalid_argument);
  EXPECT_THROW(TrainingSet(RadiometricScale::si, LogMapping{1e-3, 0.0}), std::invalid_argument);
}

TEST(TrainingSet, ReadsFilesLikeTables) {
  const TemporaryFolder folder;
  std::vector<MaterialFile> files;
  for (int i = 0; i < 2; ++i) {
    files.push_back({folder / ("material-" + std::to_string(i) + ".binary"), "family"});
    brdf::write_merl(files.back().path, brdf::tabulate(test::material(i), RadiometricScale::si));
  }
  TrainingSet set(RadiometricScale::si);
  set.add_files(files);
  ASSERT_EQ(set.material_count(), 2u);
  EXPECT_EQ(set.materials()[1].name, "material-1");
  EXPECT_EQ(set.materials()[1].family, "family");
  EXPECT_EQ(set.materials()[1].sha256.size(), 64u);
  EXPECT_NE(set.materials()[0].sha256, set.materials()[1].sha256);
  EXPECT_NEAR(set.row(1, 1)[4321], test::training_set().row(1, 1)[4321], kFloatRounding);
}

TEST(TrainingSet, NamesTheFileThatDoesNotBelongAndAddsNone) {
  const TemporaryFolder folder;
  const std::vector<MaterialFile> files = {{folder / "a.binary", ""}, {folder / "b.binary", ""}};
  brdf::write_merl(files[0].path, brdf::tabulate(test::material(0), RadiometricScale::si));
  brdf::write_merl(files[1].path, brdf::tabulate(test::material(1), RadiometricScale::merl));
  TrainingSet set(RadiometricScale::si);
  EXPECT_THAT(message_of([&] { set.add_files(files); }),
              ::testing::AllOf(HasSubstr("b.binary"), HasSubstr("radiometric scale merl")));
  EXPECT_EQ(set.material_count(), 0u);

  const std::vector<MaterialFile> twice = {files[0], files[0]};
  EXPECT_THAT(message_of([&] { set.add_files(twice); }), HasSubstr("given twice"));

  set.add_files(std::vector<MaterialFile>{files[0]});
  try {
    set.add_files(std::vector<MaterialFile>{files[0]});
    FAIL() << "a name was taken twice";
  } catch (const DataFormatError& error) {
    EXPECT_THAT(error.what(),
                ::testing::AllOf(HasSubstr("a.binary"), HasSubstr("already in the set")));
  }
}

}  // namespace
}  // namespace gonio::basis
