#include "gonio/acquisition/decisions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "gonio/acquisition/resume.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using std::chrono::seconds;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using testing::ThrowsMessage;

AddedPoint point(int number) {
  AddedPoint added;
  added.point = number;
  added.replaces = number - 2;
  // Angles that no short decimal gives.
  added.direction = {Angle::from_radians(std::sqrt(0.3)), Angle::from_radians(1.0 / 3.0),
                     Angle::from_radians(-std::exp(0.5)), Angle()};
  added.pose.joints = {Angle::from_radians(std::sqrt(2.0)), Angle::from_radians(-1.0 / 7.0),
                       Angle::from_radians(0.1), Angle()};
  added.pose.branch = rig::Branch::C;
  added.pose.mirrored = true;
  return added;
}

Decision addition(int first) {
  Decision decision;
  decision.reason = "point 3 (1, 2, 3) ended as Failed: \"x\"\n";
  decision.added = {point(first), point(first + 1)};
  decision.added[1].replaces.reset();
  decision.added[1].checks = 0;
  decision.expected_psnr_db = 100.0 / 3.0;
  return decision;
}

TEST(Decision, ComesBackFromItsTextToTheLastBit) {
  const Decision wanted = addition(5);
  const std::string text = decision_text(wanted);
  EXPECT_EQ(text.find('\n'), std::string::npos) << "one line";
  const Decision found = decision_from_text(text, "place");
  EXPECT_EQ(found.kind, Decision::Kind::add);
  EXPECT_EQ(found.reason, wanted.reason);
  EXPECT_EQ(found.expected_psnr_db, wanted.expected_psnr_db);
  ASSERT_THAT(found.added, SizeIs(2));
  EXPECT_EQ(found.added[0].replaces, 3);
  EXPECT_EQ(found.added[0].checks, std::nullopt);
  EXPECT_EQ(found.added[1].checks, 0);
  EXPECT_EQ(found.added[0].pose.joints, wanted.added[0].pose.joints);
  EXPECT_EQ(found.added[0].direction.theta_h, wanted.added[0].direction.theta_h);
  EXPECT_EQ(found.added[0].direction.phi_d, wanted.added[0].direction.phi_d);
  EXPECT_EQ(rig::branch_name(found.added[0].pose), "C'");
  EXPECT_EQ(decision_text(found), text);

  Decision enough;
  enough.kind = Decision::Kind::enough;
  enough.dropped = {4, 7};
  EXPECT_THAT(decision_from_text(decision_text(enough), "place").dropped, ElementsAre(4, 7));
  Decision remark;
  remark.kind = Decision::Kind::remark;
  remark.reason = "not reached";
  EXPECT_EQ(decision_from_text(decision_text(remark), "place").reason, "not reached");
}

struct Hostile {
  const char* name;
  std::string text;
  const char* said;
};

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

class HostileDecision : public testing::TestWithParam<Hostile> {};

TEST_P(HostileDecision, IsRefusedWithItsPlace) {
  EXPECT_THAT(
      [&] { decision_from_text(GetParam().text, "session/note"); },
      ThrowsMessage<DataFormatError>(AllOf(HasSubstr("session/note"), HasSubstr(GetParam().said))));
}

const std::string kGood = decision_text(addition(5));

INSTANTIATE_TEST_SUITE_P(
    All, HostileDecision,
    testing::Values(
        Hostile{"empty", "", "is no JSON"}, Hostile{"torn", kGood.substr(0, 60), "is no JSON"},
        Hostile{"list", "[1]", "an object"},
        Hostile{"deep", std::string(100000, '[') + std::string(100000, ']'), "is no JSON"},
        Hostile{"other_kind", replaced(kGood, "\"add\"", "\"burn\""), "expected add"},
        Hostile{"no_reason", replaced(kGood, "reason", "season"), "reason"},
        Hostile{"unknown_key", replaced(kGood, "{", "{\"more\":1,"), "unknown key"},
        Hostile{"no_points",
                R"({"decision":"add","reason":"","expected_psnr_db":null,"points":[]})",
                "expected one or more"},
        Hostile{"points_apart", replaced(kGood, "\"point\":6", "\"point\":8"), "behind point 5"},
        Hostile{"negative_point", replaced(kGood, "\"point\":5", "\"point\":-5"), "whole number"},
        Hostile{"huge_point", replaced(kGood, "\"point\":5", "\"point\":1e300"), "whole number"},
        Hostile{"replaces_itself", replaced(kGood, "\"replaces\":3", "\"replaces\":5"), "before 5"},
        Hostile{"not_finite", replaced(kGood, "\"joints_deg\":[", "\"joints_deg\":[1e999,"),
                "is no JSON"},
        Hostile{"below", replaced(kGood, "\"direction_deg\":[", "\"direction_deg\":[-1,"),
                "3 numbers"},
        Hostile{"branch", replaced(kGood, "C'", "E"), "expected A, B, C or D"},
        Hostile{"dropped_twice",
                R"({"decision":"enough","reason":"","expected_psnr_db":null,"dropped":[4,4]})",
                "ascending"}),
    [](const auto& each) { return std::string(each.param.name); });

class DecisionLog : public testing::Test {
 protected:
  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
};

TEST_F(DecisionLog, IsReadFromTheJournalInItsOrder) {
  {
    SessionWriter archive(folder_, {}, {});
    archive.note(seconds(1), kDecisionNote, decision_text(addition(5)));
    archive.note(seconds(2), "warning", "none of this");
    archive.note(seconds(3), kDecisionNote, decision_text(addition(7)));
  }
  const SessionReader archive(folder_);
  const std::vector<LoggedDecision> log = decisions(archive);
  ASSERT_THAT(log, SizeIs(2));
  EXPECT_EQ(log[1].at, seconds(3));
  EXPECT_EQ(log[1].decision.added[1].point, 8);
  EXPECT_THAT(decisions(archive.before_note(2)), SizeIs(1));
}

TEST_F(DecisionLog, SaysWhenADecisionInBetweenIsLost) {
  {
    SessionWriter archive(folder_, {}, {});
    archive.note(seconds(1), kDecisionNote, decision_text(addition(5)));
    archive.note(seconds(3), kDecisionNote, decision_text(addition(9)));
  }
  EXPECT_THAT([&] { decisions(SessionReader(folder_)); },
              ThrowsMessage<DataFormatError>(
                  AllOf(HasSubstr("found point 9, expected 7"), HasSubstr("3.000 s"))));
  EXPECT_THROW(resume_state(SessionReader(folder_)), DataFormatError);
}

TEST_F(DecisionLog, KeepsAFailedPointThatIsReplacedFromBeingMeasuredAgain) {
  {
    SessionWriter archive(folder_, {}, {});
    for (const int number : {3, 4}) {
      PointRecord failed;
      failed.point = number;
      failed.finished_at = seconds(number);
      archive.append(failed);
    }
    archive.note(seconds(5), kDecisionNote, decision_text(addition(5)));
  }
  const ResumeState state = resume_state(SessionReader(folder_));
  EXPECT_TRUE(state.done.contains(3)) << "point 5 stands in for it";
  EXPECT_FALSE(state.done.contains(4));
  EXPECT_THAT(part_to_resume(state).replaced, ElementsAre(3));
}

}  // namespace
}  // namespace gonio::acquisition
