#include "gonio/basis/training_set.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>

#include "cell_weights.h"
#include "gonio/brdf/material_file.h"
#include "gonio/brdf/merl_file.h"
#include "gonio/errors/errors.h"
#include "gonio/files/sha256.h"
#include "gonio/parallel/parallel.h"
#include "vector_math.h"

namespace gonio::basis {
namespace {

using brdf::BrdfTable;
namespace lattice = brdf::lattice;

constexpr std::size_t kTrainingBlock = 16384;
/// More than a fifth missing says that a file is damaged, not that a cell was hidden.
constexpr std::size_t kMissingDivisor = 5;

const std::vector<std::uint32_t>& basis_cells() {
  return lattice::cells_above_horizon(brdf::IndexConvention::bin_centre);
}

void check_table(const BrdfTable& table, brdf::RadiometricScale scale, const std::string& name) {
  if (table.convention() != brdf::IndexConvention::bin_centre) {
    throw std::invalid_argument("training material " + name + ": lattice convention " +
                                std::string(to_string(table.convention())) +
                                ", expected bin_centre");
  }
  if (table.scale() != scale) {
    throw std::invalid_argument("training material " + name + ": radiometric scale " +
                                std::string(to_string(table.scale())) + ", expected " +
                                std::string(to_string(scale)));
  }
}

std::string hash_of(const std::vector<float>& values) {
  return files::sha256_of_bytes(std::as_bytes(std::span<const float>(values)));
}

}  // namespace

TrainingSet::TrainingSet(brdf::RadiometricScale scale, LogMapping mapping)
    : scale_(scale), mapping_(mapping), weights_(detail::cell_weights(mapping)) {}

const std::vector<std::uint32_t>& TrainingSet::cells() const { return basis_cells(); }

std::span<const float> TrainingSet::row(std::size_t material, int channel) const {
  if (material >= mapped_.size() || channel < 0 || channel > 2) {
    throw std::invalid_argument("TrainingSet::row: no such material or channel");
  }
  const std::size_t p = cells().size();
  return std::span<const float>(mapped_[material].rows)
      .subspan(static_cast<std::size_t>(channel) * p, p);
}

std::span<const std::uint32_t> TrainingSet::missing(std::size_t material) const {
  if (material >= mapped_.size()) {
    throw std::invalid_argument("TrainingSet::missing: no such material");
  }
  return mapped_[material].missing;
}

void TrainingSet::add(MaterialId id, const BrdfTable& table) {
  check_new_name(id.name);
  check_table(table, scale_, id.name);
  Mapped mapped = map(table);
  if (id.sha256.empty()) id.sha256 = hash_of(mapped.rows);
  append(std::move(id), std::move(mapped));
  fill_missing();
}

void TrainingSet::add(MaterialId id, const brdf::BrdfModel& model) {
  check_new_name(id.name);
  Mapped mapped = map(model);
  if (id.sha256.empty()) id.sha256 = hash_of(mapped.rows);
  append(std::move(id), std::move(mapped));
  fill_missing();
}

void TrainingSet::add_files(std::span<const MaterialFile> files,
                            const std::function<void(std::size_t)>& on_progress) {
  std::vector<MaterialId> ids(files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    ids[i].name = files[i].path.stem().string();
    ids[i].family = files[i].family;
    ids[i].group = files[i].group;
    ids[i].source = files[i].source.empty()
                        ? std::string(to_string(brdf::material_format(files[i].path)))
                        : files[i].source;
    const bool twice = std::any_of(ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const MaterialId& id) { return id.name == ids[i].name; });
    if (twice) {
      throw DataFormatError(files[i].path, "file name", "material " + ids[i].name + " given twice");
    }
    try {
      check_new_name(ids[i].name);
    } catch (const std::invalid_argument& error) {
      throw DataFormatError(files[i].path, "file name", error.what());
    }
  }

  // One file per task: what is inside a task then runs on one thread, reading overlaps with
  // mapping, and no more than one table per thread is in memory.
  std::vector<Mapped> mapped(files.size());
  const auto read = [&](std::size_t i, std::size_t) {
    BrdfTable table = brdf::read_material(files[i].path);
    try {
      if (files[i].scale_factor && table.scale() != scale_) {
        ids[i].scale_factor = *files[i].scale_factor;
        table = std::move(table).rescaled(ids[i].scale_factor, scale_);
      }
      check_table(table, scale_, ids[i].name);
      mapped[i] = map(table);
    } catch (const std::invalid_argument& error) {
      throw DataFormatError(files[i].path, "as training material", error.what());
    }
    // A sidecar's sum has just been compared with the bytes; making it takes longer than the rest.
    const bool merl = brdf::material_format(files[i].path) == brdf::MaterialFormat::merl;
    const auto sidecar = merl ? brdf::read_merl_sidecar(files[i].path) : std::nullopt;
    ids[i].sha256 = sidecar ? sidecar->binary_sha256 : files::sha256_of_file(files[i].path);
  };
  // In batches, so that a caller hears how far it is.
  const std::size_t batch = 4 * parallel::thread_count();
  for (std::size_t done = 0; done < files.size(); done += batch) {
    if (on_progress) on_progress(done);
    parallel::for_each_block(done, std::min(done + batch, files.size()), 1, read);
  }

