#include "gonio/acquisition/decisions.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "gonio/devices/clock.h"
#include "gonio/errors/errors.h"
#include "gonio/json/json_fields.h"
#include "gonio/samples/csv.h"

namespace gonio::acquisition {
namespace {

constexpr std::size_t kLongestText = 1 << 20;
constexpr const char* kAddWord = "add";
constexpr const char* kEnoughWord = "enough";
constexpr const char* kRemarkWord = "remark";

/// Degrees that give the same radians again.
double exact_degrees(Angle angle) { return std::stod(samples::csv_degrees(angle)); }

nlohmann::ordered_json point_json(const AddedPoint& added) {
  nlohmann::ordered_json joints = nlohmann::ordered_json::array();
  for (const Angle joint : added.pose.joints) joints.push_back(exact_degrees(joint));
  nlohmann::ordered_json json{
      {"point", added.point},
      {"direction_deg",
       {exact_degrees(added.direction.theta_h), exact_degrees(added.direction.theta_d),
        exact_degrees(added.direction.phi_d)}},
      {"joints_deg", joints},
      {"branch", rig::branch_name(added.pose)}};
  const auto point_or_null = [](const std::optional<int>& point) {
    return point ? nlohmann::ordered_json(*point) : nlohmann::ordered_json(nullptr);
  };
  json["replaces"] = point_or_null(added.replaces);
  json["checks"] = point_or_null(added.checks);
  return json;
}

/// Reads one decision; `fail` says what is wrong with it.
class DecisionReader {
 public:
  explicit DecisionReader(const std::filesystem::path& place) : place_(place) {}

  Decision read(const nlohmann::json& json) const {
    json::JsonFields fields(json, "", place_);
    Decision decision;
    const std::string kind = fields.text("decision");
    decision.reason = fields.text("reason");
    decision.expected_psnr_db = fields.number_or_null("expected_psnr_db");
    if (kind == kAddWord) {
      decision.kind = Decision::Kind::add;
      fields.each_object("points", [&](json::JsonFields& point) {
        decision.added.push_back(read_point(point, decision.added));
      });
      if (decision.added.empty()) fail("points", "found none, expected one or more");
    } else if (kind == kEnoughWord) {
      decision.kind = Decision::Kind::enough;
      int before = -1;
      for (const double number : fields.numbers("dropped")) {
        if (!(number > before && number < kMostPoints && number == std::floor(number))) {
          fail("dropped", fmt::format("found {:g}, expected points in ascending order", number));
        }
        before = static_cast<int>(number);
        decision.dropped.push_back(before);
      }
    } else if (kind == kRemarkWord) {
      decision.kind = Decision::Kind::remark;
    } else {
      fail("decision", fmt::format("found {:?}, expected {}, {} or {}", kind, kAddWord, kEnoughWord,
                                   kRemarkWord));
    }
    fields.finish();
    return decision;
  }

 private:
  AddedPoint read_point(json::JsonFields& fields, const std::vector<AddedPoint>& before) const {
    AddedPoint added;
    added.point = static_cast<int>(fields.whole("point", 0, kMostPoints - 1));
    if (!before.empty() && added.point != before.back().point + 1) {
      fail("points",
           fmt::format("found point {} behind point {}", added.point, before.back().point));
    }
    const auto earlier = [&](const char* key) -> std::optional<int> {
      if (fields.is_null(key)) return std::nullopt;
      const int point = static_cast<int>(fields.whole(key, 0, kMostPoints - 1));
      if (point >= added.point) {
        fail(key, fmt::format("found {}, expected a point before {}", point, added.point));
      }
      return point;
    };
    added.replaces = earlier("replaces");
    added.checks = earlier("checks");
    const std::vector<double> direction = fields.numbers("direction_deg", 3);
    const auto angle = [&](double degrees, double min, double max) {
      if (!(degrees >= min && degrees <= max)) {
        fail("direction_deg", fmt::format("found {:g}, expected {:g} to {:g}", degrees, min, max));
      }
      return Angle::from_degrees(degrees);
    };
    added.direction = {angle(direction[0], 0.0, 90.0), angle(direction[1], 0.0, 90.0),
                       angle(direction[2], -180.0, 180.0), Angle()};
    constexpr std::size_t kMostAxes = 64;
    const std::vector<double> joints = fields.numbers("joints_deg");
    if (joints.empty() || joints.size() > kMostAxes) {
      fail("joints_deg", fmt::format("found {}, expected one per axis", joints.size()));
    }
    for (const double joint : joints) added.pose.joints.push_back(Angle::from_degrees(joint));
    const std::string branch = fields.text("branch");
    added.pose.mirrored = branch.size() == 2 && branch[1] == '\'';
    if (branch.empty() || branch[0] < 'A' || branch[0] > 'D' ||
        branch.size() != (added.pose.mirrored ? 2U : 1U)) {
      fail("branch", fmt::format("found {:?}, expected A, B, C or D", branch));
    }
    added.pose.branch = static_cast<rig::Branch>(branch[0] - 'A');
    return added;
  }

  [[noreturn]] void fail(const std::string& field, const std::string& why) const {
    throw DataFormatError(place_, field, why);
  }

  const std::filesystem::path& place_;
};

}  // namespace

std::string decision_text(const Decision& decision) {
  nlohmann::ordered_json json;
  switch (decision.kind) {
    case Decision::Kind::add:
      json["decision"] = kAddWord;
      break;
    case Decision::Kind::enough:
      json["decision"] = kEnoughWord;
      break;
    case Decision::Kind::remark:
      json["decision"] = kRemarkWord;
      break;
  }
  json["reason"] = decision.reason;
  json["expected_psnr_db"] = decision.expected_psnr_db
                                 ? nlohmann::ordered_json(*decision.expected_psnr_db)
                                 : nlohmann::ordered_json(nullptr);
  if (decision.kind == Decision::Kind::add) {
    json["points"] = nlohmann::ordered_json::array();
    for (const AddedPoint& point : decision.added) json["points"].push_back(point_json(point));
  } else if (decision.kind == Decision::Kind::enough) {
    json["dropped"] = decision.dropped;
  }
  return json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

Decision decision_from_text(std::string_view text, const std::filesystem::path& place) {
  if (text.size() > kLongestText) {
    throw DataFormatError(
        place, "decision",
        fmt::format("found {} bytes, expected at most {}", text.size(), kLongestText));
  }
  // Points and their lists of numbers are the deepest.
  constexpr int kDeepest = 4;
  nlohmann::json json;
  try {
    json =
        nlohmann::json::parse(text, [](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
          if (depth > kDeepest) throw std::invalid_argument("nested too deeply");
          return true;
        });
  } catch (const std::exception& error) {
    throw DataFormatError(place, "decision", std::string("is no JSON: ") + error.what());
  }
  return DecisionReader(place).read(json);
}

std::vector<LoggedDecision> decisions(const SessionReader& archive) {
  std::vector<LoggedDecision> log;
  std::optional<int> last;
  for (const SessionNote& note : archive.notes()) {
    if (note.kind != kDecisionNote) continue;
    const std::filesystem::path place =
        archive.folder() / fmt::format("note of {:.3f} s", devices::to_seconds(note.at));
    Decision decision = decision_from_text(note.text, place);
    for (const AddedPoint& added : decision.added) {
      if (last && added.point != *last + 1) {
        throw DataFormatError(place, "points",
                              fmt::format("found point {}, expected {}: a decision before it is "
                                          "lost",
                                          added.point, *last + 1));
      }
      last = added.point;
    }
    log.push_back({note.at, std::move(decision)});
  }
  return log;
}

}  // namespace gonio::acquisition
