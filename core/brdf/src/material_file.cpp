#include "gonio/brdf/material_file.h"

#include <array>

#include "gonio/brdf/merl_file.h"
#include "gonio/brdf/rgl_file.h"

namespace gonio::brdf {

MaterialFormat material_format(const std::filesystem::path& path) {
  const std::filesystem::path extension = path.extension();
  if (extension == ".bsdf") return MaterialFormat::rgl;
  return MaterialFormat::merl;
}

std::span<const std::string_view> material_extensions() {
  static constexpr std::array<std::string_view, 2> kExtensions = {".binary", ".bsdf"};
  return kExtensions;
}

RadiometricScale material_scale(const std::filesystem::path& path) {
  if (material_format(path) != MaterialFormat::merl) return RadiometricScale::si;
  const auto sidecar = read_merl_sidecar(path);
  return sidecar ? sidecar->scale : RadiometricScale::merl;
}

BrdfTable read_material(const std::filesystem::path& path) {
  switch (material_format(path)) {
    case MaterialFormat::rgl:
      return tabulate(RglBrdf(read_rgl(path)), RadiometricScale::si);
    case MaterialFormat::merl:
      break;
  }
  return read_merl(path);
}

}  // namespace gonio::brdf
