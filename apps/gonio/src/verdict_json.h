#pragma once

#include <nlohmann/json.hpp>

#include "gonio/quality/verdict.h"

namespace gonio::cli {

/// A verdict with the figures it rests on (docs/formats.md); what is not known is null.
inline nlohmann::ordered_json verdict_json(const quality::Verdict& verdict) {
  nlohmann::ordered_json json = {
      {"trusted", verdict.trusted ? nlohmann::ordered_json(*verdict.trusted)
                                  : nlohmann::ordered_json(nullptr)},
      {"line", verdict.line},
      {"reasons", verdict.reasons}};
  const auto number = [&](const char* name, auto member) {
    json[name] = verdict.outlook ? nlohmann::ordered_json((*verdict.outlook).*member)
                                 : nlohmann::ordered_json(nullptr);
  };
  number("expected_psnr_db", &quality::Outlook::expected_psnr_db);
  number("expected_psnr_sd_db", &quality::Outlook::sd_db);
  number("innovation", &quality::Outlook::innovation);
  number("nearest_material_nepers", &quality::Outlook::nearest);
  json["largest_albedo"] = verdict.energy.applicable
                               ? nlohmann::ordered_json(verdict.energy.largest)
                               : nlohmann::ordered_json(nullptr);
  json["reciprocal_pairs"] = verdict.reciprocity.pairs.size();
  json["reciprocity_rms_z"] = verdict.reciprocity.rms_z;
  json["clamped_share"] = verdict.clamped_share;
  json["grazing_half_width_nepers"] = verdict.grazing_half_width
                                          ? nlohmann::ordered_json(*verdict.grazing_half_width)
                                          : nlohmann::ordered_json(nullptr);
  return json;
}

}  // namespace gonio::cli
