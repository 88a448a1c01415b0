// The live page of whole sessions on devices without physics, asked over real sockets.
#include "gonio/monitor/session_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "fake_rig.h"
#include "gonio/acquisition/resume.h"
#include "loopback_client.h"
#include "temporary_folder.h"

namespace gonio::monitor {
namespace {

using acquisition::FakeRig;
using acquisition::FakeStage;
using testing::HasSubstr;

const std::vector<std::array<double, 3>> kThreeDirections{
    {3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}, {20.0, 20.0, 60.0}};

class SessionPageTest : public testing::Test {
 protected:
  SessionFacts facts() const {
    SessionFacts facts;
    facts.archive = "session";
    facts.rig = "fake";
    facts.sample_id = "<b>A17</b>";
    for (const auto& point : plan_.points) facts.directions.push_back(point.direction);
    return facts;
  }
  acquisition::SessionResult run() {
    acquisition::SessionWriter archive(folder_, {}, {});
    return run(archive, {});
  }
  acquisition::SessionResult run(acquisition::SessionWriter& archive,
                                 const std::map<int, acquisition::PointOutcome>& done) {
    archive.observe(&monitor_);
    acquisition::SessionPart part;
    part.done = done;
    part.pause = pause_.get_token();
    return acquisition::run_session(
        rig_.devices(), rig_.known, plan_, options_, archive,
        [this](const acquisition::SessionProgress& now) {
          monitor_.on_progress(now);
          if (on_progress_) on_progress_(now);
        },
        stop_.get_token(), part);
  }
  /// Calls `work` on the session's thread when its second point begins.
  void at_the_second_point(const std::function<void()>& work) {
    on_progress_ = [work](const acquisition::SessionProgress& now) {
      if (now.phase == "point" && now.done == 1) work();
    };
  }
  Answer post(const std::string& target, const std::string& token) const {
    return ask(page_.port(), "POST", target, "X-Gonio-Token: " + token + "\r\n");
  }
  nlohmann::json json(const std::string& target) const {
    const Answer answer = get(page_.port(), target);
    EXPECT_EQ(answer.status, 200) << target;
    return nlohmann::json::parse(answer.body);
  }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
  FakeRig rig_;
  acquisition::SessionOptions options_;
  acquisition::MeasurementPlan plan_ = rig_.plan(kThreeDirections);
  std::stop_source stop_;
  std::stop_source pause_;
  std::function<void(const acquisition::SessionProgress&)> on_progress_;
  SessionMonitor monitor_{facts(), rig_.known};
  SessionPage page_{
      {}, monitor_, {[this] { pause_.request_stop(); }, [this] { stop_.request_stop(); }}, nullptr};
};

TEST_F(SessionPageTest, TellsWhatTheArchiveHolds) {
  EXPECT_EQ(json("/state.json")["frame"], nullptr);
  EXPECT_EQ(get(page_.port(), "/frame.png").status, 404);
  ASSERT_TRUE(run().complete);
  monitor_.ended("finished");
  const acquisition::SessionReader archive(folder_);
  const nlohmann::json state = json("/state.json");
  EXPECT_EQ(state["phase"], "finished");
  EXPECT_EQ(state["is_over"], true);
  EXPECT_EQ(state["points_done"], 3);
  EXPECT_EQ(state["points_total"], 3);
  EXPECT_EQ(state["measured"], 3);
  EXPECT_EQ(state["frames"], archive.frames().size());
  EXPECT_EQ(state["notes_told"], archive.notes().size());
  EXPECT_EQ(state["sample_id"], "<b>A17</b>");
  EXPECT_THAT(state["reconstruction"]["message"].get<std::string>(), HasSubstr("no basis given"));
  ASSERT_EQ(state["pose"]["axes"].size(), rig_.known.rig.axes.size());
  const rig::Joints& last = archive.frames().back().joints;
  for (std::size_t i = 0; i < last.size(); ++i) {
    EXPECT_NEAR(state["pose"]["axes"][i]["at_deg"], last[i].degrees(), 1e-9);
  }
  EXPECT_THAT(get(page_.port(), "/frame.png").body, testing::StartsWith("\x89PNG"));
}

TEST_F(SessionPageTest, NamesThePointUnderWayByItsPlaceInThePlan) {
  nlohmann::json seen;
  on_progress_ = [&](const acquisition::SessionProgress& now) {
    if (now.phase == "point" && seen.is_null()) seen = json("/state.json");
  };
  acquisition::SessionWriter archive(folder_, {}, {});
  run(archive,
      {{0, acquisition::PointOutcome::Measured}, {2, acquisition::PointOutcome::Measured}});
  EXPECT_EQ(seen["point"], 1);
  EXPECT_EQ(seen["points_done"], 2);
  EXPECT_NEAR(seen["direction"]["theta_h_deg"], plan_.points[1].direction.theta_h.degrees(), 1e-9);
  EXPECT_FALSE(json("/state.json").contains("point")) << "parked";
}

TEST_F(SessionPageTest, SaysWhenTheFrameItHasIsNotTheNewest) {
  on_progress_ = [&](const acquisition::SessionProgress& now) {
    if (now.phase == "white") {
      EXPECT_EQ(json("/state.json")["frame"]["newest"], false);
    }
  };
  run();
  EXPECT_EQ(json("/state.json")["frame"]["newest"], true) << "somebody has looked since";
}

TEST(SessionMonitor, CountsOnBetweenWhatItIsTold) {
  using std::chrono::seconds;
  SessionMonitor::Snapshot told;
  told.progress.phase = "white";
  told.progress.elapsed_s = 10.0;
  told.progress.remaining_s = 20.0;
  told.time_scale = 2.0;
  const auto at = told.progress_at;
  EXPECT_DOUBLE_EQ(SessionMonitor::counted_on(told, at + seconds(3)).elapsed_s, 16.0);
  EXPECT_DOUBLE_EQ(SessionMonitor::counted_on(told, at + seconds(3)).remaining_s, 14.0);
  EXPECT_DOUBLE_EQ(SessionMonitor::counted_on(told, at + seconds(60)).remaining_s, 0.0);
  told.ended = "paused";
  EXPECT_DOUBLE_EQ(SessionMonitor::counted_on(told, at + seconds(3)).elapsed_s, 10.0);
  told.ended.clear();
  told.time_scale.reset();
  EXPECT_DOUBLE_EQ(SessionMonitor::counted_on(told, at + seconds(3)).elapsed_s, 10.0);
}

TEST_F(SessionPageTest, ShowsEachPointAgainstTheWhite) {
  at_the_second_point([this] { rig_.camera.lit_dn_per_s /= 4.0; });
  run();
  const nlohmann::json points = json("/points.json")["points"];
  ASSERT_EQ(points.size(), 3U);
  constexpr double kRounding = 0.01;  // of values in whole DN
  for (const char* channel : {"R", "G", "B"}) {
    EXPECT_NEAR(points[0]["signal_over_white"][channel], 1.0, kRounding) << channel;
    EXPECT_NEAR(points[2]["signal_over_white"][channel], 0.25, kRounding) << channel;
  }
  EXPECT_NEAR(points[0]["theta_h_deg"], plan_.points[0].direction.theta_h.degrees(), 1e-9);
  EXPECT_EQ(points[0]["outcome"], "measured");
  EXPECT_EQ(json("/points.json?from=2")["points"].size(), 1U);
  EXPECT_EQ(json("/points.json?from=99")["points"].size(), 0U);
  EXPECT_EQ(json("/points.json?from=-1")["points"].size(), 3U);
}

TEST_F(SessionPageTest, RefusesToActWithoutTheTokenOfThisSession) {
  const std::string right = page_.token().text();
  std::string wrong = right;
  wrong.back() = wrong.back() == '0' ? '1' : '0';
  for (const char* target : {"/pause", "/stop"}) {
    EXPECT_EQ(ask(page_.port(), "POST", target).status, 403) << target;
    for (const std::string& token : {std::string(), wrong, right + "0", right.substr(1)}) {
      EXPECT_EQ(post(target, token).status, 403) << target << " " << token;
    }
    EXPECT_EQ(get(page_.port(), target).status, 405) << target;
    EXPECT_EQ(ask(page_.port(), "GET", target, "X-Gonio-Token: " + right + "\r\n").status, 405);
    EXPECT_EQ(get(page_.port(), std::string(target) + "?token=" + right).status, 405);
    EXPECT_EQ(ask(page_.port(), "POST", target,
                  "Origin: http://evil.example\r\nX-Gonio-Token: " + right + "\r\n")
                  .status,
              403);
  }
  EXPECT_FALSE(pause_.stop_requested());
  EXPECT_FALSE(stop_.stop_requested());
  EXPECT_NE(PageToken().text(), right) << "the same for every session";
  EXPECT_THAT(page_.control_url(), testing::EndsWith("/#" + right));
  EXPECT_THAT(get(page_.port(), "/").body + get(page_.port(), "/state.json").body,
              testing::Not(HasSubstr(right)));
}

TEST_F(SessionPageTest, PausesASessionThatCanBeResumed) {
  at_the_second_point([this] {
    EXPECT_EQ(post("/pause", page_.token().text()).status, 200);
    EXPECT_EQ(json("/state.json")["phase"], "pausing");
  });
  const acquisition::SessionResult paused = run();
  EXPECT_FALSE(paused.finished);
  EXPECT_EQ(paused.measured, 2) << "the point under way is finished, no other begun";
  const acquisition::ResumeState state =
      acquisition::resume_state(acquisition::SessionReader(folder_));
  EXPECT_EQ(json("/state.json")["notes"].back()["kind"], "paused");
  on_progress_ = {};
  pause_ = std::stop_source();
  acquisition::SessionWriter archive = acquisition::SessionWriter::resume(
      folder_, files::ProcessLock(acquisition::session_lock(folder_)), state.may_begin_at,
      rig_.clock.now(), "by a test");
  EXPECT_TRUE(run(archive, state.done).complete);
  EXPECT_EQ(json("/state.json")["measured"], 3);
}

TEST_F(SessionPageTest, StopsASessionAtOnce) {
  at_the_second_point([this] { EXPECT_EQ(post("/stop", page_.token().text()).status, 200); });
  const acquisition::SessionResult stopped = run();
  EXPECT_FALSE(stopped.finished);
  EXPECT_EQ(stopped.measured, 1);
  for (const auto& stage : rig_.stages) EXPECT_TRUE(stage->stopped) << stage->name();
  EXPECT_EQ(rig_.light.lit, "");
  EXPECT_EQ(json("/state.json")["notes"].back()["kind"], "stopped");
  EXPECT_FALSE(acquisition::SessionReader(folder_).finished());
}

TEST_F(SessionPageTest, ServesManyWhileTheSessionRuns) {
  constexpr int kClients = 10;
  std::atomic<bool> over = false;
  std::atomic<int> replies = 0;
  std::vector<std::jthread> clients;
  clients.reserve(kClients);
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back([&] {
      int told = 0;
      do {
        const nlohmann::json state = json("/state.json");
        const nlohmann::json points = json("/points.json")["points"];
        EXPECT_GE(points.size(), state["points_told"].get<std::size_t>());
        EXPECT_GE(state["points_told"].get<int>(), told) << "went backwards";
        told = state["points_told"];
        get(page_.port(), "/frame.png");
        ++replies;
      } while (!over);
    });
  }
  EXPECT_TRUE(run().complete);
  over = true;
  clients.clear();
  EXPECT_GE(replies, kClients);
  EXPECT_EQ(json("/state.json")["measured"], 3);
}

TEST_F(SessionPageTest, ShowsWhatDevicesSayAsText) {
  monitor_.on_note({std::chrono::seconds(3), "device error", "</script>\"\xff\x1b[31m"});
  const nlohmann::json note = json("/state.json")["notes"].back();
  EXPECT_EQ(note["text"], "</script>\"\xEF\xBF\xBD\x1b[31m") << "no UTF-8 becomes U+FFFD";
  EXPECT_EQ(note["at_s"], 3.0);
}

TEST_F(SessionPageTest, KeepsTheLastNotesOnly) {
  for (int i = 0; i < 1000; ++i) monitor_.on_note({{}, "retry", std::to_string(i)});
  const nlohmann::json state = json("/state.json");
  EXPECT_EQ(state["notes_told"], 1000);
  EXPECT_EQ(state["notes"].size(), 100U);
  EXPECT_EQ(state["notes"].back()["text"], "999");
}

TEST_F(SessionPageTest, WaitsForNobodyAtTheEnd) {
  // Would take an hour if it did.
  page_.let_the_end_be_seen(std::chrono::hours(1));
  json("/state.json");
  monitor_.ended("finished");
  std::jthread looker([this] { json("/state.json"); });
  page_.let_the_end_be_seen(std::chrono::hours(1));
}

TEST_F(SessionPageTest, NeedsNothingFromElsewhere) {
  for (const char* file : {"/", "/session.js", "/drawing.js", "/style.css", "/setup.html"}) {
    const Answer answer = get(page_.port(), file);
    EXPECT_EQ(answer.status, 200) << file;
    EXPECT_THAT(answer.body, testing::Not(HasSubstr("//fonts"))) << file;
    EXPECT_THAT(answer.body, testing::Not(HasSubstr("https:"))) << file;
    EXPECT_THAT(answer.body, testing::Not(HasSubstr("http:"))) << file;
  }
  EXPECT_EQ(get(page_.port(), "/../etc/passwd").status, 404);
  EXPECT_EQ(get(page_.port(), "/session.sqlite").status, 404);
}

}  // namespace
}  // namespace gonio::monitor
