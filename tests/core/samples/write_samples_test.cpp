#include <gmock/gmock.h>

#include <limits>
#include <random>

#include "directions_deg.h"
#include "gonio/errors/errors.h"
#include "gonio/samples/samples.h"
#include "scratch_folder.h"

namespace gonio::samples {
namespace {

using testing::HasSubstr;

class WriteSamples : public test::ScratchFolder {};

SampleSet one_sample() {
  SampleSet set;
  Sample sample;
  sample.direction = half_diff_deg(3.0, 12.0, 28.0);
  sample.value_per_sr = brdf::Rgb(0.1, 0.2, 0.3);
  set.samples = {sample};
  return set;
}

SampleSet random_samples() {
  std::mt19937_64 generator(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  SampleSet set;
  set.scale = brdf::RadiometricScale::merl;
  set.extra_columns = {"remark, free", "id"};
  set.comments = {"sample: red paint, batch 3"};
  for (int i = 0; i < 500; ++i) {
    Sample s;
    s.direction.theta_h = Angle::from_degrees(44.0 * unit(generator));
    s.direction.theta_d = Angle::from_degrees(44.0 * unit(generator));
    s.direction.phi_d = Angle::from_degrees(360.0 * unit(generator) - 180.0);
    for (Eigen::Index c = 0; c < 3; ++c) {
      s.value_per_sr[c] = std::exp(20.0 * unit(generator) - 15.0);
      s.sigma_per_sr[c] = unit(generator);
      s.u_common_per_sr[c] = unit(generator);
    }
    s.value_per_sr[1] = -s.value_per_sr[1];
    s.u_theta_h = Angle::from_degrees(unit(generator));
    s.u_theta_d = Angle::from_degrees(unit(generator));
    s.u_phi_d = Angle::from_degrees(unit(generator));
    s.u_tilt = Angle::from_degrees(unit(generator));
    s.direction.phi_h = Angle::from_degrees(360.0 * unit(generator) - 180.0);
    s.kernel = Angle::from_degrees(unit(generator));
    s.pose = i / 9;
    s.spot = i % 9;
    s.flags = i % 3 == 0 ? "saturated;clipped" : "";
    s.extra = {"say \"" + std::to_string(i) + "\", twice", std::to_string(i)};
    set.samples.push_back(s);
  }
  return set;
}

TEST_F(WriteSamples, LeavesOutColumnsThatSayNothing) {
  write_samples(file("out.csv"), one_sample());
  EXPECT_EQ(read_bytes(file("out.csv")),
            "# radiometric_scale = si\ntheta_h_deg,theta_d_deg,phi_d_deg,r,g,b\n"
            "3,12,28,0.1,0.2,0.3\n");
}

TEST_F(WriteSamples, ReadsBackToTheLastBit) {
  const SampleSet set = random_samples();
  write_samples(file("out.csv"), set);
  const SampleSet back = read_samples(file("out.csv"));
  EXPECT_EQ(back.scale, set.scale);
  EXPECT_EQ(back.extra_columns, set.extra_columns);
  EXPECT_EQ(back.comments, set.comments);
  ASSERT_EQ(back.samples.size(), set.samples.size());
  for (std::size_t i = 0; i < set.samples.size(); ++i) {
    const Sample& a = set.samples[i];
    const Sample& b = back.samples[i];
    EXPECT_EQ(a.direction.theta_h, b.direction.theta_h);
    EXPECT_EQ(a.direction.theta_d, b.direction.theta_d);
    EXPECT_EQ(a.direction.phi_d, b.direction.phi_d);
    EXPECT_TRUE((a.value_per_sr == b.value_per_sr).all());
    EXPECT_TRUE((a.sigma_per_sr == b.sigma_per_sr).all());
    EXPECT_TRUE((a.u_common_per_sr == b.u_common_per_sr).all());
    EXPECT_EQ(a.u_theta_h, b.u_theta_h);
    EXPECT_EQ(a.u_theta_d, b.u_theta_d);
    EXPECT_EQ(a.u_phi_d, b.u_phi_d);
    EXPECT_EQ(a.u_tilt, b.u_tilt);
    EXPECT_EQ(a.direction.phi_h, b.direction.phi_h);
    EXPECT_EQ(a.kernel, b.kernel);
    EXPECT_EQ(a.pose, b.pose);
    EXPECT_EQ(a.spot, b.spot);
    EXPECT_EQ(a.flags, b.flags);
    EXPECT_EQ(a.extra, b.extra);
  }
}

TEST_F(WriteSamples, RewritesWhatItReadByteForByte) {
  write_samples(file("first.csv"), random_samples());
  write_samples(file("second.csv"), read_samples(file("first.csv")));
  EXPECT_EQ(read_bytes(file("first.csv")), read_bytes(file("second.csv")));
}

TEST_F(WriteSamples, KeepsAnExistingFileUnlessTold) {
  const auto path = written("precious", "out.csv");
  EXPECT_THROW(write_samples(path, one_sample()), FileError);
  EXPECT_EQ(read_bytes(path), "precious");
  write_samples(path, one_sample(), files::Overwrite::Yes);
  EXPECT_EQ(read_samples(path).samples.size(), 1u);
}

TEST_F(WriteSamples, RefusesWhatCouldNotBeReadBack) {
  const auto fault = [&](auto&& spoil) {
    SampleSet set = one_sample();
    spoil(set);
    const std::string message =
        error_of<std::invalid_argument>([&] { write_samples(file("out.csv"), set); });
    EXPECT_FALSE(std::filesystem::exists(file("out.csv")));
    return message;
  };
  EXPECT_THAT(fault([](SampleSet& s) { s.samples.clear(); }), HasSubstr("no samples"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].value_per_sr[2] = NAN; }),
              HasSubstr("sample 0: value is not finite"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].sigma_per_sr[0] = -1.0; }),
              HasSubstr("sigma is negative"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].value_per_sr[0] = -2e12; }),
              HasSubstr("value is beyond 1e12 1/sr"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].u_common_per_sr[0] = 2e12; }),
              HasSubstr("u_common is negative or not within 1e12"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].direction.theta_d = Angle::from_degrees(95); }),
              HasSubstr("direction out of range"));
  EXPECT_THAT(fault([](SampleSet& s) {
                s.samples[0].direction.theta_d = Angle::from_degrees(89.9);
                s.samples[0].direction.phi_d = Angle();
              }),
              HasSubstr("direction below the horizon"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].pose = -2; }), HasSubstr("pose"));
  EXPECT_THAT(fault([](SampleSet& s) { s.extra_columns = {"r"}; }), HasSubstr("'r'"));
  EXPECT_THAT(fault([](SampleSet& s) { s.samples[0].extra = {"x"}; }), HasSubstr("extra cells"));
  EXPECT_THAT(fault([](SampleSet& s) { s.comments = {"a\n1,2,3"}; }),
              HasSubstr("control character"));
}

}  // namespace
}  // namespace gonio::samples
