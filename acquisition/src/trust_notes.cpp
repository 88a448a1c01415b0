#include "gonio/acquisition/trust_notes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace gonio::acquisition {
namespace {

/// Words between single separators.
std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> words;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    words.push_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return words;
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// The end of a text, so that one which is cut off says nothing of the kind.
constexpr std::string_view kAllCompared = "; every axis that tells was compared";
constexpr std::string_view kPointsWord = "points ";

/// The points a text of suspect_text() names.
std::vector<int> points_in(std::string_view text) {
  std::vector<int> points;
  if (!text.starts_with(kPointsWord)) return points;
  text = text.substr(kPointsWord.size(), text.find(':') - kPointsWord.size());
  for (const std::string_view word : split(text, ' ')) {
    if (const auto point = number_in<int>(word)) points.push_back(*point);
  }
  return points;
}

}  // namespace

std::string home_delta_text(const std::vector<std::string>& axes, bool over_interruption,
                            bool compared) {
  return fmt::format("{}{}{}", over_interruption ? "over the interruption: " : "",
                     fmt::join(axes, "; "), compared ? kAllCompared : "");
}

bool compares_all_axes(std::string_view home_delta_text) {
  return home_delta_text.ends_with(kAllCompared);
}

std::vector<int> unjudged_points(const SessionReader& archive) {
  std::map<int, std::chrono::nanoseconds> finished;  // by the row that counts
  for (const PointRecord& point : archive.points()) finished[point.point] = point.finished_at;
  std::vector<int> points;
  auto before = std::chrono::nanoseconds(-1);
  for (const SessionNote& note : archive.notes()) {
    if (note.kind != kHomeDeltaNote) continue;
    for (const auto& [point, at] : finished) {
      if (at > before && at <= note.at && !compares_all_axes(note.text)) points.push_back(point);
    }
    before = note.at;
  }
  std::sort(points.begin(), points.end());
  return points;
}

SentinelChange sentinel_change(const SentinelLevel& earlier, const SentinelLevel& later,
                               double u_monitor) {
  const double of_one = std::hypot(u_monitor, kSentinelRepeatability);
  return {later.level_dn_per_s / earlier.level_dn_per_s - 1.0,
          std::hypot(std::hypot(earlier.relative_sigma, later.relative_sigma),
                     std::sqrt(2.0) * of_one)};
}

std::string sentinel_text(const SentinelReading& reading) {
  std::string text;
  for (const auto& [channel, level] : reading) {
    text += fmt::format("{}{} {} {} {}", text.empty() ? "" : ";", channel, level.level_dn_per_s,
                        level.relative_sigma, level.exposure.count());
  }
  return text;
}

std::optional<SentinelReading> sentinel_from_text(std::string_view text) {
  SentinelReading reading;
  for (const std::string_view part : split(text, ';')) {
    const std::vector<std::string_view> words = split(part, ' ');
    if (words.size() != 4) return std::nullopt;
    const auto level = number_in<double>(words[1]);
    const auto sigma = number_in<double>(words[2]);
    const auto exposure_ns = number_in<std::int64_t>(words[3]);
    if (!level || !sigma || !exposure_ns) return std::nullopt;
    // NaN fails every comparison.
    if (!(*level > 0.0 && *level < 1e12 && *sigma >= 0.0 && *sigma < 1e3)) return std::nullopt;
    if (*exposure_ns <= 0) return std::nullopt;
    reading[std::string(words[0])] = {*level, *sigma, std::chrono::nanoseconds(*exposure_ns)};
  }
  if (reading.empty()) return std::nullopt;
  return reading;
}

std::string text_for_people(const SessionNote& note) {
  const auto reading =
      note.kind == kSentinelNote ? sentinel_from_text(note.text) : std::optional<SentinelReading>();
  if (!reading) return note.text;
  std::string text;
  for (const auto& [channel, level] : *reading) {
    text += fmt::format("{}{} {:.6g} DN/s, noise {:.2g} %", text.empty() ? "" : ", ", channel,
                        level.level_dn_per_s, 100.0 * level.relative_sigma);
  }
  return text;
}

std::vector<SentinelVisit> sentinel_visits(const SessionReader& archive) {
  std::vector<SentinelVisit> visits;
  for (const SessionNote& note : archive.notes()) {
    if (note.kind != kSentinelNote) continue;
    if (auto reading = sentinel_from_text(note.text)) {
      visits.push_back({note.at, std::move(*reading)});
    }
  }
  return visits;
}

std::string suspect_text(const std::vector<int>& points, const std::string& why) {
  return fmt::format("{}{}: {}", kPointsWord, fmt::join(points, " "), why);
}

std::map<int, std::string> suspect_points(const SessionReader& archive) {
  std::map<int, std::chrono::nanoseconds> finished;
  for (const PointRecord& point : archive.points()) finished[point.point] = point.finished_at;
  std::map<int, std::string> suspects;
  for (const SessionNote& note : archive.notes()) {
    if (note.kind != kSuspectNote) continue;
    for (const int point : points_in(note.text)) {
      const auto found = finished.find(point);
      if (found == finished.end() || found->second > note.at) continue;
      const std::size_t colon = note.text.find(": ");
      suspects[point] = colon == std::string::npos ? note.text : note.text.substr(colon + 2);
    }
  }
  return suspects;
}

}  // namespace gonio::acquisition
