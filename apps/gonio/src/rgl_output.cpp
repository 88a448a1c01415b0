#include "rgl_output.h"

#include <fmt/format.h>

#include <filesystem>

#include "gonio/brdf/rgl_file.h"
#include "gonio/console/failures.h"

namespace gonio::cli {

quality::LatticeError write_rgl_of(const brdf::BrdfTable& table, const std::string& name,
                                   const std::string& out, files::Overwrite overwrite) {
  if (table.scale() != brdf::RadiometricScale::si) {
    throw UsageError(fmt::format("{}: radiometric scale: found {}, expected si, which .bsdf files "
                                 "are in",
                                 name, brdf::to_string(table.scale())),
                     "--scale si converts it by the factor of --merl-to-si");
  }
  const brdf::RglTables tables =
      brdf::rgl_tables(brdf::TableBrdf(table), std::filesystem::path(name).stem().string());
  brdf::write_rgl(out, tables, overwrite);
  return quality::lattice_error(
      table, brdf::tabulate(brdf::RglBrdf(tables), brdf::RadiometricScale::si, table.convention()));
}

}  // namespace gonio::cli
