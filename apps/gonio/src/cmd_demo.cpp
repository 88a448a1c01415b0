#include <fmt/format.h>

#include <algorithm>

#include "calibration_run.h"
#include "command.h"
#include "demo_index.h"
#include "direction_choice.h"
#include "find_alignment.h"
#include "gonio/basis/basis_file.h"
#include "gonio/basis/dense_field.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/design/image_importance.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_folder.h"
#include "gonio/render/comparison_sheet.h"
#include "gonio/render/png.h"
#include "gonio/setup/calibration_settings.h"
#include "gonio/setup/simulated_rig.h"
#include "json_text.h"
#include "patch_geometry.h"
#include "plan_file.h"
#include "planning.h"
#include "pose_choice.h"
#include "provenance.h"
#include "report_data.h"
#include "session_calibration.h"
#include "session_run.h"

namespace gonio::cli {
namespace {

/// One diffuse, one plastic, one metal.
const std::vector<std::string> kDemoMaterials{"ivory-wall-latex", "red-pmma", "copper-brushed"};

/// Of a matte sample's seat on the datum of the demo's rig, which leans samples by up to 0.3 deg.
constexpr double kSeatSigma_deg = 0.17;

/// A rig as it comes from the workshop (rigs/uncalibrated.toml): nothing is where its drawing has
/// it.
RigFile demo_rig() {
  RigFile rig = default_rig_file();
  rig.rig.name = "uncalibrated LA-2";
  rig.hidden = true;
  rig.world.camera.width_px = 612;
  rig.world.camera.height_px = 512;
  rig.world.camera.cx_px = 305.5;
  rig.world.camera.cy_px = 255.5;
  return rig;
}

struct DemoOptions {
  std::vector<std::string> materials;
  int samples = 10;
  std::string out;
  std::uint64_t seed = 1;
  bool force = false;
};

/// One way to a BRDF from the same session.
struct Outcome {
  basis::Fit fit;
  std::shared_ptr<const brdf::BrdfTable> table;
  quality::Comparison comparison;
};

struct MaterialResult {
  std::string name;
  std::string family;
  Outcome ours;
  Outcome points;
  Outcome published;
};

/// "patches of 5 x 5 values per pose"
std::string patches_text(const RigFile& rig) {
  return fmt::format("patches of {0} x {0} values per pose", rig.reduction.grid);
}

class Demo {
 public:
  /// Works in `folder`, which becomes `destination` in the end.
  Demo(Context& context, const DemoOptions& options, const std::filesystem::path& folder,
       const std::filesystem::path& destination)
      : context_(context),
        console_(context.console),
        options_(options),
        folder_(folder),
        destination_(destination),
        rig_{demo_rig(), nominal_instrument(demo_rig())},
        set_(brdf::RadiometricScale::si) {}

  /// Finds out where everything is and what the camera does; the report stays in the folder.
  void calibrate() {
    const PhaseTimer timer(console_, "calibrating the rig");
    const std::filesystem::path folder = folder_ / "calibration";
    const auto white = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5));
    const auto opened = open_simulated_rig(simulated_world(rig_.file, white, options_.seed));
    calibration::routine::Routine calibration =
        calibration_in({folder}, rig_.file, calibration_settings(rig_.file), *opened);
    const auto refused =
        take_open_steps({context_, calibration, opened->devices(), passes_at_once(rig_.file)});
    if (refused) throw NumericalError(refused->step + ": " + refused->why);
    write_calibration_report(calibration, folder, rig_.file, {});
    rig_.constants = instrument_of(rig_.file, folder.string());
    calibration_ = session_calibration(rig_.file, folder.string());
    // Where it will lie; by now it is in a folder that is not there yet.
    calibration_->metadata["calibration_folder"] = (destination_ / "calibration").string();
  }

  void train_all() {
    const PhaseTimer timer(console_, "tabulating all materials");
    Progress progress(console_, "tabulating materials");
    const auto& all = brdf::builtin_materials();
    for (std::size_t i = 0; i < all.size(); ++i) {
      context_.check_stop();
      set_.add({all[i].name, all[i].family, ""}, *all[i].model);
      progress.update(static_cast<double>(i + 1) / static_cast<double>(all.size()));
    }
  }

  void prepare() {
    const PhaseTimer timer(console_, "Gram matrix");
    gram_ = basis::centred_gram(set_);
  }

  MaterialResult run(const brdf::BuiltinMaterial& material) {
    console_.say(fmt::format("{} ({}): no {} in basis or design", material.name, material.family,
                             material.family));
    const std::filesystem::path folder = folder_ / material.name;
    std::filesystem::create_directory(folder);
    const basis::Basis basis = train_without(material.family);
    {
      const PhaseTimer timer(console_, "writing the basis");
      basis::write_basis(folder / "basis.h5", basis);
    }
    context_.check_stop();
    const rig::Inverse inverse(rig_.constants.rig, rig_.file.branches);
    const std::vector<brdf::HalfDiff> chosen = choose_poses(
        console_, basis,
        design::blended_importance(basis, basis.left_vectors,
                                   design::ImportanceBlend::for_patches()),
        &inverse, {options_.samples, patch_of(rig_), planned_noise(&rig_), options_.seed},
        context_.stop);
    context_.check_stop();
    const StoredSession session = measure(material, chosen, folder);
    return reconstruct(material, basis, session, folder);
  }

