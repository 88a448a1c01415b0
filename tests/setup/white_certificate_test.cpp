#include "gonio/setup/white_certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kHeader = "theta_i_deg,theta_o_deg,delta_phi_deg,factor\n";

std::string refusal_of(const std::string& text) {
  const TemporaryFolder folder;
  try {
    read_white_certificate(folder.write("tile.csv", text));
  } catch (const DataFormatError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(WhiteCertificate, IsReadInAnyOrderOfRowsAndColumns) {
  const TemporaryFolder folder;
  const auto path = folder.write("tile.csv",
                                 "# tile 7\n"
                                 "factor,theta_o_deg,theta_i_deg,delta_phi_deg,note\n"
                                 "0.94,45,60,0,\n"
                                 "1.01,10,0,0,\n"
                                 "0.97,10,60,0,\n"
                                 "1.00,45,0,0,reference\n");
  const instrument::AngularTable table = read_white_certificate(path);
  EXPECT_THAT(table.theta_i_deg, ElementsAre(0.0, 60.0));
  EXPECT_THAT(table.theta_o_deg, ElementsAre(10.0, 45.0));
  EXPECT_THAT(table.delta_phi_deg, ElementsAre(0.0));
  EXPECT_THAT(table.factor, ElementsAre(1.01, 1.00, 0.97, 0.94));
}

TEST(WhiteCertificate, SaysInWhichLineWhatIsWrong) {
  const std::string header = kHeader;
  EXPECT_THAT(refusal_of("theta_i_deg,factor\n0,1\n"),
              AllOf(HasSubstr("tile.csv"), HasSubstr("line 1"), HasSubstr("theta_o_deg")));
  EXPECT_THAT(refusal_of(header + "0,0,0,1\n91,0,0,1\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("theta_i_deg")));
  EXPECT_THAT(refusal_of(header + "0,0,-1,1\n"), HasSubstr("delta_phi_deg"));
  EXPECT_THAT(refusal_of(header + "0,0,0,0\n"), HasSubstr("column factor"));
  EXPECT_THAT(refusal_of(header + "0,0,0,nan\n"), HasSubstr("column factor"));
  EXPECT_THAT(refusal_of(header + "0,0,0,1e300\n"), HasSubstr("column factor"));
  EXPECT_THAT(refusal_of(header + "0,0,0,1\n0,0,0,1\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("line 2 again")));
  EXPECT_THAT(refusal_of(header + "0,0,0,1\n-0,0,0,1\n"), HasSubstr("line 2 again"));
  EXPECT_THAT(refusal_of(header + "0,0,0,1\n60,45,0,1\n"),
              HasSubstr("found 2 rows with 2 theta_i, 2 theta_o and 1 delta_phi"));
  EXPECT_THAT(refusal_of(header), HasSubstr("found 0 rows"));
  EXPECT_THAT(refusal_of(""), HasSubstr("tile.csv"));
}

TEST(WhiteCertificate, HasAnEnd) {
  std::string text = kHeader;
  for (int row = 0; row <= 100000; ++row) {
    text += "0,0," + std::to_string(row * 0.001) + ",1\n";
  }
  EXPECT_THAT(refusal_of(text), HasSubstr("line 100002: expected at most 100000 rows"));
}

}  // namespace
}  // namespace gonio::cli
