#include "gonio/basis/basis_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "gonio/errors/errors.h"
#include "temporary_folder.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using test::refusal;
using test::small_basis;
using ::testing::HasSubstr;

TEST(BasisFile, ReturnsWhatWasWritten) {
  const TemporaryFolder folder;
  Basis written = small_basis();
  written.materials[1].scale_factor = 2.75;
  written.materials[1].source = "rgl";
  written.materials[1].group = "felt";
  write_basis(folder / "a.h5", written);
  const Basis read = read_basis(folder / "a.h5");
  EXPECT_EQ(read.components, written.components);
  EXPECT_EQ(read.mean, written.mean);
  EXPECT_EQ(read.singular_values, written.singular_values);
  EXPECT_EQ(read.left_vectors, written.left_vectors);
  EXPECT_EQ(read.mapping, written.mapping);
  EXPECT_EQ(read.scale, written.scale);
  ASSERT_EQ(read.materials.size(), 3u);
  EXPECT_EQ(read.materials[0].scale_factor, 1.0);
  EXPECT_EQ(read.materials[1].scale_factor, 2.75);
  EXPECT_EQ(read.materials[0].source, "");
  EXPECT_EQ(read.materials[1].source, "rgl");
  EXPECT_EQ(read.materials[0].group, "");
  EXPECT_EQ(read.materials[1].group, "felt");
  EXPECT_EQ(read.materials[2].name, "lobe-3");
  EXPECT_EQ(read.materials[2].family, "odd");
  EXPECT_EQ(read.materials[2].sha256, written.materials[2].sha256);
  EXPECT_EQ(read.materials[2].sha256.size(), 64u);
}

TEST(BasisFile, HasTheSameBytesEveryTime) {
  const TemporaryFolder folder;
  write_basis(folder / "a.h5", small_basis());
  write_basis(folder / "b.h5", read_basis(folder / "a.h5"));
  EXPECT_TRUE(read_bytes(folder / "a.h5") == read_bytes(folder / "b.h5"));
}

TEST(BasisFile, IsNotReplacedUnlessAskedFor) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.h5") << "precious";
  EXPECT_THROW(write_basis(folder / "a.h5", small_basis()), FileError);
  EXPECT_EQ(read_bytes(folder / "a.h5"), "precious");
  write_basis(folder / "a.h5", small_basis(), files::Overwrite::Yes);
  EXPECT_EQ(refusal(folder / "a.h5"), "accepted");
  const auto entries = std::distance(std::filesystem::directory_iterator(folder.path()),
                                     std::filesystem::directory_iterator());
  EXPECT_EQ(entries, 1) << "a temporary file was left";
}

TEST(BasisFile, IsNotWrittenFromPartsThatDoNotFit) {
  const TemporaryFolder folder;
  Basis basis = small_basis();
  basis.materials.pop_back();
  EXPECT_THROW(write_basis(folder / "a.h5", basis), std::invalid_argument);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.h5"));
}

TEST(BasisFile, CannotBeReadWhenItIsNotThere) {
  const TemporaryFolder folder;
  EXPECT_THROW(read_basis(folder / "none.h5"), FileError);
  EXPECT_THROW(read_basis(folder.path()), FileError);
}

TEST(BasisFile, ThatIsNotHdf5OrEndsEarlyIsRefused) {
  const TemporaryFolder folder;
  std::ofstream(folder / "text.h5") << "theta_h_deg,theta_d_deg";
  EXPECT_THAT(refusal(folder / "text.h5"), HasSubstr("not a readable HDF5 file"));
  std::ofstream(folder / "empty.h5").close();
  EXPECT_THAT(refusal(folder / "empty.h5"), HasSubstr("not a readable HDF5 file"));

  write_basis(folder / "whole.h5", small_basis());
  const auto size = std::filesystem::file_size(folder / "whole.h5");
  for (const auto part : {size / 2, size - 1, std::uintmax_t{5000}, std::uintmax_t{600}}) {
    std::filesystem::copy_file(folder / "whole.h5", folder / "part.h5",
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(folder / "part.h5", part);
    EXPECT_THAT(refusal(folder / "part.h5"), HasSubstr("part.h5: ")) << part << " bytes";
  }
}

}  // namespace
}  // namespace gonio::basis
