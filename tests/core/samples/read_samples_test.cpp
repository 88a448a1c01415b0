#include <gmock/gmock.h>

#include "gonio/errors/errors.h"
#include "gonio/samples/samples.h"
#include "scratch_folder.h"

namespace gonio::samples {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class ReadSamples : public test::ScratchFolder {
 protected:
  std::string fault(std::string_view text) {
    const auto path = written(text);
    return error_of<DataFormatError>([&] { read_samples(path); });
  }
};

constexpr const char* kHeader = "theta_h_deg,theta_d_deg,phi_d_deg,r,g,b";

TEST_F(ReadSamples, ReadsTheSixRequiredColumnsInAnyOrder) {
  const SampleSet set = read_samples(written(
      "# radiometric_scale = merl\n# operator: me\nb,r,g,phi_d_deg,theta_h_deg,theta_d_deg\n"
      "0.3,0.1,-0.2,180,2,60\n"));
  ASSERT_EQ(set.samples.size(), 1u);
  const Sample& sample = set.samples[0];
  EXPECT_EQ(sample.direction.theta_h, Angle::from_degrees(2.0));
  EXPECT_EQ(sample.direction.theta_d, Angle::from_degrees(60.0));
  EXPECT_EQ(sample.direction.phi_d, Angle::from_degrees(180.0));
  EXPECT_TRUE((sample.value_per_sr == brdf::Rgb(0.1, -0.2, 0.3)).all());
  EXPECT_TRUE((sample.sigma_per_sr == 0.0).all());
  EXPECT_EQ(sample.pose, -1);
  EXPECT_EQ(set.scale, brdf::RadiometricScale::merl);
  EXPECT_THAT(set.comments, ElementsAre("operator: me"));
  EXPECT_THAT(set.warnings, IsEmpty());
}

TEST_F(ReadSamples, WarnsOfATiltThatCannotBeSharedRightly) {
  const std::string start = std::string("# radiometric_scale=si\n") + kHeader;
  EXPECT_THAT(read_samples(written(start + ",u_tilt_deg,pose,spot\n1,2,3,4,5,6,.1,0,0\n"
                                           "1,3,3,4,5,6,.1,0,1\n"))
                  .warnings,
              ElementsAre(HasSubstr("u_tilt_deg without phi_h_deg")));
  EXPECT_THAT(read_samples(written(start + ",u_tilt_deg,pose,spot,phi_h_deg\n"
                                           "1,2,3,4,5,6,.1,0,0,0\n1,3,3,4,5,6,.1,0,1,90\n"))
                  .warnings,
              IsEmpty());
}

TEST_F(ReadSamples, ReadsAllOptionalColumns) {
  const SampleSet set = read_samples(written(
      std::string("# radiometric_scale=si\n") + kHeader +
      ",sigma_r,sigma_g,sigma_b,u_common_r,u_common_g,u_common_b,u_theta_h_deg,u_theta_d_deg,"
      "u_phi_d_deg,kernel_deg,u_tilt_deg,phi_h_deg,flags,pose\n"
      "1,2,3,4,5,6,.1,.2,.3,.4,.5,.6,.01,.02,.03,.12,.05,-170,dark;clipped,7\n"
      "4,5,6,1,1,1,0,0,0,0,0,0,0,0,0,0,0,0,,\n"));
  ASSERT_EQ(set.samples.size(), 2u);
  const Sample& sample = set.samples[0];
  EXPECT_TRUE((sample.sigma_per_sr == brdf::Rgb(.1, .2, .3)).all());
  EXPECT_TRUE((sample.u_common_per_sr == brdf::Rgb(.4, .5, .6)).all());
  EXPECT_EQ(sample.u_theta_h, Angle::from_degrees(.01));
  EXPECT_EQ(sample.u_theta_d, Angle::from_degrees(.02));
  EXPECT_EQ(sample.u_phi_d, Angle::from_degrees(.03));
  EXPECT_EQ(sample.u_tilt, Angle::from_degrees(.05));
  EXPECT_EQ(sample.direction.phi_h, Angle::from_degrees(-170));
  EXPECT_EQ(sample.kernel, Angle::from_degrees(.12));
  EXPECT_EQ(sample.flags, "dark;clipped");
  EXPECT_EQ(sample.pose, 7);
  EXPECT_EQ(set.samples[1].pose, -1);  // a blank cell: a frame of its own
}

TEST_F(ReadSamples, KeepsUnknownColumnsAsTextWithAWarning) {
  const SampleSet set = read_samples(
      written(std::string("# radiometric_scale = si\nid,") + kHeader + "\n007,1,2,3,4,5,6\n"));
  EXPECT_THAT(set.extra_columns, ElementsAre("id"));
  EXPECT_THAT(set.samples[0].extra, ElementsAre("007"));
  EXPECT_THAT(set.warnings, ElementsAre(HasSubstr("column 'id' is not known")));
}

TEST_F(ReadSamples, WarnsWhenTheScaleIsNotSaid) {
  const SampleSet set = read_samples(written(std::string(kHeader) + "\n1,2,3,4,5,6\n"));
  EXPECT_EQ(set.scale, brdf::RadiometricScale::si);
  EXPECT_THAT(set.warnings, ElementsAre(HasSubstr("taken as si")));
}

TEST_F(ReadSamples, RefusesValuesAndSigmasBeyondAnyMaterial) {
  const std::string header =
      std::string("# radiometric_scale = si\n") + kHeader + ",sigma_r,sigma_g,sigma_b\n1,2,3,";
  EXPECT_THAT(fault(header + "4,5,-2e12,1,1,1\n"), HasSubstr("line 3, column b: found '-2e12'"));
  EXPECT_THAT(fault(header + "4,2e12,6,1,1,1\n"), HasSubstr("line 3, column g: found '2e12'"));
  EXPECT_THAT(fault(header + "4,5,6,1e300,1,1\n"),
              HasSubstr("line 3, column sigma_r: found '1e300', expected 0 to 1e+12"));
}

TEST_F(ReadSamples, RefusesAnUnknownOrContradictoryScale) {
  const std::string rest = std::string(kHeader) + "\n1,2,3,4,5,6\n";
  EXPECT_THAT(fault("# radiometric_scale = furlong\n" + rest),
              HasSubstr("line 1, radiometric_scale: found 'furlong', expected si or merl"));
  EXPECT_THAT(fault("# radiometric_scale = si\n" + rest + "# radiometric_scale = merl\n"),
              HasSubstr("line 4, radiometric_scale: found a second, different scale"));
}

TEST_F(ReadSamples, RefusesMissingColumnsAndHalfGroups) {
  EXPECT_THAT(fault("theta_h_deg,theta_d_deg,phi_d_deg,r,b\n1,2,3,4,5\n"),
              HasSubstr("found no column g in the header"));
  EXPECT_THAT(fault(std::string(kHeader) + ",sigma_r\n1,2,3,4,5,6,7\n"),
              HasSubstr("found no column sigma_g, sigma_b"));
}

TEST_F(ReadSamples, RefusesARowWithoutThreeChannelValues) {
  EXPECT_THAT(fault(std::string(kHeader) + "\n1,2,3,4,5\n"), HasSubstr("found 5 cells"));
  EXPECT_THAT(fault(std::string(kHeader) + "\n1,2,3,4,,6\n"),
              HasSubstr("line 2, column g: found an empty cell, expected a finite number"));
}

TEST_F(ReadSamples, RefusesAFileWithoutSamples) {
  EXPECT_THAT(fault(std::string(kHeader) + "\n"), HasSubstr("expected at least one sample"));
}

TEST_F(ReadSamples, RefusesDirectionsOutOfRangeOrBelowTheHorizon) {
  const std::string head = std::string(kHeader) + "\n";
  EXPECT_THAT(fault(head + "-0.1,2,3,4,5,6\n"),
              HasSubstr("line 2, column theta_h_deg: found '-0.1', expected 0 to 90"));
  EXPECT_THAT(fault(head + "1,90.5,3,4,5,6\n"), HasSubstr("column theta_d_deg"));
  EXPECT_THAT(fault(head + "1,2,181,4,5,6\n"), HasSubstr("column phi_d_deg"));
  EXPECT_THAT(fault(head + "1,2,3,4,5,6\n2.84,89,15,4,5,6\n"),
              HasSubstr("line 3: found direction (2.84, 89, 15) with light or detector below"));
}

TEST_F(ReadSamples, RefusesNegativeUncertainties) {
  EXPECT_THAT(fault(std::string(kHeader) + ",sigma_r,sigma_g,sigma_b\n1,2,3,4,5,6,.1,-.1,.1\n"),
              HasSubstr("line 2, column sigma_g: found '-.1', expected 0 to 1e+12"));
  EXPECT_THAT(fault(std::string(kHeader) + ",kernel_deg\n1,2,3,4,5,6,-1\n"),
              HasSubstr("column kernel_deg"));
  EXPECT_THAT(fault(std::string(kHeader) + ",pose\n1,2,3,4,5,6,1.5\n"),
              HasSubstr("column pose: found '1.5', expected a whole number"));
}

}  // namespace
}  // namespace gonio::samples
