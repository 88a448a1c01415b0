#include "gonio/monitor/setup_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "loopback_client.h"

namespace gonio::monitor {
namespace {

devices::Frame frame_with_an_edge() {
  devices::Frame frame;
  frame.width_px = 40;
  frame.height_px = 30;
  frame.saturation_level_dn = 4095;
  frame.exposure = std::chrono::milliseconds(5);
  frame.pixels_dn.assign(40 * 30, 100);
  for (int row = 0; row < 30; ++row)
    frame.pixels_dn[static_cast<std::size_t>(row * 40 + 10)] = 4095;
  return frame;
}

class SetupPageTest : public testing::Test {
 protected:
  nlohmann::json state(const std::string& query = "") const {
    return nlohmann::json::parse(get(page_.port(), "/setup.json" + query).body);
  }

  SetupView view_;
  SetupPage page_{{}, view_, "rig, G"};
};

TEST_F(SetupPageTest, TakesAFrameOnlyWhenSomebodyLooks) {
  std::stop_source stop;
  std::jthread camera([&] {
    while (view_.wait_until_asked(stop.get_token())) view_.show(frame_with_an_edge());
  });
  EXPECT_LE(state()["number"], 1);
  const int asked = 20;
  int number = 0;
  for (int i = 0; i < asked; ++i) number = state()["number"];
  EXPECT_LE(number, asked + 1) << "one frame per look at most";
  stop.request_stop();
}

TEST_F(SetupPageTest, TellsTheRegionThatIsAskedFor) {
  EXPECT_EQ(get(page_.port(), "/frame.png").status, 404);
  view_.show(frame_with_an_edge());
  const nlohmann::json edge = state("?column=5&row=5&width=10&height=10");
  const nlohmann::json plain = state("?column=20&row=5&width=10&height=10");
  EXPECT_EQ(edge["region_px"]["width"], 10);
  EXPECT_GT(edge["focus"], 0.1);
  EXPECT_EQ(plain["focus"], 0.0);
  EXPECT_DOUBLE_EQ(edge["figures"]["saturated_share"], 0.1);
  EXPECT_EQ(plain["figures"]["saturated_share"], 0.0);
  EXPECT_EQ(edge["exposure_ms"], 5.0);
  EXPECT_EQ(edge["title"], "rig, G");
  for (const char* odd : {"?column=x", "?width=99999999999999999999", "?column=-7&width=3",
                          "?height=2147483647&row=2147483647"}) {
    EXPECT_EQ(state(odd)["region_px"]["width"], 40) << odd;
  }
  EXPECT_THAT(get(page_.port(), "/frame.png").body, testing::StartsWith("\x89PNG"));
}

TEST_F(SetupPageTest, KeepsTheLastFrameWhenTheCameraFails) {
  view_.show(frame_with_an_edge());
  view_.show_error("camera: lost packets");
  EXPECT_EQ(state()["error"], "camera: lost packets");
  EXPECT_EQ(state()["number"], 1);
  view_.show(frame_with_an_edge());
  EXPECT_EQ(state()["error"], "");
}

TEST_F(SetupPageTest, HasNothingToPost) {
  EXPECT_EQ(ask(page_.port(), "POST", "/").status, 405);
  EXPECT_EQ(get(page_.port(), "/").status, 200);
  EXPECT_EQ(get(page_.port(), "/setup.js").status, 200);
}

}  // namespace
}  // namespace gonio::monitor
