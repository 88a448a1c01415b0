#pragma once

#include <filesystem>
#include <span>
#include <string_view>

#include "gonio/brdf/brdf_table.h"

namespace gonio::brdf {

/// The formats a measured material may come in, told apart by the file's extension.
enum class MaterialFormat {
  merl,  ///< .binary and any other: merl_file.h
  rgl,   ///< .bsdf: rgl_file.h
};

MaterialFormat material_format(const std::filesystem::path& path);

/// Extensions a folder is searched for, with the dot: ".binary", ".bsdf".
std::span<const std::string_view> material_extensions();

/// The scale the file's values are in, without reading them: MERL as its sidecar says, all other
/// formats SI. Throws as read_merl() for a broken sidecar.
RadiometricScale material_scale(const std::filesystem::path& path);

/// A material file of any format as a table on the lattice (bin centres but for a MERL file that
/// says otherwise). Throws as the format's own reader.
BrdfTable read_material(const std::filesystem::path& path);

}  // namespace gonio::brdf
