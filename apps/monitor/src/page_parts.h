#pragma once

#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "gonio/devices/frame.h"
#include "gonio/monitor/frame_picture.h"
#include "gonio/monitor/http_server.h"
#include "gonio/monitor/page_token.h"
#include "gonio/rig/kinematics.h"

namespace gonio::monitor {

/// A file of the pages themselves; none of that name: nothing.
std::optional<HttpReply> page_file(std::string_view path);

HttpReply json_reply(const nlohmann::ordered_json& value);
HttpReply png_reply(std::string png);
HttpReply not_found();

/// Runs `action` for a POST with the right token; refuses anything else.
HttpReply controlled(const HttpRequest& request, const PageToken& token,
                     const std::function<void()>& action);

/// Where the three tips stand: per tip its origin and axes x, y, z in the world, mm.
nlohmann::ordered_json pose_json(const rig::RigDescription& rig, const rig::Joints& joints);

nlohmann::ordered_json figures_json(const FrameFigures& figures);

/// A frame as the pages show it, worked out once for all that look.
class ShownFrame {
 public:
  struct View {
    FrameFigures figures;
    std::string png;
  };
  /// Of `frame`; the same object again gives what it gave before.
  std::shared_ptr<const View> view(const std::shared_ptr<const devices::Frame>& frame);

 private:
  std::shared_ptr<const devices::Frame> of_;
  std::shared_ptr<const View> view_;
};

}  // namespace gonio::monitor
