#include "gonio/rig/kinematics.h"

namespace gonio::rig {

char to_char(Branch branch) { return "ABCD"[static_cast<int>(branch)]; }

std::string branch_name(const PoseSolution& pose) {
  return std::string(1, to_char(pose.branch)) + (pose.mirrored ? "'" : "");
}

std::string_view to_string(Reason reason) {
  switch (reason) {
    case Reason::BelowHorizon:
      return "BELOW_HORIZON";
    case Reason::GrazingIn:
      return "GRAZING_IN";
    case Reason::GrazingOut:
      return "GRAZING_OUT";
    case Reason::OccludedLamp:
      return "OCCLUDED_LAMP";
    case Reason::AxisLimit:
      return "AXIS_LIMIT";
    case Reason::KeepOut:
      return "KEEP_OUT";
    case Reason::NoInverse:
      return "NO_IK";
    case Reason::Footprint:
      return "FOOTPRINT";
    case Reason::PathBlocked:
      return "PATH_BLOCKED";
  }
  return "UNKNOWN";
}

}  // namespace gonio::rig