  materials_.reserve(materials_.size() + files.size());
  mapped_.reserve(mapped_.size() + files.size());
  for (std::size_t i = 0; i < files.size(); ++i) append(std::move(ids[i]), std::move(mapped[i]));
  fill_missing();
}

TrainingSet::Mapped TrainingSet::map(const BrdfTable& table) const {
  const std::vector<std::uint32_t>& cells = basis_cells();
  Mapped mapped;
  mapped.rows.resize(3 * basis_cells().size());
  mapped.missing = detail::map_table(table, mapping_, weights_, mapped.rows);
  if (mapped.missing.size() * kMissingDivisor > cells.size()) {
    throw std::invalid_argument(std::to_string(mapped.missing.size()) + " of " +
                                std::to_string(cells.size()) +
                                " cells above the horizon have no value, at most a fifth may");
  }
  // Black throughout has no shape to learn; where the logarithm rounds is no light either.
  const float black = static_cast<float>(std::log(mapping_.epsilon)) + 1e-5f;
  if (std::none_of(mapped.rows.begin(), mapped.rows.end(), [&](float x) { return x > black; })) {
    throw std::invalid_argument("no cell above the horizon has a value above 0");
  }
  return mapped;
}

TrainingSet::Mapped TrainingSet::map(const brdf::BrdfModel& model) const {
  const std::vector<std::uint32_t>& cells = basis_cells();
  const std::vector<double> values = brdf::values_at_cells(model, cells);
  const std::size_t p = cells.size();
  Mapped mapped;
  mapped.rows.resize(3 * basis_cells().size());
  const float epsilon = static_cast<float>(mapping_.epsilon);
  parallel::for_each_block(0, p, kTrainingBlock, [&](std::size_t begin, std::size_t end) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      float* const out = mapped.rows.data() + channel * p;
      const double* const in = values.data() + channel * p;
      for (std::size_t i = begin; i < end; ++i) {
        out[i] = static_cast<float>(std::max(in[i], 0.0)) * weights_[i] + epsilon;
      }
      detail::log_in_place(out + begin, end - begin);
    }
  });
  return mapped;
}

void TrainingSet::check_new_name(const std::string& name) const {
  if (name.empty()) throw std::invalid_argument("training material without a name");
  for (const MaterialId& id : materials_) {
    if (id.name == name) {
      throw std::invalid_argument("training material " + name + " is already in the set");
    }
  }
}

void TrainingSet::append(MaterialId id, Mapped mapped) {
  materials_.reserve(materials_.size() + 1);
  mapped_.push_back(std::move(mapped));
  materials_.push_back(std::move(id));
}

void TrainingSet::fill_missing() {
  const std::size_t p = cells().size();
  std::vector<std::uint32_t> incomplete;
  for (const Mapped& mapped : mapped_) {
    incomplete.insert(incomplete.end(), mapped.missing.begin(), mapped.missing.end());
  }
  if (incomplete.empty()) return;
  std::sort(incomplete.begin(), incomplete.end());
  incomplete.erase(std::unique(incomplete.begin(), incomplete.end()), incomplete.end());

  const double black = std::log(mapping_.epsilon);
  for (const std::uint32_t at : incomplete) {
    std::vector<std::size_t> without;
    double sums[3] = {0.0, 0.0, 0.0};
    for (std::size_t material = 0; material < mapped_.size(); ++material) {
      const Mapped& mapped = mapped_[material];
      if (std::binary_search(mapped.missing.begin(), mapped.missing.end(), at)) {
        without.push_back(material);
        continue;
      }
      for (std::size_t channel = 0; channel < 3; ++channel) {
        sums[channel] += static_cast<double>(mapped.rows[channel * p + at]);
      }
    }
    const std::size_t with = mapped_.size() - without.size();
    for (const std::size_t material : without) {
      for (std::size_t channel = 0; channel < 3; ++channel) {
        mapped_[material].rows[channel * p + at] =
            static_cast<float>(with > 0 ? sums[channel] / static_cast<double>(with) : black);
      }
    }
  }
}

Eigen::MatrixXf mapped_values(const LogMapping& mapping, const BrdfTable& table) {
  if (table.convention() != brdf::IndexConvention::bin_centre) {
    throw std::invalid_argument("mapped_values: lattice convention " +
                                std::string(to_string(table.convention())) +
                                ", expected bin_centre");
  }
  const std::size_t p = basis_cells().size();
  Eigen::MatrixXf values(static_cast<Eigen::Index>(p), 3);
  const std::vector<std::uint32_t> missing =
      detail::map_table(table, mapping, detail::cell_weights(mapping),
                        std::span<float>(values.data(), static_cast<std::size_t>(values.size())));
  for (const std::uint32_t at : missing) {
    values.row(at).setConstant(std::numeric_limits<float>::quiet_NaN());
  }
  return values;
}

}  // namespace gonio::basis
