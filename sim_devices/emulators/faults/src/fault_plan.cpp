#include "gonio/emulator_faults/fault_plan.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "gonio/random/distributions.h"

namespace gonio::emulator_faults {
namespace {

constexpr std::array<std::pair<Fault, std::string_view>, 19> kNames{{
    {Fault::dead_link, "dead_link"},
    {Fault::exception, "exception"},
    {Fault::crc_error, "crc_error"},
    {Fault::late_reply, "late_reply"},
    {Fault::torn_reply, "torn_reply"},
    {Fault::foreign_reply, "foreign_reply"},
    {Fault::stall, "stall"},
    {Fault::unplug, "unplug"},
    {Fault::alarm, "alarm"},
    {Fault::limit_switch, "limit_switch"},
    {Fault::lost_move, "lost_move"},
    {Fault::lost_steps, "lost_steps"},
    {Fault::never_in_position, "never_in_position"},
    {Fault::stop_ignored, "stop_ignored"},
    {Fault::power_cycle, "power_cycle"},
    {Fault::lost_packets, "lost_packets"},
    {Fault::wrong_exposure, "wrong_exposure"},
    {Fault::duplicate_frame_id, "duplicate_frame_id"},
    {Fault::no_frame, "no_frame"},
}};

[[noreturn]] void refuse(std::string_view text, const std::string& why) {
  throw std::invalid_argument(fmt::format("fault \"{}\": {}", text, why));
}

Fault fault_from_name(std::string_view text, std::string_view name) {
  std::string known;
  for (const auto& [fault, word] : kNames) {
    if (word == name) return fault;
    known += (known.empty() ? "" : ", ") + std::string(word);
  }
  refuse(text, fmt::format("found \"{}\", expected one of {}", name, known));
}

double number(std::string_view text, std::string_view key, std::string_view value) {
  double result = 0.0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), result);
  if (error != std::errc() || end != value.data() + value.size() || !std::isfinite(result)) {
    refuse(text, fmt::format("{}: found \"{}\", expected a number", key, value));
  }
  return result;
}

std::uint64_t whole(std::string_view text, std::string_view key, std::string_view value) {
  std::uint64_t result = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), result);
  if (error != std::errc() || end != value.data() + value.size()) {
    refuse(text, fmt::format("{}: found \"{}\", expected a whole number from 0", key, value));
  }
  return result;
}

void set(FaultRule& rule, std::string_view text, std::string_view key, std::string_view value) {
  if (key == "after_s") {
    rule.after_s = number(text, key, value);
  } else if (key == "for_s") {
    rule.for_s = number(text, key, value);
  } else if (key == "skip") {
    rule.skip = whole(text, key, value);
  } else if (key == "count") {
    rule.count = whole(text, key, value);
  } else if (key == "probability") {
    rule.probability = number(text, key, value);
  } else if (key == "degrees") {
    rule.degrees = number(text, key, value);
  } else {
    refuse(text,
           fmt::format("found \"{}\", expected after_s, for_s, skip, count, probability or degrees",
                       key));
  }
}

}  // namespace

std::string_view to_string(Fault fault) {
  for (const auto& [known, word] : kNames) {
    if (known == fault) return word;
  }
  return "unknown";
}

void FaultRule::validate() const {
  const auto require = [&](bool ok, const char* field, double value, const char* expected) {
    if (!ok) {
      throw std::invalid_argument(
          fmt::format("{}: found {:g}, expected {}", field, value, expected));
    }
  };
  require(after_s >= 0.0 && std::isfinite(after_s), "after_s", after_s, "0 or more");
  if (for_s) require(*for_s > 0.0 && std::isfinite(*for_s), "for_s", *for_s, "above 0");
  const bool has_degrees = degrees != 0.0 && std::isfinite(degrees);
  if (fault == Fault::lost_steps) {
    require(has_degrees, "degrees", degrees, "how far the axis is turned");
  } else {
    require(degrees == 0.0, "degrees", degrees, "none: only lost_steps has them");
  }
  require(probability >= 0.0 && probability <= 1.0, "probability", probability, "0 to 1");
}

FaultRule fault_rule_from_text(std::string_view text) {
  FaultRule rule;
  const std::size_t colon = text.find(':');
  std::string_view name = text.substr(0, colon);
  if (const std::size_t at = name.find('@'); at != std::string_view::npos) {
    rule.device = name.substr(at + 1);
    if (rule.device.empty()) refuse(text, "found nothing behind @, expected a device");
    name = name.substr(0, at);
  }
  rule.fault = fault_from_name(text, name);
  std::string_view left = colon == std::string_view::npos ? "" : text.substr(colon + 1);
  while (!left.empty()) {
    const std::size_t comma = left.find(',');
    const std::string_view part = left.substr(0, comma);
    const std::size_t equals = part.find('=');
    if (equals == std::string_view::npos) {
      refuse(text, fmt::format("found \"{}\", expected KEY=VALUE", part));
    }
    set(rule, text, part.substr(0, equals), part.substr(equals + 1));
    left = comma == std::string_view::npos ? "" : left.substr(comma + 1);
  }
  try {
    rule.validate();
  } catch (const std::invalid_argument& error) {
    refuse(text, error.what());
  }
  return rule;
}

FaultPlan::FaultPlan(std::vector<FaultRule> rules, std::uint64_t seed) : seed_(seed) {
  for (FaultRule& rule : rules) add(std::move(rule));
}

void FaultPlan::add(FaultRule rule) {
  rule.validate();
  const std::lock_guard lock(mutex_);
  rules_.push_back({std::move(rule)});
}

bool FaultPlan::strikes(Fault fault, std::string_view device, std::chrono::nanoseconds now) {
  bool struck = false;
  take_opportunity(fault, device, now, [&](const FaultRule&) { struck = true; });
  return struck;
}

double FaultPlan::lost_steps_deg(std::string_view device, std::chrono::nanoseconds now) {
  double deg = 0.0;
  take_opportunity(Fault::lost_steps, device, now,
                   [&](const FaultRule& rule) { deg += rule.degrees; });
  return deg;
}

void FaultPlan::take_opportunity(Fault fault, std::string_view device, std::chrono::nanoseconds now,
                                 const WhenStruck& when_struck) {
  const std::lock_guard lock(mutex_);
  const double time_s = std::chrono::duration<double>(now).count();
  for (std::size_t index = 0; index < rules_.size(); ++index) {
    State& state = rules_[index];
    const FaultRule& rule = state.rule;
    if (rule.fault != fault || (!rule.device.empty() && rule.device != device)) continue;
    if (time_s < rule.after_s || (rule.for_s && time_s >= rule.after_s + *rule.for_s)) continue;
    if (rule.count && state.struck >= *rule.count) continue;
    const std::uint64_t opportunity = state.opportunities++;
    if (opportunity < rule.skip) continue;
    const random::Key key = random::make_key(seed_, "emulator.fault", index);
    if (random::uniform(key, opportunity) >= rule.probability) continue;
    ++state.struck;
    if (!first_struck_) first_struck_ = now;
    when_struck(rule);
  }
}

void FaultPlan::mend() {
  const std::lock_guard lock(mutex_);
  rules_.clear();
}

std::optional<std::chrono::nanoseconds> FaultPlan::first_struck() const {
  const std::lock_guard lock(mutex_);
  return first_struck_;
}

std::uint64_t FaultPlan::struck(Fault fault) const {
  const std::lock_guard lock(mutex_);
  std::uint64_t total = 0;
  for (const State& state : rules_) {
    if (state.rule.fault == fault) total += state.struck;
  }
  return total;
}

}  // namespace gonio::emulator_faults
