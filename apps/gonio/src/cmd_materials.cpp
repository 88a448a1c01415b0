#include <fmt/format.h>

#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "command.h"
#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/files/atomic_folder.h"
#include "gonio/files/sha256.h"
#include "json_text.h"
#include "materials_input.h"
#include "merl_sums.h"
#include "provenance.h"

namespace gonio::cli {
namespace {

struct ListOptions {
  bool json = false;
};

int list(Context& context, const ListOptions& options) {
  if (options.json) {
    nlohmann::ordered_json materials = nlohmann::ordered_json::array();
    for (const brdf::BuiltinMaterial& material : brdf::builtin_materials()) {
      materials.push_back({{"name", material.name},
                           {"family", material.family},
                           {"description", material.description},
                           {"source", material.source}});
    }
    context.console.result(json_text(materials));
    return kSuccess;
  }
  std::string text;
  for (const brdf::BuiltinMaterial& material : brdf::builtin_materials()) {
    text += fmt::format("{:<24} {:<16} {}\n", material.name, material.family, material.description);
  }
  context.console.result(text);
  context.console.say(fmt::format("{} materials in {} families, all analytic and in SI units",
                                  brdf::builtin_materials().size(), brdf::families().size()));
  return kSuccess;
}

struct MakeOptions {
  std::string folder;
  std::vector<std::string> only;
  bool force = false;
};

int make(Context& context, const MakeOptions& options) {
  std::vector<const brdf::BuiltinMaterial*> chosen;
  for (const std::string& name : options.only) {
    chosen.push_back(named_material("builtin:" + name).builtin);
  }
  if (chosen.empty()) {
    for (const auto& material : brdf::builtin_materials()) chosen.push_back(&material);
  }
  files::AtomicFolder folder(options.folder, overwrite(options.force));
  Progress progress(context.console, "writing materials");
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    context.check_stop();
    const brdf::BuiltinMaterial& material = *chosen[i];
    nlohmann::ordered_json record = provenance("materials make");
    record["material"] = material.name;
    record["family"] = material.family;
    record["source"] = material.source;
    brdf::write_merl(folder.path() / (material.name + ".binary"),
                     brdf::tabulate(*material.model, brdf::RadiometricScale::si),
                     files::Overwrite::No, json_line(record));
    progress.update(static_cast<double>(i + 1) / static_cast<double>(chosen.size()), material.name);
  }
  folder.commit();
  context.console.say(fmt::format("{} materials in {}", chosen.size(), options.folder));
  return kSuccess;
}

struct VerifyOptions {
  std::string folder;
  bool json = false;
};

int verify(Context& context, const VerifyOptions& options) {
  const std::filesystem::path folder(options.folder);
  if (!std::filesystem::is_directory(folder)) {
    throw UsageError(options.folder +
                     ": found no folder, expected the MERL database's .binary files");
  }
  int intact = 0;
  std::vector<std::string> wrong;
  std::vector<std::string> missing;
  std::vector<std::string> unknown;
  std::map<std::string_view, std::string_view> expected;
  for (const MerlSum& sum : merl_sums()) expected[sum.name] = sum.sha256;
  Progress progress(context.console, "verifying");
  std::size_t done = 0;
  for (const auto& [name, sha256] : expected) {
    const std::filesystem::path file = folder / (std::string(name) + ".binary");
    if (!std::filesystem::exists(file)) {
      missing.emplace_back(name);
    } else if (files::sha256_of_file(file) == sha256) {
      ++intact;
    } else {
      wrong.emplace_back(name);
    }
    progress.update(static_cast<double>(++done) / static_cast<double>(expected.size()), name);
  }
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".binary" && !expected.contains(entry.path().stem().string())) {
      unknown.push_back(entry.path().filename().string());
    }
  }
  if (intact == 0 && wrong.empty()) {
    throw UsageError(options.folder + ": found no file of the MERL database");
  }
  if (options.json) {
    const nlohmann::ordered_json result = {
        {"intact", intact}, {"wrong", wrong}, {"missing", missing}, {"unknown", unknown}};
    context.console.result(json_text(result));
  } else {
    std::string text;
    for (const std::string& name : wrong) text += fmt::format("{}.binary: wrong SHA-256\n", name);
    for (const std::string& name : missing) text += fmt::format("{}.binary: missing\n", name);
    for (const std::string& name : unknown) text += fmt::format("{}: not of the database\n", name);
    text += fmt::format("{} of {} files as published\n", intact, expected.size());
    context.console.result(text);
  }
  return wrong.empty() && missing.empty() ? kSuccess : kDoNotTrust;
}

}  // namespace

void add_materials(const Command& root) {
  const Command materials =
      root.add("materials", "Built-in materials; check a download of the MERL database",
               "gonio materials list");
  materials.require_subcommand();

  auto list_options = std::make_shared<ListOptions>();
  const Command list_command =
      materials.add("list", "Show the built-in materials", "gonio materials list --json");
  list_command.flag("--json", list_options->json, "Print JSON");
  list_command.on_call(list_options, list);

  auto make_options = std::make_shared<MakeOptions>();
  const Command make_command =
      materials.add("make", "Write built-in materials as MERL files (35 MB each)",
                    "gonio materials make merl_like --only gold-satin");
  make_command.text("OUT_DIR", make_options->folder, "Folder to create", Need::required);
  make_command.texts("--only", make_options->only, "Only these materials");
  make_command.force(make_options->force);
  make_command.on_call(make_options, make);

  auto verify_options = std::make_shared<VerifyOptions>();
  const Command verify_command =
      materials.add("verify", "Check the files of a MERL download against the known SHA-256 sums",
                    "gonio materials verify BRDFDatabase/brdfs");
  verify_command.text("DIR", verify_options->folder, "Folder with the .binary files",
                      Need::required);
  verify_command.flag("--json", verify_options->json, "Print JSON");
  verify_command.on_call(verify_options, verify);
}

}  // namespace gonio::cli
