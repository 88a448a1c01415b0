#include "home_deltas.h"

#include <fmt/format.h>

namespace gonio::acquisition {

HomeDelta home_delta(const std::string& axis, const HomingEvidence& evidence, Angle believed,
                     bool after_outage) {
  if (!evidence.stood) {
    return {axis + " could not tell: its count was read too seldom", "", false};
  }
  const Angle delta = evidence.stood->angle - believed;
  const Angle within = evidence.stood->within;
  // What may be nothing but how the count was read is no finding, nor is it that all is well.
  if (within > kUsualHomeDelta && abs(delta) <= within) {
    return {fmt::format("{} could not tell: its count was read within {:.3f} deg only", axis,
                        within.degrees()),
            "", false};
  }
  HomeDelta found;
  found.text = fmt::format("{} {:+.4f} deg", axis, delta.degrees());
  if (within > Angle()) found.text += fmt::format(" within {:.4f} deg", within.degrees());
  // A search that failed may have left the axis anywhere as well.
  if ((after_outage || evidence.hidden) && abs(delta) > kWasOnItsWay) {
    found.text += ", was on its way or turned meanwhile";
    return found;
  }
  if (abs(delta) > kLargestHomeDelta) {
    found.lost = fmt::format(
        "axis {} was off its count by {:+.4f} deg at its home mark, expected within {:g} deg; it "
        "is homed anew",
        axis, delta.degrees(), kLargestHomeDelta.degrees());
  } else if (abs(delta) > kUsualHomeDelta) {
    found.text += fmt::format(", more than the usual {:g} deg", kUsualHomeDelta.degrees());
  }
  if (evidence.hidden && found.lost.empty()) {
    found.text += ", but could not tell: a homing before may have set its zero anew";
    return found;
  }
  if (found.lost.empty() && abs(delta) + within > kLargestHomeDelta) {
    found.text += ", which is too uncertain to tell";
    return found;
  }
  found.compared = true;
  return found;
}

}  // namespace gonio::acquisition