 private:
  basis::Basis train_without(const std::string& family) {
    const PhaseTimer timer(console_, "basis without the family");
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < set_.material_count(); ++i) {
      if (set_.materials()[i].family != family) kept.push_back(i);
    }
    return basis::train(set_, gram_, kept);
  }

  /// By its own highlight where it has one, else by its seat.
  instrument::Alignment align(const brdf::BuiltinMaterial& material) {
    const PhaseTimer timer(console_, "aligning the sample");
    const AlignmentRig rig{rig_.file, rig_.constants, true};
    const auto opened =
        open_simulated_rig(simulated_world(rig_.file, material.model, options_.seed));
    try {
      return alignment_by_highlight(console_, rig, *opened, context_.stop);
    } catch (const calibration::StepRefused&) {
      return alignment_by_seat(rig, Angle::from_degrees(kSeatSigma_deg));
    }
  }

  StoredSession measure(const brdf::BuiltinMaterial& material,
                        const std::vector<brdf::HalfDiff>& chosen,
                        const std::filesystem::path& folder) {
    std::vector<samples::Direction> directions;
    for (const brdf::HalfDiff& angles : chosen) directions.push_back({angles, 0});
    SessionSetup session;
    session.rig = rig_.file;
    session.calibration = calibration_;
    instrument::Alignment alignment = align(material);
    alignment.sample = material.name;
    session.instrument = instrument::aligned(rig_.constants, alignment);
    session.alignment = alignment_metadata(alignment);
    const rig::Inverse inverse(session.instrument.rig, rig_.file.branches);
    session.plan = plan_poses(rig_.file, inverse, directions, options_.seed);
    session.plan_text = plan_text(rig_.constants.rig, session.plan, {},
                                  {fmt::format("gonio demo {}", version_text())});
    session.material = {material.model, brdf::RadiometricScale::si};
    session.material_name = material.name;
    session.seed = options_.seed;
    session.labels = {material.name, "gonio demo", "simulated session of a built-in material"};
    session.archive = folder / "session";
    files::write_text_file(folder / "plan.csv", session.plan_text);
    {
      const PhaseTimer timer(console_, "simulated session");
      const acquisition::SessionResult result = run_session(console_, session, context_.stop);
      context_.check_stop();
      for (const std::string& warning : result.warnings) console_.warn(warning);
      console_.detail(fmt::format("  {} of {} directions in {} of session time", result.measured,
                                  session.plan.points.size(), duration_text(result.duration_s)));
    }
    return open_session(session.archive);
  }

  Outcome fit(const basis::Basis& basis, const samples::SampleSet& samples,
              const brdf::BrdfTable& truth, basis::Method method) {
    basis::ReconstructOptions how;
    how.method = method;
    Outcome outcome;
    outcome.fit = basis::fit(basis, samples, how);
    outcome.table =
        std::make_shared<brdf::BrdfTable>(basis::expand(basis, outcome.fit.coefficients));
    outcome.comparison = quality::compare(truth, *outcome.table);
    return outcome;
  }

  MaterialResult reconstruct(const brdf::BuiltinMaterial& material, const basis::Basis& basis,
                             const StoredSession& session, const std::filesystem::path& folder) {
    acquisition::ReductionOptions point_options = rig_.file.reduction;
    point_options.grid = 1;
    acquisition::Reduction patches;
    acquisition::Reduction points;
    {
      const PhaseTimer timer(console_, "reducing the frames");
      patches = reduce_session(session, session.rig.reduction);
      points = reduce_session(session, point_options);
    }
    for (const std::string& warning : patches.warnings) console_.warn(warning);
    samples::write_samples(folder / "samples.csv", patches.samples);

    const auto truth = std::make_shared<const brdf::BrdfTable>(
        brdf::tabulate(*material.model, brdf::RadiometricScale::si));
    MaterialResult result{material.name, material.family, {}, {}, {}};
    {
      const PhaseTimer timer(console_, "fitting three ways");
      result.ours = fit(basis, patches.samples, *truth, basis::Method::automatic);
      result.points = fit(basis, points.samples, *truth, basis::Method::automatic);
      result.published = fit(basis, points.samples, *truth, basis::Method::nielsen);
    }
    {
      const PhaseTimer timer(console_, "writing BRDF and pictures");
      nlohmann::ordered_json record = provenance("demo");
      record["material"] = material.name;
      record["basis"] = basis_record(basis);
      brdf::write_merl(folder / "reconstruction.binary", *result.ours.table, files::Overwrite::No,
                       json_line(record));
      render::SheetOptions sheet;
      sheet.reference_name = material.name;
      sheet.result_name = fmt::format("from {} directions", options_.samples);
      render::write_png(
          folder / "spheres.png",
          render::comparison_sheet(*material.model, brdf::TableBrdf(*result.ours.table),
                                   brdf::RadiometricScale::si, sheet));
    }
    context_.check_stop();
    const PhaseTimer timer(console_, "writing the report");
    report::ReportData data = session_report(session);
    data.material = material.name;
    data.truth = truth;
    std::string description = material.description;
    if (description[0] >= 'a' && description[0] <= 'z') description[0] -= 'a' - 'A';
    data.summary = fmt::format(
        "{}. Measured in {} directions on a simulated rig of which nothing was where its drawing "
        "has it, after a calibration and an alignment; no {} was in the training data.",
        description, session.archive.points().size(), material.family);
    data.samples = fitted_samples(patches.samples, result.ours.fit);
    for (const std::string& warning : patches.warnings) data.warnings.push_back(warning);
    data.checks = self_checks(*result.ours.table, &result.ours.fit);
    data.checks.push_back(evenness(patches.samples, result.ours.fit));
    data.methods = {
        {"This measurement", patches_text(rig_.file), result.ours.table, result.ours.comparison},
        {"Points", "the same frames, one value per pose", result.points.table,
         result.points.comparison},
        {"Published method", "the same points, eta = 40, k = n", result.published.table,
         result.published.comparison}};
    add_trust(basis, patches.samples, result.ours.fit, data.methods.front(), data);
    data.provenance.push_back({"Basis fingerprint", basis_fingerprint(basis)});
    report::write_report(folder / "report.html", data);
    return result;
  }

  const Context& context_;
  const Console& console_;
  const DemoOptions& options_;
  std::filesystem::path folder_;
  std::filesystem::path destination_;
  KnownRig rig_;
  std::optional<SessionCalibration> calibration_;
  basis::TrainingSet set_;
  Eigen::MatrixXd gram_;
};

