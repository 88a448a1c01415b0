#include <fmt/format.h>

#include <algorithm>

#include "command.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/brdf/scattered_brdf.h"
#include "gonio/samples/csv.h"
#include "gonio/samples/samples.h"
#include "json_text.h"
#include "materials_input.h"
#include "outputs.h"
#include "provenance.h"
#include "rgl_output.h"

namespace gonio::cli {
namespace {

struct ConvertOptions {
  std::string input;
  std::string out;
  ScaleWish scale;
  bool force = false;
};

bool has_extension(const std::string& name, const char* extension) {
  return std::filesystem::path(name).extension() == extension;
}

/// Samples on a cell's own angles are that cell's value; a table written to CSV comes back as it
/// was. Within rounding of the decimal degrees.
constexpr double kSameAngle_deg = 1e-6;

/// Scattered samples on the lattice: taken over where they stand on a cell, interpolated elsewhere.
brdf::BrdfTable table_from_samples(const Console& console, const std::string& path) {
  const samples::SampleSet set = samples::read_samples(path);
  for (const std::string& warning : set.warnings) console.warn(warning);
  std::vector<brdf::ScatteredValue> scattered;
  std::vector<std::pair<std::size_t, brdf::Rgb>> exact;
  scattered.reserve(set.samples.size());
  for (const samples::Sample& sample : set.samples) {
    const brdf::Rgb value = sample.value_per_sr.max(0.0);
    brdf::HalfDiff at = sample.direction;
    const auto index = brdf::lattice::nearest_index(at);
    const brdf::HalfDiff cell = brdf::lattice::angles_of(index);
    if (at.phi_d.degrees() < 0.0) at.phi_d = Angle::from_degrees(at.phi_d.degrees() + 180.0);
    const double off = std::max({std::abs((at.theta_h - cell.theta_h).degrees()),
                                 std::abs((at.theta_d - cell.theta_d).degrees()),
                                 std::abs((at.phi_d - cell.phi_d).degrees())});
    if (off < kSameAngle_deg) exact.emplace_back(brdf::lattice::cell_from_index(index), value);
    scattered.push_back({brdf::directions_from_half_diff(sample.direction), value});
  }
  // A whole lattice needs no interpolation.
  brdf::BrdfTable table(brdf::IndexConvention::bin_centre, set.scale);
  if (exact.size() < set.samples.size()) {
    const auto interpolated = blame(path, [&] { return brdf::ScatteredBrdf(scattered); });
    table = brdf::tabulate_covered(interpolated, set.scale);
  }
  for (const auto& [cell, value] : exact) table.set_value(cell, value);
  return table;
}

brdf::BrdfTable read_input(const Console& console, const ConvertOptions& options) {
  if (has_extension(options.input, ".csv")) {
    return table_from_samples(console, options.input);
  }
  const NamedMaterial material = named_material(options.input);
  report_conventions(console, material, Report::always);
  return load_table(material);
}

void write_csv(const std::string& path, const brdf::BrdfTable& table, files::Overwrite overwrite) {
  files::AtomicFile file(path, overwrite);
  std::string text =
      fmt::format("# radiometric_scale = {}\ntheta_h_deg,theta_d_deg,phi_d_deg,r,g,b\n",
                  brdf::to_string(table.scale()));
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon(table.convention())) {
    if (!table.valid(cell)) continue;
    const brdf::HalfDiff at =
        brdf::lattice::angles_of(brdf::lattice::index_from_cell(cell), table.convention());
    const brdf::Rgb value = table.value(cell);
    text += fmt::format("{},{},{},{},{},{}\n", samples::csv_degrees(at.theta_h),
                        samples::csv_degrees(at.theta_d), samples::csv_degrees(at.phi_d),
                        samples::csv_number(value[0]), samples::csv_number(value[1]),
                        samples::csv_number(value[2]));
    if (text.size() > (std::size_t{1} << 20U)) {
      file.write(text);
      text.clear();
    }
  }
  file.write(text);
  file.commit();
}

int convert(Context& context, const ConvertOptions& options) {
  require_output(options.out, options.force, {options.input});
  const bool to_rgl = has_extension(options.out, ".bsdf");
  const bool to_csv = has_extension(options.out, ".csv");
  if (!to_rgl && !to_csv && !has_extension(options.out, ".binary")) {
    throw UsageError(options.out + ": unknown format, expected .binary, .bsdf or .csv");
  }
  brdf::BrdfTable table = [&] {
    const PhaseTimer timer(context.console, "reading");
    return read_input(context.console, options);
  }();
  context.check_stop();
  if (!options.scale.scale.empty()) {
    table = in_scale(std::move(table), brdf::radiometric_scale_from_string(options.scale.scale),
                     options.scale.merl_to_si);
  }
  context.check_stop();
  if (to_csv) {
    write_csv(options.out, table, overwrite(options.force));
    context.console.say(options.out);
    return kSuccess;
  }
  if (!to_rgl) {
    nlohmann::ordered_json record = provenance("convert");
    if (std::filesystem::is_regular_file(options.input)) {
      record["input"] = input_record(options.input);
    } else {
      record["material"] = options.input;
    }
    brdf::write_merl(options.out, table, overwrite(options.force), json_line(record));
    context.console.say(options.out);
    return kSuccess;
  }
  const quality::LatticeError error =
      write_rgl_of(table, options.input, options.out, overwrite(options.force));
  context.console.say(fmt::format(
      "{}: read back, it differs by {:.4f} (weighted log RMSE), {:.4f} at grazing angles",
      options.out, error.weighted_log_rmse, error.grazing_log_rmse));
  return kSuccess;
}

}  // namespace

void add_convert(const Command& root) {
  auto options = std::make_shared<ConvertOptions>();
  const Command command = root.add("convert", "Turn a BRDF into another format: MERL, RGL, CSV",
                                   "gonio convert found.binary found.bsdf --scale si");
  command.text("IN", options->input,
               "Material file (.binary, .bsdf, .brdf), samples (.csv) or builtin:NAME",
               Need::required);
  command.text("OUT", options->out, "File to write: .binary, .bsdf or .csv", Need::required);
  add_scale_options(command, options->scale);
  command.force(options->force);
  command.on_call(options, convert);
}

}  // namespace gonio::cli
