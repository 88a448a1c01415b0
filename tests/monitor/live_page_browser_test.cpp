// The page as a browser without a screen shows it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <optional>

#include "fake_rig.h"
#include "gonio/monitor/session_page.h"
#include "gonio/monitor/setup_page.h"
#include "gonio_process.h"
#include "temporary_folder.h"

namespace gonio::monitor {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Where Debian's package chromium puts it; GONIO_CHROMIUM names another.
std::filesystem::path browser() {
  const char* other = std::getenv("GONIO_CHROMIUM");
  return other != nullptr ? other : "/usr/bin/chromium";
}

class LivePageInABrowser : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(browser())) {
      GTEST_SKIP() << browser() << " is absent (Debian: apt install chromium)";
    }
    SessionFacts facts;
    facts.archive = "session";
    facts.rig = rig_.known.rig.name;
    facts.sample_id = "<b>plate</b>";
    for (const auto& point : plan_.points) facts.directions.push_back(point.direction);
    monitor_.emplace(facts, rig_.known);
    page_.emplace(HttpAddress{}, *monitor_, SessionControls{[] {}, [] {}}, nullptr);
  }

  void measure() {
    acquisition::SessionWriter archive(folder_.path() / "session", {}, {});
    archive.observe(&*monitor_);
    acquisition::run_session(
        rig_.devices(), rig_.known, plan_, {}, archive,
        [this](const acquisition::SessionProgress& now) { monitor_->on_progress(now); });
  }

  /// What a browser has made of it after a few of the page's own seconds.
  std::string document(const std::string& url) {
    const Ended ended =
        GonioProcess(
            {"--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
             "--disable-extensions", "--user-data-dir=" + (folder_.path() / "profile").string(),
             "--enable-logging=stderr", "--virtual-time-budget=5000", "--dump-dom", url},
            folder_.path(), 0, browser().string())
            .wait();
    EXPECT_EQ(ended.exit_code, 0) << ended.error;
    EXPECT_THAT(ended.error, Not(HasSubstr("Content Security Policy")));
    EXPECT_THAT(ended.error, Not(HasSubstr("Uncaught")));
    return ended.out;
  }

  const TemporaryFolder folder_;
  acquisition::FakeRig rig_;
  acquisition::MeasurementPlan plan_ = rig_.plan({{3.0, 12.0, 28.0}, {39.0, 60.0, 89.0}});
  std::optional<SessionMonitor> monitor_;
  std::optional<SessionPage> page_;
};

TEST_F(LivePageInABrowser, ShowsAFinishedSession) {
  measure();
  monitor_->ended("finished");
  const std::string shown = document(page_->control_url());
  EXPECT_THAT(shown, HasSubstr(">finished</span>"));
  EXPECT_THAT(shown, HasSubstr("id=\"points\">2 of 2<"));
  EXPECT_THAT(shown, HasSubstr("id=\"title\">&lt;b&gt;plate&lt;/b&gt;<")) << "text, not markup";
  EXPECT_THAT(shown, HasSubstr("src=\"/frame.png?n="));
  EXPECT_THAT(shown, HasSubstr("nothing saturated"));
  EXPECT_THAT(shown, HasSubstr("no basis given"));
  for (const rig::Axis& axis : rig_.known.rig.axes) EXPECT_THAT(shown, HasSubstr(axis.name));
  EXPECT_THAT(shown, testing::ContainsRegex("id=\"controls\" hidden")) << "nothing left to stop";
}

TEST_F(LivePageInABrowser, OffersToPauseAndStopToWhoHasTheToken) {
  measure();  // and has not ended, as far as it was told
  EXPECT_THAT(document(page_->control_url()), HasSubstr("id=\"controls\">"));
  const std::string looked_at = document(page_->url());
  EXPECT_THAT(looked_at, HasSubstr("id=\"controls\" hidden"));
  EXPECT_THAT(looked_at, HasSubstr("Looking only"));
}

TEST_F(LivePageInABrowser, ShowsWhatTheCameraSeesWhileItIsSetUp) {
  devices::Frame frame;
  frame.width_px = 320;
  frame.height_px = 256;
  frame.saturation_level_dn = 4095;
  frame.exposure = std::chrono::milliseconds(5);
  frame.pixels_dn.assign(320 * 256, 700);
  SetupView view;
  view.show(frame);
  const SetupPage page({}, view, "bench, G");
  const std::string shown = document(page.url());
  EXPECT_THAT(shown, HasSubstr("id=\"title\">bench, G<"));
  EXPECT_THAT(shown, HasSubstr("320 × 256 px at 0, 0: mean 700"));
  EXPECT_THAT(shown, HasSubstr("src=\"/frame.png?n=1\""));
}

}  // namespace
}  // namespace gonio::monitor
