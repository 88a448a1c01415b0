#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

#include "gonio/brdf/brdf_table.h"
#include "gonio/brdf/convention_check.h"

namespace gonio::brdf {

/// The formats a measured material may come in, told apart by the file's extension.
enum class MaterialFormat {
  merl,    ///< .binary and any other: merl_file.h
  rgl,     ///< .bsdf: rgl_file.h
  cornell  ///< .brdf: cornell_file.h
};

/// "merl", "rgl", "cornell"
std::string_view to_string(MaterialFormat format);

MaterialFormat material_format(const std::filesystem::path& path);

/// Extensions a folder is searched for, with the dot: ".binary", ".bsdf", ".brdf".
std::span<const std::string_view> material_extensions();

/// The scale the file's values are in, without reading them: MERL as its sidecar says, all other
/// formats SI. Throws as read_merl() for a broken sidecar.
RadiometricScale material_scale(const std::filesystem::path& path);

/// A material file of any format as a table on the lattice (bin centres but for a MERL file that
/// says otherwise). Scattered samples are interpolated (scattered_brdf.h); cells they do not cover
/// have no value. Throws as the format's own reader; DataFormatError also for a table without a
/// value above 0 above the horizon or with one above 1e9 1/sr.
BrdfTable read_material(const std::filesystem::path& path);

/// How reciprocal the file's own values are (convention_check.h); nothing for MERL files, whose
/// lattice holds each reciprocal pair once. Throws as read_material().
std::optional<ConventionReport> check_file_conventions(const std::filesystem::path& path);

}  // namespace gonio::brdf