std::string table_text(const std::vector<MaterialResult>& results) {
  std::string text = fmt::format("{:<20} {:<16} {:>9} {:>9} {:>9}   {}\n", "PSNR in dB", "family",
                                 "patches", "points", "published", "weighted log RMSE");
  for (const MaterialResult& result : results) {
    text += fmt::format("{:<20} {:<16} {:9.2f} {:9.2f} {:9.2f}   {:.3f} / {:.3f} / {:.3f}\n",
                        result.name, result.family, result.ours.comparison.lighting_a.psnr_db,
                        result.points.comparison.lighting_a.psnr_db,
                        result.published.comparison.lighting_a.psnr_db,
                        result.ours.comparison.lattice.weighted_log_rmse,
                        result.points.comparison.lattice.weighted_log_rmse,
                        result.published.comparison.lattice.weighted_log_rmse);
  }
  return text;
}

/// The first of gonio-demo, gonio-demo-2, ... that does not exist.
std::string free_name() {
  std::string name = "gonio-demo";
  for (int i = 2; std::filesystem::exists(name); ++i) name = fmt::format("gonio-demo-{}", i);
  return name;
}

int demo(Context& context, const DemoOptions& options) {
  const std::string out = options.out.empty() ? free_name() : options.out;
  std::vector<const brdf::BuiltinMaterial*> materials;
  for (const std::string& name : options.materials.empty() ? kDemoMaterials : options.materials) {
    materials.push_back(named_material("builtin:" + name).builtin);
  }
  files::AtomicFolder folder(out, overwrite(options.force));
  context.console.say(fmt::format(
      "Simulated rig that is not where its drawing has it, {} built-in analytic materials; {} "
      "directions.",
      brdf::builtin_materials().size(), options.samples));
  Demo work(context, options, folder.path(), out);
  work.calibrate();
  work.train_all();
  work.prepare();
  std::vector<MaterialResult> results;
  for (const brdf::BuiltinMaterial* material : materials) results.push_back(work.run(*material));
  std::vector<DemoRow> rows;
  for (const MaterialResult& each : results) {
    rows.push_back({each.name, each.ours.comparison.lighting_a.psnr_db,
                    each.points.comparison.lighting_a.psnr_db,
                    each.published.comparison.lighting_a.psnr_db});
  }
  files::write_text_file(folder.path() / "index.html", demo_index_page(rows));
  folder.commit();
  context.console.result(
      table_text(results) + patches_text(demo_rig()) +
      "; points: the same frames reduced to one value per pose;\n"
      "published: Nielsen et al. 2015 (eta = 40, k = n) on these points.\n"
      "All on simulated sessions of analytic materials, each without its family in training.\n");
  context.console.result(fmt::format("Report: {}/index.html\n", out));
  return kSuccess;
}

}  // namespace

void add_demo(const Command& root) {
  auto options = std::make_shared<DemoOptions>();
  const Command command = root.add("demo", "The whole way on the simulated rig: train to report",
                                   "gonio demo --material gold-satin --out demo");
  command.texts("--material", options->materials,
                "Built-in materials to measure (default: a diffuse, a plastic, a metal)");
  command.integer("--samples", options->samples, 1, 200, "Directions per material");
  command.text("--out", options->out,
               "Folder to create (default: gonio-demo, or the next free gonio-demo-N)");
  command.seed(options->seed, "Of search and simulated world");
  command.force(options->force);
  command.on_call(options, demo);
}

}  // namespace gonio::cli
