#include <gmock/gmock.h>

#include "gonio/errors/errors.h"
#include "gonio/samples/samples.h"
#include "scratch_folder.h"

namespace gonio::samples {
namespace {

using testing::HasSubstr;

class ReadDirections : public test::ScratchFolder {
 protected:
  std::string fault(std::string_view text) {
    const auto path = written(text);
    return error_of<DataFormatError>([&] { read_directions(path); });
  }
};

TEST_F(ReadDirections, TakesTheFirstThreeColumnsOfAPlan) {
  const auto directions = read_directions(
      written("# plan\ntheta_h_deg,theta_d_deg,phi_d_deg,order,lamp_arm_deg\n3,12,28,0,x\n"
              "2,60,180,1,y\n"));
  ASSERT_EQ(directions.size(), 2u);
  EXPECT_EQ(directions[1].angles.phi_d, Angle::from_degrees(180.0));
  EXPECT_EQ(directions[1].line, 4);
}

TEST_F(ReadDirections, RefusesAListWithoutHeader) {
  EXPECT_THAT(fault("3,12,28\n"),
              HasSubstr("line 1: found '3' as column 1 of the header, expected theta_h_deg"));
  EXPECT_THAT(fault("theta_h_deg,theta_d_deg\n3,12\n"), HasSubstr("expected phi_d_deg"));
}

TEST_F(ReadDirections, RefusesDuplicatesNamingBothLines) {
  EXPECT_THAT(fault("theta_h_deg,theta_d_deg,phi_d_deg\n3,12,28\n1,2,3\n3.0,12,28\n"),
              HasSubstr("line 4: found the direction of line 2 again"));
  EXPECT_THAT(fault("theta_h_deg,theta_d_deg,phi_d_deg\n3,12,180\n3,12,-180\n"),
              HasSubstr("line 3: found the direction of line 2 again"));
}

TEST_F(ReadDirections, RefusesOrKeepsDirectionsBelowTheHorizonAsTold) {
  const std::string text = "theta_h_deg,theta_d_deg,phi_d_deg\n2.84,89,15\n";
  EXPECT_THAT(fault(text), HasSubstr("line 2: found direction (2.84, 89, 15)"));
  EXPECT_EQ(read_directions(written(text), BelowHorizon::Keep).size(), 1u);
}

TEST_F(ReadDirections, RefusesAnEmptyList) {
  EXPECT_THAT(fault("theta_h_deg,theta_d_deg,phi_d_deg\n"), HasSubstr("at least one direction"));
}

}  // namespace
}  // namespace gonio::samples
