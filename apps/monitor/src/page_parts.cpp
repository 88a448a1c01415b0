#include "page_parts.h"

#include <cmath>

#include "gonio/page/style.h"
#include "gonio/render/png.h"
#include "page_files.h"

namespace gonio::monitor {
namespace {

constexpr int kFrameWidth_px = 512;

nlohmann::ordered_json tip_json(const Eigen::Isometry3d& world_from_tip) {
  const auto column = [&](int i) {
    const Eigen::Vector3d v = world_from_tip.matrix().block<3, 1>(0, i);
    return nlohmann::ordered_json::array({v.x(), v.y(), v.z()});
  };
  return {{"origin_mm", column(3)}, {"x", column(0)}, {"y", column(1)}, {"z", column(2)}};
}

}  // namespace

std::optional<HttpReply> page_file(std::string_view path) {
  if (path == "/style.css") {
    return HttpReply{200, "text/css; charset=utf-8",
                     std::string(page::style_sheet()) + std::string(kLiveStyle)};
  }
  for (const PageFile& file : page_files()) {
    if (file.path == path) {
      return HttpReply{200, std::string(file.content_type), std::string(file.text)};
    }
  }
  return std::nullopt;
}

HttpReply json_reply(const nlohmann::ordered_json& value) {
  // Notes come from devices and people: what is no UTF-8 must not end the reply.
  return {200, "application/json",
          value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)};
}

HttpReply png_reply(std::string png) { return {200, "image/png", std::move(png)}; }

HttpReply not_found() { return {404, "text/plain; charset=utf-8", "found nothing here\n"}; }

HttpReply controlled(const HttpRequest& request, const PageToken& token,
                     const std::function<void()>& action) {
  if (request.method != "POST") {
    return {405, "text/plain; charset=utf-8", "expected POST\n"};
  }
  const auto shown = request.headers.find("x-gonio-token");
  if (shown == request.headers.end() || !token.is(shown->second)) {
    return {403, "text/plain; charset=utf-8",
            "X-Gonio-Token: not the token that the program has printed\n"};
  }
  action();
  return json_reply({{"done", true}});
}

nlohmann::ordered_json pose_json(const rig::RigDescription& rig, const rig::Joints& joints) {
  if (joints.size() != rig.axes.size()) return nullptr;
  nlohmann::ordered_json axes = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < joints.size(); ++i) {
    axes.push_back({{"name", rig.axes[i].name},
                    {"at_deg", joints[i].degrees()},
                    {"min_deg", rig.axes[i].min.degrees()},
                    {"max_deg", rig.axes[i].max.degrees()}});
  }
  const rig::RigPose pose = rig::forward(rig, joints);
  return {{"axes", std::move(axes)},
          {"camera", tip_json(pose.world_from_camera)},
          {"lamp", tip_json(pose.world_from_lamp)},
          {"sample", tip_json(pose.world_from_sample)}};
}

nlohmann::ordered_json figures_json(const FrameFigures& figures) {
  return {{"mean_dn", figures.mean_dn},
          {"min_dn", figures.min_dn},
          {"max_dn", figures.max_dn},
          {"saturated_share", figures.saturated_share},
          {"histogram", figures.histogram}};
}

std::shared_ptr<const ShownFrame::View> ShownFrame::view(
    const std::shared_ptr<const devices::Frame>& frame) {
  if (frame != of_ || !view_) {
    auto made = std::make_shared<View>();
    made->figures = figures_of(*frame);
    const std::vector<std::byte> png = render::encode_png(frame_picture(*frame, kFrameWidth_px));
    made->png.assign(reinterpret_cast<const char*>(png.data()), png.size());
    view_ = std::move(made);
    of_ = frame;
  }
  return view_;
}

}  // namespace gonio::monitor
